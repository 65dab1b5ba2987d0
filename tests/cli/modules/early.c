/* SPDX-License-Identifier: MIT */
/* A module of LinuxCNC 2.10 with a function that runs once, before the first cycle of thread t. */
#include "newer.h"

static struct {
    volatile int64_t* count;
}* h;
static int comp;

static void first(void* unused, long period) { (void)unused, (void)period, ++*h->count; }

int rtapi_app_main(void) {
    comp = hal_init("early");
    h = hal_malloc(sizeof *h);
    if (comp < 0 || !h || hal_pin_new_sint(comp, OUT, &h->count, 0, "early.count") ||
        hal_export_functf(first, 0, 1, 0, comp, "early.first")) {
        return -1;
    }
    int type = 0;
    void* value = 0;
    if (hal_signal_new("early-wide", 6) || hal_link("early.count", "early-wide") ||
        hal_get_signal_value_by_name("early-wide", &type, &value, 0)) {
        return -2;
    }
    if (type != 6 || *(int64_t*)value != 0) return -3;
    const int added = hal_init_funct_to_thread("early.first", "t", 1);
    return added ? added : hal_ready(comp);
}
void rtapi_app_exit(void) { hal_exit(comp); }
