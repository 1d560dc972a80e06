/* Stack and code of "open a body, evaluate it by ranges". */
#include "opened.h"

/* The model and a host's result: models.S. */
extern const uint8_t body_hab[], body_hab_end[], body_mean[];

int main(void) { return opened(body_hab, (size_t)(body_hab_end - body_hab), body_mean); }
