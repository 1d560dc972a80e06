/* Every kernel of the C interface as the golden vectors ask for it. */
#include <habitus.h>

#include "runner.h"

/* Positions of a block, and samples or landmarks of a fit. */
enum { BLOCK_NUMBERS = 3 * HAB_BLOCK_VERTICES, MOST_SAMPLES = 64 };

/* Whether a call was accepted. A code that is not the detail's breaks a promise. */
static bool accepted(context *c, hab_code code, const hab_error_detail *detail) {
    if (code == HAB_OK) {
        return c->wrong == PROBLEM_NONE;
    }
    if (detail->code != code) {
        context_object(c, PROBLEM_PROMISE);
    }
    context_refused(c, code, detail->first, detail->second);
    return false;
}

static bool opened(context *c, hab_model *model, hab_counts *counts) {
    hab_error_detail detail = {0, 0, 0, 0};
    bytes file = context_model(c);
    if (c->wrong != PROBLEM_NONE || !accepted(c, hab_model_open(file.at, file.count, model, &detail), &detail)) {
        return false;
    }
    if (context_count(c, "levels") > 0) {
        integers levels = context_integers(c, "levels");
        if (levels.count != 2 || !accepted(c, hab_model_set_levels(model, levels.at[0], levels.at[1], &detail), &detail)) {
            return false;
        }
    }
    if (context_count(c, "window") > 0) {
        integers window = context_integers(c, "window");
        if (window.count != 4 || !accepted(c,
                                           hab_model_set_window(model, window.at[0], window.at[1] - window.at[0], window.at[2],
                                                                window.at[3] - window.at[2], &detail),
                                           &detail)) {
            return false;
        }
    }
    counts->struct_bytes = sizeof *counts;
    return accepted(c, hab_model_counts(model, counts, &detail), &detail);
}

/* An evaluation of a model, or of a form of it, in memory of the case. */
static bool begun(context *c, const hab_model *model, const hab_prepared *form, floats identity, floats pose, uint32_t derivatives,
                  hab_evaluation *evaluation) {
    hab_error_detail detail = {0, 0, 0, 0};
    size_t needed = 0;
    floats workspace;
    if (!accepted(c, hab_evaluation_workspace_bytes(model, form, derivatives, &needed, &detail), &detail)) {
        return false;
    }
    workspace = context_zeros(c, needed / sizeof(float));
    return accepted(c,
                    hab_evaluation_init(model, form, identity.at, identity.count, pose.at, pose.count, derivatives, workspace.at, needed,
                                        evaluation, &detail),
                    &detail);
}

static void evaluate(context *c) {
    hab_model model;
    hab_counts counts;
    hab_evaluation evaluation;
    hab_error_detail detail = {0, 0, 0, 0};
    floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose"), out;
    integers ranges = context_integers(c, "ranges");
    size_t k;
    if (!opened(c, &model, &counts) || !begun(c, &model, NULL, identity, pose, 0, &evaluation)) {
        return;
    }
    for (k = 0; k + 1 < ranges.count; k += 2) {
        uint32_t from = ranges.at[k], n = ranges.at[k + 1] - from;
        if (ranges.at[k + 1] < from) {
            /* A range that ends before it begins: C says how many. */
            context_object(c, PROBLEM_NOT_IN_INTERFACE);
            return;
        }
        out = context_zeros(c, 3 * (size_t)n);
        if (!accepted(c, hab_evaluation_positions(&evaluation, from, n, out.at, out.count, &detail), &detail)) {
            return;
        }
        compare_part(c, "out", 3 * (size_t)from, out.at, out.count);
        if (counts.needs_evaluation) {
            continue;
        }
        if (!accepted(c,
                      hab_model_evaluate_range(&model, identity.at, identity.count, pose.at, pose.count, from, n, out.at,
                                               out.count, &detail),
                      &detail)) {
            return;
        }
        /* "out" is the whole shape: every range has to give the bits of its part. */
        compare_part(c, "out", 3 * (size_t)from, out.at, out.count);
    }
    if (counts.needs_evaluation) {
        return;
    }
    out = context_zeros(c, 3 * (size_t)counts.n_vertices);
    if (accepted(
            c,
            hab_model_evaluate(&model, identity.at, identity.count, pose.at, pose.count, out.at, out.count, &detail),
            &detail)) {
        compare(c, "out", out.at, out.count);
    }
}

