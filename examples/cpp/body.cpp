// Opens a body, gives it a shape and a posture, says where its joints went, finds the posture again from landmarks alone, and writes the mesh.
//
//     body MODEL.hab OUT.obj
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
        std::cerr << "usage: body MODEL.hab OUT.obj\n";
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
    if (model->kind() != habitus::kind::skinned) {
        std::cerr << argv[1] << ": no body\n";
        return 1;
    }
    std::cout << model->n_vertices() << " vertices, " << model->n_faces() << " triangles, " << model->identity_dim()
              << " identity weights, " << model->pose_dim() << " angles, " << model->n_joints() << " joints\n";

    // A person: one and a half standard deviations along the first identity weight.
    std::vector<float> deviations(model->identity_dim());
    deviations[0] = 1.5F;
    const auto identity = model->weights_from_deviations(habitus::mode::identity, deviations);
    const auto bounds = model->pose_bounds();
    const auto landmarks = model->landmarks();
    const auto faces = model->faces();
    if (!identity || !bounds || !landmarks || !faces) {
        return failed(argv[1], !identity ? identity.error() : !bounds ? bounds.error() : !landmarks ? landmarks.error() : faces.error());
    }
    // A posture: each angle a third of the way from the standard posture to its upper bound.
    std::vector<float> pose = bounds->second;
    for (float& angle : pose) {
        angle /= 3;
    }

    // What all vertices share is computed once; then vertices and joints come from it.
    const auto posed = model->begin(*identity, pose);
    if (!posed) {
        return failed("begin", posed.error());
    }
    const auto positions = posed->positions();
    const auto joints = posed->joint_positions();
    if (!positions || !joints) {
        return failed("evaluate", !positions ? positions.error() : joints.error());
    }
    std::cout << std::fixed << std::setprecision(1);
    for (std::uint32_t index = 0; index < model->n_joints(); ++index) {
        const auto joint = model->joint(index);
        if (!joint) {
            return failed("joint", joint.error());
        }
        const habitus::point& to = (*joints)[index];
        // A file need not have names.
        std::cout << "joint " << index << ' ' << model->joint_name(index).value_or("") << ", " << joint->n_weights << " angles, from "
                  << joint->position[0] << ' ' << joint->position[1] << ' ' << joint->position[2] << " to " << to[0] << ' ' << to[1] << ' '
                  << to[2] << '\n';
    }

    // The posture from the landmarks, within the bounds of the angles: the identity stays, and the root joint turns the body.
    std::vector<habitus::point> targets;
    for (const std::uint32_t vertex : *landmarks) {
        const std::size_t at = std::size_t{3} * vertex;
        targets.push_back({(*positions)[at], (*positions)[at + 1], (*positions)[at + 2]});
    }
    const auto person = model->prepare(habitus::mode::identity, *identity);
    if (!person) {
        return failed("prepare", person.error());
    }
    const auto options = habitus::fit_options().frame(habitus::frame::fixed).place(false).with_form(*person).pose_prior(
        habitus::prior::bounds).max_iterations(200);
    const auto fit = model->fit_landmarks(targets, options);
    if (!fit) {
        return failed("fit", fit.error());
    }
    const auto found = person->evaluate(fit->pose);
    if (!found) {
        return failed("evaluate", found.error());
    }
    std::cout << std::setprecision(3) << "mesh: " << distance(*found, *positions) << " mm from the known body after " << fit->report.iterations
              << " iterations\n";

    if (!write_obj(argv[2], *positions, *faces)) {
        std::cerr << argv[2] << ": cannot be written\n";
        return 1;
    }
    return 0;
}
