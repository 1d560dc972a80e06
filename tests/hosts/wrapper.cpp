// habitus.hpp: its views, results and owners, and that it hands everything through to habitus.h.
//
//     wrapper MODEL.hab
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
static_assert(!std::is_convertible_v<const std::vector<float>&, habitus::span<float>>);
static_assert(!std::is_convertible_v<std::vector<float>&&, habitus::span<float>>);
static_assert(!std::is_convertible_v<std::vector<double>&, habitus::span<const float>>);
static_assert(std::is_convertible_v<habitus::span<float>, habitus::span<const float>>);
static_assert(std::is_convertible_v<std::array<float, 3>&, habitus::span<float>>);
static_assert(sizeof(habitus::span<float>) == 2 * sizeof(void*));
static_assert(sizeof(habitus::placement) == sizeof(hab_placement) && sizeof(habitus::fit_report) == sizeof(hab_fit_report));

std::size_t length(habitus::span<const float> view) { return view.size(); }

void views() {
    float array[3] = {1, 2, 3};
    std::array<float, 4> fixed{};
    std::vector<float> vector(5);
    const std::vector<float> constant(6);
    CHECK(length(array) == 3 && length(fixed) == 4 && length(vector) == 5 && length(constant) == 6 && length({}) == 0);
    CHECK(length({array, 2}) == 2 && length(std::vector<float>(7)) == 7);
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
    CHECK(first.evaluate(identity, pose, {}).error() == HAB_NOT_OPENED && first.n_vertices() == 0); // NOLINT: moved from on purpose
    first = std::move(second);
    CHECK(same(first.evaluate(identity, pose).value(), before));
    const habitus::model view = first;
    CHECK(same(view.evaluate(identity, pose).value(), before));
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
    CHECK(model.landmarks(short_by_one).error() == HAB_DIMENSION_MISMATCH);
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

void evaluation(const habitus::model& model) {
    std::vector<float> deviations(model.identity_dim(), 0.5F);
    const auto identity = model.weights_from_deviations(habitus::mode::identity, deviations).value();
    const auto pose = model.mean(habitus::mode::pose).value();
    const auto all = model.evaluate(identity, pose).value();
    CHECK(all.size() == 3U * model.n_vertices());
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

void fitting(const habitus::model& model) {
    std::vector<float> deviations(model.identity_dim());
    deviations[0] = 1;
    const auto identity = model.weights_from_deviations(habitus::mode::identity, deviations).value();
    const auto pose = model.mean(habitus::mode::pose).value();
    const auto known = model.evaluate(identity, pose).value();
    const habitus::placement seen(hab_placement{1, {0, 0, 1, 0, 1, 0, -1, 0, 0}, {10, 20, 300}});
    CHECK((seen.apply(habitus::point{1, 2, 3}) == habitus::point{13, 22, 299}));
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
    auto tracking = habitus::fit_options(options).with_form(form).start_from(fit).place(false);
    const auto tracked = model.fit_landmarks(targets, measured, tracking).value();
    CHECK(tracked.identity.empty() && tracked.pose.size() == pose.size() && tracked.report.rms < 0.1F);

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

} // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: wrapper MODEL.hab\n");
        return 2;
    }
    views();
    results();
    files(argv[1]);
    if (const auto model = habitus::model_file::read(argv[1])) {
        content(*model);
        evaluation(*model);
        fitting(*model);
    } else {
        ++faults;
        std::printf("%s: %s\n", argv[1], model.error().message().c_str());
    }
    CHECK(habitus::library_is_new_enough());
    std::printf("%d checks, %d faults\n", checks, faults);
    return faults == 0 && checks > 0 ? 0 : 1;
}
