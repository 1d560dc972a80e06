/* Stack, code and scratch of the landmark fit. */
#include "board.h"
#include "cases.h"
#include "console.h"

static float workspace[HAB_FIT_WORKSPACE_BYTES(IDENTITY, POSE, HAB_FRAME_RIGID) / sizeof(float)];

/* The arguments of the fit, and what came of it. */
typedef struct fit {
    hab_model model;
    hab_fit_options options;
    hab_placement placement;
    hab_fit_report report;
    float targets[3 * LANDMARKS], identity[IDENTITY], pose[POSE];
    uint8_t measured[LANDMARKS];
    hab_code outcome;
} fit;

static void run(void *argument) {
    fit *f = argument;
    f->outcome = hab_fit_landmarks(&f->model, NULL, &f->options, f->targets, 3 * LANDMARKS, f->measured, LANDMARKS, f->identity,
                                   IDENTITY, f->pose, POSE, &f->placement, workspace, sizeof workspace, &f->report, NULL);
}

int main(void) {
    /* A known face, at a quarter of its weights, turned and moved; the first landmark is missing. */
    static const float ROTATION[9] = {0.9505806f,   -0.12733458f, -0.28316498f, 0.06803131f, 0.9752903f,
                                      -0.21019171f, 0.3029327f,   0.18054007f,  0.9357548f};
    static const float TRANSLATION[3] = {30.0f, -12.0f, 400.0f};
    static fit f;
    float identity[IDENTITY], pose[POSE];
    uint32_t landmarks[LANDMARKS], k, row, stack;
    if (hab_model_open(small_hab, (size_t)(small_hab_end - small_hab), &f.model, NULL) != HAB_OK ||
        hab_model_read_u32(&f.model, HAB_SECTION_LANDMARKS, 0, landmarks, LANDMARKS, NULL) != HAB_OK) {
        return 1;
    }
    for (k = 0; k < IDENTITY; k++) {
        identity[k] = 0.25f * IDENTITY_SHOWN[k];
    }
    for (k = 0; k < POSE; k++) {
        pose[k] = 0.25f * POSE_SHOWN[k];
    }
    for (k = 1; k < LANDMARKS; k++) {
        float at[3];
        if (hab_model_evaluate_range(&f.model, identity, IDENTITY, pose, POSE, landmarks[k], 1, at, 3, NULL) != HAB_OK) {
            return 1;
        }
        for (row = 0; row < 3; row++) {
            const float *r = ROTATION + 3 * row;
            f.targets[3 * k + row] = r[0] * at[0] + r[1] * at[1] + r[2] * at[2] + TRANSLATION[row];
        }
        f.measured[k] = 1;
    }
    (void)hab_fit_options_init(&f.options, sizeof f.options);
    f.options.noise = 0.5f;
    stack = board_stack_used(run, &f);
    if (f.outcome != HAB_OK) {
        return 1;
    }
    board_write("distance of the landmarks, mm: ");
    console_real(f.report.rms);
    board_write(" after iterations: ");
    console_number(f.report.iterations);
    board_write("\n");
    console_measure("stack", stack);
    console_measure("scratch", sizeof workspace);
    /* The targets are the model's own: what is left comes from the priors. */
    return f.report.rms < 1.0f ? 0 : 1;
}
