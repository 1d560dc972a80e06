/* What the measured programs calculate: the numbers of examples/firmware/src/cases.rs. */
#ifndef CASES_H
#define CASES_H

#include <habitus.h>

enum { IDENTITY = 4, POSE = 3, LANDMARKS = 13 };

static const float IDENTITY_SHOWN[IDENTITY] = {0.7f, -1.3f, 0.25f, 2.1f};
static const float POSE_SHOWN[POSE] = {-0.4f, 1.1f, 0.9f};

/* The small model: models.S. */
extern const uint8_t small_hab[], small_hab_end[];

#endif
