// habitus.hpp: its views, results and owners, and that it hands everything through to habitus.h.
//
//     wrapper MODEL.hab BODY.hab
//
// Compiled with exceptions and without. Each check names its line when it fails.
#include <habitus.hpp>

#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>
#if defined(__cpp_lib_span) || __cplusplus >= 202002L
#include <span>
#endif

namespace {

int checks = 0;
int faults = 0;

void check(bool holds, int line) {
    ++checks;
    if (!holds) {
        ++faults;
        std::printf("wrapper.cpp:%d: does not hold\n", line);
    }
}
#define CHECK(condition) check((condition), __LINE__)

// What must not compile does not: a temporary vector's bytes, a writable view of what is const, copies of owners.
static_assert(!std::is_copy_constructible_v<habitus::model_file> && !std::is_copy_assignable_v<habitus::model_file>);
static_assert(!std::is_copy_constructible_v<habitus::prepared> && !std::is_copy_assignable_v<habitus::prepared>);
static_assert(std::is_nothrow_move_constructible_v<habitus::model_file> && std::is_nothrow_move_constructible_v<habitus::prepared>);
static_assert(std::is_trivially_copyable_v<habitus::model>);
static_assert(!std::is_copy_constructible_v<habitus::evaluation> && !std::is_copy_assignable_v<habitus::evaluation>);
static_assert(std::is_nothrow_move_constructible_v<habitus::evaluation>);
static_assert(!std::is_convertible_v<const std::vector<float>&, habitus::span<float>>);
static_assert(!std::is_convertible_v<std::vector<float>&&, habitus::span<float>>);
static_assert(!std::is_convertible_v<std::vector<double>&, habitus::span<const float>>);
static_assert(std::is_convertible_v<habitus::span<float>, habitus::span<const float>>);
static_assert(std::is_convertible_v<std::array<float, 3>&, habitus::span<float>>);
static_assert(sizeof(habitus::span<float>) == 2 * sizeof(void*));
static_assert(sizeof(habitus::placement) == sizeof(hab_placement) && sizeof(habitus::fit_report) == sizeof(hab_fit_report));

// Nothing is handed out that lies in the bytes of a temporary file: not a model, ...
using habitus::model;
using habitus::model_file;
static_assert(!std::is_constructible_v<model, model_file> && !std::is_constructible_v<model, const model_file>);
static_assert(!std::is_convertible_v<model_file, model> && !std::is_assignable_v<model&, model_file>);
static_assert(!std::is_constructible_v<habitus::result<model>, model_file>);
static_assert(std::is_constructible_v<model, model_file&> && std::is_convertible_v<const model_file&, model>);
static_assert(std::is_assignable_v<model&, const model_file&> && std::is_constructible_v<model, model>);

// ... nor what its functions return. Each is tried on a named file and on a temporary one.
#define CALLABLE(name, call)                                         \
    template <class From, class = void>                              \
    constexpr bool name = false;                                     \
    template <class From>                                            \
    constexpr bool name<From, std::void_t<decltype(std::declval<From>() call)>> = true;
#define LENT(name, call)                                             \
    CALLABLE(name, call)                                             \
    static_assert(name<model_file&> && name<const model_file&>);     \
    static_assert(!name<model_file> && !name<const model_file>)
LENT(lends_view, .view());
LENT(lends_bytes, .bytes());
LENT(lends_landmark_name, .landmark_name(0));
LENT(lends_landmark_names, .landmark_names());
LENT(lends_pose_name, .pose_name(0));
LENT(lends_pose_names, .pose_names());
LENT(lends_joint_name, .joint_name(0));
LENT(lends_joint_names, .joint_names());
LENT(begins, .begin({}, {}));
LENT(lends_section, .section(0));
LENT(lends_sections, .sections());
LENT(lends_found_section, .find_section(1));
LENT(lends_text, .text(1, 0));
CALLABLE(names_by_arrow, ->landmark_names())
CALLABLE(names_by_star, .operator*().landmark_names())
CALLABLE(names_by_value, .value().landmark_names())
static_assert(names_by_arrow<habitus::result<model_file>&> && names_by_arrow<const habitus::result<model_file>&>);
static_assert(names_by_star<habitus::result<model_file>&> && names_by_value<const habitus::result<model_file>&>);
static_assert(!names_by_arrow<habitus::result<model_file>> && !names_by_star<habitus::result<model_file>>);
static_assert(!names_by_value<habitus::result<model_file>>);
// A view may be temporary, as may be a result that owns what it holds.
static_assert(names_by_arrow<habitus::result<model>> && names_by_star<habitus::result<model>>);

// Nor does an evaluation outlive a temporary form.
CALLABLE(form_begins, .begin({}))
static_assert(form_begins<habitus::prepared&> && form_begins<const habitus::prepared&> && !form_begins<habitus::prepared>);

// Options keep addresses: not those of temporaries.
CALLABLE(starts, .start_from(std::declval<habitus::fit_result>()))
CALLABLE(starts_const, .start_from(std::declval<const habitus::fit_result>()))
CALLABLE(tracks, .track_from(std::declval<habitus::fit_result>()))
CALLABLE(takes_form, .with_form(std::declval<habitus::prepared>()))
CALLABLE(starts_named, .start_from(std::declval<habitus::fit_result&>()).track_from(std::declval<const habitus::fit_result&>()))
CALLABLE(takes_named_form, .with_form(std::declval<habitus::prepared&>()))
static_assert(!starts<habitus::fit_options&> && !starts_const<habitus::fit_options&> && !tracks<habitus::fit_options&>);
static_assert(!takes_form<habitus::fit_options&>);
static_assert(starts_named<habitus::fit_options> && takes_named_form<habitus::fit_options&>);

// Overloads.
CALLABLE(opens_vector, .open(std::declval<std::vector<std::uint8_t>>()))
CALLABLE(opens_array, .open(std::declval<std::array<std::uint8_t, 4>>()))
CALLABLE(opens_braces, .open({1, 2, 3}))
CALLABLE(opens_nothing, .open({}))
CALLABLE(opens_named, .open(std::declval<const std::vector<std::uint8_t>&>()))
static_assert(!opens_vector<model> && !opens_array<model> && !opens_braces<model>);
static_assert(opens_nothing<model> && opens_named<model> && opens_vector<model_file&>);
static_assert(std::is_convertible_v<std::initializer_list<float>, habitus::span<const float>>);
static_assert(!std::is_convertible_v<std::initializer_list<float>, habitus::span<float>>);
static_assert(std::is_convertible_v<const std::vector<float>&, habitus::coordinates>);
static_assert(std::is_convertible_v<std::vector<habitus::point>&, habitus::coordinates>);
static_assert(std::is_convertible_v<habitus::span<const habitus::point>, habitus::coordinates>);
static_assert(!std::is_convertible_v<const std::vector<double>&, habitus::coordinates>);
static_assert(std::is_assignable_v<habitus::placement&, const hab_placement&>);
CALLABLE(applies, .apply(std::declval<std::vector<float>>()))
CALLABLE(applies_named, .apply(std::declval<std::vector<float>&>()))
static_assert(!applies<habitus::placement> && applies_named<const habitus::placement>);

std::size_t length(habitus::span<const float> view) { return view.size(); }

void views() {
    float array[3] = {1, 2, 3};
    std::array<float, 4> fixed{};
    std::vector<float> vector(5);
    const std::vector<float> constant(6);
    CHECK(length(array) == 3 && length(fixed) == 4 && length(vector) == 5 && length(constant) == 6 && length({}) == 0);
    CHECK(length({array, 2}) == 2 && length(std::vector<float>(7)) == 7);
    CHECK(length({1.0F, 2.0F, 3.0F}) == 3 && length({1.0F}) == 1);
    const std::vector<habitus::point> points{{1, 2, 3}, {4, 5, 6}};
    const habitus::coordinates numbers = points;
    CHECK(numbers.size() == 6 && numbers.data()[5] == 6 && habitus::coordinates(vector).data() == vector.data());
    CHECK(habitus::coordinates(std::vector<habitus::point>()).size() == 0 && habitus::coordinates().data() == nullptr);
    habitus::span<float> view = array;
    view[1] = 9;
    CHECK(array[1] == 9 && *view.begin() == 1 && view.end() - view.begin() == 3 && view.subspan(1, 2)[0] == 9);
#if __cplusplus >= 202002L
    CHECK(length(std::span<const float>(vector)) == 5);
#endif
}

void results() {
    habitus::result<int> good = 3;
    habitus::result<int> bad = habitus::error(HAB_NOT_FINITE, 7);
    CHECK(good && *good == 3 && good.value() == 3 && good.error().code() == HAB_OK);
    CHECK(!bad && bad.error() == HAB_NOT_FINITE && bad.error() != HAB_OK && bad.error().first() == 7);
    CHECK(HAB_NOT_FINITE == bad.error() && HAB_OK != bad.error() && !(HAB_OK == bad.error()));
    CHECK(std::string(bad.error().name()) == "HAB_NOT_FINITE");
    CHECK(bad.error().message() == "HAB_NOT_FINITE: Number 7 is NaN, infinite or too large.");
    CHECK(std::move(bad).value_or(5) == 5 && std::move(good).value_or(5) == 3);
#if defined(__cpp_exceptions)
    bool thrown = false;
    try {
        bad.value();
    } catch (const habitus::exception& exception) {
        thrown = exception.reason().code() == HAB_NOT_FINITE && std::string(exception.what()) == bad.error().message();
    }
    CHECK(thrown);
    thrown = false;
    try {
        habitus::result<void>(habitus::error(HAB_EMPTY)).value();
    } catch (const std::runtime_error&) {
        thrown = true;
    }
    CHECK(thrown);
#endif
}

bool same(const std::vector<float>& a, const std::vector<float>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

float largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
    float most = a.size() == b.size() ? 0 : std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
        most = std::max(most, std::abs(a[i] - b[i]));
    }
    return most;
}

