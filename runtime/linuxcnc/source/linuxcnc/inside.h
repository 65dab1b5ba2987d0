/* SPDX-License-Identifier: MIT */
/*
 * What the sources behind hal.h and rtapi.h share; nothing for components. They are linked with the
 * user's files, so every shared name begins with halcyon_. tools/comp/build_plugin.cpp lists which
 * of them make a plugin and which a program.
 */
#ifndef HALCYON_LINUXCNC_INSIDE_H
#define HALCYON_LINUXCNC_INSIDE_H
#define HALCYON_INSIDE
#include "hal.h"
#include "hal/abi.h"

#ifndef HALCYON_COMPONENT
#define HALCYON_COMPONENT "component"
#endif

enum { component_id = 1 }; /* in a plugin */

/* Names the host of the instance that is being created, else NULL; a program has the same host all
 * the time. plugin.c, program.c */
extern const hal_host* halcyon_current_host;
/* of a component that hal_init() made; NULL: none, or not while an instance is created */
const hal_host* halcyon_host_of(int comp);

/* declare.c: pins, parameters, functions */
/* of a .comp file; the runtime takes names below it. "": names are whole */
void halcyon_set_instance(const char* name);
void halcyon_sync_parameters(void); /* copies those declared by pointer from and to their pins */
void halcyon_mark_pins(void); /* those declared later can be dropped */
void halcyon_drop_marked_pins(void);
void halcyon_drop_pins(void);
void halcyon_detach_pins(void); /* lets the user's pointers lead to the pins' own slots */
bool halcyon_step(const hal_host* of, hal_function_decl* decl);
int halcyon_number_of_port(const hal_pin* pin); /* runtime/linuxcnc/programs/ports.c: > 0 */

/* plugin.c. Both report the failure of an instance's creation to the host and return false. */
bool halcyon_fail(const char* format, ...) __attribute__((format(printf, 1, 2)));
bool halcyon_fail_setup(const char* function,
                        int result); /* with the messages that it has printed */

/* arguments.c: takes the values of the file's module parameters. False after reporting why not. */
bool halcyon_take_arguments(void);

/* restore.c: notes the static variables at the first call and restores them at each later one.
 * False when out of memory. */
bool halcyon_restore_variables(void);

/* rtapi.c: what a component prints is collected while it is created, and queued while its functions
 * run. */
extern char halcyon_messages[2048];
void halcyon_prepare_messages(void);
void halcyon_print_messages(void);
void halcyon_start_printing(void);
void halcyon_stop_printing(void);

/* streams.c */
bool halcyon_publish_streams(const hal_host* of);

#endif
