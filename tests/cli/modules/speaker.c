/* SPDX-License-Identifier: MIT */
/* Prints in its function what the C library formats with allocated memory. */
#include "linuxcnc.h"

static int comp;

static void update(void* arg, long period) {
    char text[16];
    (void)arg, (void)period;
    rtapi_print_msg(1, "speaker: %d -0x%04x %-6s %5.2f %g\n", 7, 0xff, "text", 3.25, 1e10);
    rtapi_print_msg(1, "speaker: %.500f\n", 0.1);
    rtapi_print_msg(1, "speaker: %990d|\n", 7);
    rtapi_print_msg(1, "speaker: %1$d\n", 7);
    const int length = rtapi_snprintf(text, sizeof text, "a=%04d", 3);
    rtapi_print_msg(1, "speaker: %s %d\n", text, length);
}
int rtapi_app_main(void) {
    comp = hal_init("speaker");
    hal_export_funct("speaker", update, 0, 1, 0, comp);
    return hal_ready(comp);
}
void rtapi_app_exit(void) { hal_exit(comp); }