/* Values and derivatives of one block. */
static bool linearised(context *c, uint32_t block, floats *positions, floats *jacobian) {
    hab_model model;
    hab_counts counts;
    hab_evaluation evaluation;
    hab_error_detail detail = {0, 0, 0, 0};
    floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose");
    if (!opened(c, &model, &counts)) {
        return false;
    }
    *positions = context_zeros(c, BLOCK_NUMBERS);
    *jacobian = context_zeros(c, (counts.identity_dim + counts.pose_dim) * BLOCK_NUMBERS);
    if (!counts.needs_evaluation) {
        return accepted(c,
                        hab_model_linearise(&model, identity.at, identity.count, pose.at, pose.count, block, 1, positions->at, positions->count,
                                            jacobian->at, jacobian->count, &detail),
                        &detail);
    }
    return begun(c, &model, NULL, identity, pose, 1, &evaluation) &&
           accepted(c,
                    hab_evaluation_linearise(&evaluation, block, 1, positions->at, positions->count, jacobian->at, jacobian->count, &detail),
                    &detail);
}

static void linearised_block(context *c) {
    floats block, jacobian;
    if (linearised(c, context_integer(c, "block"), &block, &jacobian)) {
        compare(c, "values", block.at, block.count);
        compare(c, "jacobian", jacobian.at, jacobian.count);
    }
}

/* C has blocks only: the vertex is a lane of its block. */
static void linearised_vertex(context *c) {
    floats block, jacobian;
    uint32_t vertex = context_integer(c, "vertex"), lane = vertex % HAB_BLOCK_VERTICES;
    size_t k;
    if (!linearised(c, vertex / HAB_BLOCK_VERTICES, &block, &jacobian)) {
        return;
    }
    for (k = 0; k < 3; k++) {
        compare_part(c, "value", k, &block.at[k * HAB_BLOCK_VERTICES + lane], 1);
    }
    for (k = 0; k < jacobian.count / HAB_BLOCK_VERTICES; k++) {
        compare_part(c, "jacobian", k, &jacobian.at[k * HAB_BLOCK_VERTICES + lane], 1);
    }
}

static void prepared(context *c) {
    hab_model model;
    hab_counts counts;
    hab_prepared form;
    hab_evaluation evaluation;
    hab_error_detail detail = {0, 0, 0, 0};
    hab_code code;
    floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose"), none = {NULL, 0};
    bool identity_fixed = text_equals(context_word(c, "fixed"), "identity");
    uint32_t mode = identity_fixed ? HAB_MODE_IDENTITY : HAB_MODE_POSE;
    floats fixed = identity_fixed ? identity : pose, free = identity_fixed ? pose : identity;
    uint32_t from = context_integer(c, "from"), n = context_integer(c, "to") - from, n_vertices;
    floats workspace, out, all, jacobian;
    size_t workspace_bytes = 0;
    if (!opened(c, &model, &counts) ||
        !accepted(c, hab_prepared_workspace_bytes(&model, mode, from, n, &workspace_bytes, &detail), &detail)) {
        return;
    }
    if (counts.kind == HAB_KIND_BILINEAR && workspace_bytes != HAB_PREPARED_WORKSPACE_BYTES(free.count, n)) {
        context_object(c, PROBLEM_PROMISE);
    }
    workspace = context_zeros(c, workspace_bytes / sizeof(float));
    if (!accepted(c,
                  hab_prepared_init(&model, mode, fixed.at, fixed.count, from, n, workspace.at,
                                    workspace.count * sizeof(float), &form, &detail),
                  &detail)) {
        return;
    }
    n_vertices = counts.n_vertices - from * HAB_BLOCK_VERTICES;
    n_vertices = n_vertices < n * HAB_BLOCK_VERTICES ? n_vertices : n * HAB_BLOCK_VERTICES;
    out = context_zeros(c, 3 * (size_t)n_vertices);
    all = context_zeros(c, n * BLOCK_NUMBERS);
    jacobian = context_zeros(c, n * free.count * BLOCK_NUMBERS);
    code = hab_prepared_evaluate(&form, free.at, free.count, 0, n_vertices, out.at, out.count, &detail);
    if (code != HAB_NEEDS_EVALUATION) {
        if (accepted(c, code, &detail)) {
            compare(c, "out", out.at, out.count);
        }
        if (accepted(c,
                     hab_prepared_linearise(&form, free.at, free.count, 0, n, all.at, all.count, jacobian.at, jacobian.count, &detail),
                     &detail)) {
            compare(c, "values", all.at, all.count);
            compare(c, "jacobian", jacobian.at, jacobian.count);
        }
    }
    if (!begun(c, NULL, &form, identity_fixed ? none : free, identity_fixed ? free : none, 1, &evaluation)) {
        return;
    }
    if (accepted(c, hab_evaluation_positions(&evaluation, 0, n_vertices, out.at, out.count, &detail), &detail)) {
        compare(c, "out", out.at, out.count);
    }
    if (accepted(c, hab_evaluation_linearise(&evaluation, 0, n, all.at, all.count, jacobian.at, jacobian.count, &detail), &detail)) {
        compare(c, "values", all.at, all.count);
        compare(c, "jacobian", jacobian.at, jacobian.count);
    }
}

