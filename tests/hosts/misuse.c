/* What the functions of habitus.h answer when they are used wrongly. Prints a table: the call, the code returned, whether everything that the
 * call could have written is untouched. Fails unless each code is the expected one and everything is untouched.
 *
 *     misuse MODEL.hab BODY.hab WAVELET.hab
 *
 * Before each row the outputs are filled with a pattern and the inputs with something sound; the row spoils one thing. */
#include "habitus.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_VERTICES 4096
#define MAX_WEIGHTS 16
#define MAX_LANDMARKS 32
#define MAX_FILE (1u << 20)
#define N_SAMPLES 24
#define MAX_JOINTS 8

/* Everything that calls write. */
static struct outputs {
    float positions[3 * MAX_VERTICES];
    float values[3 * MAX_VERTICES];
    float jacobian[6 * HAB_BLOCK_VERTICES * MAX_WEIGHTS];
    float identity[MAX_WEIGHTS];
    float pose[MAX_WEIGHTS];
    float workspace[HAB_FIT_WORKSPACE_BYTES(MAX_WEIGHTS, MAX_WEIGHTS, HAB_FRAME_SIMILARITY) / sizeof(float)];
    uint32_t indices[3 * MAX_VERTICES];
    hab_model model;
    hab_prepared form;
    hab_evaluation evaluation;
    hab_joint joint;
    hab_model changed;
    hab_placement placement;
    hab_fit_report report;
    hab_fit_options options;
    hab_level_options level_options;
    hab_level_report level_report;
    hab_grid grid;
    hab_counts counts;
    hab_section section;
    const char *text;
    size_t text_bytes;
    size_t bytes;
    char line[200];
} out, out_before;

/* Everything that calls read. */
static struct inputs {
    float identity[MAX_WEIGHTS];
    float pose[MAX_WEIGHTS];
    float targets[3 * MAX_LANDMARKS];
    uint8_t measured[MAX_LANDMARKS];
    hab_sample samples[N_SAMPLES];
    hab_fit_options options;
    hab_level_options level_options;
    hab_model model;
    hab_model body;
    hab_model wavelet;
    hab_model coarse;
    hab_prepared form;
    hab_prepared person;
    hab_evaluation evaluation;
    uint8_t file[MAX_FILE];
} in, in_sound, in_before;

/* The weights and the workspace of the prepared form. */
static float form_workspace[HAB_PREPARED_WORKSPACE_BYTES(MAX_WEIGHTS, MAX_VERTICES / HAB_BLOCK_VERTICES) / sizeof(float)];
/* The body's file, the workspace of its form and that of its evaluation. */
static uint8_t body_file[MAX_FILE];
static float person_workspace[4096], body_workspace[HAB_SKINNED_WORKSPACE_BYTES(MAX_WEIGHTS, MAX_WEIGHTS, MAX_JOINTS, 1) / sizeof(float)];
static hab_counts counts, body_counts;
static size_t body_len, bi, bp;
/* The wavelet model's file; in.coarse is the same model, coarser. */
static uint8_t wavelet_file[MAX_FILE];
static hab_counts wavelet_counts;
static size_t wavelet_len;
static size_t file_len, ni, np, nl, nv;
static hab_error_detail detail;
static int n_rows, n_faults;

static void fresh(void) {
    const hab_error_detail none = {-7, 0, 0, 0};
    memset(&out, 0xA5, sizeof out);
    memcpy(&in, &in_sound, sizeof in);
    /* What goes in and out begins sound, too. */
    memcpy(out.identity, in.identity, sizeof out.identity);
    memcpy(out.pose, in.pose, sizeof out.pose);
    memset(&out.placement, 0, sizeof out.placement);
    out.placement.scale = out.placement.rotation[0] = out.placement.rotation[4] = out.placement.rotation[8] = 1;
    out.counts.struct_bytes = sizeof out.counts;
    out.section.struct_bytes = sizeof out.section;
    out.joint.struct_bytes = sizeof out.joint;
    out.grid.struct_bytes = sizeof out.grid;
    memcpy(&out.changed, &in.body, sizeof out.changed);
    detail = none;
}

static void remember(void) {
    memcpy(&out_before, &out, sizeof out);
    memcpy(&in_before, &in, sizeof in);
}

static int untouched(void) {
    return memcmp(&out_before, &out, sizeof out) == 0 && memcmp(&in_before, &in, sizeof in) == 0;
}

static void check(const char *call, hab_code expected, hab_code got) {
    const int same = untouched();
    /* The detail repeats the code and says which argument was meant; but not where none is passed, or where it is itself what is wrong. */
    const int silent = strstr(call, "options_init") != NULL || strstr(call, "error_format") != NULL || strstr(call, "detail") != NULL;
    const int names_argument = (got >= HAB_NULL_POINTER && got <= HAB_BAD_STRUCT) || got >= HAB_OVERLAP ? got <= HAB_BAD_LENGTH : got == HAB_DIMENSION_MISMATCH;
    const int named = !names_argument || (detail.argument > 0 && (got == HAB_DIMENSION_MISMATCH || detail.first == detail.argument));
    const int told = silent ? detail.code == -7 || detail.code == got : detail.code == got && named;
    const char *verdict = "";
    n_rows++;
    if (got != expected || !same || !told) {
        n_faults++;
        verdict = got != expected ? "  <-- FAULT: code" : !same ? "  <-- FAULT: outputs" : "  <-- FAULT: detail";
    }
    printf("| %s | %s | %s |%s\n", call, hab_error_name(got), same ? "yes" : "no", verdict);
}

#define ROW(call, spoil, expected, expression) \
    do { \
        fresh(); \
        spoil; \
        remember(); \
        check(call, expected, expression); \
    } while (0)
#define NOTHING (void)0
/* The same address and some bytes more: for the misaligned and the overlapping. */
#define MOVED(type, pointer, bytes) ((type *)(void *)((uint8_t *)(pointer) + (bytes)))

static hab_code evaluate(const float *identity, size_t n_identity, const float *pose, size_t n_pose, float *positions, size_t n) {
    return hab_model_evaluate(&in.model, identity, n_identity, pose, n_pose, positions, n, &detail);
}

static hab_code range(uint32_t first, uint32_t count, size_t n) {
    return hab_model_evaluate_range(&in.model, in.identity, ni, in.pose, np, first, count, out.positions, n, &detail);
}

static hab_code linearise(uint32_t first, uint32_t count, float *values, size_t n_values, float *jacobian, size_t n_jacobian) {
    return hab_model_linearise(&in.model, in.identity, ni, in.pose, np, first, count, values, n_values, jacobian, n_jacobian, &detail);
}

static hab_code fit(const hab_prepared *form, size_t n_targets, size_t n_measured, size_t n_identity, void *workspace, size_t bytes) {
    return hab_fit_landmarks(&in.model, form, &in.options, in.targets, n_targets, in.measured, n_measured, out.identity, n_identity,
                             out.pose, np, &out.placement, workspace, bytes, &out.report, &detail);
}

static hab_code fit_all(void) {
    return fit(NULL, 3 * nl, nl, ni, out.workspace, sizeof out.workspace);
}

static hab_code fit_points(const hab_sample *samples, size_t n) {
    return hab_fit_points(&in.model, NULL, &in.options, samples, n, out.identity, ni, out.pose, np, &out.placement, out.workspace,
                          sizeof out.workspace, &out.report, &detail);
}

static hab_code prepare(uint32_t mode, size_t n, uint32_t first, uint32_t count, void *workspace, size_t bytes) {
    return hab_prepared_init(&in.model, mode, in.identity, n, first, count, workspace, bytes, &out.form, &detail);
}

static hab_code open_bytes(size_t len) {
    return hab_model_open(in.file, len, &out.model, &detail);
}