void moved_from(const habitus::model_file& gone) {
    const std::vector<float> some(3);
    std::vector<float> out(3);
    std::vector<std::uint32_t> integers(3);
    CHECK(gone.evaluate(some, some, {}).error() == HAB_NOT_OPENED && gone.n_vertices() == 0);
    CHECK(gone.evaluate(some, some).error() == HAB_NOT_OPENED && gone.evaluate_range(some, some, 1, 1).error() == HAB_NOT_OPENED);
    CHECK(gone.landmark_names().error() == HAB_NOT_OPENED && gone.pose_names().error() == HAB_NOT_OPENED);
    CHECK(gone.landmark_name(0).error() == HAB_NOT_OPENED && gone.text(HAB_SECTION_PROVENANCE, 0).error() == HAB_NOT_OPENED);
    CHECK(gone.sections().error() == HAB_NOT_OPENED && gone.section(0).error() == HAB_NOT_OPENED);
    CHECK(gone.faces().error() == HAB_NOT_OPENED && gone.landmarks(integers).error() == HAB_NOT_OPENED);
    CHECK(gone.pose_start(0).error() == HAB_NOT_OPENED && gone.pose_start(0, out).error() == HAB_NOT_OPENED);
    CHECK(gone.mean(habitus::mode::pose).error() == HAB_NOT_OPENED);
    CHECK(gone.deviations_from_weights(habitus::mode::pose, some).error() == HAB_NOT_OPENED);
    CHECK(gone.prepare(habitus::mode::pose, some).error() == HAB_NOT_OPENED);
    CHECK(gone.begin(some, some).error() == HAB_NOT_OPENED && gone.joint(0).error() == HAB_NOT_OPENED);
    CHECK(gone.joint_names().error() == HAB_NOT_OPENED && gone.pose_bounds().error() == HAB_NOT_OPENED);
    CHECK(gone.linearise(some, some).error() == HAB_NOT_OPENED && gone.fit_landmarks(some).error() == HAB_NOT_OPENED);
}

