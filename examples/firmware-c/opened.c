/* Stack and code of "open a model, evaluate it by ranges", of whatever kind. */
#include "opened.h"

#include <habitus.h>

#include "board.h"
#include "console.h"

enum { PIECE = 64, MOST_WEIGHTS = 1024 };

static hab_model model;
static hab_counts counts;
static hab_code outcome;
static float identity[MOST_WEIGHTS], pose[MOST_WEIGHTS];
static size_t n_identity, n_pose;
static float workspace[6144];
static float piece[3 * PIECE], mean;

/* The bytes of a file. */
typedef struct file {
    const uint8_t *bytes;
    size_t len;
} file;

static void open_model(void *argument) {
    const file *opened = argument;
    outcome = hab_model_open(opened->bytes, opened->len, &model, NULL);
}

/* Mean over the vertices of x + y + z: a number in which every output bit takes part. */
static void evaluate(void *argument) {
    hab_evaluation evaluation;
    float sum = 0.0f;
    uint32_t from, count, k;
    (void)argument;
    outcome = hab_evaluation_init(&model, NULL, identity, n_identity, pose, n_pose, 0, workspace, sizeof workspace, &evaluation, NULL);
    for (from = 0; from < counts.n_vertices && outcome == HAB_OK; from += count) {
        float part = -0.0f;
        count = counts.n_vertices - from < PIECE ? counts.n_vertices - from : PIECE;
        outcome = hab_evaluation_positions(&evaluation, from, count, piece, 3 * count, NULL);
        for (k = 0; k < 3 * count; k++) {
            part += piece[k];
        }
        sum += part;
    }
    mean = sum / (float)counts.n_vertices;
}

int opened(const uint8_t *bytes, size_t len, const uint8_t *expected_mean) {
    /* The weights of examples/firmware/src/cases.rs. */
    static const float WEIGHTS[7] = {0.7f, -1.3f, 0.25f, 2.1f, -0.4f, 1.1f, 0.9f};
    uint32_t stack_open, stack_evaluate, expected = 0, k;
    file opened;
    union {
        float number;
        uint32_t bits;
    } found;
    opened.bytes = bytes;
    opened.len = len;
    counts.struct_bytes = sizeof counts;
    stack_open = board_stack_used(open_model, &opened);
    if (outcome != HAB_OK || hab_model_counts(&model, &counts, NULL) != HAB_OK) {
        return 1;
    }
    /* A wavelet model has weights for every coefficient, of which there are as many as vertices. */
    n_identity = counts.identity_dim;
    n_pose = counts.pose_dim;
    if (n_identity > MOST_WEIGHTS || n_pose > MOST_WEIGHTS) {
        return 1;
    }
    for (k = 0; k < MOST_WEIGHTS; k++) {
        identity[k] = WEIGHTS[k % 7];
        pose[k] = WEIGHTS[(k + 4) % 7];
    }
    stack_evaluate = board_stack_used(evaluate, NULL);
    found.number = mean;
    for (k = 0; k < 4; k++) {
        expected |= (uint32_t)expected_mean[k] << (8 * k);
    }
    if (outcome != HAB_OK || found.bits != expected) {
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
