// Opens a model, shapes a face with it, looks at that face from elsewhere, finds it again from its landmarks alone, and follows a
// change of expression.
//
//     face MODEL.hab OUT.obj
#include <habitus.hpp>

#include <cmath>
#include <fstream>
#include <iomanip>
#include <iostream>

namespace {

int failed(const char* what, const habitus::error& error) {
    std::cerr << what << ": " << error.message() << '\n';
    return 1;
}

/// The model's landmarks on a mesh, seen from a placement.
std::vector<float> seen_landmarks(const std::vector<std::uint32_t>& landmarks, const std::vector<float>& positions,
                                  const habitus::placement& from) {
    std::vector<float> targets;
    for (const std::uint32_t vertex : landmarks) {
        const std::size_t at = std::size_t{3} * vertex;
        const habitus::point seen = from.apply({positions[at], positions[at + 1], positions[at + 2]});
        targets.insert(targets.end(), seen.begin(), seen.end());
    }
    return targets;
}

/// Root of the mean squared distance of two meshes' vertices.
double distance(const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        sum += std::pow(double{a[i]} - double{b[i]}, 2);
    }
    return std::sqrt(3 * sum / static_cast<double>(a.size()));
}

bool write_obj(const char* path, const std::vector<float>& positions, const std::vector<std::uint32_t>& faces) {
    std::ofstream file(path);
    file << std::fixed << std::setprecision(4);
    for (std::size_t i = 0; i < positions.size(); i += 3) {
        file << "v " << positions[i] << ' ' << positions[i + 1] << ' ' << positions[i + 2] << '\n';
    }
    for (std::size_t i = 0; i < faces.size(); i += 3) {
        file << "f " << faces[i] + 1 << ' ' << faces[i + 1] + 1 << ' ' << faces[i + 2] + 1 << '\n';
    }
    return static_cast<bool>(file.flush());
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 3) {
        std::cerr << "usage: face MODEL.hab OUT.obj\n";
        return 2;
    }
    if (!habitus::library_is_new_enough()) {
        std::cerr << "the library is older than the header this program was compiled with\n";
        return 1;
    }
    const auto model = habitus::model_file::read(argv[1]);
    if (!model) {
        return failed(argv[1], model.error());
    }
    std::cout << model->n_vertices() << " vertices, " << model->n_faces() << " triangles, " << model->identity_dim()
              << " identity weights, " << model->pose_dim() << " pose weights, " << model->n_landmarks() << " landmarks\n";

    // A face: one and a half standard deviations along the second identity weight (the first hardly varies), the mean pose.
    std::vector<float> deviations(model->identity_dim());
    deviations[deviations.size() > 1 ? 1 : 0] = 1.5F;
    const auto identity = model->weights_from_deviations(habitus::mode::identity, deviations);
    const auto pose = model->mean(habitus::mode::pose);
    const auto landmarks = model->landmarks();
    const auto faces = model->faces();
    if (!identity || !pose || !landmarks || !faces) {
        return failed(argv[1], !identity ? identity.error() : !pose ? pose.error() : !landmarks ? landmarks.error() : faces.error());
    }
    const auto known = model->evaluate(*identity, *pose);
    if (!known) {
        return failed("evaluate", known.error());
    }

    // Seen from elsewhere: turned by 30 degrees about y, 40 cm away.
    const float c = 0.8660254F;
    const float s = 0.5F;
    const habitus::placement elsewhere(hab_placement{1, {c, 0, s, 0, 1, 0, -s, 0, c}, {25, -10, 400}});
    const auto fit = model->fit_landmarks(seen_landmarks(*landmarks, *known, elsewhere), habitus::fit_options().noise(0.2F));
    if (!fit) {
        return failed("fit", fit.error());
    }
    std::cout << std::fixed << std::setprecision(3) << "fit: " << fit->report.rms << " mm over " << landmarks->size()
              << " landmarks after " << fit->report.iterations << " iterations, "
              << (fit->report.converged() ? "converged" : "not converged") << '\n';

    // The face that was found, where it was seen; and how far it is from the one that was looked at, over all vertices.
    auto found = model->evaluate(fit->identity, fit->pose);
    if (!found) {
        return failed("evaluate", found.error());
    }
    auto there = *known;
    elsewhere.apply(there);
    fit->placement.apply(*found);
    std::cout << "mesh: " << distance(*found, there) << " mm from the known face\n";

    // The same person pulls a face: with the identity fixed only pose and placement are sought, from where they were.
    const auto form = model->prepare(habitus::mode::identity, fit->identity);
    if (!form) {
        return failed("prepare", form.error());
    }
    auto grimace = *pose;
    grimace[grimace.size() > 1 ? 1 : 0] += 0.1F;
    const auto next = model->evaluate(*identity, grimace);
    if (!next) {
        return failed("evaluate", next.error());
    }
    const auto options = habitus::fit_options().noise(0.2F).with_form(*form).track_from(*fit);
    const auto tracked = model->fit_landmarks(seen_landmarks(*landmarks, *next, elsewhere), options);
    if (!tracked) {
        return failed("track", tracked.error());
    }
    std::cout << "next picture: " << tracked->report.rms << " mm after " << tracked->report.iterations << " iterations\n";

    if (!write_obj(argv[2], *found, *faces)) {
        std::cerr << argv[2] << ": cannot be written\n";
        return 1;
    }
    return 0;
}