static void rows_of_opening(void) {
    ROW("open: bytes null", NOTHING, HAB_NULL_POINTER, hab_model_open(NULL, file_len, &out.model, &detail));
    ROW("open: model null", NOTHING, HAB_NULL_POINTER, hab_model_open(in.file, file_len, NULL, &detail));
    ROW("open: model null, no detail", NOTHING, HAB_NULL_POINTER, hab_model_open(in.file, file_len, NULL, NULL));
    ROW("open: model misaligned", NOTHING, HAB_MISALIGNED,
        hab_model_open(in.file, file_len, MOVED(hab_model, &out.model, 4), &detail));
    ROW("open: model within the bytes", NOTHING, HAB_OVERLAP,
        hab_model_open(in.file, file_len, MOVED(hab_model, in.file, 64), &detail));
    ROW("open: detail within the bytes", NOTHING, HAB_OVERLAP,
        hab_model_open(in.file, file_len, &out.model, MOVED(hab_error_detail, in.file, 64)));
    ROW("open: detail misaligned", NOTHING, HAB_MISALIGNED,
        hab_model_open(in.file, file_len, &out.model, MOVED(hab_error_detail, out.line, 1)));
    ROW("open: a length that wraps", NOTHING, HAB_BAD_LENGTH, open_bytes(SIZE_MAX));
    ROW("open: no bytes", NOTHING, HAB_TRUNCATED, open_bytes(0));
    ROW("open: null without bytes", NOTHING, HAB_TRUNCATED, hab_model_open(NULL, 0, &out.model, &detail));
    ROW("open: one byte", NOTHING, HAB_TRUNCATED, open_bytes(1));
    ROW("open: half the file", NOTHING, HAB_TRUNCATED, open_bytes(file_len / 2));
    ROW("open: a byte short", NOTHING, HAB_TRUNCATED, open_bytes(file_len - 1));
    ROW("open: other magic", in.file[0] ^= 0x20, HAB_BAD_MAGIC, open_bytes(file_len));
    ROW("open: all zero", memset(in.file, 0, file_len), HAB_BAD_MAGIC, open_bytes(file_len));
    ROW("open: a later version", in.file[8] = 0x7F, HAB_UNKNOWN_VERSION, open_bytes(file_len));
    ROW("open: a bit of the header flipped", in.file[60] ^= 1, HAB_BAD_CHECKSUM, open_bytes(file_len));
    ROW("open: a bit of the content flipped", in.file[file_len / 2] ^= 1, HAB_BAD_CHECKSUM, open_bytes(file_len));
    ROW("open_trusted: half the file", NOTHING, HAB_TRUNCATED,
        hab_model_open_trusted(in.file, file_len / 2, &out.model, &detail));
}

static void rows_of_models(void) {
    ROW("counts: model null", NOTHING, HAB_NULL_POINTER, hab_model_counts(NULL, &out.counts, &detail));
    ROW("counts: model all zero", memset(&in.model, 0, sizeof in.model), HAB_NOT_OPENED,
        hab_model_counts(&in.model, &out.counts, &detail));
    ROW("counts: model of a pattern", memset(&in.model, 0xA5, sizeof in.model), HAB_NOT_OPENED,
        hab_model_counts(&in.model, &out.counts, &detail));
    ROW("counts: start of the model overwritten", memset(&in.model, 0, 8), HAB_NOT_OPENED,
        hab_model_counts(&in.model, &out.counts, &detail));
    ROW("counts: a prepared form as model", memcpy(&in.model, &in.form, sizeof in.form), HAB_NOT_OPENED,
        hab_model_counts(&in.model, &out.counts, &detail));
    ROW("counts: model misaligned", NOTHING, HAB_MISALIGNED,
        hab_model_counts(MOVED(hab_model, &in.model, 1), &out.counts, &detail));
    ROW("counts: struct_bytes 0", out.counts.struct_bytes = 0, HAB_BAD_STRUCT, hab_model_counts(&in.model, &out.counts, &detail));
    ROW("counts: struct_bytes of later versions", out.counts.struct_bytes = 4096, HAB_BAD_STRUCT,
        hab_model_counts(&in.model, &out.counts, &detail));
    ROW("counts: counts are the model", NOTHING, HAB_OVERLAP, hab_model_counts(&in.model, MOVED(hab_counts, &in.model, 0), &detail));
    ROW("counts: detail within the counts", NOTHING, HAB_OVERLAP,
        hab_model_counts(&in.model, &out.counts, MOVED(hab_error_detail, &out.counts, 8)));
    ROW("section: behind the last", NOTHING, HAB_INDEX_OUT_OF_RANGE,
        hab_model_section(&in.model, counts.n_sections, &out.section, &detail));
    ROW("section: struct_bytes 0", out.section.struct_bytes = 0, HAB_BAD_STRUCT,
        hab_model_section(&in.model, 0, &out.section, &detail));
    ROW("find_section: unknown", NOTHING, HAB_UNSUPPORTED, hab_model_find_section(&in.model, 999, &out.section, &detail));
    ROW("read_u32: section of reals", NOTHING, HAB_BAD_OPTION,
        hab_model_read_u32(&in.model, HAB_SECTION_IDENTITY_MEAN, 0, out.indices, 1, &detail));
    ROW("read_u32: more than there is", NOTHING, HAB_INDEX_OUT_OF_RANGE,
        hab_model_read_u32(&in.model, HAB_SECTION_LANDMARKS, 0, out.indices, nl + 1, &detail));
    ROW("read_u32: a range that wraps", NOTHING, HAB_INDEX_OUT_OF_RANGE,
        hab_model_read_u32(&in.model, HAB_SECTION_LANDMARKS, SIZE_MAX, out.indices, 2, &detail));
    ROW("read_u32: values within the model's bytes", NOTHING, HAB_OVERLAP,
        hab_model_read_u32(&in.model, HAB_SECTION_LANDMARKS, 0, MOVED(uint32_t, in.file, 256), nl, &detail));
    ROW("read_f32: a length that wraps", NOTHING, HAB_BAD_LENGTH,
        hab_model_read_f32(&in.model, HAB_SECTION_IDENTITY_MEAN, 0, out.identity, SIZE_MAX / 4 + 1, &detail));
    ROW("text: of a section of integers", NOTHING, HAB_BAD_OPTION,
        hab_model_text(&in.model, HAB_SECTION_FACES, 0, &out.text, &out.text_bytes, &detail));
    ROW("text: behind the last line", NOTHING, HAB_INDEX_OUT_OF_RANGE,
        hab_model_text(&in.model, HAB_SECTION_PROVENANCE, UINT32_MAX, &out.text, &out.text_bytes, &detail));
    ROW("text: length null", NOTHING, HAB_NULL_POINTER,
        hab_model_text(&in.model, HAB_SECTION_PROVENANCE, 0, &out.text, NULL, &detail));
    ROW("weights: unknown mode", NOTHING, HAB_BAD_OPTION,
        hab_model_weights(&in.model, 2, in.identity, ni, out.identity, ni, &detail));
    ROW("weights: a deviation too few", NOTHING, HAB_DIMENSION_MISMATCH,
        hab_model_weights(&in.model, HAB_MODE_IDENTITY, in.identity, ni - 1, out.identity, ni, &detail));
    ROW("weights: a weight too many", NOTHING, HAB_DIMENSION_MISMATCH,
        hab_model_weights(&in.model, HAB_MODE_IDENTITY, in.identity, ni, out.identity, ni + 1, &detail));
    ROW("weights: a deviation not a number", in.identity[1] = NAN, HAB_NOT_FINITE,
        hab_model_weights(&in.model, HAB_MODE_IDENTITY, in.identity, ni, out.identity, ni, &detail));
    ROW("weights: in place", NOTHING, HAB_OVERLAP,
        hab_model_weights(&in.model, HAB_MODE_IDENTITY, out.identity, ni, out.identity, ni, &detail));
    ROW("error_format: detail null", NOTHING, HAB_NULL_POINTER, hab_error_format(NULL, out.line, sizeof out.line));
    ROW("error_format: text of no bytes", NOTHING, HAB_OUTPUT_TOO_SMALL, hab_error_format(&detail, out.line, 0));
    ROW("error_format: detail within the text", NOTHING, HAB_OVERLAP,
        hab_error_format(MOVED(const hab_error_detail, out.line, 4), out.line, sizeof out.line));
}