void files(const char* path) {
    const auto missing = habitus::model_file::read("/nonexistent/file.hab");
    CHECK(missing.error() == habitus::file_not_read && missing.error().message().find("No such file") != std::string::npos);
    CHECK(habitus::model_file::read("/").error() == habitus::file_not_read);
    CHECK(habitus::model_file::open({}).error() == HAB_TRUNCATED);

    auto opened = habitus::model_file::read(path);
    CHECK(opened.has_value());
    if (!opened) {
        return;
    }
    const auto identity = opened->mean(habitus::mode::identity).value();
    const auto pose = opened->mean(habitus::mode::pose).value();
    const auto before = opened->evaluate(identity, pose).value();
    habitus::model_file first = *std::move(opened);
    habitus::model_file second = std::move(first);
    CHECK(same(second.evaluate(identity, pose).value(), before));
    moved_from(first); // NOLINT: on purpose
    first = std::move(second);
    CHECK(same(first.evaluate(identity, pose).value(), before));
    const habitus::model view = first;
    CHECK(same(view.evaluate(identity, pose).value(), before) && same(first.view().evaluate(identity, pose).value(), before));
    CHECK(habitus::model::open({}).error() == HAB_TRUNCATED);
    CHECK(habitus::model::open(first.bytes())->landmark_names().value() == first.landmark_names().value());
    const auto over_bytes = habitus::model::open(first.bytes(), habitus::checksums::skip);
    CHECK(over_bytes && same(over_bytes->evaluate(identity, pose).value(), before));
    std::vector<std::uint8_t> bytes(first.bytes().begin(), first.bytes().end());
    bytes[bytes.size() / 2] ^= 1;
    CHECK(habitus::model::open(bytes).error() == HAB_BAD_CHECKSUM);
}

void content(const habitus::model& model) {
    CHECK(model.counts().n_vertices == model.n_vertices() && model.dim(habitus::mode::pose) == model.pose_dim());
    const auto faces = model.faces().value();
    const auto landmarks = model.landmarks().value();
    CHECK(faces.size() == 3U * model.n_faces() && landmarks.size() == model.n_landmarks());
    CHECK(*std::max_element(faces.begin(), faces.end()) < model.n_vertices());
    std::vector<std::uint32_t> short_by_one(landmarks.size() - 1);
    const auto too_short = model.landmarks(short_by_one).error();
    CHECK(too_short == HAB_DIMENSION_MISMATCH && too_short.argument() == 4 && too_short.second() == landmarks.size() - 1);
    std::vector<std::uint32_t> copy(landmarks.size());
    CHECK(model.landmarks(copy) && copy == landmarks);
    const auto sections = model.sections().value();
    CHECK(sections.size() == model.n_sections() && model.section(model.n_sections()).error() == HAB_INDEX_OUT_OF_RANGE);
    CHECK(model.find_section(sections.back().id)->data == sections.back().data && model.find_section(999).error() == HAB_UNSUPPORTED);
    if (const auto names = model.landmark_names()) {
        CHECK(names->size() == landmarks.size() && *model.landmark_name(0) == names->front());
    } else {
        CHECK(names.error() == HAB_UNSUPPORTED);
    }
    for (std::uint32_t i = 0; i < model.n_poses(); ++i) {
        CHECK(model.pose_start(i)->size() == model.pose_dim() && !model.pose_name(i)->empty());
    }
    CHECK(!model.pose_start(model.n_poses()).has_value());
    CHECK(model.text(HAB_SECTION_PROVENANCE, 0).has_value());
}

