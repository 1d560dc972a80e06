/* The board: what you replace for another one, together with link.ld. */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

/* Prints a text (semihosting). */
void board_write(const char *text);
/* Ends the emulation with a status. */
void board_exit(uint32_t status);
/* Runs `work` on a painted stack and returns the most bytes of stack that it used. Paint that a callee reserved but did not write is not
   seen, as in every measurement of this kind. */
uint32_t board_stack_used(void (*work)(void *argument), void *argument);

#endif
