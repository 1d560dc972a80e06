/* One case: the memory it starts anew in, its inputs from the text, and the comparison with its expected values. */
#include "case.h"

#include <string.h>

enum { FLOATS = 16 * 1024, INTEGERS = 512, BYTES = 12 * 1024, MOST_SHIFT = 16 };

/* Wide elements first: the union gives the bytes of the model an alignment that a shift then breaks. */
static union {
    uint64_t wide[2];
    uint8_t bytes[BYTES + MOST_SHIFT];
} model_memory;
static float float_memory[FLOATS];
static uint32_t integer_memory[INTEGERS];

void context_object(context *c, problem what) {
    if (c->wrong == PROBLEM_NONE) {
        c->wrong = what;
    }
}

void context_refused(context *c, int32_t code, uint32_t first, uint32_t second) {
    if (c->wrong == PROBLEM_NONE) {
        c->wrong = PROBLEM_REFUSED;
        c->refusal[0] = (uint32_t)code;
        c->refusal[1] = first;
        c->refusal[2] = second;
    }
}

floats context_zeros(context *c, size_t count) {
    floats none = {NULL, 0};
    floats some;
    if (c->wrong != PROBLEM_NONE || count > FLOATS - c->floats_used) {
        context_object(c, PROBLEM_MEMORY);
        return none;
    }
    some.at = float_memory + c->floats_used;
    some.count = count;
    c->floats_used += count;
    memset(some.at, 0, count * sizeof(float));
    return some;
}

integers context_zero_integers(context *c, size_t count) {
    integers none = {NULL, 0};
    integers some;
    if (c->wrong != PROBLEM_NONE || count > INTEGERS - c->integers_used) {
        context_object(c, PROBLEM_MEMORY);
        return none;
    }
    some.at = integer_memory + c->integers_used;
    some.count = count;
    c->integers_used += count;
    memset(some.at, 0, count * sizeof(uint32_t));
    return some;
}

static float float_of_bits(uint32_t bits) {
    float number;
    memcpy(&number, &bits, sizeof number);
    return number;
}