/* KEY none, KEY gaussian FACTOR, KEY box FACTOR. */
static void read_prior(context *c, const char *key, uint32_t *prior, float *factor) {
    text kind = context_word(c, key);
    *prior = HAB_PRIOR_NONE;
    *factor = 1.0f;
    if (text_equals(kind, "gaussian") || text_equals(kind, "box")) {
        *prior = text_equals(kind, "box") ? HAB_PRIOR_BOX : HAB_PRIOR_GAUSSIAN;
        *factor = context_float_at(c, key, 1);
    } else if (!text_equals(kind, "none")) {
        context_object(c, PROBLEM_TEXT);
    }
}

/* What both fits read and compare. */
typedef struct fit {
    hab_model model;
    hab_counts counts;
    hab_fit_options options;
    hab_placement placement;
    hab_fit_report report;
    hab_error_detail detail;
    floats identity, pose, workspace;
} fit;

/* The frame of a case, and its placement. */
static uint32_t read_frame(context *c, hab_placement *to) {
    text frame = context_word(c, "frame");
    floats placement = context_floats(c, "placement");
    size_t k;
    if (placement.count != 13) {
        context_object(c, PROBLEM_TEXT);
        return UINT32_MAX;
    }
    to->scale = placement.at[0];
    for (k = 0; k < 9; k++) {
        to->rotation[k] = placement.at[1 + k];
    }
    for (k = 0; k < 3; k++) {
        to->translation[k] = placement.at[10 + k];
    }
    return text_equals(frame, "fixed")        ? HAB_FRAME_FIXED
           : text_equals(frame, "rigid")      ? HAB_FRAME_RIGID
           : text_equals(frame, "similarity") ? HAB_FRAME_SIMILARITY
                                              : UINT32_MAX;
}

static void compare_placement(context *c, const hab_placement *found) {
    float numbers[13];
    size_t k;
    numbers[0] = found->scale;
    for (k = 0; k < 9; k++) {
        numbers[1 + k] = found->rotation[k];
    }
    for (k = 0; k < 3; k++) {
        numbers[10 + k] = found->translation[k];
    }
    compare(c, "placement_fitted", numbers, 13);
}

