/* Stack and code of "open a model, evaluate it by ranges". */
#include "board.h"
#include "cases.h"
#include "console.h"

enum { PIECE = 64 };

/* A host's result, in the same order of summation: models.S. */
extern const uint8_t small_mean[];

static hab_model model;
static hab_code outcome;
static float piece[3 * PIECE], mean;

static void open_model(void *argument) {
    (void)argument;
    outcome = hab_model_open(small_hab, (size_t)(small_hab_end - small_hab), &model, NULL);
}

/* Mean over the vertices of x + y + z: a number in which every output bit takes part. */
static void evaluate(void *argument) {
    const hab_counts *counts = argument;
    float sum = 0.0f;
    uint32_t from, count, k;
    for (from = 0; from < counts->n_vertices && outcome == HAB_OK; from += count) {
        float part = -0.0f;
        count = counts->n_vertices - from < PIECE ? counts->n_vertices - from : PIECE;
        outcome = hab_model_evaluate_range(&model, IDENTITY_SHOWN, IDENTITY, POSE_SHOWN, POSE, from, count, piece, 3 * count,
                                           NULL);
        for (k = 0; k < 3 * count; k++) {
            part += piece[k];
        }
        sum += part;
    }
    mean = sum / (float)counts->n_vertices;
}

int main(void) {
    hab_counts counts;
    uint32_t stack_open, stack_evaluate, bits = 0, expected = 0, k;
    union {
        float number;
        uint32_t bits;
    } found;
    counts.struct_bytes = sizeof counts;
    stack_open = board_stack_used(open_model, NULL);
    if (outcome != HAB_OK || hab_model_counts(&model, &counts, NULL) != HAB_OK) {
        return 1;
    }
    stack_evaluate = board_stack_used(evaluate, &counts);
    found.number = mean;
    bits = found.bits;
    for (k = 0; k < 4; k++) {
        expected |= (uint32_t)small_mean[k] << (8 * k);
    }
    if (outcome != HAB_OK || bits != expected) {
        board_write("another result than the host's\n");
        return 1;
    }
    board_write("mean of x + y + z, mm: ");
    console_real(mean);
    board_write("\n");
    console_measure("stack", stack_open > stack_evaluate ? stack_open : stack_evaluate);
    console_measure("stack_open", stack_open);
    console_measure("stack_evaluate", stack_evaluate);
    return 0;
}