static void rows_of_evaluation(void) {
    float *const positions = out.positions;
    const size_t n = 3 * nv, n_block = 3 * HAB_BLOCK_VERTICES;
    ROW("evaluate: identity null", NOTHING, HAB_NULL_POINTER, evaluate(NULL, ni, in.pose, np, positions, n));
    ROW("evaluate: model null, identity under the detail", NOTHING, HAB_OVERLAP,
        hab_model_evaluate(NULL, in.identity, ni, in.pose, np, positions, n, (hab_error_detail *)(void *)in.identity));
    ROW("evaluate: model null, positions under the detail", NOTHING, HAB_OVERLAP,
        hab_model_evaluate(NULL, in.identity, ni, in.pose, np, positions, n, (hab_error_detail *)(void *)positions));
    ROW("evaluate: model not open, misaligned positions under the detail", memset(&in.model, 0, sizeof in.model), HAB_MISALIGNED,
        hab_model_evaluate(&in.model, in.identity, ni, in.pose, np, MOVED(float, positions, 2), n, (hab_error_detail *)(void *)positions));
    ROW("evaluate: positions null", NOTHING, HAB_NULL_POINTER, evaluate(in.identity, ni, in.pose, np, NULL, n));
    ROW("evaluate: an identity weight too few", NOTHING, HAB_DIMENSION_MISMATCH, evaluate(in.identity, ni - 1, in.pose, np, positions, n));
    ROW("evaluate: a pose weight too many", NOTHING, HAB_DIMENSION_MISMATCH, evaluate(in.identity, ni, in.pose, np + 1, positions, n));
    ROW("evaluate: no weights", NOTHING, HAB_DIMENSION_MISMATCH, evaluate(NULL, 0, NULL, 0, positions, n));
    ROW("evaluate: positions too short", NOTHING, HAB_DIMENSION_MISMATCH, evaluate(in.identity, ni, in.pose, np, positions, n - 1));
    ROW("evaluate: positions too long", NOTHING, HAB_DIMENSION_MISMATCH, evaluate(in.identity, ni, in.pose, np, positions, n + 1));
    ROW("evaluate: positions misaligned", NOTHING, HAB_MISALIGNED,
        evaluate(in.identity, ni, in.pose, np, MOVED(float, positions, 2), n));
    ROW("evaluate: identity misaligned", NOTHING, HAB_MISALIGNED,
        evaluate(MOVED(float, in.identity, 1), ni, in.pose, np, positions, n));
    ROW("evaluate: weights within the positions", NOTHING, HAB_OVERLAP, evaluate(positions + 8, ni, in.pose, np, positions, n));
    ROW("evaluate: positions within the model's bytes", NOTHING, HAB_OVERLAP,
        evaluate(in.identity, ni, in.pose, np, MOVED(float, in.file, 4096), n));
    ROW("evaluate: positions over the model's struct", NOTHING, HAB_OVERLAP,
        evaluate(in.identity, ni, in.pose, np, MOVED(float, &in.model, 0), n));
    ROW("evaluate: detail within the positions", NOTHING, HAB_OVERLAP,
        hab_model_evaluate(&in.model, in.identity, ni, in.pose, np, positions, n, MOVED(hab_error_detail, positions, 12)));
    ROW("evaluate: a length that wraps", NOTHING, HAB_BAD_LENGTH, evaluate(in.identity, ni, in.pose, np, positions, SIZE_MAX / 4));
    ROW("evaluate: a weight not a number", in.identity[0] = NAN, HAB_NOT_FINITE, evaluate(in.identity, ni, in.pose, np, positions, n));
    ROW("evaluate: a weight infinite", in.pose[np - 1] = INFINITY, HAB_NOT_FINITE, evaluate(in.identity, ni, in.pose, np, positions, n));
    ROW("evaluate: a weight too large", in.identity[0] = -1e10F, HAB_NOT_FINITE, evaluate(in.identity, ni, in.pose, np, positions, n));
    ROW("evaluate: model all zero", memset(&in.model, 0, sizeof in.model), HAB_NOT_OPENED,
        evaluate(in.identity, ni, in.pose, np, positions, n));
    ROW("evaluate_range: behind the last vertex", NOTHING, HAB_INDEX_OUT_OF_RANGE, range((uint32_t)nv - 1, 2, 6));
    ROW("evaluate_range: a range that wraps", NOTHING, HAB_INDEX_OUT_OF_RANGE, range(UINT32_MAX, 2, 6));
    ROW("evaluate_range: positions of another count", NOTHING, HAB_DIMENSION_MISMATCH, range(0, 2, 5));
    ROW("linearise: behind the last block", NOTHING, HAB_INDEX_OUT_OF_RANGE,
        linearise(counts.n_blocks, 1, out.values, n_block, out.jacobian, n_block * (ni + np)));
    ROW("linearise: values too short", NOTHING, HAB_DIMENSION_MISMATCH,
        linearise(0, 1, out.values, n_block - 1, out.jacobian, n_block * (ni + np)));
    ROW("linearise: jacobian too long", NOTHING, HAB_DIMENSION_MISMATCH,
        linearise(0, 1, out.values, n_block, out.jacobian, n_block * (ni + np) + 1));
    ROW("linearise: values within the jacobian", NOTHING, HAB_OVERLAP,
        linearise(0, 1, out.jacobian + 4, n_block, out.jacobian, n_block * (ni + np)));
}

static void rows_of_forms(void) {
    float *const workspace = out.workspace;
    const size_t bytes = HAB_PREPARED_WORKSPACE_BYTES(np, 1);
    ROW("prepared_workspace_bytes: unknown mode", NOTHING, HAB_BAD_OPTION,
        hab_prepared_workspace_bytes(&in.model, 7, 0, 1, &out.bytes, &detail));
    ROW("prepared_workspace_bytes: blocks that wrap", NOTHING, HAB_INDEX_OUT_OF_RANGE,
        hab_prepared_workspace_bytes(&in.model, HAB_MODE_POSE, UINT32_MAX, UINT32_MAX, &out.bytes, &detail));
    ROW("prepared_init: unknown mode", NOTHING, HAB_BAD_OPTION, prepare(2, ni, 0, 1, workspace, bytes));
    ROW("prepared_init: workspace a byte short", NOTHING, HAB_WORKSPACE_TOO_SMALL, prepare(HAB_MODE_IDENTITY, ni, 0, 1, workspace, bytes - 1));
    ROW("prepared_init: no workspace", NOTHING, HAB_WORKSPACE_TOO_SMALL, prepare(HAB_MODE_IDENTITY, ni, 0, 1, NULL, 0));
    ROW("prepared_init: workspace null", NOTHING, HAB_NULL_POINTER, prepare(HAB_MODE_IDENTITY, ni, 0, 1, NULL, bytes));
    ROW("prepared_init: workspace misaligned", NOTHING, HAB_MISALIGNED,
        prepare(HAB_MODE_IDENTITY, ni, 0, 1, MOVED(float, workspace, 1), bytes));
    ROW("prepared_init: weights within the workspace", NOTHING, HAB_OVERLAP,
        prepare(HAB_MODE_IDENTITY, ni, 0, 1, in.identity, bytes));
    ROW("prepared_init: form within the workspace", NOTHING, HAB_OVERLAP,
        prepare(HAB_MODE_IDENTITY, ni, 0, 1, MOVED(float, &out.form, -64), bytes));
    ROW("prepared_init: a weight too few", NOTHING, HAB_DIMENSION_MISMATCH, prepare(HAB_MODE_IDENTITY, ni - 1, 0, 1, workspace, bytes));
    ROW("prepared_init: a weight not a number", in.identity[0] = NAN, HAB_NOT_FINITE, prepare(HAB_MODE_IDENTITY, ni, 0, 1, workspace, bytes));
    ROW("prepared_evaluate: form of zeros", memset(&in.form, 0, sizeof in.form), HAB_NOT_OPENED,
        hab_prepared_evaluate(&in.form, in.pose, np, 0, 1, out.positions, 3, &detail));
    ROW("prepared_evaluate: weights of the fixed mode", NOTHING, HAB_DIMENSION_MISMATCH,
        hab_prepared_evaluate(&in.form, in.identity, ni, 0, 1, out.positions, 3, &detail));
    ROW("prepared_evaluate: behind the last vertex", NOTHING, HAB_INDEX_OUT_OF_RANGE,
        hab_prepared_evaluate(&in.form, in.pose, np, (uint32_t)nv, 1, out.positions, 3, &detail));
    ROW("prepared_evaluate: positions within the form's workspace", NOTHING, HAB_OVERLAP,
        hab_prepared_evaluate(&in.form, in.pose, np, 0, 1, form_workspace + 48, 3, &detail));
    ROW("prepared_linearise: jacobian too short", NOTHING, HAB_DIMENSION_MISMATCH,
        hab_prepared_linearise(&in.form, in.pose, np, 0, 1, out.values, 3 * HAB_BLOCK_VERTICES, out.jacobian, 3, &detail));
}

