/* Compares every constant, size, alignment and offset of habitus.h, as this C compiler sees them, with Rust's on the same target.
 *
 * layout_entries.h is made from the header's text (`cargo xtask header --layout DIR`); Rust's list comes from a library that was built with the
 * feature `layout`. An entry that one of the lists lacks is a difference. Needs no operating system when LAYOUT_NO_MAIN is defined: call
 * layout_differences. */
#include "habitus.h"

/* Of the library with the feature `layout`: writes entry `index`, or returns 0 behind the end. */
int32_t hab_layout(uint32_t index, const char **name, uint64_t *value);

/* Calls `say` with the name of each entry that differs or is missing on one side; returns their number, or -1 when there is nothing to compare. */
int layout_differences(void (*say)(const char *name, const char *difference));

static const struct {
    const char *name;
    uint64_t value;
} of_c[] = {
#include "layout_entries.h"
};

#define N_OF_C (sizeof of_c / sizeof of_c[0])

static int same(const char *a, const char *b) {
    for (; *a != '\0' && *a == *b; a++, b++) {
    }
    return *a == *b;
}

int layout_differences(void (*say)(const char *name, const char *difference)) {
    const char *name;
    uint64_t value;
    uint32_t index;
    size_t i;
    int differences = 0;
    for (index = 0; hab_layout(index, &name, &value); index++) {
        for (i = 0; i < N_OF_C && !same(of_c[i].name, name); i++) {
        }
        if (i == N_OF_C) {
            say(name, "is not in the header");
            differences++;
        } else if (of_c[i].value != value) {
            say(name, "has another value in Rust");
            differences++;
        }
    }
    for (i = 0; i < N_OF_C; i++) {
        int found = 0;
        for (index = 0; !found && hab_layout(index, &name, &value); index++) {
            found = same(of_c[i].name, name);
        }
        if (!found) {
            say(of_c[i].name, "is not in Rust's list");
            differences++;
        }
    }
    return index == 0 || N_OF_C < 100 ? -1 : differences;
}

#ifndef LAYOUT_NO_MAIN
#include <stdio.h>

static void print(const char *name, const char *difference) {
    printf("%s %s\n", name, difference);
}

int main(void) {
    const int differences = layout_differences(print);
    if (differences != 0) {
        printf("%d differences between habitus.h and Rust\n", differences);
        return 1;
    }
    printf("%u constants, sizes and offsets of habitus.h are Rust's\n", (unsigned)N_OF_C);
    return 0;
}
#endif
