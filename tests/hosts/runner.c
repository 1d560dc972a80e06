/* Runs cases at several alignments, adds up what came of them, and shows that a changed bit is noticed. */
#include "runner.h"

#include "case.h"

/* Longest case of the vectors, with room. */
enum { CASE_BYTES = 16 * 1024 };

static const size_t SHIFTS[] = {0, 1, 2, 4, 7};
enum { N_SHIFTS = sizeof SHIFTS / sizeof SHIFTS[0] };

typedef struct summary {
    uint32_t cases, absent, failed, numbers, differing_bits, changed, noticed;
} summary;

/* Prints, with a zero at the end of each piece. */
typedef void (*printer)(const char *piece);

static void print_text(printer print, text some) {
    char piece[32];
    while (some.at != some.end) {
        size_t used = 0;
        while (some.at != some.end && used + 1 < sizeof piece) {
            piece[used++] = *some.at++;
        }
        piece[used] = 0;
        print(piece);
    }
}

static void print_number(printer print, uint32_t number) {
    char digits[11];
    size_t at = sizeof digits - 1;
    digits[at] = 0;
    do {
        digits[--at] = (char)('0' + number % 10);
        number /= 10;
    } while (number > 0);
    print(digits + at);
}

static void print_figure(printer print, const char *name, uint32_t value) {
    print("@");
    print(name);
    print(" ");
    print_number(print, value);
    print("\n");
}

static void print_case(printer print, const char *what, const char *file, const context *c) {
    print(what);
    print(file);
    print(": ");
    print_text(print, c->given.kernel);
    print(" ");
    print_text(print, c->given.name);
    print(", shift ");
    print_number(print, (uint32_t)c->shift);
    print(": problem ");
    print_number(print, (uint32_t)c->wrong);
    print(", refusal ");
    print_number(print, c->refusal[0]);
    print(" ");
    print_number(print, c->refusal[1]);
    print(" ");
    print_number(print, c->refusal[2]);
    print(", differing bits ");
    print_number(print, c->differing_bits);
    print("\n");
}

static bool equal(const context *c) { return c->wrong == PROBLEM_NONE && c->differing_bits == 0; }

/* A copy of the case, up to the empty line behind it; returns its length, 0 when it does not fit. */
static size_t copied(char *copy, size_t room, const char *from, const char *end_of_file) {
    const char *to = from;
    size_t used = 0;
    while (to != end_of_file && !(to != from && *to == '\n' && to[-1] == '\n')) {
        if (used == room) {
            return 0;
        }
        copy[used++] = *to++;
    }
    while (used > 0 && copy[used - 1] == '\n') {
        used--;
    }
    return used;
}

/* Whether the lowest bit of the last number of the case, changed in a copy, is found as a difference and nothing else. Evaluations compare
   a number once for each range that it lies in. */
static bool change_noticed(const context *original, const char *end_of_file) {
    static const char DIGITS[] = "0123456789abcdef", LOWEST_BIT[] = "00000001";
    static char copy[CASE_BYTES];
    size_t used = copied(copy, sizeof copy - sizeof LOWEST_BIT, original->given.body.at, end_of_file);
    size_t digit = 0, k;
    context c = *original;
    while (used > 0 && digit < 16 && DIGITS[digit] != copy[used - 1]) {
        digit++;
    }
    if (used < 2 || digit == 16) {
        return false;
    }
    copy[used - 1] = DIGITS[digit ^ 1];
    c.given.body = text_of(copy, used);
    case_run(&c);
    if (c.wrong == PROBLEM_TEXT && digit == 0 && copy[used - 2] == ' ') {
        /* The short form of a pattern of zeros, spelt out. */
        for (k = 0; k + 1 < sizeof LOWEST_BIT; k++) {
            copy[used - 1 + k] = LOWEST_BIT[k];
        }
        c.given.body = text_of(copy, used + k - 1);
        case_run(&c);
    }
    return c.wrong == PROBLEM_NONE && c.differing_bits > 0;
}

static void run_case(summary *sums, const vector_set *vectors, const vector_file *file, const vector_case *given, printer print) {
    size_t k;
    context c;
    bool all_equal = true;
    for (k = 0; k < N_SHIFTS; k++) {
        c.given = *given;
        c.models = vectors->models;
        c.shift = SHIFTS[k];
        case_run(&c);
        if (c.wrong == PROBLEM_NOT_IN_INTERFACE) {
            sums->absent++;
            return;
        }
        sums->numbers += c.numbers;
        sums->differing_bits += c.differing_bits;
        if (!equal(&c)) {
            all_equal = false;
            print_case(print, "", file->name, &c);
        }
    }
    sums->cases++;
    sums->failed += !all_equal;
    sums->changed++;
    if (change_noticed(&c, file->content.end)) {
        sums->noticed++;
    } else {
        print_case(print, "a changed bit was not noticed: ", file->name, &c);
    }
}

bool runner_run(const vector_set *vectors, printer print) {
    const uint16_t one = 1;
    summary sums = {0, 0, 0, 0, 0, 0, 0};
    size_t k;
    for (k = 0; k < VECTOR_FILES; k++) {
        text rest = vectors->files[k].content;
        vector_case given;
        while (text_next_case(&rest, &given)) {
            run_case(&sums, vectors, &vectors->files[k], &given, print);
        }
    }
    print_figure(print, "cases", sums.cases);
    print_figure(print, "absent", sums.absent);
    print_figure(print, "failed", sums.failed);
    print_figure(print, "numbers", sums.numbers);
    print_figure(print, "differing_bits", sums.differing_bits);
    print_figure(print, "alignments", N_SHIFTS);
    print_figure(print, "changed", sums.changed);
    print_figure(print, "noticed", sums.noticed);
    print_figure(print, "pointer_bits", (uint32_t)(8 * sizeof(void *)));
    print_figure(print, "big_endian_memory", *(const unsigned char *)&one == 0);
    return sums.cases > 0 && sums.failed == 0 && sums.differing_bits == 0 && sums.noticed == sums.changed;
}
