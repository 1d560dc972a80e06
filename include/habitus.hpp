// Habitus for C++17: habitus.h with owners, views and results. Header only; exceptions and RTTI may be off.
//
//     auto face = habitus::model_file::read("face.hab");          // result<model_file>
//     if (!face) return complain(face.error().message());
//     auto identity = face->mean(habitus::mode::identity);        // result<std::vector<float>>
//     auto pose = face->mean(habitus::mode::pose);
//     auto positions = face->evaluate(identity.value(), pose.value());    // x y z of each vertex, millimetres
//     auto fit = face->fit_landmarks(targets);                    // result<fit_result>
//
//     auto body = habitus::model_file::read("body.hab").value();
//     auto posed = body.begin(identity, angles).value();          // evaluation: positions, derivatives, joints at these weights
//     auto joints = posed.joint_positions();                      // result<std::vector<habitus::point>>
//
// A call that can fail returns a result: test it, then use `*` and `->`, or ask error(); value() throws where exceptions are on and
// ends the program where they are off. Files compiled with and without exceptions can be linked together. Each call that returns a
// std::vector has a twin that writes to a span of the caller's and allocates nothing. What a call writes is untouched when it fails;
// only the workspace of a fit, which is scratch, may have changed.
//
// evaluate and linearise take models of every kind; those twins of them that allocate nothing answer HAB_NEEDS_EVALUATION for models whose vertices
// share a state (bodies), for which `begin` keeps that state in an evaluation.
//
// A model is a view of its bytes and can be copied freely; model_file owns them. Texts and sections lie in these bytes, so they are not
// handed out by a temporary model_file: give the file a name first. Any number of threads may use one object at the same time, as
// all functions but assignments are const. Millimetres, radians, right-handed, y up, triangles counter-clockwise from outside.
//
// What the numbers mean, and which errors a call returns, is said once: in habitus.h, at the function of the same name.

#ifndef HABITUS_HPP
#define HABITUS_HPP

#include "habitus.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#if defined(__cpp_exceptions) || defined(_CPPUNWIND)
#define HABITUS_EXCEPTIONS_ 1
#include <stdexcept>
#else
#define HABITUS_EXCEPTIONS_ 0
#endif

namespace habitus {

// ---------------------------------------------------------------------------------------------------------------------- views

/// Pointer and length of elements that somebody else owns, as std::span of C++20. Made from arrays, std::array, std::vector, std::span,
/// and any other container with data() and size(); as the argument of a call that only reads, also from `{1, 2, 3}`.
template <class T>
class span {
    template <class Container>
    using data_of = std::remove_pointer_t<decltype(std::declval<Container&>().data())>;
    template <class From>
    using if_converts = std::enable_if_t<std::is_convertible_v<From (*)[], T (*)[]>>;

public:
    using element_type = T;
    using value_type = std::remove_cv_t<T>;

    constexpr span() noexcept = default;
    constexpr span(T* data, std::size_t size) noexcept : data_(data), size_(size) {}
    template <std::size_t N>
    constexpr span(T (&array)[N]) noexcept : data_(array), size_(N) {}
    template <class Container, class = decltype(std::declval<Container&>().size()), class = if_converts<data_of<Container>>>
    constexpr span(Container& container) noexcept : data_(container.data()), size_(container.size()) {}
    /// Of a temporary only elements that are read, as an argument of a call.
    template <class Container, class = decltype(std::declval<const Container&>().size()),
              class = if_converts<data_of<const Container>>, class = std::enable_if_t<std::is_const_v<T>, Container>>
    constexpr span(const Container& container) noexcept : data_(container.data()), size_(container.size()) {}
    /// The elements live until the end of the full expression: for arguments, not for variables.
    template <class Element = T, class = std::enable_if_t<std::is_const_v<Element>>>
    constexpr span(std::initializer_list<value_type> elements) noexcept : span(elements.begin(), elements.size()) {}

    constexpr T* data() const noexcept { return data_; }
    constexpr std::size_t size() const noexcept { return size_; }
    constexpr bool empty() const noexcept { return size_ == 0; }
    constexpr T* begin() const noexcept { return data_; }
    constexpr T* end() const noexcept { return data_ + size_; }
    constexpr T& operator[](std::size_t index) const noexcept { return data_[index]; }
    /// `count` elements from `first` on; both must lie within.
    constexpr span subspan(std::size_t first, std::size_t count) const noexcept { return {data_ + first, count}; }

private:
    T* data_ = nullptr;
    std::size_t size_ = 0;
};

/// x, y, z, millimetres.
using point = std::array<float, 3>;
static_assert(sizeof(point) == 3 * sizeof(float), "points follow each other without gaps");

/// A view of positions that are read: x y z after x y z as floats, or points. Made from whatever a span of either is made of.
class coordinates {
    template <class From>
    using if_floats = std::enable_if_t<std::is_convertible_v<const From&, span<const float>>, int>;
    template <class From>
    using if_points = std::enable_if_t<std::is_convertible_v<const From&, span<const point>>, int>;

public:
    constexpr coordinates() noexcept = default;
    template <class From, if_floats<From> = 0>
    constexpr coordinates(const From& from) noexcept : numbers_(from) {}
    template <class From, if_points<From> = 0, class = void>
    coordinates(const From& from) noexcept {
        const span<const point> points(from);
        numbers_ = {points.empty() ? nullptr : points.data()->data(), 3 * points.size()};
    }

    constexpr const float* data() const noexcept { return numbers_.data(); }
    /// Three for each position.
    constexpr std::size_t size() const noexcept { return numbers_.size(); }
    constexpr const float* begin() const noexcept { return numbers_.begin(); }
    constexpr const float* end() const noexcept { return numbers_.end(); }

private:
    span<const float> numbers_;
};

// -------------------------------------------------------------------------------------------------------------------- errors

/// The code of an error that only this header knows: a file could not be read. first() is the errno.
inline constexpr hab_code file_not_read = -1;

/// Why a call did nothing: a code of habitus.h and its numbers.
class error {
public:
    explicit error(const hab_error_detail& detail) noexcept : detail_(detail) {}
    explicit error(hab_code code, std::uint32_t first = 0, std::uint32_t second = 0, std::uint32_t argument = 0) noexcept
        : detail_{code, first, second, argument} {}

    hab_code code() const noexcept { return detail_.code; }
    /// What they say depends on the code, see habitus.h.
    std::uint32_t first() const noexcept { return detail_.first; }
    std::uint32_t second() const noexcept { return detail_.second; }
    /// Position, from 1, of the argument that the code speaks of in the function of habitus.h; 0 where it speaks of none.
    std::uint32_t argument() const noexcept { return detail_.argument; }
    /// For instance "HAB_NOT_FINITE".
    const char* name() const noexcept { return code() == file_not_read ? "file_not_read" : hab_error_name(code()); }
    /// One line with the numbers.
    std::string message() const {
        if (code() == file_not_read) {
            return "the file cannot be read: " + std::generic_category().message(static_cast<int>(first()));
        }
        std::array<char, 160> text{};
        hab_error_format(&detail_, text.data(), text.size());
        return text.data();
    }

    friend bool operator==(const error& error, hab_code code) noexcept { return error.code() == code; }
    friend bool operator!=(const error& error, hab_code code) noexcept { return error.code() != code; }
    friend bool operator==(hab_code code, const error& error) noexcept { return error.code() == code; }
    friend bool operator!=(hab_code code, const error& error) noexcept { return error.code() != code; }

private:
    hab_error_detail detail_{};
};

#if HABITUS_EXCEPTIONS_
/// What result::value() throws.
class exception : public std::runtime_error {
public:
    explicit exception(const habitus::error& reason) : std::runtime_error(reason.message()), reason_(reason) {}
    const habitus::error& reason() const noexcept { return reason_; }

private:
    habitus::error reason_;
};
#endif

namespace detail {

// What value() does where there is no value. As its template argument it is part of value()'s name for the linker, so that a program some
// of whose files are compiled without exceptions has two functions, not one function with two bodies.
#if HABITUS_EXCEPTIONS_
struct throws {
    [[noreturn]] static void without_value(const error& reason) { throw exception(reason); }
};
using ending = throws;
#else
struct aborts {
    [[noreturn]] static void without_value(const error&) noexcept { std::abort(); }
};
using ending = aborts;
#endif

/// Whether a T owns what its functions hand out views of: a temporary result of it has no operator->.
template <class T>
inline constexpr bool lends_views = false;

} // namespace detail

/// A value, or why there is none; as std::expected of C++23.
template <class T>
class [[nodiscard]] result {
public:
    using value_type = T;

