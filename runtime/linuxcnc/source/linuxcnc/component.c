/* SPDX-License-Identifier: MIT */
/*
 * A Halcyon component whose constructor calls the user's rtapi_app_main(). `hal compile FILE.c`
 * compiles this file with the user's, with HALCYON_COMPONENT as the name of the plugin.
 *
 * Such a component keeps its state in static variables, so it has one instance; it chooses its
 * number of channels itself, under whole names. Its pins may be used by any of its functions, in
 * whichever threads (HAL_COMPONENT_LOOSE_PINS).
 */
#include <stdio.h>
#include <string.h>

#define hal_plugin \
    hal_plugin_as_declared /* it is filled in from MODULE_DESCRIPTION before anyone sees it */
#include "inside.h"
#undef hal_plugin
#include "rtapi_app.h"

void rtapi_app_exit(void) __attribute__((weak)); /* some components have none */

extern const struct halcyon_note* const __start_halcyon_notes[]
    __attribute__((weak, visibility("hidden")));
extern const struct halcyon_note* const __stop_halcyon_notes[]
    __attribute__((weak, visibility("hidden")));

static bool create(const hal_host* of, void* unused) {
    (void)unused;
    if (!halcyon_restore_variables()) {
        of->fail(of, "out of memory");
        return false;
    }
    halcyon_current_host = of;
    halcyon_prepare_messages();
    bool good = halcyon_take_arguments();
    const int result = good ? rtapi_app_main() : 0;
    good = good && (result >= 0 || halcyon_fail_setup("rtapi_app_main", result));
    if (good) {
        halcyon_sync_parameters();
    }
    halcyon_current_host = NULL;
    return good;
}

static bool start(void* self, const hal_host* of) {
    (void)self;
    halcyon_print_messages();
    if (!halcyon_publish_streams(of)) return false;
    halcyon_start_printing();
    return true;
}

static void stop(void* self) {
    (void)self;
    halcyon_stop_printing();
}

static void destroy(void* self) {
    (void)self;
    halcyon_detach_pins(); /* what the user's pointers led to may be gone */
    if (rtapi_app_exit) {
        rtapi_app_exit();
    }
    halcyon_print_messages();
}

HAL_EXPORT hal_component hal_plugin = {
    sizeof(hal_component),
    HAL_ABI_MAJOR,
    HAL_ABI_MINOR,
    HALCYON_COMPONENT,
    "a LinuxCNC component in C",
    "",
    HAL_COMPONENT_SINGLETON | HAL_COMPONENT_WHOLE_NAMES | HAL_COMPONENT_LOOSE_PINS,
    1,
    sizeof(void*),
    _Alignof(void*),
    create,
    start,
    stop,
    destroy};

__attribute__((constructor)) static void take_notes(void) {
    static char doc[1024];
    for (const struct halcyon_note* const* note = __start_halcyon_notes;
         note < __stop_halcyon_notes; ++note) {
        if (strcmp((*note)->key, "description") == 0) {
            hal_plugin.summary = (*note)->text;
        } else if (strlen(doc) + strlen((*note)->key) + strlen((*note)->text) + 8 < sizeof doc) {
            sprintf(doc + strlen(doc), "%s%s: %s", *doc ? "\n\n" : "", (*note)->key, (*note)->text);
        }
    }
    hal_plugin.doc = doc;
}
