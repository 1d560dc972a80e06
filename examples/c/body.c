/* Opens a body, gives it a shape and a posture, says where its joints went, and writes the mesh.
 *
 *     body MODEL.hab OUT.obj
 *
 * The library allocates nothing; here the file, the mesh and the triangles are allocated, and the evaluation works in an array of fixed size. */
#include <habitus.h>

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

/* Models with more weights or joints are refused below. */
#define MAX_WEIGHTS 100
#define MAX_ANGLES 300
#define MAX_JOINTS 100

static float workspace[HAB_SKINNED_WORKSPACE_BYTES(MAX_WEIGHTS, MAX_ANGLES, MAX_JOINTS, 0) / sizeof(float)];

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

/* With the model and its memory: the rest of the program. */
static int run(const hab_model *model, const hab_counts *counts, float *positions, uint32_t *faces, const char *obj) {
    const size_t n_identity = counts->identity_dim, n_pose = counts->pose_dim;
    float deviations[MAX_WEIGHTS] = {0};
    float identity[MAX_WEIGHTS], pose[MAX_ANGLES], joints[3 * MAX_JOINTS];
    hab_error_detail detail;

    /* A person: one and a half standard deviations along the first identity weight. */
    deviations[0] = 1.5F;
    if (hab_model_weights(model, HAB_MODE_IDENTITY, deviations, n_identity, identity, n_identity, &detail) != HAB_OK) {
        return failed("identity", &detail);
    }
    /* A posture: each angle a third of the way from the standard posture to its upper bound. */
    if (hab_model_read_f32(model, HAB_SECTION_POSE_UPPER, 0, pose, n_pose, &detail) != HAB_OK) {
        return failed("bounds", &detail);
    }
    for (size_t i = 0; i < n_pose; i++) {
        pose[i] /= 3;
    }

    /* What all vertices share is computed once; then vertices come in one piece or in many. */
    hab_evaluation evaluation;
    if (hab_evaluation_init(model, NULL, identity, n_identity, pose, n_pose, 0, workspace, sizeof workspace, &evaluation, &detail) != HAB_OK) {
        return failed("begin", &detail);
    }
    if (hab_evaluation_positions(&evaluation, 0, counts->n_vertices, positions, 3 * (size_t)counts->n_vertices, &detail) != HAB_OK) {
        return failed("positions", &detail);
    }
    if (hab_evaluation_joint_positions(&evaluation, 0, counts->n_joints, joints, 3 * (size_t)counts->n_joints, &detail) != HAB_OK) {
        return failed("joints", &detail);
    }
    for (uint32_t index = 0; index < counts->n_joints; index++) {
        const char *name = "";
        size_t name_bytes = 0;
        hab_joint joint;
        joint.struct_bytes = sizeof joint;
        if (hab_model_joint(model, index, &joint, &detail) != HAB_OK) {
            return failed("joint", &detail);
        }
        /* A file need not have names. */
        hab_model_text(model, HAB_SECTION_JOINT_NAMES, index, &name, &name_bytes, NULL);
        printf("joint %" PRIu32 " %.*s, %" PRIu32 " angles, from %.1f %.1f %.1f to %.1f %.1f %.1f\n", index, (int)name_bytes, name,
               joint.n_weights, (double)joint.position[0], (double)joint.position[1], (double)joint.position[2],
               (double)joints[3 * index], (double)joints[3 * index + 1], (double)joints[3 * index + 2]);
    }
    if (hab_model_read_u32(model, HAB_SECTION_FACES, 0, faces, 3 * (size_t)counts->n_faces, &detail) != HAB_OK) {
        return failed("faces", &detail);
    }
    if (!write_obj(obj, positions, counts->n_vertices, faces, counts->n_faces)) {
        fprintf(stderr, "%s: cannot be written\n", obj);
        return EXIT_FAILURE;
    }
    return EXIT_SUCCESS;
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: %s MODEL.hab OUT.obj\n", argc > 0 ? argv[0] : "body");
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
    } else if (counts.kind != HAB_KIND_SKINNED) {
        fprintf(stderr, "%s: no body\n", argv[1]);
    } else if (counts.identity_dim > MAX_WEIGHTS || counts.pose_dim > MAX_ANGLES || counts.n_joints > MAX_JOINTS) {
        fprintf(stderr, "%s: more weights or joints than this program has room for\n", argv[1]);
    } else {
        printf("%" PRIu32 " vertices, %" PRIu32 " triangles, %" PRIu32 " identity weights, %" PRIu32 " angles, %" PRIu32 " joints\n",
               counts.n_vertices, counts.n_faces, counts.identity_dim, counts.pose_dim, counts.n_joints);
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