    result(T value) noexcept(std::is_nothrow_move_constructible_v<T>) : value_(std::move(value)), error_(HAB_OK) {}
    result(const habitus::error& reason) noexcept : value_(), error_(reason) {}

    bool has_value() const noexcept { return value_.has_value(); }
    explicit operator bool() const noexcept { return has_value(); }

    /// The value, which must be there.
    T& operator*() & noexcept { return assert(has_value()), *value_; }
    const T& operator*() const& noexcept { return assert(has_value()), *value_; }
    /// Of a temporary by value, so that `for (auto name : *model.landmark_names())` may be written.
    T operator*() && { return assert(has_value()), std::move(*value_); }
    T* operator->() & noexcept { return assert(has_value()), &*value_; }
    const T* operator->() const& noexcept { return assert(has_value()), &*value_; }
    template <class U = T, std::enable_if_t<!detail::lends_views<U>, int> = 0>
    U* operator->() && noexcept {
        return assert(has_value()), &*value_;
    }
    /// A temporary result of a model_file: what it hands out would be gone. Give it a name.
    template <class U = T, std::enable_if_t<detail::lends_views<U>, int> = 0>
    U* operator->() && = delete;

    /// The value; where there is none, throws habitus::exception, or ends the program when exceptions are off.
    template <class Ending = detail::ending>
    T& value() & {
        return has_value() ? *value_ : (Ending::without_value(error_), *value_);
    }
    template <class Ending = detail::ending>
    const T& value() const& {
        return has_value() ? *value_ : (Ending::without_value(error_), *value_);
    }
    template <class Ending = detail::ending>
    T value() && {
        return std::move(has_value() ? *value_ : (Ending::without_value(error_), *value_));
    }
    template <class U>
    T value_or(U&& other) && {
        return has_value() ? std::move(*value_) : static_cast<T>(std::forward<U>(other));
    }

    /// Why there is no value; its code is HAB_OK when there is one.
    const habitus::error& error() const& noexcept { return error_; }
    habitus::error error() && noexcept { return error_; }

private:
    std::optional<T> value_;
    habitus::error error_;
};

/// Success, or why not.
template <>
class [[nodiscard]] result<void> {
public:
    using value_type = void;

    result() noexcept : error_(HAB_OK) {}
    result(const habitus::error& reason) noexcept : error_(reason) {}

    bool has_value() const noexcept { return error_.code() == HAB_OK; }
    explicit operator bool() const noexcept { return has_value(); }
    /// Throws habitus::exception unless the call succeeded, or ends the program when exceptions are off.
    template <class Ending = detail::ending>
    void value() const {
        if (!has_value()) {
            Ending::without_value(error_);
        }
    }
    const habitus::error& error() const& noexcept { return error_; }
    habitus::error error() && noexcept { return error_; }

private:
    habitus::error error_;
};

namespace detail {

/// Runs a C function, which is given the error detail.
template <class Call>
result<void> called(Call call) noexcept {
    hab_error_detail reason{};
    const hab_code code = call(&reason);
    if (code == HAB_OK) {
        return {};
    }
    reason.code = code;
    return error(reason);
}

/// A vector that a call fills.
template <class T, class Fill>
result<std::vector<T>> filled(std::size_t size, Fill fill) {
    std::vector<T> out(size);
    if (const result<void> done = fill(span<T>(out)); !done) {
        return done.error();
    }
    return result<std::vector<T>>(std::move(out));
}

} // namespace detail

// ---------------------------------------------------------------------------------------------------------------- enumerations

/// One of the two groups of weights: who it is, and expression or posture.
enum class mode : std::uint32_t { identity = HAB_MODE_IDENTITY, pose = HAB_MODE_POSE };

/// Whether the checksums of a file's sections are compared when it is opened.
enum class checksums { verify, skip };

/// Which motions a fit seeks beside the weights.
enum class frame : std::uint32_t { fixed = HAB_FRAME_FIXED, rigid = HAB_FRAME_RIGID, similarity = HAB_FRAME_SIMILARITY };

/// What a fit knows of the weights before it sees the data.
enum class prior : std::uint32_t {
    none = HAB_PRIOR_NONE,
    gaussian = HAB_PRIOR_GAUSSIAN,
    box = HAB_PRIOR_BOX,
    bounds = HAB_PRIOR_BOUNDS
};

/// What kind of model it is.
enum class kind : std::uint32_t {
    bilinear = HAB_KIND_BILINEAR,
    linear = HAB_KIND_LINEAR,
    skinned = HAB_KIND_SKINNED,
    wavelet = HAB_KIND_WAVELET
};

/// How a skinned model blends the motions of its joints.
enum class blend : std::uint32_t { linear = HAB_BLEND_LINEAR, dual_quaternion = HAB_BLEND_DUAL_QUATERNION };

/// Whether the joints of a skinned model follow the identity.
enum class joints : std::uint32_t { regressed = HAB_JOINTS_REGRESSED, mean = HAB_JOINTS_MEAN };

/// Which wavelet the coefficients of a model belong to.
enum class wavelet : std::uint32_t { cubic = HAB_WAVELET_CUBIC, bilinear = HAB_WAVELET_BILINEAR };

/// Whether an evaluation will give derivatives, which takes more memory.
enum class derivatives : std::uint32_t { no = 0, yes = 1 };

/// Why a fit stopped.
enum class fit_status : std::uint32_t {
    converged = HAB_STATUS_CONVERGED,
    iteration_limit = HAB_STATUS_ITERATION_LIMIT,
    stalled = HAB_STATUS_STALLED
};

// --------------------------------------------------------------------------------------------------------------------- fitting

/// Where a model stands: takes a point of the model to the frame of the scan. At first where the model is.
struct placement : hab_placement {
    placement() noexcept : hab_placement{1, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}} {}
    placement(const hab_placement& other) noexcept : hab_placement(other) {}

    /// scale * rotation * at + translation.
    [[nodiscard]] point apply(const point& at) const noexcept {
        point to{};
        for (std::size_t row = 0; row < 3; ++row) {
            const float* r = rotation + 3 * row;
            to[row] = scale * (r[0] * at[0] + r[1] * at[1] + r[2] * at[2]) + translation[row];
        }
        return to;
    }
    /// Applies to x y z after x y z, in place.
    void apply(span<float> positions) const noexcept {
        for (std::size_t i = 0; i + 3 <= positions.size(); i += 3) {
            const point to = apply(point{positions[i], positions[i + 1], positions[i + 2]});
            std::copy(to.begin(), to.end(), positions.data() + i);
        }
    }
    /// The positions where the model stands, x y z after x y z.
    [[nodiscard]] std::vector<float> applied(coordinates positions) const {
        std::vector<float> out(positions.begin(), positions.end());
        apply(out);
        return out;
    }
};

/// How a fit ended.
struct fit_report : hab_fit_report {
    fit_report() noexcept : hab_fit_report{} {}
    fit_status why() const noexcept { return static_cast<fit_status>(status); }
    bool converged() const noexcept { return status == HAB_STATUS_CONVERGED; }
};

