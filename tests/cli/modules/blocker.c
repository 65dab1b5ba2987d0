/* SPDX-License-Identifier: MIT */
/* From cycle 3 on, calls in its function what fault= names. */
#include "linuxcnc.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char* fault = "";
static int comp;
PARAMETER(fault, "s", "malloc, usleep, write, fprintf or exit")

static void update(void* arg, long period) {
    static int n;
    (void)arg, (void)period;
    if (++n < 3) return;
    if (!strcmp(fault, "malloc")) {
        void* volatile memory = malloc(100);
        free(memory);
    }
    if (!strcmp(fault, "usleep")) {
        usleep(10);
    }
    if (!strcmp(fault, "write") && write(1, "blocked\n", 8) < 0) return;
    if (!strcmp(fault, "fprintf")) {
        fprintf(stderr, "%d cycles\n", n);
    }
    if (!strcmp(fault, "exit")) {
        exit(3);
    }
}
int rtapi_app_main(void) {
    comp = hal_init("blocker");
    hal_export_funct("blocker.update", update, 0, 1, 0, comp);
    return hal_ready(comp);
}
void rtapi_app_exit(void) { hal_exit(comp); }
