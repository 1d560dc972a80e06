/* Stack and code of "open a wavelet model stored in bytes, evaluate it by ranges". */
#include "opened.h"

/* The model and a host's result: models.S. */
extern const uint8_t wavelet_i8_hab[], wavelet_i8_hab_end[], wavelet_i8_mean[];

int main(void) { return opened(wavelet_i8_hab, (size_t)(wavelet_i8_hab_end - wavelet_i8_hab), wavelet_i8_mean); }