/// Largest of the differences, whatever the deviations; in place as well.
void weights(const habitus::model& model) {
    for (const auto mode : {habitus::mode::identity, habitus::mode::pose}) {
        std::vector<float> deviations(model.dim(mode));
        for (std::size_t i = 0; i < deviations.size(); ++i) {
            deviations[i] = 0.25F * static_cast<float>(i) - 1;
        }
        auto weights = model.weights_from_deviations(mode, deviations).value();
        const auto back = model.deviations_from_weights(mode, weights).value();
        CHECK(largest_difference(back, deviations) < 1e-4F);
        CHECK(largest_difference(model.deviations_from_weights(mode, model.mean(mode).value()).value(),
                                 std::vector<float>(deviations.size())) == 0);
        CHECK(model.deviations_from_weights(mode, weights, weights) && same(weights, back));
        weights.back() = std::numeric_limits<float>::quiet_NaN();
        const auto bad = model.deviations_from_weights(mode, weights, deviations).error();
        CHECK(bad == HAB_NOT_FINITE && bad.first() == weights.size() - 1 && deviations[0] == -1);
        weights.pop_back();
        const auto too_short = model.deviations_from_weights(mode, weights).error();
        CHECK(too_short == HAB_DIMENSION_MISMATCH && too_short.argument() == 3);
    }
    CHECK(model.deviations_from_weights(static_cast<habitus::mode>(2), {}).error() == HAB_BAD_OPTION);
    CHECK(model.weights_from_deviations(habitus::mode::identity, {1.0F, 2.0F}).error() == HAB_DIMENSION_MISMATCH);
}

void evaluation(const habitus::model& model) {
    std::vector<float> deviations(model.identity_dim(), 0.5F);
    const auto identity = model.weights_from_deviations(habitus::mode::identity, deviations).value();
    const auto pose = model.mean(habitus::mode::pose).value();
    const auto all = model.evaluate(identity, pose).value();
    CHECK(all.size() == 3U * model.n_vertices());
    std::vector<float> short_by_one(all.size() - 1);
    const auto too_short = model.evaluate(identity, pose, short_by_one).error();
    CHECK(too_short == HAB_DIMENSION_MISMATCH && too_short.argument() == 6);
    CHECK(too_short.message().find("Argument 6 has " + std::to_string(all.size() - 1)) != std::string::npos);
    CHECK(model.evaluate(pose, identity).error() == HAB_DIMENSION_MISMATCH);
    const auto part = model.evaluate_range(identity, pose, 5, 7).value();
    CHECK(same(part, {all.begin() + 15, all.begin() + 36}));
    CHECK(model.evaluate_range(identity, pose, model.n_vertices(), 1).error() == HAB_INDEX_OUT_OF_RANGE);
    CHECK(model.evaluate_range(identity, pose, 1, UINT32_MAX).error() == HAB_INDEX_OUT_OF_RANGE);
    std::vector<float> out(all.size());
    CHECK(model.evaluate(identity, pose, out) && same(out, all));

    const auto line = model.linearise(identity, pose).value();
    CHECK(line.values[0] == all[0] && line.values[HAB_BLOCK_VERTICES] == all[1] && line.values[1] == all[3]);
    CHECK(line.jacobian.size() == line.values.size() * (identity.size() + pose.size()));

    const auto form = model.prepare(habitus::mode::pose, pose).value();
    CHECK(form.fixed() == habitus::mode::pose && form.free_dim() == model.identity_dim() && form.n_vertices() == model.n_vertices());
    CHECK(same(form.evaluate(identity).value(), all));
    CHECK(same(form.linearise(identity)->values, line.values));
    auto other = model.prepare(habitus::mode::identity, identity, 1, 2).value();
    CHECK(other.n_vertices() == 2 * HAB_BLOCK_VERTICES && other.n_blocks() == 2);
    CHECK(largest_difference(other.evaluate(pose).value(), {all.begin() + 48, all.begin() + 144}) < 1e-4F);
    const auto last = model.prepare(habitus::mode::identity, identity, model.n_blocks() - 1, 1).value();
    CHECK(last.evaluate(pose)->size() == 3U * (model.n_vertices() - HAB_BLOCK_VERTICES * (model.n_blocks() - 1)));
    const habitus::prepared moved = std::move(other);
    CHECK(moved.evaluate(pose).has_value());
    CHECK(other.evaluate(pose, {}).error() == HAB_NOT_OPENED); // NOLINT: moved from on purpose
    CHECK(model.prepare(habitus::mode::identity, identity, 0, UINT32_MAX).error() == HAB_INDEX_OUT_OF_RANGE);
}

std::vector<habitus::point> points_of(const std::vector<float>& numbers) {
    std::vector<habitus::point> out;
    for (std::size_t i = 0; i + 3 <= numbers.size(); i += 3) {
        out.push_back({numbers[i], numbers[i + 1], numbers[i + 2]});
    }
    return out;
}

