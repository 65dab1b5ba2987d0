/* SPDX-License-Identifier: MIT */
/* A component as LinuxCNC hands write it: counts rising edges; for each channel a pin by pointer, one by handle, a parameter
 * of each kind, and a function. More than four channels are rejected. */
#include "hal.h"
#include "rtapi.h"
#include "rtapi_app.h"

MODULE_AUTHOR("Halcyon");
MODULE_DESCRIPTION("Counts rising edges");
MODULE_LICENSE("Dual MIT/GPL");

static int num_chan = 1;
RTAPI_MP_INT(num_chan, "number of channels");

struct channel {
    hal_bit_t* in;
    hal_sint_t count;
    hal_float_t scale; /* a variable of its own */
    hal_real_t offset;
    hal_float_t* out;
    bool before;
};
static struct channel* channels;
static int component;

static void update(void* arg, long period) {
    struct channel* c = arg;
    (void)period;
    if (*c->in && !c->before) {
        hal_set_si32(c->count, hal_get_si32(c->count) + 1);
    }
    c->before = *c->in;
    *c->out = hal_get_si32(c->count) * c->scale + hal_get_real(c->offset);
    if (c->before && *c->out > 1e6) {
        rtapi_print_msg(RTAPI_MSG_ERR, "edges: %ld is a lot\n", (long)*c->out);
    }
}

int rtapi_app_main(void) {
    component = hal_init("edges");
    if (component < 0) return component;
    if (num_chan > 4) {
        rtapi_print_msg(RTAPI_MSG_ERR, "edges: %d channels are too many\n", num_chan);
        hal_exit(component);
        return -EINVAL;
    }
    channels = hal_malloc(num_chan * (long)sizeof *channels);
    if (!channels) return -ENOMEM;
    for (int i = 0; i < num_chan; ++i) {
        struct channel* c = &channels[i];
        int bad = hal_pin_bit_newf(HAL_IN, &c->in, component, "edges.%d.in", i);
        bad = bad ? bad : hal_pin_new_si32(component, HAL_IO, &c->count, 0, "edges.%d.count", i);
        bad = bad ? bad : hal_pin_float_newf(HAL_OUT, &c->out, component, "edges.%d.out", i);
        bad = bad ? bad : hal_param_float_newf(HAL_RW, &c->scale, component, "edges.%d.scale", i);
        bad = bad ? bad
                  : hal_param_new_real(component, HAL_RW, &c->offset, 0.5, "edges.%d.offset", i);
        bad = bad ? bad : hal_export_functf(update, c, 1, 0, component, "edges.%d", i);
        if (bad) return bad;
        c->scale = 10.0;
    }
    return hal_ready(component);
}

void rtapi_app_exit(void) { hal_exit(component); }
