/* SPDX-License-Identifier: MIT */
/* Reads a firmware file: its size and the sum of its bytes, or why not. */
#include "linuxcnc.h"
#include <stddef.h>

struct firmware {
    size_t size;
    const unsigned char* data;
};
int rtapi_request_firmware(const struct firmware**, const char* name, void* device);
void rtapi_release_firmware(const struct firmware*);

static char* file = "";
static int comp;
PARAMETER(file, "s", "name in /lib/firmware")

int rtapi_app_main(void) {
    const struct firmware* firmware;
    const int result = rtapi_request_firmware(&firmware, file, 0);
    unsigned long sum = 0;
    if (result != 0) {
        rtapi_print_msg(1, "firmware: %s: %d%s\n", file, result, firmware ? " with a result" : "");
        return result;
    }
    for (size_t i = 0; i < firmware->size; ++i) {
        sum += firmware->data[i];
    }
    rtapi_print("firmware: %lu bytes, sum %lu\n", (unsigned long)firmware->size, sum);
    rtapi_release_firmware(firmware);
    comp = hal_init("firmware");
    return hal_ready(comp);
}
void rtapi_app_exit(void) { hal_exit(comp); }
