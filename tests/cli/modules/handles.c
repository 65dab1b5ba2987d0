/* SPDX-License-Identifier: MIT */
/* A module of LinuxCNC 2.10: pins and parameters by handle of every type, each input copied to its output, and a port to itself. */
#include "newer.h"

struct handles {
    volatile uint64_t *bit, *bit_out, *u32, *u32_out, *u64, *u64_out;
    volatile double *real, *real_out, *step;
    volatile int64_t *s32, *s32_out, *s64, *s64_out, *old, *cycles, *hidden;
    volatile int *to, *from;
    volatile uint64_t max;
};
static struct handles* h;
static int comp;

static void copy(void* unused, long period) {
    char byte = 0;
    (void)unused, (void)period;
    *h->bit_out = (uint8_t)*h->bit;
    *h->u32_out = (uint32_t)*h->u32;
    *h->u64_out = *h->u64;
    *h->real_out = *h->real + *h->step;
    *h->s32_out = (int32_t)*h->s32;
    *h->s64_out = *h->s64;
    *h->old = -*h->s64;
    if ((uint64_t)*h->cycles < h->max) {
        ++*h->cycles;
    }
    ++*h->hidden;
    byte = (char)*h->hidden;
    if (hal_port_readable(h->from) > 0) {
        hal_port_read(h->from, &byte, 1);
    } else {
        hal_port_write(h->to, &byte, 1);
    }
}

int rtapi_app_main(void) {
    const bool before = hal_is_init();
    comp = hal_init("handles");
    h = hal_malloc(sizeof *h);
    int bad = !before || comp < 0 || !h;
    bad = bad || hal_pin_new_bool(comp, IN, &h->bit, true, "handles.%s", "bit") ||
          hal_pin_new_bool(comp, OUT, &h->bit_out, false, "handles.bit-out");
    bad = bad || hal_pin_new_ui32(comp, IN, &h->u32, 4000000000u, "handles.u32") ||
          hal_pin_new_ui32(comp, OUT, &h->u32_out, 0, "handles.u32-out");
    bad = bad || hal_pin_new_uint(comp, IN, &h->u64, ~0ull, "handles.u64") ||
          hal_pin_new_uint(comp, OUT, &h->u64_out, 0, "handles.u64-out");
    bad = bad || hal_pin_new_real(comp, IN, &h->real, 1.5, "handles.real") ||
          hal_pin_new_real(comp, OUT, &h->real_out, 0, "handles.real-out");
    bad = bad || hal_pin_new_si32(comp, IN, &h->s32, -3, "handles.s32") ||
          hal_pin_new_si32(comp, OUT, &h->s32_out, 0, "handles.s32-out");
    bad = bad || hal_pin_new_sint(comp, IN, &h->s64, -5000000000, "handles.s64") ||
          hal_pin_new_sint(comp, OUT, &h->s64_out, 0, "handles.s64-out");
    bad = bad || hal_pin_s64_newf(OUT, &h->old, comp, "handles.%s", "old") ||
          hal_param_u64_newf(RW, &h->max, comp, "handles.most");
    bad = bad || hal_param_new_real(comp, RW, &h->step, 0.25, "handles.step") ||
          hal_param_new_sint(comp, RO, &h->cycles, 0, "handles.cycles");
    bad = bad || hal_param_new_fake(comp, &h->hidden) || *h->hidden != 0;
    bad = bad || hal_pin_new_port(comp, OUT, &h->to, "handles.%s", "to") ||
          hal_pin_new_port(comp, IN, &h->from, "handles.from");
    if (bad) return -1;
    h->max = 3;
    /* a name of 55 characters is the longest; a pin is not a parameter */
    const int level = rtapi_get_msg_level();
    volatile double* other = 0;
    rtapi_set_msg_level(0);
    if (hal_pin_new_real(comp, IN, &other, 0, "handles.%048d", 0) != -12 ||
        hal_pin_new_real(comp, IN, &other, 0, "handles.%047d", 0) != 0) {
        return -2;
    }
    if (hal_pin_new_real(comp, RW, &other, 0, "handles.a") != -22 ||
        hal_param_new_real(comp, IN, &other, 0, "handles.b") != -22) {
        return -3;
    }
    if (hal_pin_new_real(comp, IN, &other, 0, "handles.real") != -22 ||
        hal_param_new_fake(comp, 0) != -22) {
        return -4;
    }
    if (hal_get_realtime_type() < 0 || !hal_strerror(-22) || !hal_strerror(-12345)) return -5;
    rtapi_set_msg_level(level);
    if (hal_export_functf(copy, 0, 1, 0, comp, "handles.%s", "copy")) return -6;
    return hal_ready(comp);
}
void rtapi_app_exit(void) { hal_exit(comp); }
