/* The board: vectors, start-up, semihosting, and the measurement of stack. */
#include "board.h"

#include <stddef.h>

/* Addresses from link.ld; the values are never read. */
extern uint32_t _stack_bottom[], _stack_top[], _data_start[], _data_end[], _data_load[], _bss_start[], _bss_end[];

int main(void);
void reset(void);

static uint32_t semihost(uint32_t operation, const void *argument) {
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void board_write(const char *text) { (void)semihost(0x04, text); }

void board_exit(uint32_t status) {
    /* Stopped by the application, as SYS_EXIT_EXTENDED wants it. */
    const uint32_t block[2] = {0x20026, status};
    for (;;) {
        (void)semihost(0x20, block);
    }
}

static void fault(void) {
    board_write("fault: the stack overflowed or an address was wrong\n");
    board_exit(102);
}

/* Initialises static memory and runs the program. */
static void __attribute__((noinline)) start(void) {
    const uint32_t *from = _data_load;
    uint32_t *to;
    for (to = _data_start; to != _data_end; to++) {
        *to = *from++;
    }
    for (to = _bss_start; to != _bss_end; to++) {
        *(volatile uint32_t *)to = 0;
    }
    board_exit((uint32_t)main());
}

/* Enables the floating-point unit, then starts. No floating point here: its prologue would save registers of a unit that is still off,
   which faults. */
void __attribute__((naked)) reset(void) {
    __asm__ volatile(
        "ldr r0, =0xE000ED88\n" /* CPACR of every Cortex-M4 and M7; bits 20-23 grant CP10 and CP11. */
        "ldr r1, [r0]\n"
        "orr r1, r1, #0xF00000\n"
        "str r1, [r0]\n"
        "dsb\n"
        "isb\n"
        "b %c0\n"
        :
        : "i"(start));
}

typedef union vector {
    void (*handler)(void);
    const uint32_t *address;
} vector;

/* Initial stack pointer, reset, and fourteen exceptions, none of which may happen here. */
static const vector VECTORS[16] __attribute__((section(".vectors"), used)) = {
    {.address = _stack_top}, {.handler = reset}, {.handler = fault}, {.handler = fault},
    {.handler = fault},      {.handler = fault}, {.handler = fault}, {.handler = fault},
    {.handler = fault},      {.handler = fault}, {.handler = fault}, {.handler = fault},
    {.handler = fault},      {.handler = fault}, {.handler = fault}, {.handler = fault},
};

uint32_t __attribute__((noinline)) board_stack_used(void (*work)(void *argument), void *argument) {
    const uint32_t paint = 0xC5A117ED;
    volatile uint32_t *bottom = _stack_bottom;
    volatile uint32_t *top;
    volatile uint32_t *at;
    __asm__ volatile("mov %0, sp" : "=r"(top));
    /* Between the bottom of the stack and the stack pointer lies nothing in use. */
    for (at = bottom; at < top; at++) {
        *at = paint;
    }
    work(argument);
    for (at = bottom; at < top && *at == paint; at++) {
    }
    return (uint32_t)((uintptr_t)top - (uintptr_t)at);
}