/// Weights and placement that a fit found. Where a prepared form fixed a mode, its weights are empty: they are those of the form. As the
/// start of a fit, an empty mode stands for the mean.
struct fit_result {
    std::vector<float> identity{};
    std::vector<float> pose{};
    habitus::placement placement{};
    fit_report report{};
};

class prepared;

/// How to fit. The defaults are the library's: they suit landmarks of a face.
///
/// To follow one person through a sequence of scans, fit the first with both modes free, then seek only pose and placement from where they were:
///
///     auto now = model.fit_landmarks(scans[0]).value();
///     const auto person = model.prepare(mode::identity, now.identity).value();
///     for (std::size_t i = 1; i < scans.size(); ++i) {
///         const auto options = fit_options().with_form(person).track_from(now);
///         now = model.fit_landmarks(scans[i], options).value();            // now.identity is empty: it is fixed
///         const auto positions = person.evaluate(now.pose).value();
///         draw(now.placement.applied(positions));
///     }
struct fit_options {
    fit_options() noexcept { hab_fit_options_init(&numbers, sizeof numbers); }

    /// Factors, noise, limits; see hab_fit_options.
    hab_fit_options numbers{};
    /// Start from here instead of from the mean. Must live until the last fit with these options returns.
    const fit_result* start = nullptr;
    /// Keep the mode that is fixed in this form, of all blocks of the model: cheaper. Must live until the last fit with these options returns.
    const prepared* form = nullptr;

    fit_options& frame(habitus::frame motions) noexcept { return numbers.frame = static_cast<std::uint32_t>(motions), *this; }
    /// Whether the first placement is found from the data (as by default) or is the start's.
    fit_options& place(bool from_data) noexcept { return numbers.place = from_data ? 1 : 0, *this; }
    fit_options& identity_prior(prior kind, float factor = 1) noexcept {
        numbers.identity_prior = static_cast<std::uint32_t>(kind);
        return numbers.identity_factor = factor, *this;
    }
    fit_options& pose_prior(prior kind, float factor = 1) noexcept {
        numbers.pose_prior = static_cast<std::uint32_t>(kind);
        return numbers.pose_factor = factor, *this;
    }
    /// Standard deviation of the measured positions per axis, millimetres.
    fit_options& noise(float millimetres) noexcept { return numbers.noise = millimetres, *this; }
    fit_options& max_iterations(std::uint32_t most) noexcept { return numbers.max_iterations = most, *this; }
    /// Start from these weights. The placement is found from the data nevertheless, unless place(false) is set too; see track_from.
    /// Only the address is kept: the result must live until the last fit with these options returns.
    fit_options& start_from(const fit_result& other) noexcept { return start = &other, *this; }
    fit_options& start_from(const fit_result&&) = delete;
    /// Start from these weights and from this placement: for the next scan of a sequence. Only the address is kept, as in start_from.
    fit_options& track_from(const fit_result& previous) noexcept { return start_from(previous).place(false); }
    fit_options& track_from(const fit_result&&) = delete;
    /// Keep the mode that is fixed in a form of all blocks. Only the address is kept: the form must live until the last fit with these
    /// options returns.
    fit_options& with_form(const prepared& other) noexcept { return form = &other, *this; }
    fit_options& with_form(const prepared&&) = delete;
};

/// How to fit a wavelet model level by level. The defaults are the library's: four passes over level 0, as landmarks start a fit.
struct level_options {
    level_options() noexcept { hab_level_options_init(&numbers, sizeof numbers); }

    /// See hab_level_options.
    hab_level_options numbers{};
    /// Start from here instead of from the mean. Must live until the last fit with these options returns.
    const fit_result* start = nullptr;

    level_options& frame(habitus::frame motions) noexcept { return numbers.frame = static_cast<std::uint32_t>(motions), *this; }
    /// Whether weights of a mode are sought, or held.
    level_options& seek(mode of, bool sought) noexcept {
        return (of == mode::identity ? numbers.identity : numbers.pose) = sought ? 1 : 0, *this;
    }
    /// Half the box of each weight in standard deviations.
    level_options& box(float kappa) noexcept { return numbers.kappa = kappa, *this; }
    /// Pull of each weight to its mean, mm^2.
    level_options& pull(float omega) noexcept { return numbers.omega = omega, *this; }
    /// `count` levels from `first` on.
    level_options& levels(std::uint32_t first, std::uint32_t count) noexcept {
        return numbers.first_level = first, numbers.n_levels = count, *this;
    }
    level_options& passes(std::uint32_t of_each) noexcept { return numbers.passes = of_each, *this; }
    /// Only the address is kept: the result must live until the last fit with these options returns.
    level_options& start_from(const fit_result& other) noexcept { return start = &other, *this; }
    level_options& start_from(const fit_result&&) = delete;
};

/// Weights and placement that a fit by levels found.
struct level_result {
    fit_result found{};
    hab_level_report report{};
};

/// Values and derivatives of blocks of vertices; the layout is that of hab_model_linearise.
struct linearisation {
    std::vector<float> values;
    std::vector<float> jacobian;
};

// ----------------------------------------------------------------------------------------------------------------- evaluations

/// A model or a prepared form at some weights; made by their functions begin. Owns its memory; what it reads beside must live as long as it: the bytes of the
/// model file, and the form. Can be moved, not copied; one that was moved from answers HAB_NOT_OPENED.
class evaluation {
public:
    evaluation(evaluation&& other) noexcept { *this = std::move(other); }
    evaluation& operator=(evaluation&& other) noexcept {
        if (this != &other) {
            workspace_ = std::move(other.workspace_);
            n_vertices_ = other.n_vertices_;
            n_blocks_ = other.n_blocks_;
            n_joints_ = other.n_joints_;
            dim_ = other.dim_;
            begun_ = std::exchange(other.begun_, hab_evaluation{});
        }
        return *this;
    }
    evaluation(const evaluation&) = delete;
    evaluation& operator=(const evaluation&) = delete;
    ~evaluation() = default;

    std::uint32_t n_vertices() const noexcept { return n_vertices_; }
    std::uint32_t n_blocks() const noexcept { return n_blocks_; }
    /// Joints of a skinned model; 0 in others, and in forms whose pose is fixed.
    std::uint32_t n_joints() const noexcept { return n_joints_; }
    /// Number of weights that derivatives are taken by.
    std::uint32_t dim() const noexcept { return dim_; }

    /// Positions of all vertices, x y z after x y z, millimetres.
    result<void> positions(span<float> out) const noexcept { return positions_range(0, n_vertices_, out); }
    result<std::vector<float>> positions() const {
        return detail::filled<float>(std::size_t{3} * n_vertices_, [&](span<float> out) { return positions(out); });
    }
    /// Positions of `count` vertices from `first` on. Any split gives the same bits.
    result<void> positions_range(std::uint32_t first, std::uint32_t count, span<float> out) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_evaluation_positions(&begun_, first, count, out.data(), out.size(), reason);
        });
    }
    /// Values and derivatives by every free weight of `count` blocks from `first` on; begun with derivatives::yes.
    result<void> linearise(std::uint32_t first, std::uint32_t count, span<float> values, span<float> jacobian) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_evaluation_linearise(&begun_, first, count, values.data(), values.size(), jacobian.data(), jacobian.size(),
                                            reason);
        });
    }
    /// Of all blocks.
    result<linearisation> linearise() const {
        const std::size_t values = std::size_t{n_blocks_} * 3 * HAB_BLOCK_VERTICES;
        linearisation out{std::vector<float>(values), std::vector<float>(values * dim_)};
        if (const result<void> done = linearise(0, n_blocks_, out.values, out.jacobian); !done) {
            return done.error();
        }
        return result<linearisation>(std::move(out));
    }
    /// Where the joints stand, millimetres.
    result<std::vector<point>> joint_positions() const {
        std::vector<point> out(n_joints_);
        if (const result<void> done = joint_positions(0, out); !done) {
            return done.error();
        }
        return result<std::vector<point>>(std::move(out));
    }
    /// As many from `first` on as `out` has elements.
    result<void> joint_positions(std::uint32_t first, span<point> out) const noexcept {
        float* const numbers = out.empty() ? nullptr : out.data()->data();
        return detail::called([&](hab_error_detail* reason) {
            return hab_evaluation_joint_positions(&begun_, first, static_cast<std::uint32_t>(out.size()), numbers, 3 * out.size(), reason);
        });
    }

    /// For functions of habitus.h.
    const hab_evaluation* c_evaluation() const noexcept { return &begun_; }

