// Every kernel of the C++ interface as the golden vectors ask for it.
#include <habitus.hpp>

#include <vector>

#include "runner.h"

namespace {

using habitus::span;

constexpr std::size_t block_numbers = 3 * HAB_BLOCK_VERTICES;

span<const float> view(const floats& some) { return {some.at, some.count}; }

/// Whether there is a value; notes the refusal where there is none.
template <class T>
bool accepted(context* c, const habitus::result<T>& outcome) {
    if (!outcome) {
        context_refused(c, outcome.error().code(), outcome.error().first(), outcome.error().second());
    }
    return c->wrong == PROBLEM_NONE;
}

/// A view of the bytes of the case; the next case overwrites them.
habitus::result<habitus::model> opened(context* c) {
    const bytes file = context_model(c);
    auto model = habitus::model::open(span<const std::uint8_t>(file.at, file.count));
    if (model && context_count(c, "levels") == 2) {
        const integers levels = context_integers(c, "levels");
        if (const auto set = model->set_levels(levels.at[0], levels.at[1]); !set) {
            return set.error();
        }
    }
    if (model && context_count(c, "window") == 4) {
        const std::uint32_t* at = context_integers(c, "window").at;
        if (const auto set = model->set_window(at[0], at[1] - at[0], at[2], at[3] - at[2]); !set) {
            return set.error();
        }
    }
    return model;
}

void compare_all(context* c, const char* key, const std::vector<float>& found) { compare(c, key, found.data(), found.size()); }

void evaluate(context* c) {
    const floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose");
    const integers ranges = context_integers(c, "ranges");
    const auto model = opened(c);
    if (!accepted(c, model)) {
        return;
    }
    for (std::size_t k = 0; k + 1 < ranges.count; k += 2) {
        const std::uint32_t from = ranges.at[k], to = ranges.at[k + 1];
        if (to < from) {
            // A range that ends before it begins: C++ says how many.
            return context_object(c, PROBLEM_NOT_IN_INTERFACE);
        }
        const auto part = model->evaluate_range(view(identity), view(pose), from, to - from);
        if (!accepted(c, part)) {
            return;
        }
        compare_part(c, "out", 3 * std::size_t{from}, part->data(), part->size());
    }
    const auto whole = model->evaluate(view(identity), view(pose));
    if (accepted(c, whole)) {
        compare_all(c, "out", *whole);
    }
}

void linearised_block(context* c) {
    const floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose");
    const std::uint32_t block = context_integer(c, "block");
    const auto model = opened(c);
    if (!accepted(c, model)) {
        return;
    }
    std::vector<float> values(block_numbers), jacobian(block_numbers * (model->identity_dim() + model->pose_dim()));
    // Every kind of model has evaluations; those whose vertices share no state do without.
    const auto begun = model->begin(view(identity), view(pose), habitus::derivatives::yes);
    if (!accepted(c, begun)) {
        return;
    }
    const auto done = model->needs_evaluation() ? begun->linearise(block, 1, values, jacobian)
                                                : model->linearise(view(identity), view(pose), block, 1, values, jacobian);
    if (accepted(c, done)) {
        compare_all(c, "values", values);
        compare_all(c, "jacobian", jacobian);
    }
}

/// C++ has blocks only: the vertex is a lane of its block.
void linearised_vertex(context* c) {
    const floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose");
    const std::size_t vertex = context_integer(c, "vertex"), lane = vertex % HAB_BLOCK_VERTICES;
    const auto model = opened(c);
    if (!accepted(c, model)) {
        return;
    }
    const auto all = model->linearise(view(identity), view(pose));
    if (!accepted(c, all)) {
        return;
    }
    const std::size_t block = vertex / HAB_BLOCK_VERTICES, dim = model->identity_dim() + model->pose_dim();
    for (std::size_t k = 0; k < 3; k++) {
        compare_part(c, "value", k, &all->values[block * block_numbers + k * HAB_BLOCK_VERTICES + lane], 1);
    }
    for (std::size_t k = 0; k < 3 * dim; k++) {
        compare_part(c, "jacobian", k, &all->jacobian[block * dim * block_numbers + k * HAB_BLOCK_VERTICES + lane], 1);
    }
}

void prepared(context* c) {
    const floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose");
    const bool identity_fixed = text_equals(context_word(c, "fixed"), "identity");
    const floats fixed = identity_fixed ? identity : pose, free = identity_fixed ? pose : identity;
    const std::uint32_t from = context_integer(c, "from"), to = context_integer(c, "to");
    const auto model = opened(c);
    if (!accepted(c, model)) {
        return;
    }
    const auto mode = identity_fixed ? habitus::mode::identity : habitus::mode::pose;
    const auto form = model->prepare(mode, view(fixed), from, to - from);
    if (!accepted(c, form)) {
        return;
    }
    const auto out = form->evaluate(view(free));
    if (accepted(c, out)) {
        compare_all(c, "out", *out);
    }
    const auto all = form->linearise(view(free));
    if (accepted(c, all)) {
        compare_all(c, "values", all->values);
        compare_all(c, "jacobian", all->jacobian);
    }
}

/// KEY none, KEY gaussian FACTOR, KEY box FACTOR.
habitus::prior prior_of(context* c, const char* key, float& factor) {
    const text kind = context_word(c, key);
    factor = 1;
    if (text_equals(kind, "none")) {
        return habitus::prior::none;
    }
    factor = context_float_at(c, key, 1);
    if (!text_equals(kind, "gaussian") && !text_equals(kind, "box")) {
        context_object(c, PROBLEM_TEXT);
    }
    return text_equals(kind, "box") ? habitus::prior::box : habitus::prior::gaussian;
}

habitus::frame frame_of(context* c) {
    const text frame = context_word(c, "frame");
    if (text_equals(frame, "rigid")) {
        return habitus::frame::rigid;
    }
    if (text_equals(frame, "similarity")) {
        return habitus::frame::similarity;
    }
    if (!text_equals(frame, "fixed")) {
        context_object(c, PROBLEM_TEXT);
    }
    return habitus::frame::fixed;
}

habitus::fit_options options_of(context* c) {
    habitus::fit_options options;
    float factor = 1;
    options.frame(frame_of(c));
    options.place(context_integer(c, "place") > 0).noise(context_float_at(c, "noise", 0));
    options.max_iterations(context_integer(c, "max_iterations"));
    options.numbers.relative_decrease = context_float_at(c, "relative_decrease", 0);
    options.numbers.damping = context_float_at(c, "damping", 0);
    const auto identity = prior_of(c, "identity_prior", factor);
    options.identity_prior(identity, factor);
    const auto pose = prior_of(c, "pose_prior", factor);
    options.pose_prior(pose, factor);
    return options;
}

habitus::fit_result start_of(context* c) {
    const floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose"),
                 placement = context_floats(c, "placement");
    habitus::fit_result start;
    if (placement.count != 13) {
        context_object(c, PROBLEM_TEXT);
        return start;
    }
    start.identity.assign(identity.at, identity.at + identity.count);
    start.pose.assign(pose.at, pose.at + pose.count);
    start.placement.scale = placement.at[0];
    std::copy(placement.at + 1, placement.at + 10, start.placement.rotation);
    std::copy(placement.at + 10, placement.at + 13, start.placement.translation);
    return start;
}

void compare_placement(context* c, const habitus::placement& place) {
    std::vector<float> numbers{place.scale};
    numbers.insert(numbers.end(), place.rotation, place.rotation + 9);
    numbers.insert(numbers.end(), place.translation, place.translation + 3);
    compare_all(c, "placement_fitted", numbers);
}

void compare_fit(context* c, const habitus::result<habitus::fit_result>& outcome) {
    // The core counts its own options, where noise is the second; habitus.h counts those of hab_fit_options.
    if (outcome.error() == HAB_BAD_OPTION && outcome.error().first() == 7) {
        return context_refused(c, HAB_BAD_OPTION, 2, 0);
    }
    if (!accepted(c, outcome)) {
        return;
    }
    const habitus::fit_report& report = outcome->report;
    const std::uint32_t ended[] = {report.iterations, static_cast<std::uint32_t>(report.why())};
    compare_integers(c, "iterations_status", ended, 2);
    compare_all(c, "rms_energy_start", {report.rms, report.energy, report.start_energy});
    compare_all(c, "identity_fitted", outcome->identity);
    compare_all(c, "pose_fitted", outcome->pose);
    compare_placement(c, outcome->placement);
}

std::vector<hab_sample> samples_of(context* c) {
    const integers kinds = context_integers(c, "kinds"), corners = context_integers(c, "corners");
    const floats barycentric = context_floats(c, "barycentric"), targets = context_floats(c, "targets"),
                 normals = context_floats(c, "normals"), weights = context_floats(c, "sample_weights");
    const std::size_t n = kinds.count;
    std::vector<hab_sample> samples(n);
    if (corners.count != 3 * n || barycentric.count != 3 * n || targets.count != 3 * n || normals.count != 3 * n ||
        weights.count != n) {
        context_object(c, PROBLEM_TEXT);
        return samples;
    }
    for (std::size_t k = 0; k < n; k++) {
        std::copy(corners.at + 3 * k, corners.at + 3 * k + 3, samples[k].vertices);
        std::copy(barycentric.at + 3 * k, barycentric.at + 3 * k + 3, samples[k].barycentric);
        std::copy(targets.at + 3 * k, targets.at + 3 * k + 3, samples[k].target);
        if (kinds.at[k] == 2) {
            std::copy(normals.at + 3 * k, normals.at + 3 * k + 3, samples[k].normal);
        }
        // A sample left out is one of weight 0.
        samples[k].weight = kinds.at[k] == 0 ? 0.0f : weights.at[k];
    }
    return samples;
}

void fit_points(context* c) {
    const std::vector<hab_sample> samples = samples_of(c);
    const habitus::fit_options options = options_of(c);
    const habitus::fit_result start = start_of(c);
    const auto model = opened(c);
    if (accepted(c, model)) {
        compare_fit(c, model->fit_points(samples, habitus::fit_options(options).start_from(start)));
    }
}

/// A fit level by level.
void fit_wavelet(context* c) {
    const std::vector<hab_sample> samples = samples_of(c);
    const integers free = context_integers(c, "free"), levels = context_integers(c, "fitted_levels");
    const habitus::fit_result start = start_of(c);
    const auto model = opened(c);
    if (!accepted(c, model) || free.count != 2 || levels.count != 2) {
        return context_object(c, PROBLEM_TEXT);
    }
    habitus::level_options options;
    options.frame(frame_of(c)).seek(habitus::mode::identity, free.at[0] > 0).seek(habitus::mode::pose, free.at[1] > 0);
    options.box(context_float_at(c, "kappa", 0)).pull(context_float_at(c, "omega", 0)).passes(context_integer(c, "passes"));
    options.levels(levels.at[0], levels.at[1] - levels.at[0]).start_from(start);
    const auto outcome = model->fit_levels(samples, options);
    // The core counts its own options: 1 kappa, 2 omega, 3 levels or passes.
    const std::uint32_t option = outcome.error().first();
    if (outcome.error() == HAB_BAD_OPTION && option >= 4) {
        return context_refused(c, HAB_BAD_OPTION, option < 6 ? option - 3 : 3, 0);
    }
    if (!accepted(c, outcome)) {
        return;
    }
    const std::uint32_t ended[] = {outcome->report.passes, outcome->report.reached};
    compare_integers(c, "passes_reached", ended, 2);
    compare_all(c, "rms_start", {outcome->report.rms, outcome->report.start_rms});
    compare_all(c, "identity_fitted", outcome->found.identity);
    compare_all(c, "pose_fitted", outcome->found.pose);
    compare_placement(c, outcome->found.placement);
}

void fit_landmarks(context* c) {
    const integers kinds = context_integers(c, "kinds");
    const floats targets = context_floats(c, "targets");
    const habitus::fit_options options = options_of(c);
    const habitus::fit_result start = start_of(c);
    const auto model = opened(c);
    if (!accepted(c, model)) {
        return;
    }
    const std::vector<std::uint8_t> measured(kinds.at, kinds.at + kinds.count);
    compare_fit(c, model->fit_landmarks(view(targets), measured, habitus::fit_options(options).start_from(start)));
}

/// Reals of a section that the file may lack, compared with a part of a field; returns where the part ends.
std::size_t compare_reals(context* c, const habitus::model& model, std::uint32_t id, const char* key, std::size_t from) {
    const auto section = model.find_section(id);
    if (section.error() == HAB_UNSUPPORTED) {
        return from;
    }
    if (!accepted(c, section)) {
        return from;
    }
    std::vector<float> found(section->data_bytes / sizeof(float));
    if (accepted(c, model.read(id, span<float>(found)))) {
        compare_part(c, key, from, found.data(), found.size());
    }
    return from + found.size();
}

/// What the file holds, but the two flags that C++ does not tell: linear modes, and sections that may be ignored.
void open_file(context* c) {
    constexpr std::size_t numbers = 9;
    const auto model = opened(c);
    if (!accepted(c, model)) {
        return;
    }
    const bool wavelet = model->kind() == habitus::kind::wavelet;
    // The header of a wavelet model counts the weights of one coefficient.
    const std::uint32_t coefficients = wavelet ? model->grid()->n_coefficients : 1;
    const std::uint32_t header[] = {model->counts().kind, model->n_vertices(), model->identity_dim() / coefficients,
                                    model->pose_dim() / coefficients};
    for (std::size_t k = 0; k < 4; k++) {
        compare_integer_at(c, "header", k, header[k]);
    }
    if (context_count(c, "sections") != model->n_sections() * numbers) {
        context_object(c, PROBLEM_COUNT);
    }
    for (std::uint32_t k = 0; k < model->n_sections(); k++) {
        const auto section = model->section(k);
        if (!accepted(c, section)) {
            return;
        }
        const std::uint32_t* shape = section->shape;
        const std::uint32_t known[] = {section->element, section->rank, shape[0], shape[1], shape[2], shape[3],
                                       static_cast<std::uint32_t>(section->data_bytes)};
        compare_integer_at(c, "sections", k * numbers, section->id);
        for (std::size_t at = 0; at < 7; at++) {
            compare_integer_at(c, "sections", k * numbers + 2 + at, known[at]);
        }
    }
    const struct {
        const char* key;
        std::uint32_t sections[3];
    } gaussians[] = {
        {"identity_gaussian", {HAB_SECTION_IDENTITY_MEAN, HAB_SECTION_IDENTITY_SCALE, HAB_SECTION_IDENTITY_PRECISION}},
        {"pose_gaussian", {HAB_SECTION_POSE_MEAN, HAB_SECTION_POSE_SCALE, HAB_SECTION_POSE_PRECISION}},
    };
    for (const auto& gaussian : gaussians) {
        if (wavelet) {
            // Statistics without a precision; the fits by levels read them.
            break;
        }
        std::size_t end = 0;
        for (const std::uint32_t id : gaussian.sections) {
            end = compare_reals(c, *model, id, gaussian.key, end);
        }
        if (end != context_count(c, gaussian.key)) {
            context_object(c, PROBLEM_COUNT);
        }
    }
    if (model->n_landmarks() > 0) {
        const auto landmarks = model->landmarks();
        if (accepted(c, landmarks)) {
            compare_integers(c, "landmarks", landmarks->data(), landmarks->size());
        }
    }
    if (model->n_faces() > 0) {
        const auto faces = model->faces();
        if (accepted(c, faces)) {
            compare_integers(c, "faces", faces->data(), faces->size());
        }
    }
}

} // namespace

extern "C" void kernel_run(context* c) {
    const struct {
        const char* name;
        void (*run)(context* c);
    } kernels[] = {
        {"evaluate", evaluate},           {"linearised_block", linearised_block},
        {"linearised_vertex", linearised_vertex}, {"prepared", prepared},
        {"fit_points", fit_points},       {"fit_landmarks", fit_landmarks},
        {"fit_wavelet", fit_wavelet},
        {"open", open_file},
    };
    for (const auto& kernel : kernels) {
        if (text_equals(c->given.kernel, kernel.name)) {
            return kernel.run(c);
        }
    }
    context_object(c, PROBLEM_NOT_IN_INTERFACE);
}
