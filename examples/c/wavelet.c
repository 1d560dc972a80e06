/* Opens a wavelet model, shows it at every level of detail and through a window, and fits its coarse levels to its own landmarks, moved.
 *
 *     wavelet MODEL.hab OUT.obj
 *
 * The mesh that is written is that of the fit. The library allocates nothing; here the file, the weights, the mesh and the workspaces are
 * allocated, their sizes being those of the model. */
#include <habitus.h>

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

/* Landmarks that are fitted to, and levels: those that a dozen landmarks determine. */
#define MAX_LANDMARKS 100
#define FITTED_LEVELS 2

/* Memory of the program, released at its end. */
typedef struct memory {
    uint8_t *file;
    float *identity, *pose, *positions, *workspace;
    uint32_t *faces;
} memory;

/* Prints why a call failed. */
static int failed(const char *what, const hab_error_detail *detail) {
    char line[160];
    hab_error_format(detail, line, sizeof line);
    fprintf(stderr, "%s: %s\n", what, line);
    return EXIT_FAILURE;
}

/* The bytes of a file, to be freed; null when it cannot be read. */
static uint8_t *file_bytes(const char *path, size_t *len) {
    uint8_t *bytes = NULL;
    long size = -1;
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return NULL;
    }
    if (fseek(file, 0, SEEK_END) == 0 && (size = ftell(file)) > 0 && fseek(file, 0, SEEK_SET) == 0) {
        bytes = malloc((size_t)size);
    }
    if (bytes != NULL && fread(bytes, 1, (size_t)size, file) != (size_t)size) {
        free(bytes);
        bytes = NULL;
    }
    fclose(file);
    *len = bytes == NULL ? 0 : (size_t)size;
    return bytes;
}

/* Writes a mesh; 0 when it cannot. */
static int write_obj(const char *path, const float *positions, uint32_t n_vertices, const uint32_t *faces, uint32_t n_faces) {
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        return 0;
    }
    for (size_t v = 0; v < n_vertices; v++) {
        const float *p = positions + 3 * v;
        fprintf(file, "v %.4f %.4f %.4f\n", (double)p[0], (double)p[1], (double)p[2]);
    }
    for (size_t f = 0; f < n_faces; f++) {
        const uint32_t *face = faces + 3 * f;
        fprintf(file, "f %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", face[0] + 1, face[1] + 1, face[2] + 1);
    }
    const int sound = !ferror(file);
    return (fclose(file) == 0) && sound;
}

/* Positions of all vertices of a model at the levels and in the window that it has; the weights are a prefix of those of all levels. */
static int evaluated(const hab_model *model, memory *m, uint32_t *n_vertices) {
    hab_error_detail detail;
    hab_counts counts = {0};
    size_t bytes;
    counts.struct_bytes = sizeof counts;
    if (hab_model_counts(model, &counts, &detail) != HAB_OK ||
        hab_evaluation_workspace_bytes(model, NULL, 0, &bytes, &detail) != HAB_OK) {
        return failed("counts", &detail);
    }
    free(m->workspace);
    m->workspace = malloc(bytes);
    if (m->workspace == NULL) {
        fprintf(stderr, "out of memory\n");
        return EXIT_FAILURE;
    }
    hab_evaluation evaluation;
    if (hab_evaluation_init(model, NULL, m->identity, counts.identity_dim, m->pose, counts.pose_dim, 0, m->workspace, bytes, &evaluation,
                            &detail) != HAB_OK) {
        return failed("begin", &detail);
    }
    *n_vertices = counts.n_vertices;
    if (hab_evaluation_positions(&evaluation, 0, counts.n_vertices, m->positions, 3 * (size_t)counts.n_vertices, &detail) != HAB_OK) {
        return failed("positions", &detail);
    }
    return EXIT_SUCCESS;
}

