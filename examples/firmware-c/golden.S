/* The text of the golden vectors inside the program. */
.macro file name, path
    .section .models.\name, "a"
    .global \name
    .global \name\()_end
\name:
    .incbin "\path"
\name\()_end:
.endm

file models_txt, models.txt
file generator_txt, generator.txt
file fit_txt, fit.txt
file solve_txt, solve.txt
file bodies_txt, bodies.txt
file wavelets_txt, wavelets.txt
file files_txt, files.txt
