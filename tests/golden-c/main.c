/* Runs the golden vectors and their negative control on the processor it is compiled for. Prints each failing case, then the figures as
   lines `@name value`. Ends with 0 when every bit is as it should be and every changed bit was noticed. */
#include <inttypes.h>
#include <stdint.h>
#include <stdio.h>

/* Defined by the library habitus_golden_c. */
uint32_t golden_run(void);
uint32_t golden_control(void);

/* Called by it. */
void golden_report(const char *text, size_t length);
void golden_figure(const char *name, size_t length, uint32_t value);

void golden_report(const char *text, size_t length) { printf("%.*s\n", (int)length, text); }

void golden_figure(const char *name, size_t length, uint32_t value) {
    printf("@%.*s %" PRIu32 "\n", (int)length, name, value);
}

int main(void) {
    const uint16_t one = 1;
    uint32_t equal = golden_run();
    uint32_t noticed = golden_control();
    /* What the processor does, beside what the compiler took it for. */
    printf("@big_endian_memory %d\n", *(const unsigned char *)&one == 0);
    return equal == 1 && noticed == 1 ? 0 : 1;
}
