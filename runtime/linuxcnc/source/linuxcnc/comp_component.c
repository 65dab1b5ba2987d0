/* SPDX-License-Identifier: MIT */
/* The life of the instances of a translated .comp file; comp_instance.h has the part that depends
 * on the file. */
#include "comp_instance.h"
#include "inside.h"

static unsigned instances, running;

bool halcyon_enter(const hal_host* of, const char* instance) {
    halcyon_current_host = of;
    halcyon_mark_pins();
    halcyon_set_instance(instance);
    if (instances++ == 0) {
        halcyon_prepare_messages();
    }
    return halcyon_take_arguments();
}

bool halcyon_leave(bool good) {
    if (good) {
        halcyon_sync_parameters();
    } else {
        halcyon_drop_marked_pins();
    }
    halcyon_current_host = NULL;
    halcyon_set_instance("");
    return good;
}

bool halcyon_start(void* self, const hal_host* of) {
    (void)self;
    halcyon_print_messages();
    if (running > 0) {
        ++running;
        return true;
    }
    if (!halcyon_publish_streams(of)) return false;
    halcyon_start_printing();
    running = 1;
    return true;
}

void halcyon_stop(void* self) {
    (void)self;
    if (--running == 0) {
        halcyon_stop_printing();
    }
}

void halcyon_gone(void) {
    halcyon_detach_pins();
    halcyon_print_messages();
    if (--instances == 0) {
        halcyon_drop_pins();
    }
}