static hab_code begin(size_t n_identity, size_t n_pose, uint32_t derivatives, void *workspace, size_t bytes) {
    return hab_evaluation_init(&in.body, NULL, in.identity, n_identity, in.pose, n_pose, derivatives, workspace, bytes, &out.evaluation,
                               &detail);
}

static hab_code positions_of(uint32_t first, uint32_t count, float *positions, size_t n) {
    return hab_evaluation_positions(&in.evaluation, first, count, positions, n, &detail);
}

static hab_code fit_levels(const hab_sample *samples, size_t n, size_t n_identity) {
    return hab_fit_levels(&in.model, &in.level_options, samples, n, out.identity, n_identity, out.pose, np, &out.placement, out.workspace,
                          sizeof out.workspace, &out.level_report, &detail);
}

/* Fits landmarks of a wavelet model with what a fit to a face is given: none of the rows gets as far as the weights, which are others. */
static hab_code fit_wavelet(const hab_model *model, size_t n_landmarks) {
    return hab_fit_landmarks(model, NULL, &in.options, in.targets, 3 * n_landmarks, NULL, 0, out.identity, ni, out.pose, np, &out.placement,
                             out.workspace, sizeof out.workspace, &out.report, &detail);
}

/* What a wavelet model has not, or not while it has fewer vertices than its file. */
static void rows_of_parts(void) {
    const size_t n = wavelet_counts.n_landmarks;
    ROW("read_u32: triangles of a coarse surface", NOTHING, HAB_INDEX_OUT_OF_RANGE,
        hab_model_read_u32(&in.coarse, HAB_SECTION_FACES, 0, out.indices, 3, &detail));
    ROW("read_u32: landmarks of a coarse surface", NOTHING, HAB_INDEX_OUT_OF_RANGE,
        hab_model_read_u32(&in.coarse, HAB_SECTION_LANDMARKS, 0, out.indices, 1, &detail));
    ROW("fit_landmarks: a coarse surface", NOTHING, HAB_EMPTY, fit_wavelet(&in.coarse, n));
    ROW("fit_landmarks: a wavelet model, Gaussian prior", NOTHING, HAB_NEEDS_LEVELS, fit_wavelet(&in.wavelet, n));
    ROW("fit_landmarks: a wavelet model, boxes, weights of a face", in.options.identity_prior = in.options.pose_prior = HAB_PRIOR_BOX,
        HAB_DIMENSION_MISMATCH, fit_wavelet(&in.wavelet, n));
}

/* What a face is asked for that only wavelet models have; the golden vectors hold what these refuse themselves. */
static void rows_of_wavelets(void) {
    ROW("grid: a face", NOTHING, HAB_WRONG_KIND, hab_model_grid(&in.model, &out.grid, &detail));
    ROW("grid: struct_bytes 0", out.grid.struct_bytes = 0, HAB_BAD_STRUCT, hab_model_grid(&in.model, &out.grid, &detail));
    ROW("grid: grid null", NOTHING, HAB_NULL_POINTER, hab_model_grid(&in.model, NULL, &detail));
    ROW("set_levels: a face", memcpy(&out.changed, &in.model, sizeof in.model), HAB_WRONG_KIND,
        hab_model_set_levels(&out.changed, 0, 0, &detail));
    ROW("set_levels: model null", NOTHING, HAB_NULL_POINTER, hab_model_set_levels(NULL, 0, 0, &detail));
    ROW("set_levels: detail within the model", NOTHING, HAB_OVERLAP,
        hab_model_set_levels(&out.changed, 0, 0, MOVED(hab_error_detail, &out.changed, 32)));
    ROW("set_window: a face", memcpy(&out.changed, &in.model, sizeof in.model), HAB_WRONG_KIND,
        hab_model_set_window(&out.changed, 0, 1, 0, 1, &detail));
    ROW("set_window: model all zero", memset(&out.changed, 0, sizeof out.changed), HAB_NOT_OPENED,
        hab_model_set_window(&out.changed, 0, 1, 0, 1, &detail));
    ROW("fit_levels_workspace_bytes: a face", NOTHING, HAB_WRONG_KIND,
        hab_fit_levels_workspace_bytes(&in.model, 1, 0, 1, &out.bytes, &detail));
    ROW("fit_levels: a face", NOTHING, HAB_WRONG_KIND, fit_levels(in.samples, N_SAMPLES, ni));
    ROW("fit_levels: struct_bytes 0", in.level_options.struct_bytes = 0, HAB_BAD_STRUCT, fit_levels(in.samples, N_SAMPLES, ni));
    ROW("fit_levels: no box", in.level_options.kappa = 0, HAB_BAD_OPTION, fit_levels(in.samples, N_SAMPLES, ni));
    ROW("fit_levels: no pass", in.level_options.passes = 0, HAB_BAD_OPTION, fit_levels(in.samples, N_SAMPLES, ni));
    ROW("fit_levels: a weight less", NOTHING, HAB_DIMENSION_MISMATCH, fit_levels(in.samples, N_SAMPLES, ni - 1));
    ROW("fit_levels: samples null", NOTHING, HAB_NULL_POINTER, fit_levels(NULL, N_SAMPLES, ni));
    ROW("fit_levels: samples in the output", NOTHING, HAB_OVERLAP,
        fit_levels(MOVED(const hab_sample, out.identity, 0), 1, ni));
    ROW("fit_levels: a placement that is none", (in.level_options.frame = HAB_FRAME_FIXED, out.placement.scale = 0), HAB_BAD_OPTION,
        fit_levels(in.samples, N_SAMPLES, ni));
    ROW("level_options_init: another size", NOTHING, HAB_BAD_STRUCT, hab_level_options_init(&out.level_options, 4));
    ROW("level_options_init: null", NOTHING, HAB_NULL_POINTER, hab_level_options_init(NULL, sizeof(hab_level_options)));
}

