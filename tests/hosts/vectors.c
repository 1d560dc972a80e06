/* Every kernel of the C interface as the golden vectors ask for it. */
#include <habitus.h>

#include "runner.h"

/* Whether a call was accepted. A code that is not the detail's breaks a promise. */
static bool accepted(context *c, hab_code code, const hab_error_detail *detail) {
    if (code == HAB_OK) {
        return c->problem == PROBLEM_NONE;
    }
    if (detail->code != code) {
        context_object(c, PROBLEM_PROMISE);
    }
    context_refused(c, code, detail->first, detail->second);
    return false;
}

static bool opened(context *c, hab_model *model, hab_counts *counts) {
    hab_error_detail detail = {0, 0, 0};
    bytes file = context_model(c);
    if (c->problem != PROBLEM_NONE || !accepted(c, hab_model_open(file.at, file.count, model, &detail), &detail)) {
        return false;
    }
    counts->struct_bytes = sizeof *counts;
    return accepted(c, hab_model_counts(model, counts, &detail), &detail);
}

static void evaluate(context *c) {
    hab_model model;
    hab_counts counts;
    hab_error_detail detail = {0, 0, 0};
    floats identity = context_floats(c, "identity"), pose = context_floats(c, "pose"), out;
    integers ranges = context_integers(c, "ranges");
    size_t k;
    if (!opened(c, &model, &counts)) {
        return;
    }
    for (k = 0; k + 1 < ranges.count; k += 2) {
        uint32_t from = ranges.at[k], n = ranges.at[k + 1] - from;
        if (ranges.at[k + 1] < from) {
            /* A range that ends before it begins: C says how many. */
            context_object(c, PROBLEM_NOT_IN_INTERFACE);
            return;
        }
        out = context_zeros(c, 3 * (size_t)n);
        if (!accepted(c,
                      hab_model_evaluate_range(&model, identity.at, identity.count, pose.at, pose.count, from, n, out.at,
                                               out.count, &detail),
                      &detail)) {
            return;
        }
        /* "out" is the whole shape: every range has to give the bits of its part. */
        compare_part(c, "out", 3 * (size_t)from, out.at, out.count);
    }
    out = context_zeros(c, 3 * (size_t)counts.n_vertices);
    if (accepted(
            c,
            hab_model_evaluate(&model, identity.at, identity.count, pose.at, pose.count, out.at, out.count, &detail),
            &detail)) {
        compare(c, "out", out.at, out.count);
    }
}

void kernel_run(context *c) {
    static const struct {
        const char *name;
        void (*run)(context *c);
    } KERNELS[] = {
        {"evaluate", evaluate},
    };
    size_t k;
    for (k = 0; k < sizeof KERNELS / sizeof KERNELS[0]; k++) {
        if (text_equals(c->given.kernel, KERNELS[k].name)) {
            KERNELS[k].run(c);
            return;
        }
    }
    context_object(c, PROBLEM_NOT_IN_INTERFACE);
}
