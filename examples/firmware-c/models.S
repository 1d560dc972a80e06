/* Model files, in a section of their own: the linker script places it in the memory for models. A program keeps only what it names. */
.macro file name, path
    .section .models.\name, "a"
    .balign 4
    .global \name
    .global \name\()_end
\name:
    .incbin "\path"
\name\()_end:
.endm

file face_hab, face.hab
file small_hab, small.hab
file small_mean, small.mean
