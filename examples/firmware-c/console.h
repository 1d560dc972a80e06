/* Numbers as text, without printf, whose code would exceed the kernel's. */
#ifndef CONSOLE_H
#define CONSOLE_H

#include <stdint.h>

void console_number(uint32_t number);
/* A real number with three decimals; it must fit 32 bits in thousandths. */
void console_real(float number);
/* A line that `cargo xtask firmware` reads: `@name value`. */
void console_measure(const char *name, uint32_t value);

#endif