static void rows_of_bodies(void) {
    float *const workspace = out.workspace;
    const size_t bytes = sizeof out.workspace, n_block = 3 * HAB_BLOCK_VERTICES;
    ROW("evaluate: a body", NOTHING, HAB_NEEDS_EVALUATION,
        hab_model_evaluate(&in.body, in.identity, bi, in.pose, bp, out.positions, 3 * (size_t)body_counts.n_vertices, &detail));
    ROW("linearise: a body", NOTHING, HAB_NEEDS_EVALUATION,
        hab_model_linearise(&in.body, in.identity, bi, in.pose, bp, 0, 1, out.values, n_block, out.jacobian, n_block * (bi + bp), &detail));
    ROW("prepared_evaluate: a body with its identity fixed", NOTHING, HAB_NEEDS_EVALUATION,
        hab_prepared_evaluate(&in.person, in.pose, bp, 0, 1, out.positions, 3, &detail));
    ROW("prepared_evaluate: positions within the body's file", NOTHING, HAB_OVERLAP,
        hab_prepared_evaluate(&in.person, in.pose, bp, 0, 1, MOVED(float, body_file, 4096), 3, &detail));
    ROW("evaluation_workspace_bytes: model null", NOTHING, HAB_NULL_POINTER,
        hab_evaluation_workspace_bytes(NULL, NULL, 0, &out.bytes, &detail));
    ROW("evaluation_workspace_bytes: derivatives 2", NOTHING, HAB_BAD_OPTION,
        hab_evaluation_workspace_bytes(&in.body, NULL, 2, &out.bytes, &detail));
    ROW("evaluation_workspace_bytes: form of zeros", memset(&in.person, 0, sizeof in.person), HAB_NOT_OPENED,
        hab_evaluation_workspace_bytes(NULL, &in.person, 0, &out.bytes, &detail));
    ROW("evaluation_init: model all zero", memset(&in.body, 0, sizeof in.body), HAB_NOT_OPENED, begin(bi, bp, 0, workspace, bytes));
    ROW("evaluation_init: an evaluation as model", memcpy(&in.body, &in.evaluation, sizeof in.evaluation), HAB_NOT_OPENED,
        begin(bi, bp, 0, workspace, bytes));
    ROW("evaluation_init: an identity weight too few", NOTHING, HAB_DIMENSION_MISMATCH, begin(bi - 1, bp, 0, workspace, bytes));
    ROW("evaluation_init: a pose weight too many", NOTHING, HAB_DIMENSION_MISMATCH, begin(bi, bp + 1, 0, workspace, bytes));
    ROW("evaluation_init: weights of the form's fixed mode", NOTHING, HAB_DIMENSION_MISMATCH,
        hab_evaluation_init(NULL, &in.person, in.identity, bi, in.pose, bp, 0, workspace, bytes, &out.evaluation, &detail));
    ROW("evaluation_init: an angle not a number", in.pose[3] = NAN, HAB_NOT_FINITE, begin(bi, bp, 0, workspace, bytes));
    ROW("evaluation_init: derivatives 2", NOTHING, HAB_BAD_OPTION, begin(bi, bp, 2, workspace, bytes));
    ROW("evaluation_init: workspace for no derivatives", NOTHING, HAB_WORKSPACE_TOO_SMALL,
        begin(bi, bp, 1, workspace, HAB_SKINNED_WORKSPACE_BYTES(bi, bp, body_counts.n_joints, 0)));
    ROW("evaluation_init: no workspace", NOTHING, HAB_WORKSPACE_TOO_SMALL, begin(bi, bp, 0, NULL, 0));
    ROW("evaluation_init: workspace null", NOTHING, HAB_NULL_POINTER, begin(bi, bp, 0, NULL, bytes));
    ROW("evaluation_init: workspace misaligned", NOTHING, HAB_MISALIGNED, begin(bi, bp, 0, MOVED(float, workspace, 2), bytes - 4));
    ROW("evaluation_init: a length that wraps", NOTHING, HAB_BAD_LENGTH, begin(bi, bp, 0, workspace, SIZE_MAX));
    ROW("evaluation_init: weights within the workspace", NOTHING, HAB_OVERLAP, begin(bi, bp, 0, in.identity, 4096));
    ROW("evaluation_init: workspace within the model's bytes", NOTHING, HAB_OVERLAP, begin(bi, bp, 0, MOVED(float, body_file, 1024), 4096));
    ROW("evaluation_init: workspace within the form's", NOTHING, HAB_OVERLAP,
        hab_evaluation_init(NULL, &in.person, NULL, 0, in.pose, bp, 0, person_workspace, 4096, &out.evaluation, &detail));
    ROW("evaluation_init: evaluation null", NOTHING, HAB_NULL_POINTER,
        hab_evaluation_init(&in.body, NULL, in.identity, bi, in.pose, bp, 0, workspace, bytes, NULL, &detail));
    ROW("evaluation_init: detail within the evaluation", NOTHING, HAB_OVERLAP,
        hab_evaluation_init(&in.body, NULL, in.identity, bi, in.pose, bp, 0, workspace, bytes, &out.evaluation,
                            MOVED(hab_error_detail, &out.evaluation, 16)));
    ROW("evaluation_positions: all zero", memset(&in.evaluation, 0, sizeof in.evaluation), HAB_NOT_OPENED,
        positions_of(0, 1, out.positions, 3));
    ROW("evaluation_positions: evaluation null", NOTHING, HAB_NULL_POINTER,
        hab_evaluation_positions(NULL, 0, 1, out.positions, 3, &detail));
    ROW("evaluation_positions: end overwritten", memset(&in.evaluation, 7, 8), HAB_NOT_OPENED, positions_of(0, 1, out.positions, 3));
    ROW("evaluation_positions: behind the last vertex", NOTHING, HAB_INDEX_OUT_OF_RANGE,
        positions_of(body_counts.n_vertices, 1, out.positions, 3));
    ROW("evaluation_positions: a range that wraps", NOTHING, HAB_INDEX_OUT_OF_RANGE, positions_of(UINT32_MAX, 2, out.positions, 6));
    ROW("evaluation_positions: positions of another count", NOTHING, HAB_DIMENSION_MISMATCH, positions_of(0, 2, out.positions, 5));
    ROW("evaluation_positions: positions null", NOTHING, HAB_NULL_POINTER, positions_of(0, 1, NULL, 3));
    ROW("evaluation_positions: positions within its workspace", NOTHING, HAB_OVERLAP, positions_of(0, 1, body_workspace + 8, 3));
    ROW("evaluation_positions: positions within the model's bytes", NOTHING, HAB_OVERLAP,
        positions_of(0, 1, MOVED(float, body_file, 2048), 3));
    ROW("evaluation_positions: positions over the evaluation", NOTHING, HAB_OVERLAP,
        positions_of(0, 1, MOVED(float, &in.evaluation, 0), 3));
    ROW("evaluation_linearise: begun without derivatives", hab_evaluation_init(&in.body, NULL, in.identity, bi, in.pose, bp, 0, body_workspace, sizeof body_workspace, &in.evaluation, NULL),
        HAB_BAD_OPTION, hab_evaluation_linearise(&in.evaluation, 0, 1, out.values, n_block, out.jacobian, n_block * (bi + bp), &detail));
    ROW("evaluation_linearise: behind the last block", begin(bi, bp, 1, body_workspace, sizeof body_workspace), HAB_INDEX_OUT_OF_RANGE,
        hab_evaluation_linearise(&out.evaluation, body_counts.n_blocks, 1, out.values, n_block, out.jacobian, n_block * (bi + bp), &detail));
    ROW("evaluation_linearise: jacobian too short", begin(bi, bp, 1, body_workspace, sizeof body_workspace), HAB_DIMENSION_MISMATCH,
        hab_evaluation_linearise(&out.evaluation, 0, 1, out.values, n_block, out.jacobian, n_block * (bi + bp) - 1, &detail));
    ROW("evaluation_linearise: values within the jacobian", begin(bi, bp, 1, body_workspace, sizeof body_workspace), HAB_OVERLAP,
        hab_evaluation_linearise(&out.evaluation, 0, 1, out.jacobian + 4, n_block, out.jacobian, n_block * (bi + bp), &detail));
    ROW("evaluation_joint_positions: behind the last joint", NOTHING, HAB_INDEX_OUT_OF_RANGE,
        hab_evaluation_joint_positions(&in.evaluation, body_counts.n_joints, 1, out.positions, 3, &detail));
    ROW("evaluation_joint_positions: positions of another count", NOTHING, HAB_DIMENSION_MISMATCH,
        hab_evaluation_joint_positions(&in.evaluation, 0, 2, out.positions, 5, &detail));
    ROW("evaluation_joint_positions: a face", hab_evaluation_init(&in.model, NULL, in.identity, ni, in.pose, np, 0, body_workspace, sizeof body_workspace, &in.evaluation, NULL),
        HAB_UNSUPPORTED, hab_evaluation_joint_positions(&in.evaluation, 0, 1, out.positions, 3, &detail));
    ROW("joint: behind the last", NOTHING, HAB_INDEX_OUT_OF_RANGE, hab_model_joint(&in.body, body_counts.n_joints, &out.joint, &detail));
    ROW("joint: of a face", NOTHING, HAB_UNSUPPORTED, hab_model_joint(&in.model, 0, &out.joint, &detail));
    ROW("joint: struct_bytes 0", out.joint.struct_bytes = 0, HAB_BAD_STRUCT, hab_model_joint(&in.body, 0, &out.joint, &detail));
    ROW("joint: joint null", NOTHING, HAB_NULL_POINTER, hab_model_joint(&in.body, 0, NULL, &detail));
    ROW("set_blend: unknown", NOTHING, HAB_BAD_OPTION, hab_model_set_blend(&out.changed, 2, &detail));
    ROW("set_blend: model null", NOTHING, HAB_NULL_POINTER, hab_model_set_blend(NULL, 0, &detail));
    ROW("set_blend: model all zero", memset(&out.changed, 0, sizeof out.changed), HAB_NOT_OPENED, hab_model_set_blend(&out.changed, 0, &detail));
    ROW("set_blend: detail within the model", NOTHING, HAB_OVERLAP,
        hab_model_set_blend(&out.changed, 1, MOVED(hab_error_detail, &out.changed, 32)));
    ROW("set_blend: a face", memcpy(&out.changed, &in.model, sizeof in.model), HAB_WRONG_KIND, hab_model_set_blend(&out.changed, 0, &detail));
    ROW("set_joints: unknown", NOTHING, HAB_BAD_OPTION, hab_model_set_joints(&out.changed, 2, &detail));
    ROW("set_joints: a face", memcpy(&out.changed, &in.model, sizeof in.model), HAB_WRONG_KIND, hab_model_set_joints(&out.changed, 1, &detail));
    ROW("model_fit_workspace_bytes: unknown frame", NOTHING, HAB_BAD_OPTION,
        hab_model_fit_workspace_bytes(&in.body, NULL, 3, &out.bytes, &detail));
    ROW("model_fit_workspace_bytes: form of another model", NOTHING, HAB_DIMENSION_MISMATCH,
        hab_model_fit_workspace_bytes(&in.body, &in.form, HAB_FRAME_RIGID, &out.bytes, &detail));
    ROW("fit_landmarks: bounds of identity weights", in.options.identity_prior = HAB_PRIOR_BOUNDS, HAB_BAD_OPTION, fit_all());
    ROW("fit_landmarks: bounds that a file has not", in.options.pose_prior = HAB_PRIOR_BOUNDS, HAB_UNSUPPORTED, fit_all());
    ROW("fit_landmarks: a body without room for its state", in.options.pose_prior = HAB_PRIOR_BOUNDS, HAB_WORKSPACE_TOO_SMALL,
        hab_fit_landmarks(&in.body, NULL, &in.options, in.targets, 3 * (size_t)body_counts.n_landmarks, NULL, 0, out.identity, bi, out.pose,
                          bp, &out.placement, workspace, hab_fit_workspace_bytes((uint32_t)bi, (uint32_t)bp, HAB_FRAME_RIGID), NULL, &detail));
}

