/* Runs the golden vectors on a host: vectors FOLDER, the folder that holds them. Ends with 0 when every bit is as it should be. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runner.h"

static void print(const char *piece) { fputs(piece, stdout); }

/* A file as a whole; the program ends where there is none. */
static text file_text(const char *folder, const char *name) {
    char path[4096];
    FILE *file;
    char *content;
    long length;
    if (strlen(folder) + strlen(name) + 2 > sizeof path) {
        fprintf(stderr, "%s: the path is too long\n", folder);
        exit(2);
    }
    strcpy(path, folder);
    strcat(path, "/");
    strcat(path, name);
    file = fopen(path, "rb");
    if (file == NULL || fseek(file, 0, SEEK_END) != 0 || (length = ftell(file)) <= 0) {
        fprintf(stderr, "%s: cannot be read\n", path);
        exit(2);
    }
    rewind(file);
    content = malloc((size_t)length);
    if (content == NULL || fread(content, 1, (size_t)length, file) != (size_t)length) {
        fprintf(stderr, "%s: cannot be read\n", path);
        exit(2);
    }
    fclose(file);
    return text_of(content, (size_t)length);
}

int main(int count, char **arguments) {
    static const char *const NAMES[VECTOR_FILES] = {"generator.txt", "fit.txt",      "solve.txt",
                                                      "bodies.txt",    "wavelets.txt", "files.txt"};
    vector_set vectors;
    size_t k;
    if (count != 2) {
        fprintf(stderr, "usage: vectors FOLDER\n");
        return 2;
    }
    vectors.models = file_text(arguments[1], "models.txt");
    for (k = 0; k < VECTOR_FILES; k++) {
        vectors.files[k].name = NAMES[k];
        vectors.files[k].content = file_text(arguments[1], NAMES[k]);
    }
    return runner_run(&vectors, print) ? 0 : 1;
}