void fitting(const habitus::model& model) {
    std::vector<float> deviations(model.identity_dim());
    deviations[0] = 1;
    const auto identity = model.weights_from_deviations(habitus::mode::identity, deviations).value();
    const auto pose = model.mean(habitus::mode::pose).value();
    const auto known = model.evaluate(identity, pose).value();
    const habitus::placement seen(hab_placement{1, {0, 0, 1, 0, 1, 0, -1, 0, 0}, {10, 20, 300}});
    CHECK((seen.apply(habitus::point{1, 2, 3}) == habitus::point{13, 22, 299}));
    CHECK((seen.applied(std::vector<float>{1, 2, 3}) == std::vector<float>{13, 22, 299}));
    CHECK((seen.applied(std::vector<habitus::point>{{1, 2, 3}}) == std::vector<float>{13, 22, 299}));
    habitus::placement assigned;
    assigned = static_cast<const hab_placement&>(seen);
    CHECK((assigned.apply({1, 2, 3}) == habitus::point{13, 22, 299}));
    assigned = {};
    CHECK(assigned.scale == 1 && assigned.rotation[8] == 1 && assigned.translation[2] == 0);
    std::vector<float> targets;
    std::vector<hab_sample> samples;
    for (const std::uint32_t vertex : model.landmarks().value()) {
        const auto target = seen.apply({known[3 * vertex], known[3 * vertex + 1], known[3 * vertex + 2]});
        targets.insert(targets.end(), target.begin(), target.end());
        samples.push_back({{vertex, 0, 0}, {1, 0, 0}, {target[0], target[1], target[2]}, {0, 0, 0}, 1});
    }
    const auto options = habitus::fit_options().noise(0.1F);
    CHECK(options.numbers.struct_bytes == sizeof(hab_fit_options) && options.numbers.frame == HAB_FRAME_RIGID);
    const auto fit = model.fit_landmarks(targets, options).value();
    CHECK(fit.report.converged() && fit.report.why() == habitus::fit_status::converged && fit.report.rms < 0.1F);
    CHECK(std::abs(fit.placement.translation[2] - 300) < 1 && fit.identity.size() == identity.size());
    const auto as_points = model.fit_landmarks(points_of(targets), options).value();
    CHECK(same(as_points.identity, fit.identity) && same(as_points.pose, fit.pose));
    CHECK(same(model.fit_landmarks(targets, {}, options)->identity, fit.identity));
    CHECK(same(model.fit_landmarks(points_of(targets), {}, options)->identity, fit.identity));
    CHECK(same(model.fit_landmarks(targets, {})->identity, model.fit_landmarks(targets)->identity));
    CHECK(model.fit_landmarks(targets, {1, 1, 0}).error() == HAB_DIMENSION_MISMATCH);
    const auto points = model.fit_points(samples, options).value();
    CHECK(same(points.identity, fit.identity) && same(points.pose, fit.pose));
    std::vector<std::uint8_t> measured(model.n_landmarks(), 1);
    measured[0] = 0;
    targets[0] = 1e6F; // Not looked at.
    CHECK(model.fit_landmarks(targets, measured, options)->report.rms < 0.1F);
    CHECK(model.fit_landmarks(targets, std::vector<std::uint8_t>(measured.size()), options).error() == HAB_EMPTY);
    CHECK(model.fit_landmarks(habitus::span<const float>(targets.data(), 3), options).error() == HAB_DIMENSION_MISMATCH);
    CHECK(model.fit_landmarks(targets, habitus::fit_options().frame(static_cast<habitus::frame>(9))).error() == HAB_BAD_OPTION);
    CHECK(model.fit_landmarks(targets, measured, habitus::fit_options().pose_prior(habitus::prior::gaussian, -1)).error() ==
          HAB_BAD_OPTION);

    const auto form = model.prepare(habitus::mode::identity, fit.identity).value();
    auto tracking = habitus::fit_options(options).with_form(form).track_from(fit);
    const auto tracked = model.fit_landmarks(targets, measured, tracking).value();
    CHECK(tracked.identity.empty() && tracked.pose.size() == pose.size() && tracked.report.rms < 0.1F);

    // start_from takes the weights alone, track_from the placement as well; an empty mode starts at its mean.
    auto elsewhere = fit;
    elsewhere.placement.translation[0] += 5;
    const auto placed = model.fit_landmarks(targets, measured, habitus::fit_options(options).start_from(elsewhere)).value();
    const auto followed = model.fit_landmarks(targets, measured, habitus::fit_options(options).track_from(elsewhere)).value();
    const auto loose = habitus::fit_options(options).start_from(elsewhere).place(false);
    CHECK(placed.report.start_energy < 10 && followed.report.start_energy > 1000 && followed.report.rms < 0.1F);
    CHECK(model.fit_landmarks(targets, measured, loose)->report.start_energy == followed.report.start_energy);
    const auto fixed = habitus::fit_options(options).frame(habitus::frame::fixed).track_from(fit);
    CHECK(same(habitus::model(model).fit_landmarks(targets, measured, fixed)->placement.applied(known), fit.placement.applied(known)));
    habitus::fit_result partial;
    partial.pose = pose;
    CHECK(same(model.fit_landmarks(targets, measured, habitus::fit_options(options).start_from(partial))->identity,
               model.fit_landmarks(targets, measured, options)->identity));

    // In the caller's memory.
    auto found_identity = model.mean(habitus::mode::identity).value();
    auto found_pose = pose;
    habitus::placement place;
    habitus::fit_report report;
    std::vector<float> workspace(model.fit_workspace(options));
    const auto again = model.fit_points(samples, options, found_identity, found_pose, place, report, workspace);
    CHECK(again && same(found_identity, fit.identity) && report.iterations == fit.report.iterations);
    workspace.pop_back();
    CHECK(model.fit_points(samples, options, found_identity, found_pose, place, report, workspace).error() == HAB_WORKSPACE_TOO_SMALL);
}

std::uint32_t word(const std::vector<std::uint8_t>& bytes, std::size_t at) {
    std::uint32_t out = 0;
    for (std::size_t i = 4; i-- > 0;) {
        out = out << 8 | bytes[at + i];
    }
    return out;
}

void set_word(std::vector<std::uint8_t>& bytes, std::size_t at, std::size_t value) {
    for (std::size_t i = 0; i < 4; ++i) {
        bytes[at + i] = static_cast<std::uint8_t>(value >> 8 * i);
    }
}

