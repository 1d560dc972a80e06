/* Compares the golden vectors with what the C interface gives on this processor. */
#include "board.h"
#include "runner.h"

/* The text of the vectors: golden.S. */
extern const char models_txt[], models_txt_end[], generator_txt[], generator_txt_end[], fit_txt[], fit_txt_end[], solve_txt[],
    solve_txt_end[], bodies_txt[], bodies_txt_end[], wavelets_txt[], wavelets_txt_end[], files_txt[], files_txt_end[];

static text between(const char *from, const char *to) { return text_of(from, (size_t)(to - from)); }

int main(void) {
    vector_set vectors;
    vectors.models = between(models_txt, models_txt_end);
    vectors.files[0].name = "generator.txt";
    vectors.files[0].content = between(generator_txt, generator_txt_end);
    vectors.files[1].name = "fit.txt";
    vectors.files[1].content = between(fit_txt, fit_txt_end);
    vectors.files[2].name = "solve.txt";
    vectors.files[2].content = between(solve_txt, solve_txt_end);
    vectors.files[3].name = "bodies.txt";
    vectors.files[3].content = between(bodies_txt, bodies_txt_end);
    vectors.files[4].name = "wavelets.txt";
    vectors.files[4].content = between(wavelets_txt, wavelets_txt_end);
    vectors.files[5].name = "files.txt";
    vectors.files[5].content = between(files_txt, files_txt_end);
    return runner_run(&vectors, board_write) ? 0 : 1;
}
