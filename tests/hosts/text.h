/* The format of the golden vectors, read in place: tests/golden/src/text.rs describes it. */
#ifndef HABITUS_TESTS_TEXT_H
#define HABITUS_TESTS_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Bytes of a text, not ended by a zero. */
typedef struct text {
    const char *at;
    const char *end;
} text;

/* What is computed, which case of it, and the lines behind: its fields, then the cases that follow. */
typedef struct vector_case {
    text kernel;
    text name;
    text body;
} vector_case;

/* The values of a field that are still to be read. */
typedef struct values {
    text words;
    text lines;
} values;

text text_of(const char *bytes, size_t length);
bool text_equals(text some, const char *zero_ended);
/* The next case of a file; false at its end. */
bool text_next_case(text *rest, vector_case *next);

/* The field of a case; false without such a field. */
bool case_field(const vector_case *given, const char *key, values *field);
bool values_next(values *rest, text *word);
size_t values_count(values all);

/* A decimal integer. */
bool decimal_of(text word, uint32_t *number);
/* Hexadecimal digits, exactly so many, at most 8, or a single zero. */
bool hexadecimal_of(text word, size_t digits, uint32_t *number);

#ifdef __cplusplus
}
#endif

#endif