/// The checksum of docs/model-file.md, of the header and the table.
std::uint32_t checksum(const std::vector<std::uint8_t>& bytes, std::size_t table_end) {
    std::uint32_t sum = UINT32_MAX;
    for (std::size_t at = 0; at < table_end; ++at) {
        if (at >= 60 && at < 64) {
            continue;
        }
        sum ^= bytes[at];
        for (int bit = 0; bit < 8; ++bit) {
            sum = sum >> 1 ^ ((sum & 1) != 0 ? 0xedb88320U : 0U);
        }
    }
    return ~sum;
}

/// A model file without some of its sections.
std::vector<std::uint8_t> without(habitus::span<const std::uint8_t> from, std::uint32_t first, std::uint32_t last) {
    const std::vector<std::uint8_t> whole(from.begin(), from.end());
    std::vector<std::size_t> kept;
    for (std::size_t entry = 64; entry < 64 * (1 + std::size_t{word(whole, 28)}); entry += 64) {
        if (word(whole, entry) < first || word(whole, entry) > last) {
            kept.push_back(entry);
        }
    }
    std::vector<std::uint8_t> out(whole.begin(), whole.begin() + 64);
    for (const std::size_t entry : kept) {
        out.insert(out.end(), whole.data() + entry, whole.data() + entry + 64);
    }
    const std::size_t table_end = out.size();
    for (std::size_t i = 0; i < kept.size(); ++i) {
        const std::size_t at = word(whole, kept[i] + 32), bytes = word(whole, kept[i] + 40);
        set_word(out, 64 * (i + 1) + 32, out.size());
        out.insert(out.end(), whole.data() + at, whole.data() + at + bytes);
        out.resize((out.size() + 63) / 64 * 64);
    }
    set_word(out, 16, out.size());
    set_word(out, 28, kept.size());
    set_word(out, 60, checksum(out, table_end));
    return out;
}

/// Where a fit starts when the file has no statistics.
void no_statistics(const habitus::model_file& whole) {
    const auto identity = whole.mean(habitus::mode::identity).value();
    const auto pose = whole.mean(habitus::mode::pose).value();
    const auto known = whole.evaluate(identity, pose).value();
    std::vector<float> targets;
    for (const std::uint32_t vertex : whole.landmarks().value()) {
        targets.insert(targets.end(), {known[3 * vertex], known[3 * vertex + 1], known[3 * vertex + 2]});
    }
    std::vector<hab_sample> samples;
    for (std::uint32_t vertex = 0; vertex < whole.n_vertices(); vertex += 5) {
        samples.push_back({{vertex, 0, 0}, {1, 0, 0}, {known[3 * vertex], known[3 * vertex + 1], known[3 * vertex + 2]}, {0, 0, 0}, 1});
    }
    // The placement is known: the shape must move.
    auto options = habitus::fit_options().frame(habitus::frame::fixed).place(false);
    options.identity_prior(habitus::prior::none).pose_prior(habitus::prior::none).max_iterations(200);

    const auto poses = habitus::model_file::open(without(whole.bytes(), HAB_SECTION_IDENTITY_MEAN, HAB_SECTION_POSE_PRECISION)).value();
    CHECK(poses.mean(habitus::mode::pose).error() == HAB_UNSUPPORTED && poses.n_poses() > 0);
    CHECK(poses.deviations_from_weights(habitus::mode::pose, pose).error() == HAB_UNSUPPORTED);
    const auto moved = poses.fit_points(samples, options).value();
    CHECK(moved.report.iterations > 0 && moved.report.rms < 0.1F);

    const auto bare = habitus::model_file::open(without(whole.bytes(), HAB_SECTION_IDENTITY_MEAN, HAB_SECTION_POSE_NAMES)).value();
    CHECK(bare.n_poses() == 0 && bare.n_landmarks() == whole.n_landmarks());
    CHECK(bare.fit_points(samples, options).error() == HAB_UNSUPPORTED);
    CHECK(bare.fit_landmarks(targets, options).error() == HAB_UNSUPPORTED);
    habitus::fit_result start;
    start.pose = pose;
    const auto from_start = bare.fit_points(samples, habitus::fit_options(options).start_from(start)).value();
    CHECK(from_start.report.iterations > 0 && from_start.report.rms < 0.1F);
    // With one mode fixed the other may start at zero.
    const auto form = bare.prepare(habitus::mode::identity, identity).value();
    const auto by_form = bare.fit_points(samples, habitus::fit_options(options).with_form(form)).value();
    CHECK(by_form.report.iterations > 0 && by_form.report.rms < 0.01F);
}

/// The example at habitus::fit_options.
void sequence(const habitus::model& model) {
    using namespace habitus;
    const auto identity = model.mean(mode::identity).value();
    std::vector<std::vector<point>> scans;
    for (const float grimace : {0.0F, 0.5F, 1.0F}) {
        std::vector<float> deviations(model.pose_dim());
        deviations.back() = grimace;
        const auto seen = model.evaluate(identity, model.weights_from_deviations(mode::pose, deviations).value()).value();
        std::vector<point> scan;
        for (const std::uint32_t vertex : model.landmarks().value()) {
            scan.push_back({seen[3 * vertex] + 2 * grimace, seen[3 * vertex + 1], seen[3 * vertex + 2] + 300});
        }
        scans.push_back(scan);
    }
    auto now = model.fit_landmarks(scans[0]).value();
    const auto person = model.prepare(mode::identity, now.identity).value();
    for (std::size_t i = 1; i < scans.size(); ++i) {
        const auto options = fit_options().with_form(person).track_from(now);
        now = model.fit_landmarks(scans[i], options).value();
        const auto positions = person.evaluate(now.pose).value();
        const auto drawn = now.placement.applied(positions);
        CHECK(now.identity.empty() && now.report.rms < 1 && drawn.size() == positions.size() && std::abs(drawn[2] - positions[2] - 300) < 5);
    }
}

