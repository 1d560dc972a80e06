/* The format of the golden vectors, read in place. No function of the C library is called. */
#include "text.h"

static const text NOTHING = {NULL, NULL};

text text_of(const char *bytes, size_t length) {
    text all;
    all.at = bytes;
    all.end = bytes + length;
    return all;
}

bool text_equals(text some, const char *zero_ended) {
    while (some.at != some.end && *some.at == *zero_ended) {
        some.at++;
        zero_ended++;
    }
    return some.at == some.end && *zero_ended == 0;
}

static bool starts_with(text some, const char *zero_ended) {
    while (some.at != some.end && *zero_ended != 0 && *some.at == *zero_ended) {
        some.at++;
        zero_ended++;
    }
    return *zero_ended == 0;
}

/* The part up to a byte, or to the end. */
static text cut(text *rest, char mark) {
    text part = *rest;
    while (rest->at != rest->end && *rest->at != mark) {
        rest->at++;
    }
    part.end = rest->at;
    return part;
}

static bool next_line(text *rest, text *line) {
    if (rest->at == rest->end) {
        return false;
    }
    *line = cut(rest, '\n');
    if (rest->at != rest->end) {
        rest->at++;
    }
    return true;
}

static bool next_word(text *line, text *word) {
    while (line->at != line->end && *line->at == ' ') {
        line->at++;
    }
    *word = cut(line, ' ');
    return word->at != word->end;
}

bool text_next_case(text *rest, vector_case *next) {
    text line, word;
    while (next_line(rest, &line)) {
        if (next_word(&line, &word) && text_equals(word, "case")) {
            next->kernel = next->name = NOTHING;
            (void)(next_word(&line, &next->kernel) && next_word(&line, &next->name));
            next->body = *rest;
            return true;
        }
    }
    return false;
}

bool case_field(const vector_case *given, const char *key, values *field) {
    text lines = given->body;
    text line, word;
    while (next_line(&lines, &line) && !starts_with(line, "case ")) {
        if (starts_with(line, "  ") && !starts_with(line, "    ") && next_word(&line, &word) && text_equals(word, key)) {
            field->words = line;
            field->lines = lines;
            return true;
        }
    }
    field->words = field->lines = NOTHING;
    return false;
}

bool values_next(values *rest, text *word) {
    text line;
    while (!next_word(&rest->words, word)) {
        if (!next_line(&rest->lines, &line) || !starts_with(line, "    ")) {
            /* Anything else ends the field for good. */
            rest->words = rest->lines = NOTHING;
            return false;
        }
        rest->words = line;
    }
    return true;
}

size_t values_count(values all) {
    text word;
    size_t count = 0;
    while (values_next(&all, &word)) {
        count++;
    }
    return count;
}

bool decimal_of(text word, uint32_t *number) {
    uint32_t value = 0;
    bool any = word.at != word.end;
    for (; word.at != word.end; word.at++) {
        uint32_t digit = (uint32_t)(*word.at - '0');
        if (*word.at < '0' || *word.at > '9' || value > (UINT32_MAX - digit) / 10) {
            return false;
        }
        value = 10 * value + digit;
    }
    *number = value;
    return any;
}

bool hexadecimal_of(text word, size_t digits, uint32_t *number) {
    uint32_t value = 0;
    if (text_equals(word, "0")) {
        *number = 0;
        return true;
    }
    if (digits > 8 || (size_t)(word.end - word.at) != digits) {
        return false;
    }
    for (; word.at != word.end; word.at++) {
        if (*word.at >= '0' && *word.at <= '9') {
            value = value << 4 | (uint32_t)(*word.at - '0');
        } else if (*word.at >= 'a' && *word.at <= 'f') {
            value = value << 4 | (uint32_t)(*word.at - 'a' + 10);
        } else {
            return false;
        }
    }
    *number = value;
    return true;
}
