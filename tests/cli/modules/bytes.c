/* SPDX-License-Identifier: MIT */
/* Two components in one: a writer of numbered bytes, five a cycle, and a reader that checks their order. */
#include "linuxcnc.h"

int hal_pin_port_newf(int dir, volatile int** slot, int comp, const char* format, ...);
unsigned hal_port_readable(int port);
unsigned hal_port_writable(int port);
bool hal_port_peek(int port, char* to, unsigned count);
bool hal_port_peek_commit(int port, unsigned count);
void hal_port_clear(int port);

struct pins {
    volatile int *to, *from;
    volatile bool *clear, *good;
    volatile uint32_t *written, *read, *waiting, *capacity, *size;
};
static struct pins* pins;
static int comp;

static void write_bytes(void* unused, long period) {
    char bytes[5];
    (void)unused, (void)period;
    for (int i = 0; i < 5; ++i) {
        bytes[i] = (char)(*pins->written + (uint32_t)i);
    }
    if (hal_port_write(*pins->to, bytes, 5)) {
        *pins->written += 5;
    }
    *pins->capacity = hal_port_writable(*pins->to);
    *pins->size = hal_port_buffer_size(*pins->to);
}
static void read_bytes(void* unused, long period) {
    char bytes[4], first[2];
    (void)unused, (void)period;
    if (*pins->clear) {
        hal_port_clear(*pins->from);
    }
    if (hal_port_peek(*pins->from, first, 2) && hal_port_read(*pins->from, bytes, 4)) {
        *pins->good = *pins->good && first[1] == bytes[1];
        for (int i = 0; i < 4; ++i) {
            *pins->good = *pins->good && (uint8_t)bytes[i] == (uint8_t)(*pins->read + (uint32_t)i);
        }
        *pins->read += 4;
    }
    *pins->waiting = hal_port_readable(*pins->from);
}

int rtapi_app_main(void) {
    comp = hal_init("bytes");
    pins = hal_malloc(sizeof *pins);
    if (hal_pin_port_newf(IO, &pins->to, comp, "bytes.both") != -22) return -1;
    if (hal_pin_port_newf(OUT, &pins->to, comp, "bytes.%s", "to") ||
        hal_pin_new("bytes.from", 5, IN, (void**)&pins->from, comp)) {
        return -1;
    }
    hal_pin_bit_newf(IN, &pins->clear, comp, "bytes.clear");
    hal_pin_bit_newf(OUT, &pins->good, comp, "bytes.good");
    hal_pin_u32_newf(OUT, &pins->written, comp, "bytes.written");
    hal_pin_u32_newf(OUT, &pins->read, comp, "bytes.read");
    hal_pin_u32_newf(OUT, &pins->waiting, comp, "bytes.waiting");
    hal_pin_u32_newf(OUT, &pins->capacity, comp, "bytes.room");
    hal_pin_u32_newf(OUT, &pins->size, comp, "bytes.size");
    *pins->good = 1;
    hal_export_funct("bytes.write", write_bytes, 0, 0, 0, comp);
    hal_export_funct("bytes.read", read_bytes, 0, 0, 0, comp);
    return hal_ready(comp);
}
void rtapi_app_exit(void) { hal_exit(comp); }