private:
    friend class model;
    friend class prepared;
    evaluation() noexcept = default;

    static result<evaluation> begun(const hab_model* model, const hab_prepared* form, span<const float> identity, span<const float> pose,
                                    derivatives wanted) {
        std::size_t bytes = 0;
        const auto number = static_cast<std::uint32_t>(wanted);
        result<void> done = detail::called(
            [&](hab_error_detail* reason) { return hab_evaluation_workspace_bytes(model, form, number, &bytes, reason); });
        evaluation made;
        if (done) {
            made.workspace_.resize(bytes / sizeof(float));
            done = detail::called([&](hab_error_detail* reason) {
                return hab_evaluation_init(model, form, identity.data(), identity.size(), pose.data(), pose.size(), number,
                                           made.workspace_.data(), bytes, &made.begun_, reason);
            });
        }
        if (!done) {
            return done.error();
        }
        made.dim_ = static_cast<std::uint32_t>(identity.size() + pose.size());
        return result<evaluation>(std::move(made));
    }

    hab_evaluation begun_{};
    std::vector<float> workspace_{};
    std::uint32_t n_vertices_ = 0;
    std::uint32_t n_blocks_ = 0;
    std::uint32_t n_joints_ = 0;
    std::uint32_t dim_ = 0;
};

// -------------------------------------------------------------------------------------------------------------- prepared forms

/// A model with the weights of one mode fixed, which costs less per evaluation; made by model::prepare. Owns its memory; that of a skinned model with the identity fixed also reads the
/// bytes of the model file, which must live on, others no longer need the model. Can be moved, not copied; one that was moved from answers HAB_NOT_OPENED.
class prepared {
public:
    prepared(prepared&& other) noexcept { *this = std::move(other); }
    prepared& operator=(prepared&& other) noexcept {
        if (this != &other) {
            workspace_ = std::move(other.workspace_);
            fixed_ = other.fixed_;
            free_dim_ = other.free_dim_;
            n_blocks_ = other.n_blocks_;
            n_vertices_ = other.n_vertices_;
            n_joints_ = other.n_joints_;
            form_ = std::exchange(other.form_, hab_prepared{});
        }
        return *this;
    }
    prepared(const prepared&) = delete;
    prepared& operator=(const prepared&) = delete;
    ~prepared() = default;

    /// The mode whose weights are fixed.
    mode fixed() const noexcept { return fixed_; }
    /// Number of weights of the other mode.
    std::uint32_t free_dim() const noexcept { return free_dim_; }
    std::uint32_t n_vertices() const noexcept { return n_vertices_; }
    std::uint32_t n_blocks() const noexcept { return n_blocks_; }

    /// Positions of all vertices of the form, x y z after x y z; `weights` are those of the mode that is not fixed.
    result<void> evaluate(span<const float> weights, span<float> positions) const noexcept {
        return evaluate_range(weights, 0, n_vertices_, positions);
    }
    result<std::vector<float>> evaluate(span<const float> weights) const {
        return detail::filled<float>(std::size_t{3} * n_vertices_, [&](span<float> out) {
            const result<void> done = evaluate(weights, out);
            if (done.error() != HAB_NEEDS_EVALUATION) {
                return done;
            }
            const result<evaluation> begun = begin(weights);
            return begun ? begun->positions(out) : result<void>(begun.error());
        });
    }
    /// An evaluation at these weights. The form must live as long as the evaluation.
    result<evaluation> begin(span<const float> weights, derivatives wanted = derivatives::no) const& {
        const span<const float> none;
        const bool identity = fixed_ == mode::identity;
        result<evaluation> begun =
            evaluation::begun(nullptr, &form_, identity ? none : weights, identity ? weights : none, wanted);
        if (begun) {
            begun->n_vertices_ = n_vertices_;
            begun->n_blocks_ = n_blocks_;
            begun->n_joints_ = n_joints_;
        }
        return begun;
    }
    result<evaluation> begin(span<const float>, derivatives = derivatives::no) const&& = delete;
    /// Positions of `count` vertices from `first` on.
    result<void> evaluate_range(span<const float> weights, std::uint32_t first, std::uint32_t count,
                                span<float> positions) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_prepared_evaluate(&form_, weights.data(), weights.size(), first, count, positions.data(), positions.size(), reason);
        });
    }
    /// Values and derivatives by the free weights of `count` blocks from `first` on.
    result<void> linearise(span<const float> weights, std::uint32_t first, std::uint32_t count, span<float> values,
                           span<float> jacobian) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_prepared_linearise(&form_, weights.data(), weights.size(), first, count, values.data(), values.size(),
                                          jacobian.data(), jacobian.size(), reason);
        });
    }
    /// Of all blocks.
    result<linearisation> linearise(span<const float> weights) const {
        const std::size_t values = std::size_t{n_blocks_} * 3 * HAB_BLOCK_VERTICES;
        linearisation out{std::vector<float>(values), std::vector<float>(values * free_dim_)};
        result<void> done = linearise(weights, 0, n_blocks_, out.values, out.jacobian);
        if (done.error() == HAB_NEEDS_EVALUATION) {
            const result<evaluation> begun = begin(weights, derivatives::yes);
            done = begun ? begun->linearise(0, n_blocks_, out.values, out.jacobian) : result<void>(begun.error());
        }
        if (!done) {
            return done.error();
        }
        return result<linearisation>(std::move(out));
    }

    /// For functions of habitus.h.
    const hab_prepared* c_form() const noexcept { return &form_; }

private:
    friend class model;
    prepared() noexcept = default;

    hab_prepared form_{};
    std::vector<float> workspace_{};
    mode fixed_ = mode::identity;
    std::uint32_t free_dim_ = 0;
    std::uint32_t n_blocks_ = 0;
    std::uint32_t n_vertices_ = 0;
    std::uint32_t n_joints_ = 0;
};

// ---------------------------------------------------------------------------------------------------------------------- models

class model_file;

/// An opened model: a view of the bytes of a .hab file, which must stay where they are, unchanged, as long as it or a copy of it is used.
class model {
public:
    /// Opens over bytes of any alignment; nothing is copied.
    static result<model> open(span<const std::uint8_t> bytes, checksums sums = checksums::verify) noexcept {
        model opened;
        const auto open = sums == checksums::verify ? hab_model_open : hab_model_open_trusted;
        result<void> done = detail::called(
            [&](hab_error_detail* reason) { return open(bytes.data(), bytes.size(), &opened.model_, reason); });
        if (done) {
            opened.counts_.struct_bytes = sizeof opened.counts_;
            done = detail::called(
                [&](hab_error_detail* reason) { return hab_model_counts(&opened.model_, &opened.counts_, reason); });
        }
        if (!done) {
            return done.error();
        }
        return opened;
    }
    /// The bytes would be gone when the call returns: model_file::open keeps them. Templates, so that `{}` is an empty span.
    template <class Allocator>
    static result<model> open(const std::vector<std::uint8_t, Allocator>&&, checksums = checksums::verify) = delete;
    template <std::size_t N>
    static result<model> open(const std::array<std::uint8_t, N>&&, checksums = checksums::verify) = delete;
    template <std::size_t N>
    static result<model> open(const std::uint8_t (&&)[N], checksums = checksums::verify) = delete;

