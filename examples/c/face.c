/* Opens a model, shapes a face with it, looks at that face from elsewhere, and finds it again from its landmarks alone.
 *
 *     face MODEL.hab OUT.obj
 *
 * The library allocates nothing; here the file, the mesh and the triangles are allocated, and the fit works in arrays of fixed size. */
#include <habitus.h>

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Models with more weights or landmarks are refused below. */
#define MAX_WEIGHTS 100
#define MAX_LANDMARKS 200

static float workspace[HAB_FIT_WORKSPACE_BYTES(MAX_WEIGHTS, MAX_WEIGHTS, HAB_FRAME_RIGID) / sizeof(float)];

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

/* Where a point of the model is in the frame of the scan. */
static void place(const hab_placement *placement, const float point[3], float to[3]) {
    for (int row = 0; row < 3; row++) {
        const float *r = placement->rotation + 3 * row;
        to[row] = placement->scale * (r[0] * point[0] + r[1] * point[1] + r[2] * point[2]) + placement->translation[row];
    }
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

/* With the model and its memory: the rest of the program. */
static int run(const hab_model *model, const hab_counts *counts, float *positions, uint32_t *faces, const char *obj) {
    const size_t n_identity = counts->identity_dim, n_pose = counts->pose_dim, n_landmarks = counts->n_landmarks;
    const size_t n_numbers = 3 * (size_t)counts->n_vertices;
    float deviations[MAX_WEIGHTS] = {0};
    float identity[MAX_WEIGHTS], pose[MAX_WEIGHTS], targets[3 * MAX_LANDMARKS];
    uint32_t landmarks[MAX_LANDMARKS];
    hab_error_detail detail;

    /* A face: one and a half standard deviations along the first identity weight, one below the mean along the second. */
    deviations[0] = 1.5F;
    if (n_identity > 1) {
        deviations[1] = -1;
    }
    if (hab_model_weights(model, HAB_MODE_IDENTITY, deviations, n_identity, identity, n_identity, &detail) != HAB_OK) {
        return failed("identity", &detail);
    }
    deviations[0] = 0;
    deviations[1] = 0;
    if (hab_model_weights(model, HAB_MODE_POSE, deviations, n_pose, pose, n_pose, &detail) != HAB_OK) {
        return failed("pose", &detail);
    }
    if (hab_model_evaluate(model, identity, n_identity, pose, n_pose, positions, n_numbers, &detail) != HAB_OK) {
        return failed("evaluate", &detail);
    }
    if (hab_model_read_u32(model, HAB_SECTION_FACES, 0, faces, 3 * (size_t)counts->n_faces, &detail) != HAB_OK) {
        return failed("faces", &detail);
    }

    /* Seen from elsewhere: turned by 30 degrees about y, 40 cm away. */
    const float c = 0.8660254F, s = 0.5F;
    const hab_placement seen = {1, {c, 0, s, 0, 1, 0, -s, 0, c}, {25, -10, 400}};
    if (hab_model_read_u32(model, HAB_SECTION_LANDMARKS, 0, landmarks, n_landmarks, &detail) != HAB_OK) {
        return failed("landmarks", &detail);
    }
    for (size_t i = 0; i < n_landmarks; i++) {
        place(&seen, positions + 3 * (size_t)landmarks[i], targets + 3 * i);
    }

    /* From the landmarks back to weights and placement, starting from the mean. */
    hab_fit_options options;
    hab_fit_options_init(&options, sizeof options);
    options.noise = 0.2F;
    if (hab_model_weights(model, HAB_MODE_IDENTITY, deviations, n_identity, identity, n_identity, &detail) != HAB_OK) {
        return failed("mean", &detail);
    }
    hab_placement found = {1, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    hab_fit_report report;
    if (hab_fit_landmarks(model, NULL, &options, targets, 3 * n_landmarks, NULL, 0, identity, n_identity, pose, n_pose, &found,
                          workspace, sizeof workspace, &report, &detail) != HAB_OK) {
        return failed("fit", &detail);
    }
    printf("fit: %.3f mm over %zu landmarks after %" PRIu32 " iterations, %s\n", (double)report.rms, n_landmarks,
           report.iterations, report.status == HAB_STATUS_CONVERGED ? "converged" : "not converged");

    /* The face that was found, where it was seen; and how far it is from the one that was looked at, over all vertices. */
    double sum = 0;
    for (size_t v = 0; v < counts->n_vertices; v++) {
        float point[3], there[3], known[3];
        if (hab_model_evaluate_range(model, identity, n_identity, pose, n_pose, (uint32_t)v, 1, point, 3, &detail) != HAB_OK) {
            return failed("evaluate", &detail);
        }
        place(&found, point, there);
        place(&seen, positions + 3 * v, known);
        for (int k = 0; k < 3; k++) {
            sum += (double)(there[k] - known[k]) * (double)(there[k] - known[k]);
            positions[3 * v + (size_t)k] = there[k];
        }
    }
    printf("mesh: %.3f mm from the known face, at %.1f %.1f %.1f\n", sqrt(sum / (double)counts->n_vertices),
           (double)found.translation[0], (double)found.translation[1], (double)found.translation[2]);
    if (!write_obj(obj, positions, counts->n_vertices, faces, counts->n_faces)) {
        fprintf(stderr, "%s: cannot be written\n", obj);
        return EXIT_FAILURE;
    }
    return EXIT_SUCCESS;
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: %s MODEL.hab OUT.obj\n", argc > 0 ? argv[0] : "face");
        return 2;
    }
    if (hab_abi_version() < HAB_ABI_VERSION) {
        fprintf(stderr, "the library is older than the header this program was compiled with\n");
        return EXIT_FAILURE;
    }
    size_t len;
    uint8_t *bytes = file_bytes(argv[1], &len);
    if (bytes == NULL) {
        fprintf(stderr, "%s: cannot be read\n", argv[1]);
        return EXIT_FAILURE;
    }

    hab_model model;
    hab_counts counts = {0};
    counts.struct_bytes = sizeof counts;
    hab_error_detail detail;
    int status = EXIT_FAILURE;
    if (hab_model_open(bytes, len, &model, &detail) != HAB_OK || hab_model_counts(&model, &counts, &detail) != HAB_OK) {
        failed(argv[1], &detail);
    } else if (counts.identity_dim > MAX_WEIGHTS || counts.pose_dim > MAX_WEIGHTS || counts.n_landmarks > MAX_LANDMARKS) {
        fprintf(stderr, "%s: more weights or landmarks than this program has room for\n", argv[1]);
    } else {
        printf("%" PRIu32 " vertices, %" PRIu32 " triangles, %" PRIu32 " identity weights, %" PRIu32 " pose weights, %" PRIu32
               " landmarks\n",
               counts.n_vertices, counts.n_faces, counts.identity_dim, counts.pose_dim, counts.n_landmarks);
        float *positions = malloc(3 * sizeof(float) * ((size_t)counts.n_vertices + 1));
        uint32_t *faces = malloc(3 * sizeof(uint32_t) * ((size_t)counts.n_faces + 1));
        if (positions != NULL && faces != NULL) {
            status = run(&model, &counts, positions, faces, argv[2]);
        } else {
            fprintf(stderr, "out of memory\n");
        }
        free(faces);
        free(positions);
    }
    free(bytes);
    return status;
}
