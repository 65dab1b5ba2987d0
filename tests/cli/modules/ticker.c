/* SPDX-License-Identifier: MIT */
/* Has a task of its own, which counts in its own period, and does at the third period what fault= names. A function pauses and resumes it. */
#include "linuxcnc.h"
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static char* fault = "";
PARAMETER(fault, "s",
          "crash, exit, malloc, silent, return, leave (the task runs when the module goes) or main")
static int comp, task = -1;
static struct {
    volatile int32_t *count, *self, *seen, *created;
    volatile double *in, *twice;
    volatile bool* pause;
    volatile double step;
}* own;
static bool is(const char* what) { return strcmp(fault, what) == 0; }

static void body(void* arg) {
    int n = 0;
    rtapi_print_msg(1, "ticker: the task has argument %s\n", (const char*)arg);
    for (;;) {
        ++n;
        *own->count += 1;
        *own->self = rtapi_task_self();
        *own->twice = 2 * *own->in + own->step;
        *own->created = rtapi_task_new(body, 0, 1, comp, 0, 1);
        if (n == 3 && is("crash")) {
            *(volatile int*)8 = 1;
        }
        if (n == 3 && is("exit")) {
            exit(3);
        }
        if (n == 3 && is("malloc")) {
            void* volatile memory = malloc(10000);
            free(memory);
        }
        if (n == 3 && is("silent")) {
            for (volatile int i = 0;; ++i) {
            }
        }
        if (n == 3 && is("return")) return;
        rtapi_wait();
    }
}
static void update(void* arg, long period) {
    (void)arg, (void)period;
    *own->seen = rtapi_task_self();
    if (*own->pause) {
        rtapi_task_pause(task);
    } else {
        rtapi_task_resume(task);
    }
}

int rtapi_app_main(void) {
    comp = hal_init("ticker");
    own = hal_malloc(sizeof *own);
    hal_pin_s32_newf(OUT, &own->count, comp, "ticker.count");
    hal_pin_s32_newf(OUT, &own->self, comp, "ticker.self");
    hal_pin_s32_newf(OUT, &own->seen, comp, "ticker.seen");
    hal_pin_s32_newf(OUT, &own->created, comp, "ticker.created");
    hal_pin_float_newf(IN, &own->in, comp, "ticker.in");
    hal_pin_float_newf(OUT, &own->twice, comp, "ticker.twice");
    hal_pin_bit_newf(IN, &own->pause, comp, "ticker.pause");
    hal_param_float_newf(RW, &own->step, comp, "ticker.step");
    hal_export_funct("ticker", update, 0, 1, 0, comp);
    const int high = rtapi_prio_highest();
    const int low = rtapi_prio_lowest();
    const int owner = rtapi_task_new(body, 0, high, 9999, 0, 1);

    const int priority = rtapi_task_new(body, 0, high + 1, comp, 0, 1);

    const int code = rtapi_task_new(0, 0, high, comp, 0, 1);
    rtapi_print_msg(1, "ticker: bad %d %d %d, priorities %d %d %d, self %d\n", owner, priority,
                    code, rtapi_prio_next_lower(high) < high, rtapi_prio_next_higher(low) > low,
                    rtapi_prio_next_higher(high) == high && rtapi_prio_next_lower(low) == low,
                    rtapi_task_self());
    task = rtapi_task_new(body, "text", low, comp, 65536, 1);
    if (task < 0) return task;
    const int free_running = rtapi_task_resume(task);
    const int unknown = rtapi_task_start(task + 1, 1000000);

    const int zero = rtapi_task_start(task, 0);
    const int start = rtapi_task_start(task, 1000000);
    const int again = rtapi_task_start(task, 1000000);
    rtapi_print_msg(1, "ticker: free-running %d, unknown %d, period %d, start %d %d\n",
                    free_running, unknown, zero, start, again);
    return is("main") ? -5 : hal_ready(comp);
}
void rtapi_app_exit(void) {
    const int32_t before = *own->count;
    if (!is("leave") && !is("silent")) {
        const int first = rtapi_task_delete(task);
        const int again = rtapi_task_delete(task);
        rtapi_print_msg(1, "ticker: delete %d %d, counted %d\n", first, again, before > 0);
    }
    hal_exit(comp);
}