    model(const model&) noexcept = default;
    model& operator=(const model&) noexcept = default;
    ~model() = default;
    /// A view of a temporary file would outlive its bytes. Keep the model_file, and copy from that.
    model(const model_file&&) = delete;
    model& operator=(const model_file&&) = delete;

    /// All counts at once.
    hab_counts counts() const noexcept { return counts_; }
    std::uint32_t n_vertices() const noexcept { return counts_.n_vertices; }
    std::uint32_t identity_dim() const noexcept { return counts_.identity_dim; }
    std::uint32_t pose_dim() const noexcept { return counts_.pose_dim; }
    std::uint32_t n_faces() const noexcept { return counts_.n_faces; }
    std::uint32_t n_landmarks() const noexcept { return counts_.n_landmarks; }
    std::uint32_t n_poses() const noexcept { return counts_.n_poses; }
    std::uint32_t n_sections() const noexcept { return counts_.n_sections; }
    std::uint32_t n_blocks() const noexcept { return counts_.n_blocks; }
    std::uint32_t n_joints() const noexcept { return counts_.n_joints; }
    habitus::kind kind() const noexcept { return static_cast<habitus::kind>(counts_.kind); }
    /// Whether vertices share a state, so that calls that allocate nothing want an evaluation.
    bool needs_evaluation() const noexcept { return counts_.needs_evaluation != 0; }
    /// Number of weights of a mode.
    std::uint32_t dim(mode of) const noexcept { return of == mode::identity ? identity_dim() : pose_dim(); }

    // What the file holds.

    /// Triangles, three vertices each, counted from 0.
    result<std::vector<std::uint32_t>> faces() const { return all<std::uint32_t>(HAB_SECTION_FACES, std::size_t{3} * n_faces()); }
    /// Writes 3 * n_faces() vertices.
    result<void> faces(span<std::uint32_t> out) const noexcept { return exactly(HAB_SECTION_FACES, std::size_t{3} * n_faces(), out); }
    /// Vertex of each landmark.
    result<std::vector<std::uint32_t>> landmarks() const { return all<std::uint32_t>(HAB_SECTION_LANDMARKS, n_landmarks()); }
    /// Writes n_landmarks() vertices.
    result<void> landmarks(span<std::uint32_t> out) const noexcept { return exactly(HAB_SECTION_LANDMARKS, n_landmarks(), out); }
    /// The text lies within the model's bytes.
    result<std::string_view> landmark_name(std::uint32_t landmark) const noexcept { return text(HAB_SECTION_LANDMARK_NAMES, landmark); }
    result<std::vector<std::string_view>> landmark_names() const { return texts(HAB_SECTION_LANDMARK_NAMES, n_landmarks()); }
    /// Name of a pose of the training data that the file keeps as a starting point.
    result<std::string_view> pose_name(std::uint32_t pose) const noexcept { return text(HAB_SECTION_POSE_NAMES, pose); }
    result<std::vector<std::string_view>> pose_names() const { return texts(HAB_SECTION_POSE_NAMES, n_poses()); }
    /// Pose weights of such a pose.
    result<std::vector<float>> pose_start(std::uint32_t pose) const {
        return detail::filled<float>(pose_dim(), [&](span<float> out) { return pose_start(pose, out); });
    }
    /// Writes pose_dim() weights.
    result<void> pose_start(std::uint32_t pose, span<float> out) const noexcept {
        if (const result<void> fits = sized(pose_dim(), out.size(), read_out); !fits) {
            return fits;
        }
        return read(HAB_SECTION_POSE_STARTS, out, std::size_t{pose} * pose_dim());
    }

    // Of a skinned model.

    /// Parent, weights, axis and position of a joint.
    result<hab_joint> joint(std::uint32_t index) const noexcept {
        hab_joint found{};
        found.struct_bytes = sizeof found;
        const result<void> done =
            detail::called([&](hab_error_detail* reason) { return hab_model_joint(&model_, index, &found, reason); });
        if (!done) {
            return done.error();
        }
        return found;
    }
    /// The text lies within the model's bytes.
    result<std::string_view> joint_name(std::uint32_t index) const noexcept { return text(HAB_SECTION_JOINT_NAMES, index); }
    result<std::vector<std::string_view>> joint_names() const { return texts(HAB_SECTION_JOINT_NAMES, n_joints()); }
    /// Lower and upper bound of each pose weight, radians.
    result<std::pair<std::vector<float>, std::vector<float>>> pose_bounds() const {
        result<std::vector<float>> lower = all<float>(HAB_SECTION_POSE_LOWER, pose_dim());
        if (!lower) {
            return lower.error();
        }
        result<std::vector<float>> upper = all<float>(HAB_SECTION_POSE_UPPER, pose_dim());
        if (!upper) {
            return upper.error();
        }
        return std::pair(*std::move(lower), *std::move(upper));
    }
    habitus::blend blend() const noexcept { return static_cast<habitus::blend>(counts_.blend); }
    habitus::joints joints() const noexcept { return static_cast<habitus::joints>(counts_.joints); }
    /// Blends motions in another way from now on; what was begun or prepared stays as it is.
    result<void> set_blend(habitus::blend how) noexcept {
        return altered([&](hab_error_detail* reason) { return hab_model_set_blend(&model_, static_cast<std::uint32_t>(how), reason); });
    }
    /// Lets joints follow the identity or stay from now on.
    result<void> set_joints(habitus::joints how) noexcept {
        return altered([&](hab_error_detail* reason) { return hab_model_set_joints(&model_, static_cast<std::uint32_t>(how), reason); });
    }

    // Of a wavelet model.

    /// The grid, and which part of it is evaluated.
    result<hab_grid> grid() const noexcept {
        hab_grid found{};
        found.struct_bytes = sizeof found;
        const result<void> done = detail::called([&](hab_error_detail* reason) { return hab_model_grid(&model_, &found, reason); });
        if (!done) {
            return done.error();
        }
        return found;
    }
    /// Weights up to level `detail_level` alone and the surface at level `resolution`, from now on; what was begun or prepared stays as it is. While
    /// the vertices are fewer than the file's, there are no faces and no landmarks: they speak of the whole surface, as a copy from before has it.
    result<void> set_levels(std::uint32_t detail_level, std::uint32_t resolution) noexcept {
        return altered([&](hab_error_detail* reason) { return hab_model_set_levels(&model_, detail_level, resolution, reason); });
    }
    /// A rectangle of nodes alone, from now on; without faces and landmarks, as set_levels.
    result<void> set_window(std::uint32_t first_column, std::uint32_t n_columns, std::uint32_t first_row, std::uint32_t n_rows) noexcept {
        return altered([&](hab_error_detail* reason) {
            return hab_model_set_window(&model_, first_column, n_columns, first_row, n_rows, reason);
        });
    }

