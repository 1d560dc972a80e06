/* One case: its memory, its inputs, its comparisons; used by the runner. */
#ifndef HABITUS_TESTS_CASE_H
#define HABITUS_TESTS_CASE_H

#include "runner.h"

/* Runs the case that `given`, `models` and `shift` of the context name; fills in the rest. */
void case_run(context *c);

#endif