static bool fit_read(context *c, fit *f) {
    size_t workspace_bytes = 0;
    f->identity = context_floats(c, "identity");
    f->pose = context_floats(c, "pose");
    if (!opened(c, &f->model, &f->counts)) {
        return false;
    }
    if (hab_fit_options_init(&f->options, sizeof f->options) != HAB_OK) {
        context_object(c, PROBLEM_PROMISE);
        return false;
    }
    f->options.frame = read_frame(c, &f->placement);
    f->options.place = context_integer(c, "place");
    f->options.noise = context_float_at(c, "noise", 0);
    f->options.max_iterations = context_integer(c, "max_iterations");
    f->options.relative_decrease = context_float_at(c, "relative_decrease", 0);
    f->options.damping = context_float_at(c, "damping", 0);
    read_prior(c, "identity_prior", &f->options.identity_prior, &f->options.identity_factor);
    read_prior(c, "pose_prior", &f->options.pose_prior, &f->options.pose_factor);
    if (!accepted(c, hab_model_fit_workspace_bytes(&f->model, NULL, f->options.frame, &workspace_bytes, &f->detail), &f->detail)) {
        return false;
    }
    f->workspace = context_zeros(c, workspace_bytes / sizeof(float));
    if (!f->counts.needs_evaluation &&
        (workspace_bytes != hab_fit_workspace_bytes(f->counts.identity_dim, f->counts.pose_dim, f->options.frame) ||
         workspace_bytes != HAB_FIT_WORKSPACE_BYTES(f->counts.identity_dim, f->counts.pose_dim, f->options.frame))) {
        context_object(c, PROBLEM_PROMISE);
    }
    return c->wrong == PROBLEM_NONE;
}

static void fit_compare(context *c, fit *f, hab_code code) {
    float energies[3];
    uint32_t ended[2];
    /* The core counts its own options, where noise is the second; C counts those of hab_fit_options. */
    if (code == HAB_BAD_OPTION && f->detail.first == 7) {
        f->detail.first = 2;
    }
    if (!accepted(c, code, &f->detail)) {
        return;
    }
    ended[0] = f->report.iterations;
    ended[1] = f->report.status;
    energies[0] = f->report.rms;
    energies[1] = f->report.energy;
    energies[2] = f->report.start_energy;
    compare_integers(c, "iterations_status", ended, 2);
    compare(c, "rms_energy_start", energies, 3);
    compare(c, "identity_fitted", f->identity.at, f->identity.count);
    compare(c, "pose_fitted", f->pose.at, f->pose.count);
    compare_placement(c, &f->placement);
}

/* The samples of a case; MOST_SAMPLES at most. */
static const hab_sample *read_samples(context *c, size_t *count) {
    static hab_sample samples[MOST_SAMPLES];
    integers kinds = context_integers(c, "kinds"), corners = context_integers(c, "corners");
    floats barycentric = context_floats(c, "barycentric"), targets = context_floats(c, "targets"),
           normals = context_floats(c, "normals"), weights = context_floats(c, "sample_weights");
    size_t k, axis, n = *count = kinds.count;
    if (n > MOST_SAMPLES) {
        context_object(c, PROBLEM_MEMORY);
        return samples;
    }
    if (corners.count != 3 * n || barycentric.count != 3 * n || targets.count != 3 * n || normals.count != 3 * n ||
        weights.count != n) {
        context_object(c, PROBLEM_TEXT);
        return samples;
    }
    for (k = 0; k < n; k++) {
        for (axis = 0; axis < 3; axis++) {
            samples[k].vertices[axis] = corners.at[3 * k + axis];
            samples[k].barycentric[axis] = barycentric.at[3 * k + axis];
            samples[k].target[axis] = targets.at[3 * k + axis];
            samples[k].normal[axis] = kinds.at[k] == 2 ? normals.at[3 * k + axis] : 0.0f;
        }
        /* A sample left out is one of weight 0. */
        samples[k].weight = kinds.at[k] == 0 ? 0.0f : weights.at[k];
    }
    return samples;
}

static void fit_points(context *c) {
    fit f = {0};
    size_t n;
    const hab_sample *samples = read_samples(c, &n);
    if (!fit_read(c, &f)) {
        return;
    }
    fit_compare(c, &f,
                hab_fit_points(&f.model, NULL, &f.options, samples, n, f.identity.at, f.identity.count, f.pose.at,
                               f.pose.count, &f.placement, f.workspace.at, f.workspace.count * sizeof(float), &f.report,
                               &f.detail));
}

