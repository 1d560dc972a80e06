/* What the programs that open and evaluate a model share: each of them is this with one model. */
#ifndef OPENED_H
#define OPENED_H

#include <stddef.h>
#include <stdint.h>

/* Opens a model and evaluates it by ranges of 64 vertices; prints a number and the stack of both. `expected_mean` are the bytes of a host's result, in
   the same order of summation. Returns the status of the program. */
int opened(const uint8_t *bytes, size_t len, const uint8_t *expected_mean);

#endif