static void on_a_line(void) {
    size_t i;
    for (i = 0; i < nl; i++) {
        in.targets[3 * i] = in.targets[3 * i + 1] = in.targets[3 * i + 2] = (float)i;
    }
}

static void rows_of_fits(void) {
    float *const workspace = out.workspace;
    const size_t needed = hab_fit_workspace_bytes((uint32_t)ni, (uint32_t)np, HAB_FRAME_RIGID);
    ROW("fit_options_init: options null", NOTHING, HAB_NULL_POINTER, hab_fit_options_init(NULL, sizeof(hab_fit_options)));
    ROW("fit_options_init: options misaligned", NOTHING, HAB_MISALIGNED, hab_fit_options_init(MOVED(hab_fit_options, &out.options, 2), sizeof(hab_fit_options)));
    ROW("fit_options_init: options of another size", NOTHING, HAB_BAD_STRUCT, hab_fit_options_init(&out.options, 8));
    ROW("fit_landmarks: struct_bytes 0", in.options.struct_bytes = 0, HAB_BAD_STRUCT, fit_all());
    ROW("fit_landmarks: options null", NOTHING, HAB_NULL_POINTER,
        hab_fit_landmarks(&in.model, NULL, NULL, in.targets, 3 * nl, NULL, 0, out.identity, ni, out.pose, np, &out.placement, workspace,
                          needed, NULL, &detail));
    ROW("fit_landmarks: unknown frame", in.options.frame = 3, HAB_BAD_OPTION, fit_all());
    ROW("fit_landmarks: place 2", in.options.place = 2, HAB_BAD_OPTION, fit_all());
    ROW("fit_landmarks: unknown prior", in.options.pose_prior = 9, HAB_BAD_OPTION, fit_all());
    ROW("fit_landmarks: no noise", in.options.noise = 0, HAB_BAD_OPTION, fit_all());
    ROW("fit_landmarks: noise not a number", in.options.noise = NAN, HAB_BAD_OPTION, fit_all());
    ROW("fit_landmarks: factor infinite", in.options.identity_factor = INFINITY, HAB_BAD_OPTION, fit_all());
    ROW("fit_landmarks: a target too few", NOTHING, HAB_DIMENSION_MISMATCH, fit(NULL, 3 * nl - 1, nl, ni, workspace, needed));
    ROW("fit_landmarks: targets of no landmarks", NOTHING, HAB_DIMENSION_MISMATCH, fit(NULL, 0, 0, ni, workspace, needed));
    ROW("fit_landmarks: measured too short", NOTHING, HAB_DIMENSION_MISMATCH, fit(NULL, 3 * nl, nl - 1, ni, workspace, needed));
    ROW("fit_landmarks: an identity weight too few", NOTHING, HAB_DIMENSION_MISMATCH, fit(NULL, 3 * nl, nl, ni - 1, workspace, needed));
    ROW("fit_landmarks: all missing", memset(in.measured, 0, sizeof in.measured), HAB_EMPTY, fit_all());
    ROW("fit_landmarks: two measured", memset(in.measured + 2, 0, sizeof in.measured - 2), HAB_DEGENERATE, fit_all());
    ROW("fit_landmarks: all on a line", on_a_line(), HAB_DEGENERATE, fit_all());
    ROW("fit_landmarks: all at one place", memset(in.targets, 0, sizeof in.targets), HAB_DEGENERATE, fit_all());
    ROW("fit_landmarks: a target not a number", in.targets[4] = NAN, HAB_NOT_FINITE, fit_all());
    ROW("fit_landmarks: a target infinite", in.targets[7] = -INFINITY, HAB_NOT_FINITE, fit_all());
    ROW("fit_landmarks: start not a number", out.identity[0] = NAN, HAB_NOT_FINITE, fit_all());
    ROW("fit_landmarks: placement not a number", (in.options.place = 0, out.placement.rotation[4] = NAN), HAB_BAD_OPTION, fit_all());
    ROW("fit_landmarks: placement mirrored", (in.options.place = 0, out.placement.rotation[8] = -1), HAB_BAD_OPTION, fit_all());
    ROW("fit_landmarks: placement of no size", (in.options.place = 0, out.placement.scale = 0), HAB_BAD_OPTION, fit_all());
    ROW("fit_landmarks: noise too small to be squared", in.options.noise = 1e-30F, HAB_BAD_OPTION, fit_all());
    ROW("fit_landmarks: workspace a byte short", NOTHING, HAB_WORKSPACE_TOO_SMALL, fit(NULL, 3 * nl, nl, ni, workspace, needed - 1));
    ROW("fit_landmarks: workspace null", NOTHING, HAB_NULL_POINTER, fit(NULL, 3 * nl, nl, ni, NULL, needed));
    ROW("fit_landmarks: workspace misaligned", NOTHING, HAB_MISALIGNED, fit(NULL, 3 * nl, nl, ni, MOVED(float, workspace, 2), needed));
    ROW("fit_landmarks: targets within the workspace", NOTHING, HAB_OVERLAP, fit(NULL, 3 * nl, nl, ni, in.targets, needed));
    ROW("fit_landmarks: weights within the workspace", NOTHING, HAB_OVERLAP, fit(NULL, 3 * nl, nl, ni, out.identity, needed));
    ROW("fit_landmarks: workspace within the model's bytes", NOTHING, HAB_OVERLAP, fit(NULL, 3 * nl, nl, ni, in.file + 4096, needed));
    ROW("fit_landmarks: identity is pose", NOTHING, HAB_OVERLAP,
        hab_fit_landmarks(&in.model, NULL, &in.options, in.targets, 3 * nl, NULL, 0, out.identity, ni, out.identity, np, &out.placement,
                          workspace, needed, NULL, &detail));
    ROW("fit_landmarks: detail within the report", NOTHING, HAB_OVERLAP,
        hab_fit_landmarks(&in.model, NULL, &in.options, in.targets, 3 * nl, NULL, 0, out.identity, ni, out.pose, np, &out.placement,
                          workspace, needed, &out.report, MOVED(hab_error_detail, &out.report, 4)));
    ROW("fit_landmarks: form of zeros", memset(&in.form, 0, sizeof in.form), HAB_NOT_OPENED, fit(&in.form, 3 * nl, nl, 0, workspace, needed));
    ROW("fit_landmarks: weights of the form's fixed mode", NOTHING, HAB_DIMENSION_MISMATCH, fit(&in.form, 3 * nl, nl, ni, workspace, needed));
    ROW("fit_points: no samples", NOTHING, HAB_EMPTY, fit_points(NULL, 0));
    ROW("fit_points: samples null", NOTHING, HAB_NULL_POINTER, fit_points(NULL, 4));
    ROW("fit_points: samples misaligned", NOTHING, HAB_MISALIGNED, fit_points(MOVED(hab_sample, in.samples, 2), 4));
    ROW("fit_points: a length that wraps", NOTHING, HAB_BAD_LENGTH, fit_points(in.samples, SIZE_MAX / 8));
    ROW("fit_points: a vertex that is none", in.samples[3].vertices[0] = (uint32_t)nv, HAB_INDEX_OUT_OF_RANGE, fit_points(in.samples, N_SAMPLES));
    ROW("fit_points: a normal of length 2", in.samples[3].normal[0] = 2, HAB_BAD_SAMPLE, fit_points(in.samples, N_SAMPLES));
    ROW("fit_points: a weight not a number", in.samples[3].weight = NAN, HAB_NOT_FINITE, fit_points(in.samples, N_SAMPLES));
    ROW("fit_points: a barycentric coordinate infinite", in.samples[3].barycentric[2] = INFINITY, HAB_NOT_FINITE,
        fit_points(in.samples, N_SAMPLES));
}

