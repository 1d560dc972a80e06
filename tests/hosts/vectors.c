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
    counts->struct_bytes = sizeof *counts;
    return accepted(c, hab_model_counts(model, counts, &detail), &detail);
}

static void evaluate(context *c) {
    hab_model model;
    hab_counts counts;
    hab_error_detail detail = {0, 0, 0, 0};
    floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose"), out;
    integers ranges = context_integers(c, "ranges");
    size_t k;
    if (!opened(c, &model, &counts)) {
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
        if (!accepted(c,
                      hab_model_evaluate_range(&model, identity.at, identity.count, pose.at, pose.count, from, n, out.at,
                                               out.count, &detail),
                      &detail)) {
            return;
        }
        /* "out" is the whole shape: every range has to give the bits of its part. */
        compare_part(c, "out", 3 * (size_t)from, out.at, out.count);
    }
    out = context_zeros(c, 3 * (size_t)counts.n_vertices);
    if (accepted(
            c,
            hab_model_evaluate(&model, identity.at, identity.count, pose.at, pose.count, out.at, out.count, &detail),
            &detail)) {
        compare(c, "out", out.at, out.count);
    }
}

static void linearised_block(context *c) {
    hab_model model;
    hab_counts counts;
    hab_error_detail detail = {0, 0, 0, 0};
    floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose"), block, jacobian;
    uint32_t first = context_integer(c, "block");
    if (!opened(c, &model, &counts)) {
        return;
    }
    block = context_zeros(c, BLOCK_NUMBERS);
    jacobian = context_zeros(c, (counts.identity_dim + counts.pose_dim) * BLOCK_NUMBERS);
    if (accepted(c,
                 hab_model_linearise(&model, identity.at, identity.count, pose.at, pose.count, first, 1, block.at,
                                     block.count, jacobian.at, jacobian.count, &detail),
                 &detail)) {
        compare(c, "values", block.at, block.count);
        compare(c, "jacobian", jacobian.at, jacobian.count);
    }
}

