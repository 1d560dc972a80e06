/* Nothing but the start-up and the console: what the other programs' sizes are counted from. */
#include <stddef.h>

#include "board.h"
#include "console.h"

static void nothing(void *argument) { (void)argument; }

int main(void) {
    console_measure("stack", board_stack_used(nothing, NULL));
    console_real((float)(uintptr_t)main);
    board_write("\n");
    return 0;
}