/// A face by an evaluation, which it does not need.
void evaluation_of_face(const habitus::model& model) {
    const auto identity = model.mean(habitus::mode::identity).value();
    const auto pose = model.mean(habitus::mode::pose).value();
    CHECK(!model.needs_evaluation() && model.kind() == habitus::kind::bilinear && model.n_joints() == 0);
    const auto begun = model.begin(identity, pose, habitus::derivatives::yes).value();
    CHECK(same(begun.positions().value(), model.evaluate(identity, pose).value()));
    CHECK(same(begun.linearise().value().jacobian, model.linearise(identity, pose).value().jacobian));
    CHECK(begun.joint_positions().error() == HAB_UNSUPPORTED && begun.dim() == model.identity_dim() + model.pose_dim());
    CHECK(model.joint(0).error() == HAB_UNSUPPORTED && model.pose_bounds().error() == HAB_UNSUPPORTED);
    habitus::model copy = model;
    CHECK(copy.set_blend(habitus::blend::linear).error() == HAB_WRONG_KIND);
    CHECK(copy.set_joints(habitus::joints::mean).error() == HAB_WRONG_KIND);
    CHECK(copy.set_levels(0, 0).error() == HAB_WRONG_KIND && copy.set_window(0, 1, 0, 1).error() == HAB_WRONG_KIND);
    CHECK(copy.grid().error() == HAB_WRONG_KIND && copy.fit_levels({}).error() == HAB_WRONG_KIND);
}

/// A skinned model.
void body(habitus::model_file& body) {
    using namespace habitus;
    CHECK(body.kind() == kind::skinned && body.needs_evaluation() && body.blend() == blend::linear);
    CHECK(body.joints() == joints::regressed && body.counts().element == HAB_ELEMENT_F32);
    const auto names = body.joint_names().value();
    CHECK(names.size() == body.n_joints() && body.joint_name(0).value() == names[0] && !body.joint_name(body.n_joints()).has_value());
    std::uint32_t weights = 0;
    for (std::uint32_t index = 0; index < body.n_joints(); ++index) {
        const hab_joint joint = body.joint(index).value();
        CHECK((joint.parent == HAB_NO_PARENT) == (index == 0) && joint.first_weight == weights);
        weights += joint.n_weights;
    }
    CHECK(weights == body.pose_dim() && body.joint(body.n_joints()).error() == HAB_INDEX_OUT_OF_RANGE);
    const auto bounds = body.pose_bounds().value();
    std::vector<float> pose(body.pose_dim());
    for (std::size_t i = 0; i < pose.size(); ++i) {
        pose[i] = 0.25F * bounds.first[i] + 0.5F * bounds.second[i];
    }
    std::vector<float> identity(body.identity_dim(), 0.5F);

    auto begun = body.begin(identity, pose).value();
    const auto positions = begun.positions().value();
    CHECK(same(body.evaluate(identity, pose).value(), positions));
    const auto part = body.evaluate_range(identity, pose, 17, 20).value();
    CHECK(same(part, std::vector<float>(positions.begin() + 51, positions.begin() + 111)));
    std::vector<float> memory(positions.size());
    CHECK(body.evaluate(identity, pose, memory).error() == HAB_NEEDS_EVALUATION);
    CHECK(body.evaluate_range(identity, pose, 0, 1, memory).error() == HAB_NEEDS_EVALUATION);
    CHECK(begun.positions_range(1, 1, span<float>(memory.data(), 3)) && memory[0] == positions[3]);
    CHECK(begun.positions(span<float>(memory.data(), 3)).error() == HAB_DIMENSION_MISMATCH);
    const auto joints_there = begun.joint_positions().value();
    CHECK(joints_there.size() == body.n_joints());
    CHECK(begun.linearise().error() == HAB_BAD_OPTION);
    CHECK(body.begin({}, pose).error() == HAB_DIMENSION_MISMATCH && body.evaluate({}, pose).error() == HAB_DIMENSION_MISMATCH);
    CHECK(body.linearise(identity, {}).error() == HAB_DIMENSION_MISMATCH);
    CHECK(!body.linearise(identity, pose).value().jacobian.empty());
    habitus::evaluation moved = std::move(begun);
    CHECK(same(moved.positions().value(), positions) && begun.positions().error() == HAB_NOT_OPENED); // NOLINT: on purpose
    begun = std::move(moved);
    CHECK(same(begun.positions().value(), positions));

    // Forms.
    const auto person = body.prepare(mode::identity, identity).value();
    const auto posed = person.begin(pose, derivatives::yes).value();
    CHECK(same(person.evaluate(pose).value(), positions) && same(posed.positions().value(), positions));
    CHECK(posed.joint_positions().value() == joints_there && posed.dim() == body.pose_dim());
    CHECK(same(person.linearise(pose).value().jacobian, posed.linearise().value().jacobian));
    CHECK(person.evaluate(pose, memory).error() == HAB_NEEDS_EVALUATION && person.evaluate(identity).error() == HAB_DIMENSION_MISMATCH);
    const auto posture = body.prepare(mode::pose, pose).value();
    CHECK(largest_difference(posture.evaluate(identity).value(), positions) < 0.01F);
    CHECK(posture.begin(identity).value().joint_positions().error() == HAB_UNSUPPORTED);

    // Fits from the standard posture; the root joint already turns the body.
    std::vector<point> targets;
    for (const std::uint32_t vertex : body.landmarks().value()) {
        targets.push_back({positions[3 * vertex], positions[3 * vertex + 1], positions[3 * vertex + 2]});
    }
    auto options = fit_options().frame(frame::fixed).place(false).pose_prior(prior::bounds).max_iterations(200);
    CHECK(body.fit_workspace(options) > hab_fit_workspace_bytes(body.identity_dim(), body.pose_dim(), HAB_FRAME_FIXED) / sizeof(float));
    const auto found = body.fit_landmarks(targets, options).value();
    CHECK(found.report.rms < 3);
    for (std::size_t i = 0; i < pose.size(); ++i) {
        CHECK(found.pose[i] >= bounds.first[i] && found.pose[i] <= bounds.second[i]);
    }
    const auto tracked = body.fit_landmarks(targets, fit_options(options).with_form(person)).value();
    CHECK(tracked.identity.empty() && tracked.report.rms < 0.5F);
    CHECK(body.fit_landmarks(targets, fit_options(options).pose_prior(prior::gaussian)).error() == HAB_UNSUPPORTED);

    // Other ways of moving.
    CHECK(body.set_blend(blend::dual_quaternion) && body.blend() == blend::dual_quaternion);
    CHECK(body.set_joints(joints::mean) && body.joints() == joints::mean);
    CHECK(!same(body.evaluate(identity, pose).value(), positions) && same(begun.positions().value(), positions));
    CHECK(body.set_blend(static_cast<blend>(7)).error() == HAB_BAD_OPTION && body.blend() == blend::dual_quaternion);
    CHECK(body.set_blend(blend::linear) && body.set_joints(joints::regressed) && same(body.evaluate(identity, pose).value(), positions));
}

