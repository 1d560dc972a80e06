/* Stack and code of "open a wavelet model, evaluate it by ranges". */
#include "opened.h"

/* The model and a host's result: models.S. */
extern const uint8_t wavelet_hab[], wavelet_hab_end[], wavelet_mean[];

int main(void) { return opened(wavelet_hab, (size_t)(wavelet_hab_end - wavelet_hab), wavelet_mean); }
