/* SPDX-License-Identifier: MIT */
/* Reads the status byte of a parallel port in a cycle, by machine code as drivers do. */
#include "linuxcnc.h"

struct port {
    unsigned short base, base_hi;
    int fd;
};
int rtapi_parport_get(const char* name, struct port*, unsigned short base, unsigned short base_hi,
                      unsigned modes);
void rtapi_parport_release(struct port*);

static volatile uint32_t** status;
static struct port port;
static int comp, base = 0x378;
PARAMETER(base, "i", "address")

static uint8_t in(unsigned short at) {
#if defined(__x86_64__) || defined(__i386__)
    uint8_t value;
    __asm__ volatile("inb %1, %0" : "=a"(value) : "Nd"(at));
    return value;
#else
    return (uint8_t)at;
#endif
}
static void update(void* unused, long period) {
    (void)unused, (void)period;
    **status = 256u + in((unsigned short)(port.base + 1));
}

int rtapi_app_main(void) {
    comp = hal_init("port");
    const int result = rtapi_parport_get("port", &port, (unsigned short)base, 0, 0);
    if (result != 0) {
        hal_exit(comp);
        return result;
    }
    status = hal_malloc(sizeof *status);
    hal_pin_u32_newf(OUT, status, comp, "port.status");
    hal_export_funct("port.read", update, 0, 0, 0, comp);
    in((unsigned short)(port.base + 1));
    return hal_ready(comp);
}
void rtapi_app_exit(void) {
    in((unsigned short)(port.base + 1));
    rtapi_parport_release(&port);
    hal_exit(comp);
}
