/* Runs the golden vectors through an interface of the kernel: the C functions (vectors.c) or the C++ classes (vectors.cpp).
 *
 * Allocates nothing and calls nothing of the C library beyond what a compiler itself may call (memcpy, memset), so that it also runs on
 * bare metal; what it has to say goes to the function that runner_run is given. */
#ifndef HABITUS_TESTS_RUNNER_H
#define HABITUS_TESTS_RUNNER_H

#include "text.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Why a case could not be compared as written. All but the first two count as failures. */
typedef enum problem {
    PROBLEM_NONE,
    /* The interface cannot express the case. */
    PROBLEM_NOT_IN_INTERFACE,
    /* A field is absent or not as the format asks. */
    PROBLEM_TEXT,
    /* The runner's memory is too small. */
    PROBLEM_MEMORY,
    /* Another number of values than the vectors hold for the field. */
    PROBLEM_COUNT,
    /* Refused what should be accepted, or for another reason than the vectors say. */
    PROBLEM_REFUSED,
    /* Accepted what should be refused. */
    PROBLEM_ACCEPTED,
    /* Nothing was compared. */
    PROBLEM_NOTHING,
    /* A promise of the interface beside the numbers is broken: a size, or a code that is not the detail's. */
    PROBLEM_PROMISE
} problem;

typedef struct floats {
    float *at;
    size_t count;
} floats;

typedef struct integers {
    uint32_t *at;
    size_t count;
} integers;

typedef struct bytes {
    const uint8_t *at;
    size_t count;
} bytes;

/* A case while it runs. After the first problem the functions below do nothing and give nothing. */
typedef struct context {
    vector_case given;
    text models;
    /* Bytes between a multiple of 16 and the model's first. */
    size_t shift;
    size_t floats_used;
    size_t integers_used;
    problem wrong;
    /* Code and numbers of a refusal. */
    uint32_t refusal[3];
    uint32_t numbers;
    uint32_t differing_bits;
} context;

/* Runs one case: defined by vectors.c or vectors.cpp. */
void kernel_run(context *c);

/* Notes a problem, unless there is one already. */
void context_object(context *c, problem what);
/* Notes that the kernel refused. */
void context_refused(context *c, int32_t code, uint32_t first, uint32_t second);
/* The model file that the case names, with its changes. */
bytes context_model(context *c);
/* The numbers of a field; none without the field. */
floats context_floats(context *c, const char *key);
integers context_integers(context *c, const char *key);
/* So many zeros. */
floats context_zeros(context *c, size_t count);
integers context_zero_integers(context *c, size_t count);
/* The first integer or word of a field; number `at` of it. */
uint32_t context_integer(context *c, const char *key);
float context_float_at(context *c, const char *key, size_t at);
text context_word(context *c, const char *key);

/* Compares with a field, bit by bit; it has exactly so many values. */
void compare(context *c, const char *key, const float *found, size_t count);
void compare_integers(context *c, const char *key, const uint32_t *found, size_t count);
/* The same with a part of the field that begins at value `from`. */
void compare_part(context *c, const char *key, size_t from, const float *found, size_t count);
void compare_integer_at(context *c, const char *key, size_t at, uint32_t found);
/* Number of values of a field; 0 without it. */
size_t context_count(const context *c, const char *key);

/* A file of vectors. */
typedef struct vector_file {
    const char *name;
    text content;
} vector_file;

/* Files of cases, without models.txt. */
enum { VECTOR_FILES = 6 };
typedef struct vector_set {
    text models;
    vector_file files[VECTOR_FILES];
} vector_set;

/* Runs every case at several alignments of the model's bytes, then each with one bit of its last number changed. Prints the failing
   ones, then figures as lines `@name value`. True when every bit is as it should be and every changed bit was noticed. */
bool runner_run(const vector_set *vectors, void (*print)(const char *piece));

#ifdef __cplusplus
}
#endif

#endif