/* The surface at every level, and one node of the finest through a window: the same bits for a little memory. */
static int levels_and_window(const hab_model *model, const hab_grid *grid, memory *m) {
    hab_error_detail detail;
    hab_model part = *model;
    uint32_t n_vertices;
    float node[3] = {0};
    for (uint32_t level = 0; level <= grid->levels; level++) {
        if (hab_model_set_levels(&part, level, level, &detail) != HAB_OK) {
            return failed("levels", &detail);
        }
        if (evaluated(&part, m, &n_vertices) != EXIT_SUCCESS) {
            return EXIT_FAILURE;
        }
        printf("level %" PRIu32 ": %" PRIu32 " vertices\n", level, n_vertices);
    }
    const uint32_t column = grid->width / 2, row = grid->height / 2;
    for (size_t axis = 0; axis < 3; axis++) {
        node[axis] = m->positions[3 * ((size_t)row * grid->width + column) + axis];
    }
    if (hab_model_set_window(&part, column, 1, row, 1, &detail) != HAB_OK) {
        return failed("window", &detail);
    }
    if (evaluated(&part, m, &n_vertices) != EXIT_SUCCESS) {
        return EXIT_FAILURE;
    }
    const int same = n_vertices == 1 && node[0] == m->positions[0] && node[1] == m->positions[1] && node[2] == m->positions[2];
    printf("the node in the middle %s its window\n", same ? "is that of" : "differs from");
    return same ? EXIT_SUCCESS : EXIT_FAILURE;
}

/* Fits the coarse levels to landmarks of another shape of the model, which has moved, and leaves the positions of the fit. */
static int fit(const hab_model *model, const hab_counts *counts, const hab_grid *grid, memory *m) {
    static uint32_t landmarks[MAX_LANDMARKS];
    static hab_sample samples[MAX_LANDMARKS];
    const size_t n = counts->n_landmarks;
    hab_error_detail detail;
    hab_level_options options;
    hab_level_report report;
    hab_placement placement;
    uint32_t n_vertices;
    size_t bytes;
    if (hab_model_read_u32(model, HAB_SECTION_LANDMARKS, 0, landmarks, n, &detail) != HAB_OK) {
        return failed("landmarks", &detail);
    }
    /* The weights of the base half a standard deviation from their means: by the scales, which hab_model_weights knows. */
    for (size_t i = 0; i < counts->identity_dim; i++) {
        m->positions[i] = i < counts->identity_dim / grid->n_coefficients * grid->base_width * grid->base_height ? 0.5F : 0.0F;
    }
    if (hab_model_weights(model, HAB_MODE_IDENTITY, m->positions, counts->identity_dim, m->identity, counts->identity_dim, &detail) != HAB_OK) {
        return failed("weights", &detail);
    }
    if (evaluated(model, m, &n_vertices) != EXIT_SUCCESS) {
        return EXIT_FAILURE;
    }
    for (size_t k = 0; k < n; k++) {
        const float *p = m->positions + 3 * (size_t)landmarks[k];
        hab_sample sample = {{0}, {1, 0, 0}, {0}, {0}, 1};
        sample.vertices[0] = landmarks[k];
        /* A quarter turn about z. */
        sample.target[0] = 40 - p[1];
        sample.target[1] = p[0] - 20;
        sample.target[2] = p[2] + 300;
        samples[k] = sample;
    }
    for (size_t i = 0; i < counts->identity_dim; i++) {
        m->positions[i] = 0;
    }
    if (hab_model_weights(model, HAB_MODE_IDENTITY, m->positions, counts->identity_dim, m->identity, counts->identity_dim, &detail) != HAB_OK ||
        hab_level_options_init(&options, sizeof options) != HAB_OK) {
        return failed("start", &detail);
    }
    options.n_levels = grid->levels + 1 < FITTED_LEVELS ? grid->levels + 1 : FITTED_LEVELS;
    if (hab_fit_levels_workspace_bytes(model, n, options.first_level, options.n_levels, &bytes, &detail) != HAB_OK) {
        return failed("workspace", &detail);
    }
    free(m->workspace);
    m->workspace = malloc(bytes);
    if (m->workspace == NULL) {
        fprintf(stderr, "out of memory\n");
        return EXIT_FAILURE;
    }
    if (hab_fit_levels(model, &options, samples, n, m->identity, counts->identity_dim, m->pose, counts->pose_dim, &placement, m->workspace, bytes,
                       &report, &detail) != HAB_OK) {
        return failed("fit", &detail);
    }
    printf("%zu landmarks: %.3f mm, after placing alone %.3f mm\n", n, (double)report.rms, (double)report.start_rms);
    return report.rms < report.start_rms ? evaluated(model, m, &n_vertices) : EXIT_FAILURE;
}

