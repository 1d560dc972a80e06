/* Stack and code of "open a linear model, evaluate it by ranges". */
#include "opened.h"

/* The model and a host's result: models.S. */
extern const uint8_t linear_hab[], linear_hab_end[], linear_mean[];

int main(void) { return opened(linear_hab, (size_t)(linear_hab_end - linear_hab), linear_mean); }
