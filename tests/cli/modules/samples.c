/* SPDX-License-Identifier: MIT */
/* Writes its two pins into the stream of sampler 0, one record per cycle. */
#include <stddef.h>

#include "linuxcnc.h"

static int comp;
static struct pins {
    volatile double* real;
    volatile int32_t* whole;
}* pins;
static struct stream stream;

static void sample(void* arg, long period) {
    (void)arg, (void)period;
    union stream_value row[2] = {{.raw = 0}, {.raw = 0}};
    row[0].f = *pins->real;
    row[1].s = *pins->whole;
    hal_stream_write(&stream, row);
}

int rtapi_app_main(void) {
    comp = hal_init("samples");
    if (comp < 0 || hal_stream_create(&stream, comp, 0x48534130, 1000, "fs")) return -1;
    pins = hal_malloc(sizeof *pins);
    if (!pins || hal_pin_float_newf(IN, &pins->real, comp, "samples.real") ||
        hal_pin_s32_newf(IN, &pins->whole, comp, "samples.whole")) {
        return -2;
    }
    return hal_export_funct("samples", sample, NULL, 1, 0, comp) ? -3 : hal_ready(comp);
}

void rtapi_app_exit(void) {
    hal_stream_destroy(&stream);
    hal_exit(comp);
}
