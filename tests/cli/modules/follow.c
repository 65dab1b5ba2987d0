/* SPDX-License-Identifier: MIT */
/* Needs planner.c; makes a thread and shares memory by a key. */
#include "linuxcnc.h"

double planner_next(double now);

static int comp, segment, period = 1000000;
PARAMETER(period, "i", "of its thread")
static struct {
    volatile double* position;
}* pins;
static struct shared {
    int cycles;
}* shared;

static void update(void* arg, long ns) {
    (void)arg, (void)ns;
    *pins->position = planner_next(*pins->position);
    shared->cycles++;
}
int rtapi_app_main(void) {
    void* memory;
    comp = hal_init("follow");
    pins = hal_malloc(sizeof *pins);
    segment = rtapi_shmem_new(0x48414c99, comp, sizeof *shared);
    if (segment < 0 || rtapi_shmem_getptr(segment, &memory) != 0) return -1;
    shared = memory;
    if (shared->cycles != 0 || rtapi_shmem_new(0x48414c99, comp, 1) != segment ||
        rtapi_shmem_delete(segment, comp) != 0) {
        return -2;
    }
    hal_pin_float_newf(OUT, &pins->position, comp, "follow.position");
    hal_export_funct("follow", update, 0, 1, 0, comp);
    if (hal_create_thread("follow-thread", (unsigned long)period, 1) <= 0) return -3;
    return hal_ready(comp);
}
void rtapi_app_exit(void) {
    rtapi_shmem_delete(segment, comp);
    hal_exit(comp);
}