/* With the model and its memory: the rest of the program. */
static int run(const hab_model *model, const hab_counts *counts, memory *m, const char *obj) {
    hab_error_detail detail;
    hab_grid grid;
    grid.struct_bytes = sizeof grid;
    if (hab_model_grid(model, &grid, &detail) != HAB_OK) {
        return failed("grid", &detail);
    }
    printf("%" PRIu32 " x %" PRIu32 " nodes in %" PRIu32 " levels, %" PRIu32 " + %" PRIu32 " weights\n", grid.width, grid.height, grid.levels,
           counts->identity_dim, counts->pose_dim);
    /* The means of the training data. */
    for (size_t i = 0; i < counts->pose_dim || i < counts->identity_dim; i++) {
        m->positions[i] = 0;
    }
    if (hab_model_weights(model, HAB_MODE_IDENTITY, m->positions, counts->identity_dim, m->identity, counts->identity_dim, &detail) != HAB_OK ||
        hab_model_weights(model, HAB_MODE_POSE, m->positions, counts->pose_dim, m->pose, counts->pose_dim, &detail) != HAB_OK) {
        return failed("means", &detail);
    }
    if (levels_and_window(model, &grid, m) != EXIT_SUCCESS || fit(model, counts, &grid, m) != EXIT_SUCCESS) {
        return EXIT_FAILURE;
    }
    if (hab_model_read_u32(model, HAB_SECTION_FACES, 0, m->faces, 3 * (size_t)counts->n_faces, &detail) != HAB_OK) {
        return failed("faces", &detail);
    }
    if (!write_obj(obj, m->positions, counts->n_vertices, m->faces, counts->n_faces)) {
        fprintf(stderr, "%s: cannot be written\n", obj);
        return EXIT_FAILURE;
    }
    return EXIT_SUCCESS;
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: %s MODEL.hab OUT.obj\n", argc > 0 ? argv[0] : "wavelet");
        return 2;
    }
    if (hab_abi_version() < HAB_ABI_VERSION) {
        fprintf(stderr, "the library is older than the header this program was compiled with\n");
        return EXIT_FAILURE;
    }
    size_t len;
    memory m = {0};
    hab_model model;
    hab_counts counts = {0};
    counts.struct_bytes = sizeof counts;
    hab_error_detail detail;
    int status = EXIT_FAILURE;
    m.file = file_bytes(argv[1], &len);
    if (m.file == NULL) {
        fprintf(stderr, "%s: cannot be read\n", argv[1]);
        return EXIT_FAILURE;
    }
    if (hab_model_open(m.file, len, &model, &detail) != HAB_OK || hab_model_counts(&model, &counts, &detail) != HAB_OK) {
        failed(argv[1], &detail);
    } else if (counts.kind != HAB_KIND_WAVELET || counts.n_landmarks < 3 || counts.n_landmarks > MAX_LANDMARKS) {
        fprintf(stderr, "%s: no wavelet model with landmarks\n", argv[1]);
    } else {
        /* The positions also hold deviations of the weights. */
        size_t most = 3 * (size_t)counts.n_vertices;
        most = most > counts.identity_dim ? most : counts.identity_dim;
        most = most > counts.pose_dim ? most : counts.pose_dim;
        m.identity = malloc(sizeof(float) * counts.identity_dim);
        m.pose = malloc(sizeof(float) * counts.pose_dim);
        m.positions = malloc(sizeof(float) * most);
        m.faces = malloc(sizeof(uint32_t) * (3 * (size_t)counts.n_faces + 1));
        if (m.identity != NULL && m.pose != NULL && m.positions != NULL && m.faces != NULL) {
            status = run(&model, &counts, &m, argv[2]);
        } else {
            fprintf(stderr, "out of memory\n");
        }
    }
    free(m.faces);
    free(m.workspace);
    free(m.positions);
    free(m.pose);
    free(m.identity);
    free(m.file);
    return status;
}