/* Whether a file cut anywhere, or with any byte changed, is refused. */
static void damaged_files(void) {
    size_t i, refused = 0, tried = 0;
    fresh();
    /* Compared below as a whole, where an opened model has padding that nobody sets. */
    memset(&out.changed, 0, sizeof out.changed);
    remember();
    for (i = 0; i < file_len; i += i < 1024 ? 1 : 4099) {
        const hab_code code = open_bytes(i);
        tried++;
        refused += code >= 300 && code < 400 && memcmp(&out, &out_before, sizeof out) == 0;
    }
    for (i = 0; i < file_len; i += i < 1024 ? 1 : 4099) {
        hab_code code;
        in.file[i] ^= 0x10;
        code = open_bytes(file_len);
        in.file[i] ^= 0x10;
        tried++;
        refused += code >= 300 && code < 400 && memcmp(&out, &out_before, sizeof out) == 0;
    }
    printf("files cut or damaged at one byte: %u tried, %u refused\n", (unsigned)tried, (unsigned)refused);
    n_faults += refused != tried;
}

/* Whether the model's bytes at any address give the same positions. */
static void any_alignment(void) {
    uint8_t *const memory = malloc(file_len + 64);
    unsigned same = 0, at;
    if (memory == NULL) {
        printf("out of memory\n");
        exit(1);
    }
    fresh();
    if (evaluate(in.identity, ni, in.pose, np, out.values, 3 * nv) != HAB_OK) {
        n_faults++;
    }
    for (at = 0; at < 64; at++) {
        hab_model model;
        memcpy(memory + at, in.file, file_len);
        memset(out.positions, 0, sizeof out.positions);
        same += hab_model_open(memory + at, file_len, &model, &detail) == HAB_OK &&
                hab_model_evaluate(&model, in.identity, ni, in.pose, np, out.positions, 3 * nv, &detail) == HAB_OK &&
                memcmp(out.positions, out.values, 3 * nv * sizeof(float)) == 0;
    }
    free(memory);
    printf("model bytes at addresses 0 to 63 beyond a multiple of 64: %u give the same bits\n", same);
    n_faults += same != 64;
}

