/* SPDX-License-Identifier: MIT */
/* Between ports.c, which knows the program's pins, and functions.cpp, which defines LinuxCNC 2.9's
 * functions: their port is a number, that of hal.h a pointer. */
#ifndef HALCYON_PROGRAMS_PORTS_H
#define HALCYON_PROGRAMS_PORTS_H
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Reads, peeks (verb) or writes count bytes, or asks for the state. Returns true when all were
 * transferred; sets number to the value of the reply's key, or to 0. An unknown number transfers
 * nothing. [setup] */
bool halcyon_use_port_number(int port, const char* verb, char* to, const char* from, unsigned count,
                             const char* key, unsigned* number);

#ifdef __cplusplus
}
#endif
#endif
