// Opens a wavelet model, shows it at every level of detail and through a window, and fits its coarse levels to its own landmarks, moved. The mesh
// that is written is that of the fit.
//
//     wavelet MODEL.hab OUT.obj
#include <habitus.hpp>

#include <algorithm>
#include <fstream>
#include <iomanip>
#include <iostream>

namespace {

/// Levels that a dozen landmarks determine.
constexpr std::uint32_t fitted_levels = 2;

int failed(const char* what, const habitus::error& error) {
    std::cerr << what << ": " << error.message() << '\n';
    return 1;
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

/// The surface of a model at the mean of the training data.
habitus::result<std::vector<float>> mean_surface(const habitus::model& model) {
    const auto identity = model.mean(habitus::mode::identity);
    const auto pose = model.mean(habitus::mode::pose);
    if (!identity || !pose) {
        return !identity ? identity.error() : pose.error();
    }
    return model.evaluate(*identity, *pose);
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 3) {
        std::cerr << "usage: wavelet MODEL.hab OUT.obj\n";
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
    const auto grid = model->grid();
    const auto landmarks = model->landmarks();
    const auto faces = model->faces();
    if (!grid || !landmarks || !faces) {
        return failed(argv[1], !grid ? grid.error() : !landmarks ? landmarks.error() : faces.error());
    }
    std::cout << grid->width << " x " << grid->height << " nodes in " << grid->levels << " levels, " << model->identity_dim() << " + "
              << model->pose_dim() << " weights\n";

    // A view of the model keeps levels of its own: coarse surfaces, and in the end a single node of the finest.
    habitus::model part = model->view();
    std::vector<float> surface;
    for (std::uint32_t level = 0; level <= grid->levels; ++level) {
        if (const auto set = part.set_levels(level, level); !set) {
            return failed("levels", set.error());
        }
        auto found = mean_surface(part);
        if (!found) {
            return failed("evaluate", found.error());
        }
        surface = *std::move(found);
        std::cout << "level " << level << ": " << part.n_vertices() << " vertices\n";
    }
    const std::uint32_t column = grid->width / 2, row = grid->height / 2;
    if (const auto set = part.set_window(column, 1, row, 1); !set) {
        return failed("window", set.error());
    }
    const auto node = mean_surface(part);
    if (!node) {
        return failed("evaluate", node.error());
    }
    const bool same = std::equal(node->begin(), node->end(), surface.begin() + 3 * (row * grid->width + column));
    std::cout << "the node in the middle " << (same ? "is that of" : "differs from") << " its window\n";

    // Landmarks of a person half a standard deviation from the mean in all weights of the base, a quarter turn about z away.
    std::vector<float> deviations(model->identity_dim());
    std::fill_n(deviations.begin(), deviations.size() / grid->n_coefficients * grid->base_width * grid->base_height, 0.5F);
    const auto identity = model->weights_from_deviations(habitus::mode::identity, deviations);
    const auto pose = model->mean(habitus::mode::pose);
    if (!identity || !pose) {
        return failed("weights", !identity ? identity.error() : pose.error());
    }
    const auto person = model->evaluate(*identity, *pose);
    if (!person) {
        return failed("evaluate", person.error());
    }
    std::vector<hab_sample> samples;
    for (const std::uint32_t vertex : *landmarks) {
        const float* p = person->data() + std::size_t{3} * vertex;
        samples.push_back({{vertex, 0, 0}, {1, 0, 0}, {40 - p[1], p[0] - 20, p[2] + 300}, {0, 0, 0}, 1});
    }
    const auto fit = model->fit_levels(samples, habitus::level_options().levels(0, std::min(fitted_levels, grid->levels + 1)));
    if (!fit) {
        return failed("fit", fit.error());
    }
    std::cout << std::fixed << std::setprecision(3) << samples.size() << " landmarks: " << fit->report.rms << " mm, after placing alone "
              << fit->report.start_rms << " mm\n";
    const auto found = model->evaluate(fit->found.identity, fit->found.pose);
    if (!found) {
        return failed("evaluate", found.error());
    }
    if (!write_obj(argv[2], *found, *faces)) {
        std::cerr << argv[2] << ": cannot be written\n";
        return 1;
    }
    return same && fit->report.rms < fit->report.start_rms ? 0 : 1;
}
