/* SPDX-License-Identifier: MIT */
/* A program that wires the machine and asks it for values. */
#include "declared.h"

static void show(const char* what, int result, int type, const void* data, bool flag) {
    if (result != 0) {
        printf("%s: %s\n", what, result == -22 ? "EINVAL" : "another error");
    } else if (type == HAL_FLOAT) {
        printf("%s: float %g %d\n", what, *(const double*)data, flag);
    } else if (type == HAL_BIT) {
        printf("%s: bit %d %d\n", what, *(const bool*)data, flag);
    } else {
        printf("%s: type %d %d\n", what, type, flag);
    }
}

#define SHOW(what, call)                      \
    do {                                      \
        const int result = call;              \
        show(what, result, type, data, flag); \
    } while (0)

int main(void) {
    const int comp = hal_init("wire");
    if (comp <= 0 || hal_ready(comp) != 0) return 1;
    printf("new %d\n", hal_signal_new("x", HAL_FLOAT));
    printf("link %d %d\n", hal_link("adder.out", "x"), hal_link("gain.in", "x"));
    printf("addf %d %d\n", hal_add_funct_to_thread("adder", "servo", 1),
           hal_add_funct_to_thread("gain", "servo", -1));
    printf("start %d\n", hal_start_threads());
    printf("set %d\n", hal_param_float_set("gain.gain", 3));
    usleep(100000);
    int type = 0;
    void* data = NULL;
    bool flag = false;
    SHOW("adder.out", hal_get_pin_value_by_name("adder.out", &type, &data, &flag));
    SHOW("adder.in1", hal_get_pin_value_by_name("adder.in1", &type, &data, &flag));
    SHOW("x", hal_get_signal_value_by_name("x", &type, &data, &flag));
    flag = false;
    SHOW("adder.tmax", hal_get_param_value_by_name("adder.tmax", &type, &data));
    SHOW("adder.ou", hal_get_pin_value_by_name("adder.ou", &type, &data, &flag));
    fflush(stdout);
    printf("link %d\n", hal_link("nothing.out", "x"));
    printf("unlink %d delete %d\n", hal_unlink("gain.in"), hal_signal_delete("x"));
    return hal_exit(comp);
}
