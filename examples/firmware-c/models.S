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
file linear_hab, linear.hab
file linear_mean, linear.mean
file body_hab, body.hab
file body_mean, body.mean
file body_i8_hab, body-i8.hab
file body_i8_mean, body-i8.mean
file wavelet_hab, wavelet.hab
file wavelet_mean, wavelet.mean
file wavelet_i8_hab, wavelet-i8.hab
file wavelet_i8_mean, wavelet-i8.mean