    /// Section number `index` of the file.
    result<hab_section> section(std::uint32_t index) const noexcept {
        return a_section([&](hab_section* to, hab_error_detail* reason) { return hab_model_section(&model_, index, to, reason); });
    }
    /// The section with an identifier of hab_section_id; HAB_UNSUPPORTED when there is none.
    result<hab_section> find_section(std::uint32_t id) const noexcept {
        return a_section([&](hab_section* to, hab_error_detail* reason) { return hab_model_find_section(&model_, id, to, reason); });
    }
    /// All sections in their order.
    result<std::vector<hab_section>> sections() const {
        if (const result<void> open = opened(); !open) {
            return open.error();
        }
        std::vector<hab_section> out;
        for (std::uint32_t index = 0; index < n_sections(); ++index) {
            const result<hab_section> found = section(index);
            if (!found) {
                return found.error();
            }
            out.push_back(*found);
        }
        return result<std::vector<hab_section>>(std::move(out));
    }
    /// Integers of a section from element `first` on.
    result<void> read(std::uint32_t section_id, span<std::uint32_t> out, std::size_t first = 0) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_model_read_u32(&model_, section_id, first, out.data(), out.size(), reason);
        });
    }
    /// Reals of a section from element `first` on.
    result<void> read(std::uint32_t section_id, span<float> out, std::size_t first = 0) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_model_read_f32(&model_, section_id, first, out.data(), out.size(), reason);
        });
    }
    /// A line of a text section; the text lies within the model's bytes.
    result<std::string_view> text(std::uint32_t section_id, std::uint32_t line) const noexcept {
        const char* from = nullptr;
        std::size_t bytes = 0;
        const result<void> done = detail::called(
            [&](hab_error_detail* reason) { return hab_model_text(&model_, section_id, line, &from, &bytes, reason); });
        if (!done) {
            return done.error();
        }
        return std::string_view(from, bytes);
    }

    // Weights.

    /// Mean of the training data plus so many standard deviations for each weight.
    result<void> weights_from_deviations(mode of, span<const float> deviations, span<float> weights) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_model_weights(&model_, static_cast<std::uint32_t>(of), deviations.data(), deviations.size(), weights.data(),
                                     weights.size(), reason);
        });
    }
    result<std::vector<float>> weights_from_deviations(mode of, span<const float> deviations) const {
        return detail::filled<float>(dim(of), [&](span<float> out) { return weights_from_deviations(of, deviations, out); });
    }
    /// How many standard deviations each weight is from the mean of the training data: (weight - mean) / scale. `deviations` may be the
    /// memory of `weights`. Errors as hab_model_weights, the arguments counted as there.
    result<void> deviations_from_weights(mode of, span<const float> weights, span<float> deviations) const noexcept {
        const bool identity = of == mode::identity;
        if (!identity && of != mode::pose) {
            return error(HAB_BAD_OPTION, 2);
        }
        const std::uint32_t means = identity ? HAB_SECTION_IDENTITY_MEAN : HAB_SECTION_POSE_MEAN;
        const std::uint32_t scales = identity ? HAB_SECTION_IDENTITY_SCALE : HAB_SECTION_POSE_SCALE;
        float mean = 0;
        float scale = 1;
        const auto read_at = [&](std::size_t at) {
            const result<void> done = read(means, span<float>(&mean, 1), at);
            return done ? read(scales, span<float>(&scale, 1), at) : done;
        };
        for (const result<void>& right : {sized(dim(of), weights.size(), 3), sized(dim(of), deviations.size(), 5), read_at(0)}) {
            if (!right) {
                return right;
            }
        }
        // The bound is that of the library for weights.
        const auto bad = std::find_if(weights.begin(), weights.end(), [](float weight) { return !(std::abs(weight) <= 1e9F); });
        if (bad != weights.end()) {
            return error(HAB_NOT_FINITE, static_cast<std::uint32_t>(bad - weights.begin()));
        }
        for (std::size_t at = 0; at < weights.size(); ++at) {
            if (const result<void> done = read_at(at); !done) {
                return done;
            }
            deviations[at] = (weights[at] - mean) / scale;
        }
        return {};
    }
    result<std::vector<float>> deviations_from_weights(mode of, span<const float> weights) const {
        return detail::filled<float>(dim(of), [&](span<float> out) { return deviations_from_weights(of, weights, out); });
    }
    /// Mean of the training data.
    result<std::vector<float>> mean(mode of) const { return weights_from_deviations(of, std::vector<float>(dim(of))); }

    // Evaluation.

    /// An evaluation at these weights, for models of every kind: several calls share what is computed once. The bytes of the file must live as long as it.
    result<evaluation> begin(span<const float> identity, span<const float> pose, derivatives wanted = derivatives::no) const {
        result<evaluation> begun = evaluation::begun(&model_, nullptr, identity, pose, wanted);
        if (begun) {
            begun->n_vertices_ = n_vertices();
            begun->n_blocks_ = n_blocks();
            begun->n_joints_ = n_joints();
        }
        return begun;
    }
    /// Positions of all vertices, x y z after x y z, millimetres; `positions` has 3 * n_vertices() elements.
    result<void> evaluate(span<const float> identity, span<const float> pose, span<float> positions) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_model_evaluate(&model_, identity.data(), identity.size(), pose.data(), pose.size(), positions.data(),
                                      positions.size(), reason);
        });
    }
    result<std::vector<float>> evaluate(span<const float> identity, span<const float> pose) const {
        return detail::filled<float>(std::size_t{3} * n_vertices(), [&](span<float> out) {
            if (!needs_evaluation()) {
                return evaluate(identity, pose, out);
            }
            const result<evaluation> begun = begin(identity, pose);
            return begun ? begun->positions(out) : result<void>(begun.error());
        });
    }
    /// Positions of `count` vertices from `first` on; `positions` has 3 * count elements. Any split gives the same bits.
    result<void> evaluate_range(span<const float> identity, span<const float> pose, std::uint32_t first, std::uint32_t count,
                                span<float> positions) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_model_evaluate_range(&model_, identity.data(), identity.size(), pose.data(), pose.size(), first, count,
                                            positions.data(), positions.size(), reason);
        });
    }
    result<std::vector<float>> evaluate_range(span<const float> identity, span<const float> pose, std::uint32_t first,
                                              std::uint32_t count) const {
        if (const result<void> open = opened(); !open) {
            return open.error();
        }
        if (const result<void> inside = within(first, count, n_vertices()); !inside) {
            return inside.error();
        }
        return detail::filled<float>(std::size_t{3} * count, [&](span<float> out) {
            if (!needs_evaluation()) {
                return evaluate_range(identity, pose, first, count, out);
            }
            const result<evaluation> begun = begin(identity, pose);
            return begun ? begun->positions_range(first, count, out) : result<void>(begun.error());
        });
    }
    /// Values and derivatives by every weight of `count` blocks of HAB_BLOCK_VERTICES vertices from `first` on; see hab_model_linearise.
    result<void> linearise(span<const float> identity, span<const float> pose, std::uint32_t first, std::uint32_t count,
                           span<float> values, span<float> jacobian) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_model_linearise(&model_, identity.data(), identity.size(), pose.data(), pose.size(), first, count, values.data(),
                                       values.size(), jacobian.data(), jacobian.size(), reason);
        });
    }
    /// Of all blocks.
    result<linearisation> linearise(span<const float> identity, span<const float> pose) const {
        if (needs_evaluation()) {
            const result<evaluation> begun = begin(identity, pose, derivatives::yes);
            return begun ? begun->linearise() : result<linearisation>(begun.error());
        }
        const std::size_t values = std::size_t{n_blocks()} * 3 * HAB_BLOCK_VERTICES;
        linearisation out{std::vector<float>(values), std::vector<float>(values * (identity_dim() + pose_dim()))};
        if (const result<void> done = linearise(identity, pose, 0, n_blocks(), out.values, out.jacobian); !done) {
            return done.error();
        }
        return result<linearisation>(std::move(out));
    }
    /// A form with the weights of one mode fixed.
    result<prepared> prepare(mode fixed, span<const float> weights) const { return prepare(fixed, weights, 0, n_blocks()); }
    /// Of `count` blocks from `first` on: its vertex v is vertex HAB_BLOCK_VERTICES * first + v of the model.
    result<prepared> prepare(mode fixed, span<const float> weights, std::uint32_t first, std::uint32_t count) const {
        std::size_t bytes = 0;
        const auto number = static_cast<std::uint32_t>(fixed);
        result<void> done = detail::called([&](hab_error_detail* reason) {
            return hab_prepared_workspace_bytes(&model_, number, first, count, &bytes, reason);
        });
        prepared made;
        if (done) {
            made.workspace_.resize(bytes / sizeof(float));
            done = detail::called([&](hab_error_detail* reason) {
                return hab_prepared_init(&model_, number, weights.data(), weights.size(), first, count, made.workspace_.data(), bytes,
                                         &made.form_, reason);
            });
        }
        if (!done) {
            return done.error();
        }
        // Of the last block only the vertices that there are; of no block none.
        const std::uint32_t from = std::min(n_vertices(), first * HAB_BLOCK_VERTICES);
        made.fixed_ = fixed;
        made.free_dim_ = fixed == mode::identity ? pose_dim() : identity_dim();
        made.n_blocks_ = count;
        made.n_vertices_ = std::min(count * HAB_BLOCK_VERTICES, n_vertices() - from);
        made.n_joints_ = fixed == mode::identity ? n_joints() : 0;
        return result<prepared>(std::move(made));
    }

    // Fitting.

    // Both start from options.start, or from the mean of the training data. Where there are no statistics, identity weights start at 0, and pose weights of a skinned model, too: that is
    // its standard posture. A bilinear model without statistics starts at the first of its poses; where it has no pose either, HAB_UNSUPPORTED, as with both modes at 0 it does not
    // move, and a fit could not leave the start. With a prepared form zeros do: it is affine in the weights that are left.

    /// Weights and placement from the model's landmarks: `targets` holds x y z of each, in the model's order.
    result<fit_result> fit_landmarks(coordinates targets, const fit_options& options = {}) const {
        return fit_landmarks(targets, span<const std::uint8_t>(), options);
    }
    /// `measured` says for each landmark whether its target counts (not 0) or is missing (0); empty: all count.
    result<fit_result> fit_landmarks(coordinates targets, span<const std::uint8_t> measured, const fit_options& options = {}) const {
        return fitted(options, [&](fit_result& out, span<float> workspace) {
            return fit_landmarks(targets, measured, options, out.identity, out.pose, out.placement, out.report, workspace);
        });
    }
    /// `measured` in braces.
    result<fit_result> fit_landmarks(coordinates targets, std::initializer_list<std::uint8_t> measured,
                                     const fit_options& options = {}) const {
        return fit_landmarks(targets, span<const std::uint8_t>(measured), options);
    }
    /// In the caller's memory: `identity`, `pose` and `place` hold the start and receive the result (options.start is not looked at), and the
    /// workspace has fit_workspace(options) elements.
    result<void> fit_landmarks(coordinates targets, span<const std::uint8_t> measured, const fit_options& options,
                               span<float> identity, span<float> pose, placement& place, fit_report& report,
                               span<float> workspace) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_fit_landmarks(&model_, form_of(options), &options.numbers, targets.data(), targets.size(), measured.data(),
                                     measured.size(), identity.data(), identity.size(), pose.data(), pose.size(), &place,
                                     workspace.data(), workspace.size() * sizeof(float), &report, reason);
        });
    }
    /// Weights and placement from points whose place on the model is known, see hab_sample.
    result<fit_result> fit_points(span<const hab_sample> samples, const fit_options& options = {}) const {
        return fitted(options, [&](fit_result& out, span<float> workspace) {
            return fit_points(samples, options, out.identity, out.pose, out.placement, out.report, workspace);
        });
    }
    /// In the caller's memory, as above.
    result<void> fit_points(span<const hab_sample> samples, const fit_options& options, span<float> identity, span<float> pose,
                            placement& place, fit_report& report, span<float> workspace) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_fit_points(&model_, form_of(options), &options.numbers, samples.data(), samples.size(), identity.data(),
                                  identity.size(), pose.data(), pose.size(), &place, workspace.data(),
                                  workspace.size() * sizeof(float), &report, reason);
        });
    }
    /// Weights of a wavelet model from points on its vertices, level by level.
    result<level_result> fit_levels(span<const hab_sample> samples, const level_options& options = {}) const {
        level_result out;
        for (const mode of : {mode::identity, mode::pose}) {
            std::vector<float>& weights = of == mode::identity ? out.found.identity : out.found.pose;
            if (options.start != nullptr) {
                weights = of == mode::identity ? options.start->identity : options.start->pose;
            }
            if (weights.empty()) {
                result<std::vector<float>> at = mean(of);
                if (!at) {
                    return at.error();
                }
                weights = *std::move(at);
            }
        }
        if (options.start != nullptr) {
            out.found.placement = options.start->placement;
        }
        std::size_t bytes = 0;
        result<void> done = detail::called([&](hab_error_detail* reason) {
            return hab_fit_levels_workspace_bytes(&model_, samples.size(), options.numbers.first_level, options.numbers.n_levels, &bytes,
                                                  reason);
        });
        if (done) {
            std::vector<float> workspace(bytes / sizeof(float));
            done = fit_levels(samples, options, out.found.identity, out.found.pose, out.found.placement, out.report, workspace);
        }
        if (!done) {
            return done.error();
        }
        out.found.report.rms = out.report.rms;
        return result<level_result>(std::move(out));
    }
    /// In the caller's memory, as above; the workspace has hab_fit_levels_workspace_bytes.
    result<void> fit_levels(span<const hab_sample> samples, const level_options& options, span<float> identity, span<float> pose,
                            placement& place, hab_level_report& report, span<float> workspace) const noexcept {
        return detail::called([&](hab_error_detail* reason) {
            return hab_fit_levels(&model_, &options.numbers, samples.data(), samples.size(), identity.data(), identity.size(),
                                  pose.data(), pose.size(), &place, workspace.data(), workspace.size() * sizeof(float), &report, reason);
        });
    }
    /// Elements of workspace that a fit with these options needs.
    std::size_t fit_workspace(const fit_options& options = {}) const noexcept {
        std::size_t bytes = 0;
        const result<void> done = detail::called([&](hab_error_detail* reason) {
            return hab_model_fit_workspace_bytes(&model_, form_of(options), options.numbers.frame, &bytes, reason);
        });
        // What is wrong with them the fit will say.
        return done ? bytes / sizeof(float) : 0;
    }

    /// For functions of habitus.h.
    const hab_model* c_model() const noexcept { return &model_; }