/* A fit level by level. */
static void fit_wavelet(context *c) {
    hab_model model;
    hab_counts counts;
    hab_level_options options;
    hab_level_report report = {0, 0, 0, 0};
    hab_placement placement;
    hab_error_detail detail = {0, 0, 0, 0};
    hab_code code;
    floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose"), workspace;
    integers free = context_integers(c, "free"), levels = context_integers(c, "fitted_levels");
    uint32_t ended[2];
    float distances[2];
    size_t n, workspace_bytes = 0;
    const hab_sample *samples = read_samples(c, &n);
    if (!opened(c, &model, &counts)) {
        return;
    }
    if (hab_level_options_init(&options, sizeof options) != HAB_OK || free.count != 2 || levels.count != 2) {
        context_object(c, PROBLEM_PROMISE);
        return;
    }
    options.frame = read_frame(c, &placement);
    options.identity = free.at[0];
    options.pose = free.at[1];
    options.kappa = context_float_at(c, "kappa", 0);
    options.omega = context_float_at(c, "omega", 0);
    options.first_level = levels.at[0];
    options.n_levels = levels.at[1] - levels.at[0];
    options.passes = context_integer(c, "passes");
    if (!accepted(c, hab_fit_levels_workspace_bytes(&model, n, options.first_level, options.n_levels, &workspace_bytes, &detail), &detail)) {
        return;
    }
    workspace = context_zeros(c, workspace_bytes / sizeof(float));
    code = hab_fit_levels(&model, &options, samples, n, identity.at, identity.count, pose.at, pose.count, &placement, workspace.at,
                          workspace_bytes, &report, &detail);
    /* The core counts its own options: 1 kappa, 2 omega, 3 levels or passes. */
    if (code == HAB_BAD_OPTION && detail.first >= 4) {
        detail.first = detail.first < 6 ? detail.first - 3 : 3;
    }
    if (!accepted(c, code, &detail)) {
        return;
    }
    ended[0] = report.passes;
    ended[1] = report.reached;
    distances[0] = report.rms;
    distances[1] = report.start_rms;
    compare_integers(c, "passes_reached", ended, 2);
    compare(c, "rms_start", distances, 2);
    compare(c, "identity_fitted", identity.at, identity.count);
    compare(c, "pose_fitted", pose.at, pose.count);
    compare_placement(c, &placement);
}

static void fit_landmarks(context *c) {
    uint8_t measured[MOST_SAMPLES];
    fit f = {0};
    integers kinds = context_integers(c, "kinds");
    floats targets = context_floats(c, "targets");
    size_t k;
    if (!fit_read(c, &f)) {
        return;
    }
    if (kinds.count > MOST_SAMPLES) {
        context_object(c, PROBLEM_MEMORY);
        return;
    }
    for (k = 0; k < kinds.count; k++) {
        measured[k] = kinds.at[k] > 0;
    }
    fit_compare(c, &f,
                hab_fit_landmarks(&f.model, NULL, &f.options, targets.at, targets.count, measured, kinds.count,
                                  f.identity.at, f.identity.count, f.pose.at, f.pose.count, &f.placement,
                                  f.workspace.at, f.workspace.count * sizeof(float), &f.report, &f.detail));
}

/* Reals of a section that the file may lack, compared with a part of a field; returns where the part ends. */
static size_t compare_reals(context *c, const hab_model *model, uint32_t id, const char *key, size_t from) {
    hab_error_detail detail = {0, 0, 0, 0};
    hab_section section;
    hab_code code;
    floats found;
    section.struct_bytes = sizeof section;
    code = c->wrong == PROBLEM_NONE ? hab_model_find_section(model, id, &section, &detail) : HAB_UNSUPPORTED;
    if (code == HAB_UNSUPPORTED || !accepted(c, code, &detail)) {
        return from;
    }
    found = context_zeros(c, section.data_bytes / sizeof(float));
    if (accepted(c, hab_model_read_f32(model, id, 0, found.at, found.count, &detail), &detail)) {
        compare_part(c, key, from, found.at, found.count);
    }
    return from + found.count;
}

static void compare_section_integers(context *c, const hab_model *model, uint32_t id, const char *key, size_t count) {
    hab_error_detail detail = {0, 0, 0, 0};
    integers found = context_zero_integers(c, count);
    if (count > 0 && accepted(c, hab_model_read_u32(model, id, 0, found.at, found.count, &detail), &detail)) {
        compare_integers(c, key, found.at, found.count);
    }
}

