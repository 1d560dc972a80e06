/* Stack and code of "open a bilinear model, evaluate it by ranges". */
#include "opened.h"

/* The model and a host's result: models.S. */
extern const uint8_t small_hab[], small_hab_end[], small_mean[];

int main(void) { return opened(small_hab, (size_t)(small_hab_end - small_hab), small_mean); }