protected:
    model() noexcept = default;
    /// Forgets the bytes: every call answers HAB_NOT_OPENED.
    void close() noexcept {
        model_ = {};
        counts_ = {};
    }

private:
    static const hab_prepared* form_of(const fit_options& options) noexcept {
        return options.form != nullptr ? options.form->c_form() : nullptr;
    }
    /// Changes the model, and what is known of it.
    template <class Change>
    result<void> altered(Change change) noexcept {
        const result<void> done = detail::called(change);
        return done ? detail::called([&](hab_error_detail* reason) { return hab_model_counts(&model_, &counts_, reason); }) : done;
    }
    /// HAB_NOT_OPENED for what was moved from.
    result<void> opened() const noexcept {
        hab_counts counts{};
        counts.struct_bytes = sizeof counts;
        return detail::called([&](hab_error_detail* reason) { return hab_model_counts(&model_, &counts, reason); });
    }
    /// Position of the output of hab_model_read_u32 and hab_model_read_f32.
    static constexpr std::uint32_t read_out = 4;
    result<void> sized(std::size_t expected, std::size_t found, std::uint32_t argument) const noexcept {
        const result<void> open = opened();
        if (!open || expected == found) {
            return open;
        }
        const auto shown = static_cast<std::uint32_t>(found < UINT32_MAX ? found : UINT32_MAX);
        return error(HAB_DIMENSION_MISMATCH, static_cast<std::uint32_t>(expected), shown, argument);
    }
    static result<void> within(std::uint32_t first, std::uint32_t count, std::uint32_t limit) noexcept {
        if (first <= limit && count <= limit - first) {
            return {};
        }
        return error(HAB_INDEX_OUT_OF_RANGE, first <= UINT32_MAX - count ? first + count : UINT32_MAX, limit);
    }
    template <class T>
    result<std::vector<T>> all(std::uint32_t section_id, std::size_t size) const {
        return detail::filled<T>(size, [&](span<T> out) { return read(section_id, out); });
    }
    template <class T>
    result<void> exactly(std::uint32_t section_id, std::size_t size, span<T> out) const noexcept {
        const result<void> fits = sized(size, out.size(), read_out);
        return fits ? read(section_id, out) : fits;
    }
    template <class Find>
    result<hab_section> a_section(Find find) const noexcept {
        hab_section found{};
        found.struct_bytes = sizeof found;
        const result<void> done = detail::called([&](hab_error_detail* reason) { return find(&found, reason); });
        if (!done) {
            return done.error();
        }
        return found;
    }
    result<std::vector<std::string_view>> texts(std::uint32_t section_id, std::uint32_t count) const {
        if (const result<void> open = opened(); !open) {
            return open.error();
        }
        std::vector<std::string_view> out;
        out.reserve(count);
        for (std::uint32_t line = 0; line < count; ++line) {
            const result<std::string_view> found = text(section_id, line);
            if (!found) {
                return found.error();
            }
            out.push_back(*found);
        }
        return result<std::vector<std::string_view>>(std::move(out));
    }
    /// Weights that a fit seeks; those of a fixed mode are none.
    std::pair<std::uint32_t, std::uint32_t> free_dims(const fit_options& options) const noexcept {
        const bool fixes_identity = options.form != nullptr && options.form->fixed() == mode::identity;
        const bool fixes_pose = options.form != nullptr && options.form->fixed() == mode::pose;
        return {fixes_identity ? 0 : identity_dim(), fixes_pose ? 0 : pose_dim()};
    }
    /// Where a fit begins, see there.
    result<std::vector<float>> start_of(mode of, std::uint32_t dim, const fit_options& options) const {
        if (dim == 0) {
            return std::vector<float>();
        }
        if (options.start != nullptr) {
            const std::vector<float>& given = of == mode::identity ? options.start->identity : options.start->pose;
            if (!given.empty()) {
                return given;
            }
        }
        result<std::vector<float>> found = mean(of);
        if (found.error() != HAB_UNSUPPORTED) {
            return found;
        }
        if (of == mode::identity || options.form != nullptr || kind() == habitus::kind::skinned) {
            return std::vector<float>(dim);
        }
        if (n_poses() == 0) {
            return found;
        }
        found = pose_start(0);
        const bool moves = found && std::any_of(found->begin(), found->end(), [](float weight) { return weight != 0; });
        return moves ? found : result<std::vector<float>>(error(HAB_UNSUPPORTED, HAB_SECTION_POSE_MEAN));
    }
    template <class Run>
    result<fit_result> fitted(const fit_options& options, Run run) const {
        const auto [identity_free, pose_free] = free_dims(options);
        result<std::vector<float>> identity = start_of(mode::identity, identity_free, options);
        if (!identity) {
            return identity.error();
        }
        result<std::vector<float>> pose = start_of(mode::pose, pose_free, options);
        if (!pose) {
            return pose.error();
        }
        fit_result out;
        out.identity = *std::move(identity);
        out.pose = *std::move(pose);
        if (options.start != nullptr) {
            out.placement = options.start->placement;
        }
        std::vector<float> workspace(fit_workspace(options));
        if (const result<void> done = run(out, span<float>(workspace)); !done) {
            return done.error();
        }
        return result<fit_result>(std::move(out));
    }

    hab_model model_{};
    hab_counts counts_{};
};

