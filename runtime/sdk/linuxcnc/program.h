/* SPDX-License-Identifier: MIT */
/* What program.c gives component.c and comp_program.c; nothing for users. */
#ifndef HALCYON_LINUXCNC_PROGRAM_H
#define HALCYON_LINUXCNC_PROGRAM_H
#include "hal/abi.h"
#include "hal/naming.h"

extern const hal_host program_host;
extern char program_prefix[256]; /* of a .comp file's instance; "": names are whole */

int program_begin(const char *name); /* finds the machine; negative after printing why it cannot be used */
int program_ready(bool ready);       /* from then on the values are exchanged */
void program_end(void);
int program_every(unsigned every_ms, unsigned timeout_ms); /* these four: as halcyon_every() and so on */
void program_alive(void);
int program_safe(const char *pin, double value);
bool program_connected(void);

#endif
