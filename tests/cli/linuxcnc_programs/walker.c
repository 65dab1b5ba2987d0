/* SPDX-License-Identifier: MIT */
/* A program that follows pointers from a variable of the library, as halscope does. */
#include <stdio.h>

extern char* hal_data;

int main(void) {
    printf("%d\n", *(int*)hal_data);
    return 0;
}
