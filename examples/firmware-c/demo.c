/* A complete small program to copy: a face model in flash is opened, evaluated piece by piece, and fitted to landmarks. No heap; the only
   buffers are the ones seen here. It prints what examples/firmware/src/bin/demo.rs prints. */
#include <habitus.h>

#include "board.h"
#include "console.h"

/* The model file: models.S. */
extern const uint8_t face_hab[], face_hab_end[];

/* The weights of the model, fixed when the program is compiled so that arrays can hold them. */
enum { IDENTITY = 6, EXPRESSION = 4, LANDMARKS = 13, PIECE = 64 };

static const float IDENTITY_SHOWN[IDENTITY] = {0.20f, -0.13f, 0.05f, 0.08f, -0.04f, 0.10f};
static const float EXPRESSION_SHOWN[EXPRESSION] = {0.35f, -0.30f, 0.20f, 0.10f};

static void say(const char *what, uint32_t count) {
    board_write(what);
    console_number(count);
    board_write("\n");
}

static void show(const char *what, const float *weights, uint32_t count) {
    uint32_t k;
    board_write(what);
    for (k = 0; k < count; k++) {
        board_write(" ");
        console_real(weights[k]);
    }
    board_write("\n");
}

static hab_code demo(hab_error_detail *detail) {
    static float piece[3 * PIECE];
    static float workspace[HAB_FIT_WORKSPACE_BYTES(IDENTITY, EXPRESSION, HAB_FRAME_RIGID) / sizeof(float)];
    /* Where the camera sees the face: a rotation and a translation. */
    static const float ROTATION[9] = {0.9017378f,   0.21272558f,  0.37632006f, -0.1734207f, 0.9754345f,
                                      -0.13584147f, -0.39597252f, 0.05723171f, 0.9164772f};
    static const float TRANSLATION[3] = {25.0f, -40.0f, 600.0f};
    hab_model model;
    hab_counts counts;
    hab_fit_options options;
    hab_fit_report report;
    hab_placement placement = {1.0f, {1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f}, {0.0f, 0.0f, 0.0f}};
    uint32_t landmarks[LANDMARKS];
    float measured[3 * LANDMARKS], identity[IDENTITY] = {0.0f}, expression[EXPRESSION] = {0.0f};
    float lowest = 0.0f, highest = 0.0f;
    uint32_t from, count, k, row;
    hab_code code;

    /* 1. Open the file where it lies: checked once, nothing is copied. */
    counts.struct_bytes = sizeof counts;
    code = hab_model_open(face_hab, (size_t)(face_hab_end - face_hab), &model, detail);
    if (code != HAB_OK || (code = hab_model_counts(&model, &counts, detail)) != HAB_OK) {
        return code;
    }
    say("vertices: ", counts.n_vertices);
    say("identity weights: ", counts.identity_dim);
    say("expression weights: ", counts.pose_dim);

    /* 2. Evaluate it 64 vertices at a time: the whole mesh never has to fit into memory. */
    for (from = 0; from < counts.n_vertices; from += count) {
        count = counts.n_vertices - from < PIECE ? counts.n_vertices - from : PIECE;
        code = hab_model_evaluate_range(&model, IDENTITY_SHOWN, IDENTITY, EXPRESSION_SHOWN, EXPRESSION, from, count, piece,
                                        3 * count, detail);
        if (code != HAB_OK) {
            return code;
        }
        for (k = 0; k < count; k++) {
            float y = piece[3 * k + 1];
            lowest = (from == 0 && k == 0) || y < lowest ? y : lowest;
            highest = (from == 0 && k == 0) || y > highest ? y : highest;
        }
    }
    board_write("height of this face, mm: ");
    console_real(highest - lowest);
    board_write("\n");

    /* 3. Measure its landmarks somewhere else in space, as a camera would... */
    code = hab_model_read_u32(&model, HAB_SECTION_LANDMARKS, 0, landmarks, LANDMARKS, detail);
    for (k = 0; code == HAB_OK && k < LANDMARKS; k++) {
        float at[3];
        code = hab_model_evaluate_range(&model, IDENTITY_SHOWN, IDENTITY, EXPRESSION_SHOWN, EXPRESSION, landmarks[k], 1, at, 3,
                                        detail);
        for (row = 0; code == HAB_OK && row < 3; row++) {
            const float *r = ROTATION + 3 * row;
            measured[3 * k + row] = r[0] * at[0] + r[1] * at[1] + r[2] * at[2] + TRANSLATION[row];
        }
    }
    if (code != HAB_OK) {
        return code;
    }

    /* 4. ... and find weights and placement again from them alone. */
    (void)hab_fit_options_init(&options);
    options.noise = 0.2f;
    code = hab_fit_landmarks(&model, NULL, &options, measured, 3 * LANDMARKS, NULL, 0, identity, IDENTITY, expression,
                             EXPRESSION, &placement, workspace, sizeof workspace, &report, detail);
    if (code != HAB_OK) {
        return code;
    }
    board_write("distance of the landmarks after the fit, mm: ");
    console_real(report.rms);
    board_write("\n");
    say("iterations: ", report.iterations);
    show("identity found:", identity, IDENTITY);
    show("expression found:", expression, EXPRESSION);
    return HAB_OK;
}

int main(void) {
    hab_error_detail detail = {HAB_OK, 0, 0, 0};
    char line[160];
    if (demo(&detail) == HAB_OK) {
        return 0;
    }
    if (hab_error_format(&detail, line, sizeof line) == HAB_OK) {
        board_write(line);
        board_write("\n");
    }
    return 1;
}
