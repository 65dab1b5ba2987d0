/* SPDX-License-Identifier: MIT */
/* Wires itself up while it is loaded, uses all of it wrongly as well, and takes it apart when it is unloaded. mode=: fail does so at the end, late after it is ready. */
#include "linuxcnc.h"
#include <string.h>

static char* mode = "";
PARAMETER(mode, "s", "fail, lock, or nothing")
static int comp;
static struct {
    volatile double *in, *out, *late;
    volatile int32_t* denied;
    volatile double gain;
}* own;
static int made;

static int make(char* prefix, char* argument) { return made += prefix && argument; }

static void update(void* arg, long period) {
    (void)arg, (void)period;
    *own->out = *own->in + own->gain;
    *own->denied = hal_signal_new("never", FLOAT);
}
static void last(void* arg, long period) { (void)arg, (void)period, *own->late = 2 * *own->out; }

static void say_value(const char* what, int result, int type, const void* data, bool flag) {
    if (result != 0) {
        rtapi_print_msg(1, "%s: %d\n", what, result);
    } else {
        rtapi_print_msg(1, "%s: type %d, %g, %d\n", what, type,
                        type == FLOAT ? *(const double*)data
                        : type == S32 ? *(const int32_t*)data
                                      : *(const bool*)data,
                        flag);
    }
}

int rtapi_app_main(void) {
    comp = hal_init("wires");
    own = hal_malloc(sizeof *own);
    own->gain = 0.5;
    hal_pin_float_newf(IN, &own->in, comp, "wires.in");
    hal_pin_float_newf(OUT, &own->out, comp, "wires.out");
    hal_pin_s32_newf(OUT, &own->denied, comp, "wires.denied");
    hal_param_float_newf(RW, &own->gain, comp, "wires.gain");
    hal_export_funct("wires", update, 0, 1, 0, comp);
    hal_create_thread("wired", 1000000, 1);
    if (strcmp(mode, "lock") == 0) {
        const int before = hal_get_lock();
        const int done = hal_set_lock(2);
        const int lock = hal_get_lock();
        const int new = hal_signal_new("w", FLOAT);

        const int start = hal_start_threads();
        const int set = hal_param_float_set("wires.gain", 2);
        rtapi_print_msg(1, "before %d, set %d, then %d, new %d, start %d, set %d\n", before, done,
                        lock, new, start, set);
        return hal_ready(comp);
    }
    const int new = hal_signal_new("w", FLOAT);
    const int again = hal_signal_new("w", FLOAT);

    const int type = hal_signal_new("x", 9);
    const int link = hal_link("wires.out", "w");
    const int both = hal_link("wires.in", "w");

    const int same = hal_link("wires.in", "w");
    const int other = hal_link("sum.in0", "w");

    const int unknown = hal_link("nothing", "w");
    rtapi_print_msg(1, "new %d %d %d, link %d %d %d %d %d\n", new, again, type, link, both, same,
                    other, unknown);
    hal_pin_float_newf(OUT, &own->late, comp,
                       "wires.late"); /* after the others were used by name */
    hal_export_funct("wires.last", last, 0, 1, 0, comp);
    const int first = hal_add_funct_to_thread("wires.last", "wired", -1);

    const int front = hal_add_funct_to_thread("wires", "wired", 1);

    const int theirs = hal_add_funct_to_thread("sum", "wired", -1);
    const int zero = hal_add_funct_to_thread("wires", "wired", 0);

    const int none = hal_add_funct_to_thread("wires", "unwired", 1);

    const int taken = hal_del_funct_from_thread("sum", "wired");

    const int twice = hal_del_funct_from_thread("sum", "wired");

    const int back = hal_add_funct_to_thread("sum", "wired", -1);
    rtapi_print_msg(1, "addf %d %d %d %d %d, delf %d %d, addf %d\n", first, front, theirs, zero,
                    none, taken, twice, back);
    const int set = hal_param_float_set("wires.gain", 3);
    const int bad = hal_param_s32_set("wires.gain", 3);

    const int foreign = hal_param_s32_set("sum.tmax", 7);
    const int missing = hal_param_bit_set("nothing", 1);
    rtapi_print_msg(1, "set %d %g, type %d, foreign %d, missing %d\n", set, own->gain, bad, foreign,
                    missing);
    const int alias = hal_pin_alias("wires.out", "wires.result");

    const int second = hal_pin_alias("wires.out", "wires.more");

    const int gone = hal_pin_alias("wires.in", 0);

    const int parameter = hal_param_alias("wires.gain", "wires.add");
    rtapi_print_msg(1, "alias %d %d %d %d\n", alias, second, gone, parameter);
    int kind = 0;
    void* data = 0;
    bool flag = false;
    int result = hal_get_pin_value_by_name("sum.in1", &kind, &data, &flag);
    say_value("sum.in1", result, kind, data, flag);
    result = hal_get_pin_value_by_name("wires.out", &kind, &data, &flag);
    say_value("wires.out", result, kind, data, flag);
    result = hal_get_signal_value_by_name("w", &kind, &data, &flag);
    say_value("w", result, kind, data, flag);
    result = hal_get_param_value_by_name("wires.gain", &kind, &data);
    say_value("wires.gain", result, kind, data, false);
    result = hal_get_pin_value_by_name("wires.gain", &kind, &data, &flag);
    say_value("wires.gain as a pin", result, kind, data, flag);
    const int port = hal_port_alloc(4);
    const int written = hal_port_write(port, "abcd", 4);

    const int more = hal_port_write(port, "e", 1);
    char text[5] = "";
    hal_port_read(port, text, 4);
    rtapi_print_msg(1, "port %d %d %d %s %u, none %d\n", port > 0, written, more, text,
                    hal_port_buffer_size(port), hal_port_alloc(0));
    rtapi_print_msg(1, "make %d %d, unready %d, realtime %d %d\n", hal_set_constructor(comp, make),
                    hal_set_constructor(99, make), hal_unready(comp),
                    rtapi_is_realtime() == 0 || rtapi_is_realtime() == 1, rtapi_is_kernelspace());
    const int id = rtapi_init("wires");
    const int exit = rtapi_exit(id);
    const int exit_again = rtapi_exit(id);
    rtapi_print_msg(1, "rtapi %d, exit %d %d\n", id > 0, exit, exit_again);
    if (strcmp(mode, "fail") == 0) return -5;
    rtapi_print_msg(1, "start %d\n", hal_start_threads());
    return hal_ready(comp);
}
void rtapi_app_exit(void) {
    const int unlink = hal_unlink("wires.in");
    const int foreign = hal_unlink("sum.in0");

    const int signal = hal_signal_delete("w");
    const int missing = hal_signal_delete("nothing");
    rtapi_print_msg(1, "unlink %d %d, delete %d %d, link %d, made %d\n", unlink, foreign, signal,
                    missing, hal_link("sum.in0", "w"), made);
    hal_exit(comp);
}
