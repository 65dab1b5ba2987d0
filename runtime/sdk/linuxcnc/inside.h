/* SPDX-License-Identifier: MIT */
/* What the sources behind hal.h and rtapi.h share; nothing for components. */
#ifndef HALCYON_LINUXCNC_INSIDE_H
#define HALCYON_LINUXCNC_INSIDE_H
#define HALCYON_INSIDE
#include "hal.h"
#include "hal/abi.h"

#ifndef HALCYON_COMPONENT
#define HALCYON_COMPONENT "component"
#endif

extern const hal_host *host; /* component.c; while the instance is made */

/* rtapi.c: what the component prints while it is set up is kept, in a cycle it is queued */
extern char said[2048];
void look_at_parameters(void); /* component.c: those by pointer */
void prepare_lines(void);
void say_what_was_said(void);
void start_printing(void);
void stop_printing(void);

/* ports.c */
bool publish_streams(const hal_host *of);

#endif