static uint32_t bits_of_float(float number) {
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

floats context_floats(context *c, const char *key) {
    values field;
    text word;
    uint32_t bits;
    size_t k;
    floats some = context_zeros(c, context_count(c, key));
    (void)case_field(&c->given, key, &field);
    for (k = 0; k < some.count; k++) {
        if (!values_next(&field, &word) || !hexadecimal_of(word, 8, &bits)) {
            context_object(c, PROBLEM_TEXT);
            break;
        }
        some.at[k] = float_of_bits(bits);
    }
    return some;
}

integers context_integers(context *c, const char *key) {
    values field;
    text word;
    size_t k;
    integers some = context_zero_integers(c, context_count(c, key));
    (void)case_field(&c->given, key, &field);
    for (k = 0; k < some.count; k++) {
        if (!values_next(&field, &word) || !decimal_of(word, &some.at[k])) {
            context_object(c, PROBLEM_TEXT);
            break;
        }
    }
    return some;
}

text context_word(context *c, const char *key) {
    values field;
    text word = {NULL, NULL};
    if (!case_field(&c->given, key, &field) || !values_next(&field, &word)) {
        context_object(c, PROBLEM_TEXT);
    }
    return word;
}

uint32_t context_integer(context *c, const char *key) {
    uint32_t number = 0;
    if (!decimal_of(context_word(c, key), &number)) {
        context_object(c, PROBLEM_TEXT);
    }
    return number;
}

float context_float_at(context *c, const char *key, size_t at) {
    values field;
    text word = {NULL, NULL};
    uint32_t bits = 0;
    bool found = case_field(&c->given, key, &field) && values_next(&field, &word);
    for (; found && at > 0; at--) {
        found = values_next(&field, &word);
    }
    if (!found || !hexadecimal_of(word, 8, &bits)) {
        context_object(c, PROBLEM_TEXT);
    }
    return float_of_bits(bits);
}

size_t context_count(const context *c, const char *key) {
    values field;
    return case_field(&c->given, key, &field) ? values_count(field) : 0;
}

/* The bytes of a model from its words; false where they are not as the format asks. */
static bool model_bytes(values words, uint8_t *out, size_t length) {
    text word;
    size_t used = 0;
    uint32_t number;
    while (values_next(&words, &word)) {
        bool zeros = word.end - word.at > 3 && word.at[2] == '*';
        if (zeros) {
            word.at += 3;
            if (!decimal_of(word, &number) || number > length - used) {
                return false;
            }
            memset(out + used, 0, number);
            used += number;
        }
        while (!zeros && word.at != word.end) {
            text pair = word;
            pair.end = word.at + 2;
            if (word.end - word.at < 2 || used == length || !hexadecimal_of(pair, 2, &number)) {
                return false;
            }
            out[used++] = (uint8_t)number;
            word.at += 2;
        }
    }
    return used == length;
}

/* The fields `patch` of a case: position and new byte. */
static bool patched(const vector_case *given, uint8_t *out, size_t length) {
    values field;
    text word;
    uint32_t position, byte;
    (void)case_field(given, "patch", &field);
    while (values_next(&field, &word)) {
        if (!decimal_of(word, &position) || position >= length || !values_next(&field, &word) ||
            !hexadecimal_of(word, 2, &byte)) {
            return false;
        }
        out[position] = (uint8_t)byte;
    }
    return true;
}

bytes context_model(context *c) {
    bytes none = {NULL, 0};
    bytes file;
    text name = context_word(c, "model");
    text rest = c->models;
    vector_case model;
    values field;
    text word;
    uint32_t length, kept;
    uint8_t *out = model_memory.bytes + c->shift;
    bool found = false;
    while (!found && text_next_case(&rest, &model)) {
        text a = model.name, b = name;
        while (a.at != a.end && b.at != b.end && *a.at == *b.at) {
            a.at++;
            b.at++;
        }
        found = a.at == a.end && b.at == b.end;
    }
    if (!found || !case_field(&model, "length", &field) || !values_next(&field, &word) || !decimal_of(word, &length)) {
        context_object(c, PROBLEM_TEXT);
        return none;
    }
    kept = context_count(c, "length") > 0 ? context_integer(c, "length") : length;
    if (c->wrong != PROBLEM_NONE || length > BYTES || kept > BYTES || c->shift > MOST_SHIFT) {
        context_object(c, PROBLEM_MEMORY);
        return none;
    }
    memset(model_memory.bytes, 0, sizeof model_memory.bytes);
    if (!case_field(&model, "bytes", &field) || !model_bytes(field, out, length) ||
        !patched(&c->given, out, length > kept ? length : kept)) {
        context_object(c, PROBLEM_TEXT);
        return none;
    }
    file.at = out;
    file.count = kept;
    return file;
}

static void compare_word(context *c, values *field, bool integer, uint32_t found) {
    text word;
    uint32_t expected, bits;
    if (!values_next(field, &word)) {
        context_object(c, PROBLEM_COUNT);
    } else if (!(integer ? decimal_of(word, &expected) : hexadecimal_of(word, 8, &expected))) {
        context_object(c, PROBLEM_TEXT);
    } else {
        c->numbers++;
        for (bits = expected ^ found; bits != 0; bits &= bits - 1) {
            c->differing_bits++;
        }
    }
}

/* The values of a field from `from` on. */
static bool field_from(context *c, const char *key, size_t from, values *field) {
    text word;
    if (c->wrong == PROBLEM_NONE && !case_field(&c->given, key, field)) {
        context_object(c, PROBLEM_TEXT);
    }
    while (c->wrong == PROBLEM_NONE && from > 0) {
        from--;
        if (!values_next(field, &word)) {
            context_object(c, PROBLEM_COUNT);
        }
    }
    return c->wrong == PROBLEM_NONE;
}

void compare_part(context *c, const char *key, size_t from, const float *found, size_t count) {
    values field;
    size_t k;
    if (field_from(c, key, from, &field)) {
        for (k = 0; k < count && c->wrong == PROBLEM_NONE; k++) {
            compare_word(c, &field, false, bits_of_float(found[k]));
        }
    }
}

void compare(context *c, const char *key, const float *found, size_t count) {
    if (c->wrong == PROBLEM_NONE && context_count(c, key) != count) {
        context_object(c, PROBLEM_COUNT);
    }
    compare_part(c, key, 0, found, count);
}

void compare_integer_at(context *c, const char *key, size_t at, uint32_t found) {
    values field;
    if (field_from(c, key, at, &field)) {
        compare_word(c, &field, true, found);
    }
}

void compare_integers(context *c, const char *key, const uint32_t *found, size_t count) {
    size_t k;
    if (c->wrong == PROBLEM_NONE && context_count(c, key) != count) {
        context_object(c, PROBLEM_COUNT);
    }
    for (k = 0; k < count; k++) {
        compare_integer_at(c, key, k, found[k]);
    }
}

void case_run(context *c) {
    bool refusal = context_count(c, "error") > 0;
    size_t k;
    c->floats_used = c->integers_used = 0;
    c->wrong = PROBLEM_NONE;
    c->numbers = c->differing_bits = 0;
    for (k = 0; k < 3; k++) {
        c->refusal[k] = 0;
    }
    /* Nothing of the last case can pass for a result. */
    memset(float_memory, 0, sizeof float_memory);
    kernel_run(c);
    if (c->wrong == PROBLEM_REFUSED && refusal) {
        c->wrong = PROBLEM_NONE;
        compare_integers(c, "error", c->refusal, 3);
    } else if (c->wrong == PROBLEM_NONE && refusal) {
        c->wrong = PROBLEM_ACCEPTED;
    } else if (c->wrong == PROBLEM_NONE && c->numbers == 0) {
        c->wrong = PROBLEM_NOTHING;
    }
}
