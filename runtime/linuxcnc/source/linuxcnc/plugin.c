/* SPDX-License-Identifier: MIT */
/* hal.h in a plugin: the component's name, its memory, and how the creation of an instance
 * fails. */
#include <stdio.h>
#include <string.h>

#include "inside.h"

const hal_host* halcyon_current_host;
static char component_name[HAL_NAME_LEN + 1];

int hal_init(const char* name) {
    if (!name || strlen(name) > HAL_NAME_LEN) return -EINVAL;
    strcpy(component_name, name);
    return component_id;
}
int hal_ready(int comp) { return comp == component_id ? 0 : -EINVAL; }
int hal_unready(int comp) { return comp == component_id ? 0 : -EINVAL; }
int hal_exit(int comp) { return comp == component_id ? 0 : -EINVAL; }
char* hal_comp_name(int comp) { return comp == component_id ? component_name : NULL; }
void* hal_malloc(long size) {
    return halcyon_current_host && size > 0
               ? halcyon_current_host->allocate(halcyon_current_host, (size_t)size, 16)
               : NULL;
}

const hal_host* halcyon_host_of(int comp) { return (void)comp, halcyon_current_host; }
const hal_host* halcyon_host(void) { return halcyon_current_host; }

bool halcyon_fail(const char* format, ...) {
    char reason[2600];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(reason, sizeof reason, format, arguments);
    va_end(arguments);
    halcyon_current_host->fail(halcyon_current_host, reason);
    return false;
}

bool halcyon_fail_setup(const char* function, int result) {
    char* const messages = halcyon_messages;
    for (char* at = messages; *at; ++at) { /* one line; the last end of line goes */
        if (*at == '\n') {
            *at = at[1] ? ';' : '\0';
        }
    }
    return *messages ? halcyon_fail("%s (%s: %s)", messages, function, strerror(-result))
                     : halcyon_fail("%s failed: %s", function, strerror(-result));
}