/// A wavelet model, whole and in part.
void wavelet(const habitus::model_file& file) {
    using namespace habitus;
    const std::uint32_t levels = file.grid().value().levels;
    CHECK(file.n_faces() > 0 && file.n_landmarks() > 0 && file.faces().value().size() == 3 * file.n_faces());
    model part = file.view();
    for (const bool window : {false, true}) {
        const auto set = window ? part.set_levels(levels, levels) : part.set_levels(0, 0);
        CHECK(set && (!window || part.set_window(0, 2, 0, 3)));
        CHECK(part.n_vertices() < file.n_vertices() && part.n_faces() == 0 && part.n_landmarks() == 0);
        CHECK(part.faces().value().empty() && part.landmarks().value().empty() && part.landmark_names().value().empty());
        std::vector<std::uint32_t> three(3);
        CHECK(part.faces(three).error() == HAB_DIMENSION_MISMATCH);
        CHECK(part.read(HAB_SECTION_FACES, three).error() == HAB_INDEX_OUT_OF_RANGE);
        CHECK(part.find_section(HAB_SECTION_FACES).value().shape[0] == file.n_faces());
        const auto boxes = fit_options().identity_prior(prior::box).pose_prior(prior::box);
        CHECK(part.fit_landmarks(std::vector<float>(3 * file.n_landmarks()), boxes).error() == HAB_EMPTY);
    }

    // Weights of the base alone, all vertices: the landmarks are there.
    CHECK(part.set_levels(0, levels) && part.n_faces() == file.n_faces() && part.n_landmarks() == file.n_landmarks());
    const auto pose = part.mean(mode::pose).value();
    const auto shape = part.weights_from_deviations(mode::identity, std::vector<float>(part.identity_dim(), 0.75F)).value();
    const auto surface = part.evaluate(shape, pose).value();
    std::vector<point> targets;
    for (const std::uint32_t vertex : part.landmarks().value()) {
        targets.push_back({surface[3 * vertex], surface[3 * vertex + 1], surface[3 * vertex + 2]});
    }
    const auto boxes = fit_options().identity_prior(prior::box).pose_prior(prior::box);
    const auto found = part.fit_landmarks(targets, boxes);
    CHECK(found && found->report.rms < 0.5F);
    const auto refused = part.fit_landmarks(targets).error();
    CHECK(refused == HAB_NEEDS_LEVELS && refused.first() == HAB_SECTION_IDENTITY_PRECISION);
    CHECK(refused.message().find("hab_fit_levels") != std::string::npos);
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 4) {
        std::fprintf(stderr, "usage: wrapper MODEL.hab BODY.hab WAVELET.hab\n");
        return 2;
    }
    views();
    results();
    files(argv[1]);
    if (const auto model = habitus::model_file::read(argv[1])) {
        content(*model);
        weights(*model);
        evaluation(*model);
        fitting(*model);
        no_statistics(*model);
        sequence(*model);
        evaluation_of_face(*model);
    } else {
        ++faults;
        std::printf("%s: %s\n", argv[1], model.error().message().c_str());
    }
    auto opened = habitus::model_file::read(argv[2]);
    CHECK(opened.has_value());
    if (opened) {
        body(*opened);
    }
    const auto grid = habitus::model_file::read(argv[3]);
    CHECK(grid.has_value());
    if (grid) {
        wavelet(*grid);
    }
    CHECK(habitus::library_is_new_enough());
    std::printf("%d checks, %d faults\n", checks, faults);
    return faults == 0 && checks > 0 ? 0 : 1;
}