/* C has blocks only: the vertex is a lane of its block. */
static void linearised_vertex(context *c) {
    hab_model model;
    hab_counts counts;
    hab_error_detail detail = {0, 0, 0, 0};
    floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose"), block, jacobian;
    uint32_t vertex = context_integer(c, "vertex"), lane = vertex % HAB_BLOCK_VERTICES;
    size_t k;
    if (!opened(c, &model, &counts)) {
        return;
    }
    block = context_zeros(c, BLOCK_NUMBERS);
    jacobian = context_zeros(c, (counts.identity_dim + counts.pose_dim) * BLOCK_NUMBERS);
    if (!accepted(c,
                  hab_model_linearise(&model, identity.at, identity.count, pose.at, pose.count,
                                      vertex / HAB_BLOCK_VERTICES, 1, block.at, block.count, jacobian.at,
                                      jacobian.count, &detail),
                  &detail)) {
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
    hab_error_detail detail = {0, 0, 0, 0};
    floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose");
    bool identity_fixed = text_equals(context_word(c, "fixed"), "identity");
    uint32_t mode = identity_fixed ? HAB_MODE_IDENTITY : HAB_MODE_POSE;
    floats fixed = identity_fixed ? identity : pose, free = identity_fixed ? pose : identity;
    uint32_t from = context_integer(c, "from"), n = context_integer(c, "to") - from, n_vertices;
    floats workspace, out, all, jacobian;
    size_t workspace_bytes = 0;
    if (!opened(c, &model, &counts)) {
        return;
    }
    workspace = context_zeros(c, HAB_PREPARED_WORKSPACE_BYTES(free.count, n) / sizeof(float));
    if (!accepted(c,
                  hab_prepared_init(&model, mode, fixed.at, fixed.count, from, n, workspace.at,
                                    workspace.count * sizeof(float), &form, &detail),
                  &detail)) {
        return;
    }
    if (accepted(c, hab_prepared_workspace_bytes(&model, mode, from, n, &workspace_bytes, &detail), &detail) &&
        workspace_bytes != workspace.count * sizeof(float)) {
        context_object(c, PROBLEM_PROMISE);
    }
    n_vertices = counts.n_vertices - from * HAB_BLOCK_VERTICES;
    n_vertices = n_vertices < n * HAB_BLOCK_VERTICES ? n_vertices : n * HAB_BLOCK_VERTICES;
    out = context_zeros(c, 3 * (size_t)n_vertices);
    if (accepted(c, hab_prepared_evaluate(&form, free.at, free.count, 0, n_vertices, out.at, out.count, &detail),
                 &detail)) {
        compare(c, "out", out.at, out.count);
    }
    all = context_zeros(c, n * BLOCK_NUMBERS);
    jacobian = context_zeros(c, n * free.count * BLOCK_NUMBERS);
    if (accepted(c,
                 hab_prepared_linearise(&form, free.at, free.count, 0, n, all.at, all.count, jacobian.at,
                                        jacobian.count, &detail),
                 &detail)) {
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

static bool fit_read(context *c, fit *f) {
    text frame = context_word(c, "frame");
    floats placement = context_floats(c, "placement");
    size_t k;
    f->identity = context_floats(c, "identity");
    f->pose = context_floats(c, "pose");
    if (!opened(c, &f->model, &f->counts) || hab_fit_options_init(&f->options, sizeof f->options) != HAB_OK || placement.count != 13) {
        context_object(c, PROBLEM_PROMISE);
        return false;
    }
    f->placement.scale = placement.at[0];
    for (k = 0; k < 9; k++) {
        f->placement.rotation[k] = placement.at[1 + k];
    }
    for (k = 0; k < 3; k++) {
        f->placement.translation[k] = placement.at[10 + k];
    }
    f->options.frame = text_equals(frame, "fixed")        ? HAB_FRAME_FIXED
                       : text_equals(frame, "rigid")      ? HAB_FRAME_RIGID
                       : text_equals(frame, "similarity") ? HAB_FRAME_SIMILARITY
                                                          : UINT32_MAX;
    f->options.place = context_integer(c, "place");
    f->options.noise = context_float_at(c, "noise", 0);
    f->options.max_iterations = context_integer(c, "max_iterations");
    f->options.relative_decrease = context_float_at(c, "relative_decrease", 0);
    f->options.damping = context_float_at(c, "damping", 0);
    read_prior(c, "identity_prior", &f->options.identity_prior, &f->options.identity_factor);
    read_prior(c, "pose_prior", &f->options.pose_prior, &f->options.pose_factor);
    f->workspace = context_zeros(
        c, HAB_FIT_WORKSPACE_BYTES(f->counts.identity_dim, f->counts.pose_dim, f->options.frame) / sizeof(float));
    if (c->wrong == PROBLEM_NONE &&
        f->workspace.count * sizeof(float) !=
            hab_fit_workspace_bytes(f->counts.identity_dim, f->counts.pose_dim, f->options.frame)) {
        context_object(c, PROBLEM_PROMISE);
    }
    return c->wrong == PROBLEM_NONE;
}

static void fit_compare(context *c, fit *f, hab_code code) {
    float energies[3], placement[13];
    uint32_t ended[2];
    size_t k;
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
    placement[0] = f->placement.scale;
    for (k = 0; k < 9; k++) {
        placement[1 + k] = f->placement.rotation[k];
    }
    for (k = 0; k < 3; k++) {
        placement[10 + k] = f->placement.translation[k];
    }
    compare_integers(c, "iterations_status", ended, 2);
    compare(c, "rms_energy_start", energies, 3);
    compare(c, "identity_fitted", f->identity.at, f->identity.count);
    compare(c, "pose_fitted", f->pose.at, f->pose.count);
    compare(c, "placement_fitted", placement, 13);
}

static void fit_points(context *c) {
    static hab_sample samples[MOST_SAMPLES];
    fit f = {0};
    integers kinds = context_integers(c, "kinds"), corners = context_integers(c, "corners");
    floats barycentric = context_floats(c, "barycentric"), targets = context_floats(c, "targets"),
           normals = context_floats(c, "normals"), weights = context_floats(c, "sample_weights");
    size_t k, axis, n = kinds.count;
    if (!fit_read(c, &f)) {
        return;
    }
    if (n > MOST_SAMPLES) {
        context_object(c, PROBLEM_MEMORY);
        return;
    }
    if (corners.count != 3 * n || barycentric.count != 3 * n || targets.count != 3 * n || normals.count != 3 * n ||
        weights.count != n) {
        context_object(c, PROBLEM_TEXT);
        return;
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
    fit_compare(c, &f,
                hab_fit_points(&f.model, NULL, &f.options, samples, n, f.identity.at, f.identity.count, f.pose.at,
                               f.pose.count, &f.placement, f.workspace.at, f.workspace.count * sizeof(float), &f.report,
                               &f.detail));
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
    uint32_t k, axis;
    if (!opened(c, &model, &counts)) {
        return;
    }
    compare_integer_at(c, "header", 0, counts.kind);
    compare_integer_at(c, "header", 1, counts.n_vertices);
    compare_integer_at(c, "header", 2, counts.identity_dim);
    compare_integer_at(c, "header", 3, counts.pose_dim);
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
