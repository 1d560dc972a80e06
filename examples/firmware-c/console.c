/* Numbers as text. */
#include "console.h"

#include <stddef.h>

#include "board.h"

/* At least so many digits. */
static void digits(uint32_t number, uint32_t least) {
    char text[11];
    size_t at = sizeof text - 1;
    text[at] = 0;
    while (number > 0 || sizeof text - 1 - at < least) {
        text[--at] = (char)('0' + number % 10);
        number /= 10;
    }
    board_write(text + at);
}

void console_number(uint32_t number) { digits(number, 1); }

void console_real(float number) {
    float thousandths = 1000.0f * (number < 0.0f ? -number : number);
    uint32_t rounded;
    /* Also false for a number that is none. */
    if (!(thousandths < 4.0e9f)) {
        board_write("too large");
        return;
    }
    if (number < 0.0f) {
        board_write("-");
    }
    rounded = (uint32_t)(thousandths + 0.5f);
    console_number(rounded / 1000);
    board_write(".");
    digits(rounded % 1000, 3);
}

void console_measure(const char *name, uint32_t value) {
    board_write("@");
    board_write(name);
    board_write(" ");
    console_number(value);
    board_write("\n");
}