/* What the file holds, but the two flags that C does not tell: linear modes, and sections that may be ignored. */
static void open_file(context *c) {
    enum { NUMBERS = 9, IGNORED = 1 };
    hab_model model;
    hab_counts counts;
    hab_section section;
    hab_error_detail detail = {0, 0, 0, 0};
    size_t end;
    uint32_t k, axis, coefficients = 1;
    if (!opened(c, &model, &counts)) {
        return;
    }
    if (counts.kind == HAB_KIND_WAVELET) {
        hab_grid grid;
        grid.struct_bytes = sizeof grid;
        if (!accepted(c, hab_model_grid(&model, &grid, &detail), &detail)) {
            return;
        }
        /* The header counts the weights of one coefficient. */
        coefficients = grid.n_coefficients;
    }
    compare_integer_at(c, "header", 0, counts.kind);
    compare_integer_at(c, "header", 1, counts.n_vertices);
    compare_integer_at(c, "header", 2, counts.identity_dim / coefficients);
    compare_integer_at(c, "header", 3, counts.pose_dim / coefficients);
    if (context_count(c, "sections") != (size_t)counts.n_sections * NUMBERS) {
        context_object(c, PROBLEM_COUNT);
    }
    for (k = 0; k < counts.n_sections; k++) {
        section.struct_bytes = sizeof section;
        if (!accepted(c, hab_model_section(&model, k, &section, &detail), &detail)) {
            return;
        }
        compare_integer_at(c, "sections", k * NUMBERS, section.id);
        compare_integer_at(c, "sections", k * NUMBERS + IGNORED + 1, section.element);
        compare_integer_at(c, "sections", k * NUMBERS + IGNORED + 2, section.rank);
        for (axis = 0; axis < 4; axis++) {
            compare_integer_at(c, "sections", k * NUMBERS + IGNORED + 3 + axis, section.shape[axis]);
        }
        compare_integer_at(c, "sections", k * NUMBERS + IGNORED + 7, (uint32_t)section.data_bytes);
    }
    if (counts.kind == HAB_KIND_WAVELET) {
        /* Its statistics have no precision; the fits by levels read them. */
        compare_section_integers(c, &model, HAB_SECTION_LANDMARKS, "landmarks", counts.n_landmarks);
        return;
    }
    end = compare_reals(c, &model, HAB_SECTION_IDENTITY_MEAN, "identity_gaussian", 0);
    end = compare_reals(c, &model, HAB_SECTION_IDENTITY_SCALE, "identity_gaussian", end);
    end = compare_reals(c, &model, HAB_SECTION_IDENTITY_PRECISION, "identity_gaussian", end);
    if (end != context_count(c, "identity_gaussian")) {
        context_object(c, PROBLEM_COUNT);
    }
    end = compare_reals(c, &model, HAB_SECTION_POSE_MEAN, "pose_gaussian", 0);
    end = compare_reals(c, &model, HAB_SECTION_POSE_SCALE, "pose_gaussian", end);
    end = compare_reals(c, &model, HAB_SECTION_POSE_PRECISION, "pose_gaussian", end);
    if (end != context_count(c, "pose_gaussian")) {
        context_object(c, PROBLEM_COUNT);
    }
    compare_section_integers(c, &model, HAB_SECTION_LANDMARKS, "landmarks", counts.n_landmarks);
    compare_section_integers(c, &model, HAB_SECTION_FACES, "faces", 3 * (size_t)counts.n_faces);
}

void kernel_run(context *c) {
    static const struct {
        const char *name;
        void (*run)(context *c);
    } KERNELS[] = {
        {"evaluate", evaluate},
        {"linearised_block", linearised_block},
        {"linearised_vertex", linearised_vertex},
        {"prepared", prepared},
        {"fit_points", fit_points},
        {"fit_landmarks", fit_landmarks},
        {"fit_wavelet", fit_wavelet},
        {"open", open_file},
    };
    size_t k;
    for (k = 0; k < sizeof KERNELS / sizeof KERNELS[0]; k++) {
        if (text_equals(c->given.kernel, KERNELS[k].name)) {
            KERNELS[k].run(c);
            return;
        }
    }
    context_object(c, PROBLEM_NOT_IN_INTERFACE);
}
