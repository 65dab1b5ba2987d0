/* SPDX-License-Identifier: MIT */
/* I/O ports of the PC. The process needs the right to use them (CAP_SYS_RAWIO and ioperm() or
 * iopl()); without it, SIGSEGV. */
#ifndef HALCYON_RTAPI_IO_H
#define HALCYON_RTAPI_IO_H

#if defined(__i386__) || defined(__x86_64__)
#include <sys/io.h>

static inline unsigned char rtapi_inb(unsigned port) { return inb((unsigned short)port); }
static inline unsigned short rtapi_inw(unsigned port) { return inw((unsigned short)port); }
static inline unsigned rtapi_inl(unsigned port) { return inl((unsigned short)port); }
static inline void rtapi_outb(unsigned char value, unsigned port) {
    outb(value, (unsigned short)port);
}
static inline void rtapi_outw(unsigned short value, unsigned port) {
    outw(value, (unsigned short)port);
}
static inline void rtapi_outl(unsigned value, unsigned port) { outl(value, (unsigned short)port); }
#else
#error "this computer has no I/O ports"
#endif

#endif