namespace detail {

template <>
inline constexpr bool lends_views<model_file> = true;

} // namespace detail

/// A model with its bytes. Can be moved, not copied; one that was moved from answers HAB_NOT_OPENED. A `model` copied from it, as view() makes
/// one, and the texts and sections that it hands out must not be used after it is gone: a temporary gives none of them.
class model_file : public model {
public:
    /// Takes the bytes of a file.
    static result<model_file> open(std::vector<std::uint8_t> bytes, checksums sums = checksums::verify) noexcept {
        // A vector keeps its elements where they are when it is moved.
        const result<model> opened = model::open(span<const std::uint8_t>(bytes), sums);
        if (!opened) {
            return opened.error();
        }
        return result<model_file>(model_file(*opened, std::move(bytes)));
    }
    /// Reads a file; an error may have the code file_not_read.
    static result<model_file> read(const std::string& path, checksums sums = checksums::verify) {
        const auto unreadable = [] { return error(file_not_read, static_cast<std::uint32_t>(errno != 0 ? errno : EIO)); };
        errno = 0;
        std::ifstream file(path, std::ios::binary | std::ios::ate);
        const std::streamoff size = file ? static_cast<std::streamoff>(file.tellg()) : -1;
        // A folder opens on some systems, and then seems to be as large as can be.
        if (size < 0 || size == std::numeric_limits<std::streamoff>::max()) {
            return unreadable();
        }
        std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
        if (!file.seekg(0).read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size))) {
            return unreadable();
        }
        return open(std::move(bytes), sums);
    }
    using model::read;

    model_file(model_file&& other) noexcept : model(other), bytes_(std::move(other.bytes_)) { other.close(); }
    model_file& operator=(model_file&& other) noexcept {
        if (this != &other) {
            model::operator=(other);
            bytes_ = std::move(other.bytes_);
            other.close();
        }
        return *this;
    }
    model_file(const model_file&) = delete;
    model_file& operator=(const model_file&) = delete;
    ~model_file() = default;

    /// For what keeps or takes a model by value.
    model view() const& noexcept { return *this; }
    span<const std::uint8_t> bytes() const& noexcept { return bytes_; }
    model view() const&& = delete;
    span<const std::uint8_t> bytes() const&& = delete;

    // Those of model that hand out views of the bytes.

    result<std::string_view> landmark_name(std::uint32_t landmark) const& noexcept { return model::landmark_name(landmark); }
    result<std::vector<std::string_view>> landmark_names() const& { return model::landmark_names(); }
    result<std::string_view> pose_name(std::uint32_t pose) const& noexcept { return model::pose_name(pose); }
    result<std::string_view> joint_name(std::uint32_t index) const& noexcept { return model::joint_name(index); }
    result<std::vector<std::string_view>> joint_names() const& { return model::joint_names(); }
    result<std::vector<std::string_view>> pose_names() const& { return model::pose_names(); }
    result<hab_section> section(std::uint32_t index) const& noexcept { return model::section(index); }
    result<hab_section> find_section(std::uint32_t id) const& noexcept { return model::find_section(id); }
    result<std::vector<hab_section>> sections() const& { return model::sections(); }
    result<std::string_view> text(std::uint32_t section_id, std::uint32_t line) const& noexcept { return model::text(section_id, line); }
    result<std::string_view> landmark_name(std::uint32_t) const&& = delete;
    result<std::vector<std::string_view>> landmark_names() const&& = delete;
    result<std::string_view> pose_name(std::uint32_t) const&& = delete;
    result<std::string_view> joint_name(std::uint32_t) const&& = delete;
    result<std::vector<std::string_view>> joint_names() const&& = delete;
    result<std::vector<std::string_view>> pose_names() const&& = delete;
    result<hab_section> section(std::uint32_t) const&& = delete;
    result<hab_section> find_section(std::uint32_t) const&& = delete;
    result<std::vector<hab_section>> sections() const&& = delete;
    result<std::string_view> text(std::uint32_t, std::uint32_t) const&& = delete;

    // An evaluation reads the bytes; so does the form of a skinned model.

    result<evaluation> begin(span<const float> identity, span<const float> pose, derivatives wanted = derivatives::no) const& {
        return model::begin(identity, pose, wanted);
    }
    result<evaluation> begin(span<const float>, span<const float>, derivatives = derivatives::no) const&& = delete;

private:
    model_file(const model& opened, std::vector<std::uint8_t>&& bytes) noexcept : model(opened), bytes_(std::move(bytes)) {}

    std::vector<std::uint8_t> bytes_;
};

/// Whether the library that runs is new enough for the header that the program was compiled with.
inline bool library_is_new_enough() noexcept { return hab_abi_version() >= HAB_ABI_VERSION; }

} // namespace habitus

#undef HABITUS_EXCEPTIONS_

#endif // HABITUS_HPP
