/* Stack and code of "open a body stored in bytes, evaluate it by ranges". */
#include "opened.h"

/* The model and a host's result: models.S. */
extern const uint8_t body_i8_hab[], body_i8_hab_end[], body_i8_mean[];

int main(void) { return opened(body_i8_hab, (size_t)(body_i8_hab_end - body_i8_hab), body_i8_mean); }
