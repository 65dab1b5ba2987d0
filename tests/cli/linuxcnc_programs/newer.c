/* SPDX-License-Identifier: MIT */
/* A program of LinuxCNC 2.10: pins by handle, an input that it sets itself, and values by name in a structure. */
#include "declared.h"

int hal_pin_new_bool(int comp, int dir, volatile uint64_t** handle, bool initial,
                     const char* format, ...);
int hal_pin_new_real(int comp, int dir, volatile double** handle, double initial,
                     const char* format, ...);
int hal_pin_new_si32(int comp, int dir, volatile int64_t** handle, int32_t initial,
                     const char* format, ...);
int hal_pin_new_sint(int comp, int dir, volatile int64_t** handle, int64_t initial,
                     const char* format, ...);
int hal_param_new_ui32(int comp, int dir, volatile uint64_t** handle, uint32_t initial,
                       const char* format, ...);
struct query {
    const char* name;
    int kind;
    uint64_t caller;
    int type;
    void* reference;
    union {
        bool b;
        int64_t s;
        uint64_t u;
        double r;
    } value;
    union {
        struct {
            int dir;
            const char *alias, *signal, *component;
            int comp;
        } pin;
        struct {
            int writers, readers, both;
        } signal;
    } is;
};
int hal_lib_init(void);
void hal_lib_exit(void);
int hal_is_init(void);
int hal_get_p(struct query*, int (*then)(struct query*, void*), void*);
int hal_get_s(struct query*, int (*then)(struct query*, void*), void*);
int hal_set_p(struct query*, int (*then)(struct query*, void*), void*);
int hal_set_s(struct query*, int (*then)(struct query*, void*), void*);
const char* hal_strerror(int error);

static int double_it(struct query* q, void* by) {
    q->value.r *= *(double*)by;
    return 0;
}
static int give_up(struct query* q, void* unused) { return (void)q, (void)unused, -5; }

static void ask(const char* name) {
    struct query q = {.name = name};
    int result = hal_get_p(&q, NULL, NULL);
    if (result == 0) {
        printf("%s: kind %d type %d dir %d %s", name, q.kind, q.type, q.is.pin.dir,
               q.is.pin.signal ? q.is.pin.signal : "-");
    } else {
        q = (struct query){.name = name};
        result = hal_get_s(&q, NULL, NULL);
        if (result != 0) {
            printf("%s: %d\n", name, result);
            return;
        }
        printf("%s: kind %d type %d writers %d readers %d", name, q.kind, q.type,
               q.is.signal.writers, q.is.signal.readers);
    }
    printf(q.type == 2 ? " %g\n" : " %.0f\n", q.type == 2 ? q.value.r : (double)q.value.s);
}

int main(void) {
    volatile uint64_t **bit = hal_malloc(8), **parameter = hal_malloc(8);
    volatile double** in = hal_malloc(8);
    volatile int64_t **whole = hal_malloc(8), **wide = hal_malloc(8);
    printf("init %d", hal_is_init());
    printf(" %d", hal_lib_init());
    printf(" %d\n", hal_is_init());
    ask("adder.in0"); /* without a component */
    const int comp = hal_init("newer");
    if (hal_pin_new_bool(comp, HAL_OUT, bit, true, "newer.%s", "bit") ||
        hal_pin_new_real(comp, HAL_IN, in, 0.5, "newer.in") ||
        hal_pin_new_si32(comp, HAL_OUT, whole, -3, "newer.whole") ||
        hal_pin_new_sint(comp, HAL_OUT, wide, -5000000000, "newer.wide") ||
        hal_param_new_ui32(comp, HAL_RW, parameter, 7, "newer.parameter")) {
        return 1;
    }
    if (hal_ready(comp) != 0) return 2;
    **in = 2.5; /* its own input, unlinked */
    double by = 2;
    struct query q = {.name = "adder.in1", .type = HAL_FLOAT, .value.r = 4};
    printf("set %d", hal_set_p(&q, NULL, NULL));
    q = (struct query){.name = "adder.in1", .kind = 2};
    printf(" as a parameter %d", hal_get_p(&q, NULL, NULL));
    q = (struct query){.name = "adder.in1", .type = HAL_S32};
    printf(" as s32 %d", hal_get_p(&q, NULL, NULL));
    q = (struct query){.name = "sum", .type = HAL_FLOAT, .value.r = 21};
    printf(" signal %d", hal_set_s(&q, NULL, NULL));
    q = (struct query){.name = "sum", .value.r = 21};
    printf(" by a function %d", hal_set_s(&q, double_it, &by));
    printf(" that fails %d\n", hal_set_s(&q, give_up, NULL));
    ask("adder.in1");
    ask("adder.in0");
    ask("newer.parameter");
    ask("sum");
    ask("nothing");
    puts(hal_strerror(-22));
    fflush(stdout);
    hal_lib_exit();
    for (;;) {
        **bit = (uint64_t)(**in == 2.5);
        **whole = -4;
        usleep(1000);
    }
}