/* Sound inputs; 0 when one of the calls fails. The targets are the landmarks of the face of these weights. */
static int prepare_inputs(void) {
    uint32_t landmarks[MAX_LANDMARKS], faces[3 * N_SAMPLES];
    float zeros[MAX_WEIGHTS] = {0};
    size_t i, bytes;
    hab_model *const model = &in.model;
    counts.struct_bytes = sizeof counts;
    if (hab_model_open(in.file, file_len, model, &detail) != HAB_OK || hab_model_counts(model, &counts, &detail) != HAB_OK) {
        return 0;
    }
    ni = counts.identity_dim, np = counts.pose_dim, nl = counts.n_landmarks, nv = counts.n_vertices;
    if (ni > MAX_WEIGHTS || np > MAX_WEIGHTS || nl > MAX_LANDMARKS || nv > MAX_VERTICES || ni < 2 || np < 1 || ni == np) {
        printf("this model does not suit the rows\n");
        return 0;
    }
    memset(in.measured, 1, sizeof in.measured);
    if (hab_fit_options_init(&in.options, sizeof in.options) != HAB_OK ||
        hab_level_options_init(&in.level_options, sizeof in.level_options) != HAB_OK ||
        hab_model_weights(model, HAB_MODE_IDENTITY, zeros, ni, in.identity, ni, &detail) != HAB_OK ||
        hab_model_weights(model, HAB_MODE_POSE, zeros, np, in.pose, np, &detail) != HAB_OK ||
        hab_model_evaluate(model, in.identity, ni, in.pose, np, out.positions, 3 * nv, &detail) != HAB_OK ||
        hab_model_read_u32(model, HAB_SECTION_LANDMARKS, 0, landmarks, nl, &detail) != HAB_OK ||
        hab_model_read_u32(model, HAB_SECTION_FACES, 0, faces, 3 * N_SAMPLES, &detail) != HAB_OK ||
        hab_prepared_workspace_bytes(model, HAB_MODE_IDENTITY, 0, counts.n_blocks, &bytes, &detail) != HAB_OK ||
        bytes != HAB_PREPARED_WORKSPACE_BYTES(np, counts.n_blocks) || bytes > sizeof form_workspace ||
        hab_prepared_init(model, HAB_MODE_IDENTITY, in.identity, ni, 0, counts.n_blocks, form_workspace, sizeof form_workspace, &in.form,
                          &detail) != HAB_OK) {
        return 0;
    }
    body_counts.struct_bytes = sizeof body_counts;
    if (hab_model_open(body_file, body_len, &in.body, &detail) != HAB_OK || hab_model_counts(&in.body, &body_counts, &detail) != HAB_OK) {
        return 0;
    }
    bi = body_counts.identity_dim, bp = body_counts.pose_dim;
    if (bi < 2 || bi > ni || bp >= MAX_WEIGHTS || body_counts.n_joints < 2 || body_counts.n_joints > MAX_JOINTS ||
        body_counts.n_vertices > MAX_VERTICES || body_counts.n_landmarks > nl) {
        printf("this body does not suit the rows\n");
        return 0;
    }
    if (hab_prepared_init(&in.body, HAB_MODE_IDENTITY, in.identity, bi, 0, body_counts.n_blocks, person_workspace, sizeof person_workspace,
                          &in.person, &detail) != HAB_OK ||
        hab_evaluation_workspace_bytes(&in.body, NULL, 1, &bytes, &detail) != HAB_OK ||
        bytes > HAB_SKINNED_WORKSPACE_BYTES(bi, bp, body_counts.n_joints, 1) ||
        hab_evaluation_init(&in.body, NULL, in.identity, bi, in.pose, bp, 1, body_workspace, sizeof body_workspace, &in.evaluation,
                            &detail) != HAB_OK) {
        return 0;
    }
    wavelet_counts.struct_bytes = sizeof wavelet_counts;
    if (hab_model_open(wavelet_file, wavelet_len, &in.wavelet, &detail) != HAB_OK ||
        hab_model_counts(&in.wavelet, &wavelet_counts, &detail) != HAB_OK) {
        return 0;
    }
    if (wavelet_counts.n_landmarks < 3 || wavelet_counts.n_landmarks > MAX_LANDMARKS || wavelet_counts.n_faces < 1) {
        printf("this wavelet model does not suit the rows\n");
        return 0;
    }
    memcpy(&in.coarse, &in.wavelet, sizeof in.coarse);
    if (hab_model_set_levels(&in.coarse, 0, 0, &detail) != HAB_OK || hab_model_counts(&in.coarse, &wavelet_counts, &detail) != HAB_OK) {
        return 0;
    }
    if (wavelet_counts.n_faces != 0 || wavelet_counts.n_landmarks != 0) {
        printf("a coarse surface counts what it has not\n");
        return 0;
    }
    if (hab_model_counts(&in.wavelet, &wavelet_counts, &detail) != HAB_OK) {
        return 0;
    }
    for (i = 0; i < nl; i++) {
        memcpy(in.targets + 3 * i, out.positions + 3 * (size_t)landmarks[i], 3 * sizeof(float));
    }
    for (i = 0; i < N_SAMPLES; i++) {
        hab_sample *const sample = &in.samples[i];
        memset(sample, 0, sizeof *sample);
        memcpy(sample->vertices, faces + 3 * i, sizeof sample->vertices);
        sample->barycentric[0] = sample->weight = 1;
        memcpy(sample->target, out.positions + 3 * (size_t)faces[3 * i], sizeof sample->target);
    }
    memcpy(&in_sound, &in, sizeof in);
    return 1;
}

/* Whether the calls that the rows spoil succeed when nothing is spoilt: else a row could be right for another reason. */
static int sound_calls_succeed(void) {
    const size_t n_block = 3 * HAB_BLOCK_VERTICES;
    fresh();
    return open_bytes(file_len) == HAB_OK && evaluate(in.identity, ni, in.pose, np, out.positions, 3 * nv) == HAB_OK &&
           range(1, 2, 6) == HAB_OK && linearise(0, 1, out.values, n_block, out.jacobian, n_block * (ni + np)) == HAB_OK &&
           prepare(HAB_MODE_IDENTITY, ni, 0, 1, out.workspace, HAB_PREPARED_WORKSPACE_BYTES(np, 1)) == HAB_OK && fit_all() == HAB_OK &&
           fit(&in.form, 3 * nl, nl, 0, out.workspace, sizeof out.workspace) == HAB_OK && fit_points(in.samples, N_SAMPLES) == HAB_OK &&
           hab_model_counts(&in.model, &out.counts, &detail) == HAB_OK &&
           hab_model_section(&in.model, 0, &out.section, &detail) == HAB_OK &&
           hab_model_text(&in.model, HAB_SECTION_PROVENANCE, 0, &out.text, &out.text_bytes, &detail) == HAB_OK &&
           hab_prepared_evaluate(&in.form, in.pose, np, 0, 1, out.positions, 3, &detail) == HAB_OK &&
           begin(bi, bp, 1, out.workspace, sizeof out.workspace) == HAB_OK && positions_of(1, 2, out.positions, 6) == HAB_OK &&
           hab_evaluation_linearise(&in.evaluation, 0, 1, out.values, n_block, out.jacobian, n_block * (bi + bp), &detail) == HAB_OK &&
           hab_evaluation_joint_positions(&in.evaluation, 0, 2, out.positions, 6, &detail) == HAB_OK &&
           hab_model_joint(&in.body, 0, &out.joint, &detail) == HAB_OK && hab_model_set_blend(&out.changed, 1, &detail) == HAB_OK &&
           hab_model_set_joints(&out.changed, 1, &detail) == HAB_OK &&
           hab_model_fit_workspace_bytes(&in.model, NULL, HAB_FRAME_RIGID, &out.bytes, &detail) == HAB_OK &&
           out.bytes == HAB_FIT_WORKSPACE_BYTES(ni, np, HAB_FRAME_RIGID) &&
           hab_model_fit_workspace_bytes(&in.body, NULL, HAB_FRAME_RIGID, &out.bytes, &detail) == HAB_OK &&
           out.bytes <= HAB_SKINNED_FIT_WORKSPACE_BYTES(bi, bp, body_counts.n_joints, HAB_FRAME_RIGID) &&
           hab_fit_workspace_bytes((uint32_t)ni, (uint32_t)np, HAB_FRAME_SIMILARITY) ==
               HAB_FIT_WORKSPACE_BYTES(ni, np, HAB_FRAME_SIMILARITY) &&
           hab_fit_workspace_bytes((uint32_t)ni, (uint32_t)np, 3) == 0;
}

int main(int argc, char **argv) {
    FILE *file = argc == 4 ? fopen(argv[1], "rb") : NULL;
    FILE *body = argc == 4 ? fopen(argv[2], "rb") : NULL;
    FILE *wavelet = argc == 4 ? fopen(argv[3], "rb") : NULL;
    char line[160];
    if (file == NULL || body == NULL || wavelet == NULL) {
        fprintf(stderr, "usage: misuse MODEL.hab BODY.hab WAVELET.hab\n");
        return 2;
    }
    file_len = fread(in.file, 1, sizeof in.file, file);
    body_len = fread(body_file, 1, sizeof body_file, body);
    fclose(file);
    wavelet_len = fread(wavelet_file, 1, sizeof wavelet_file, wavelet);
    fclose(body);
    fclose(wavelet);
    if (!prepare_inputs() || !sound_calls_succeed()) {
        hab_error_format(&detail, line, sizeof line);
        printf("a sound call failed, the last one so far: %s\n", line);
        return 1;
    }
    printf("| call | code returned | outputs untouched |\n|---|---|---|\n");
    rows_of_opening();
    rows_of_models();
    rows_of_evaluation();
    rows_of_forms();
    rows_of_bodies();
    rows_of_wavelets();
    rows_of_parts();
    rows_of_fits();
    damaged_files();
    any_alignment();
    printf("%d rows, %d faults\n", n_rows, n_faults);
    return n_faults == 0 ? 0 : 1;
}
