/* SPDX-License-Identifier: MIT */
/* Writes a record to a stream in each cycle, and reads one where read is TRUE. What halsampler does from outside, here by the same functions. */
#include "linuxcnc.h"

bool hal_stream_readable(struct stream*);
bool hal_stream_writable(struct stream*);
int hal_stream_maxdepth(struct stream*);
int hal_stream_element_count(struct stream*);
int hal_stream_element_type(struct stream*, int index);
int hal_stream_num_overruns(struct stream*);
int hal_stream_num_underruns(struct stream*);
int hal_stream_detach(struct stream*);

static int comp;
static struct stream stream;
static struct {
    volatile bool *read, *write, *bit;
    volatile double* real;
    volatile int32_t *written, *got, *s32, *number, *depth, *overruns, *underruns;
    volatile uint32_t* u32;
}* pins;

static void update(void* arg, long period) {
    static int n;
    union stream_value record[4] = {{0}};
    unsigned number = 0;
    (void)arg, (void)period;
    ++n;
    if (*pins->write) {
        record[0].f = n * 0.5;
        record[1].b = n & 1;
        record[2].s = -n;

        record[3].u = 4000000000u + (unsigned)n;
        *pins->written = hal_stream_write(&stream, record);
    }
    if (*pins->read) {
        *pins->got = hal_stream_read(&stream, record, &number);
        if (*pins->got == 0) {
            *pins->real = record[0].f;
            *pins->bit = record[1].b;
            *pins->s32 = record[2].s;

            *pins->u32 = record[3].u;
            *pins->number = (int)number;
        }
    }
    *pins->depth = hal_stream_depth(&stream);
    *pins->overruns = hal_stream_num_overruns(&stream);
    *pins->underruns = hal_stream_num_underruns(&stream);
}
int rtapi_app_main(void) {
    struct stream wrong;
    comp = hal_init("stream");
    pins = hal_malloc(sizeof *pins);
    hal_pin_bit_newf(IN, &pins->read, comp, "stream.read");
    hal_pin_bit_newf(IN, &pins->write, comp, "stream.write");
    hal_pin_bit_newf(OUT, &pins->bit, comp, "stream.bit");
    hal_pin_float_newf(OUT, &pins->real, comp, "stream.real");
    hal_pin_s32_newf(OUT, &pins->written, comp, "stream.written");
    hal_pin_s32_newf(OUT, &pins->got, comp, "stream.got");
    hal_pin_s32_newf(OUT, &pins->s32, comp, "stream.s32");
    hal_pin_u32_newf(OUT, &pins->u32, comp, "stream.u32");
    hal_pin_s32_newf(OUT, &pins->number, comp, "stream.number");
    hal_pin_s32_newf(OUT, &pins->depth, comp, "stream.depth");
    hal_pin_s32_newf(OUT, &pins->overruns, comp, "stream.overruns");
    hal_pin_s32_newf(OUT, &pins->underruns, comp, "stream.underruns");
    if (hal_stream_create(&wrong, comp, 0x48414c98, 4, "fx") != -22 ||
        hal_stream_create(&wrong, comp, 0x48414c98, 4, "") != -22) {
        return -1;
    }
    if (hal_stream_create(&wrong, comp, 0x48414c98, 0, "f") != -22 ||
        hal_stream_create(&wrong, comp, 0x48414c98, 4, "ffffffffffffffffffffff") != -22) {
        return -2;
    }
    if (hal_stream_create(&stream, comp, 0x48414c97, 4, "FbsU") != 0) return -3;
    if (hal_stream_maxdepth(&stream) != 4 || hal_stream_element_count(&stream) != 4) return -4;
    if (hal_stream_element_type(&stream, 0) != FLOAT ||
        hal_stream_element_type(&stream, 3) != U32 || hal_stream_element_type(&stream, 4) != -22) {
        return -5;
    }
    if (hal_stream_readable(&stream) || !hal_stream_writable(&stream)) return -6;
    hal_export_funct("stream", update, 0, 1, 0, comp);
    return hal_ready(comp);
}
void rtapi_app_exit(void) {
    hal_stream_destroy(&stream);
    hal_exit(comp);
}
