/* SPDX-License-Identifier: MIT */
/*
 * realtime PLUGIN.so [NAME=VALUE...]: what `hal compile --check-rt` compiles and runs. A host of
 * the component interface that stands before the C library: it runs each function of one instance a
 * thousand cycles with random and extreme values, and prints a line for each function that does in
 * a cycle what may wait, takes longer than a period, or crashes. Exit code 2: there are some.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <semaphore.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "hal/abi.h"

enum { cycles = 1000, max = 4096 };
static const int64_t period_ns = 1000000;

static __thread bool in_cycle;
static const char* forbidden; /* the first call of the function that runs */
static void* callers[32];     /* the return addresses of that call, the innermost first */
static int caller_count;

static void check(const char* call) {
    if (in_cycle && !forbidden) {
        forbidden = call;
        in_cycle = false; /* what the unwinder calls is not the component's */
        caller_count = backtrace(callers, sizeof callers / sizeof *callers);
        in_cycle = true;
    }
}

/* --- what stands before the C library --- */

void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
void __libc_free(void*);
void* malloc(size_t bytes) {
    check("malloc");
    return __libc_malloc(bytes);
}
void* calloc(size_t count, size_t bytes) {
    check("calloc");
    return __libc_calloc(count, bytes);
}
void* realloc(void* memory, size_t bytes) {
    check("realloc");
    return __libc_realloc(memory, bytes);
}
void* aligned_alloc(size_t align, size_t bytes) {
    check("aligned_alloc");
    return __libc_memalign(align, bytes);
}
void* memalign(size_t align, size_t bytes) {
    check("memalign");
    return __libc_memalign(align, bytes);
}
int posix_memalign(void** memory, size_t align, size_t bytes) {
    check("posix_memalign");
    *memory = __libc_memalign(align, bytes);
    return *memory ? 0 : ENOMEM;
}
void free(void* memory) {
    if (memory) {
        check("free");
    }
    __libc_free(memory);
}

/* --- exceptions: what a component in C++ throws goes through here --- */

static const char* thrown; /* the type of the last one, as its author wrote it */

static void* of_cxx(const char* name) {
    static void*
        library; /* the component brought it: it is behind this program, so RTLD_NEXT does not see it */
    if (!library) {
        library = dlopen("libstdc++.so.6", RTLD_LAZY | RTLD_NOLOAD);
    }
    void* const function = library ? dlsym(library, name) : NULL;
    return function ? function : dlsym(RTLD_NEXT, name);
}
void* __cxa_allocate_exception(size_t bytes) {
    check("throw");
    const bool before = in_cycle;
    in_cycle = false; /* the throw is what is reported, not what it calls */
    void* const memory = ((void* (*)(size_t))of_cxx("__cxa_allocate_exception"))(bytes);
    in_cycle = before;
    return memory;
}
void __cxa_throw(void* object, void* type, void (*destroy)(void*)) {
    const bool before = in_cycle;
    in_cycle = false;
    /* std::type_info: its table of functions, then its name */
    const char* const mangled = ((const char**)type)[1];
    char* (*const demangle)(const char*, char*, size_t*, int*) =
        (char* (*)(const char*, char*, size_t*, int*))of_cxx("__cxa_demangle");
    const char* const name =
        demangle ? demangle(mangled + (*mangled == '*'), NULL, NULL, NULL) : NULL;
    thrown = name ? name : mangled;
    in_cycle = before;
    ((void (*)(void*, void*, void (*)(void*)))of_cxx("__cxa_throw"))(object, type, destroy);
    abort();
}

#define GUARDED(result, name, parameters, arguments)                     \
    result name parameters {                                             \
        static result(*real) parameters;                                 \
        check(#name);                                                    \
        if (!real) real = (result(*) parameters)dlsym(RTLD_NEXT, #name); \
        return real arguments;                                           \
    }
GUARDED(int, pthread_mutex_lock, (pthread_mutex_t * mutex), (mutex))
GUARDED(int, pthread_mutex_timedlock, (pthread_mutex_t * mutex, const struct timespec* until),
        (mutex, until))
GUARDED(int, pthread_rwlock_rdlock, (pthread_rwlock_t * lock), (lock))
GUARDED(int, pthread_rwlock_wrlock, (pthread_rwlock_t * lock), (lock))
GUARDED(int, pthread_cond_wait, (pthread_cond_t * condition, pthread_mutex_t* mutex),
        (condition, mutex))
GUARDED(int, pthread_join, (pthread_t thread, void** result), (thread, result))
GUARDED(int, pthread_create,
        (pthread_t * thread, const pthread_attr_t* attributes, void* (*run)(void*), void* self),
        (thread, attributes, run, self))
GUARDED(int, sem_wait, (sem_t * semaphore), (semaphore))
GUARDED(int, sched_yield, (void), ())
GUARDED(unsigned, sleep, (unsigned seconds), (seconds))
GUARDED(int, usleep, (useconds_t us), (us))
GUARDED(int, nanosleep, (const struct timespec* wanted, struct timespec* left), (wanted, left))
GUARDED(int, clock_nanosleep,
        (clockid_t clock, int flags, const struct timespec* wanted, struct timespec* left),
        (clock, flags, wanted, left))
GUARDED(int, poll, (struct pollfd * files, nfds_t count, int ms), (files, count, ms))
GUARDED(ssize_t, read, (int file, void* to, size_t bytes), (file, to, bytes))
GUARDED(ssize_t, write, (int file, const void* from, size_t bytes), (file, from, bytes))
GUARDED(ssize_t, recv, (int file, void* to, size_t bytes, int flags), (file, to, bytes, flags))
GUARDED(ssize_t, send, (int file, const void* from, size_t bytes, int flags),
        (file, from, bytes, flags))
GUARDED(int, close, (int file), (file))
GUARDED(void*, mmap,
        (void* address, size_t bytes, int protection, int flags, int file, off_t offset),
        (address, bytes, protection, flags, file, offset))
GUARDED(int, munmap, (void* address, size_t bytes), (address, bytes))
GUARDED(int, mprotect, (void* address, size_t bytes, int protection), (address, bytes, protection))
GUARDED(int, madvise, (void* address, size_t bytes, int advice), (address, bytes, advice))
GUARDED(int, mlock, (const void* address, size_t bytes), (address, bytes))
GUARDED(int, munlock, (const void* address, size_t bytes), (address, bytes))
GUARDED(int, sched_setaffinity, (pid_t process, size_t bytes, const cpu_set_t* cpus),
        (process, bytes, cpus))
GUARDED(int, sched_setscheduler,
        (pid_t process, int policy, const struct sched_param* parameters),
        (process, policy, parameters))
GUARDED(int, pthread_setaffinity_np, (pthread_t thread, size_t bytes, const cpu_set_t* cpus),
        (thread, bytes, cpus))
GUARDED(int, socket, (int family, int type, int protocol), (family, type, protocol))
GUARDED(ssize_t, recvfrom,
        (int file, void* to, size_t bytes, int flags, struct sockaddr* from, socklen_t* length),
        (file, to, bytes, flags, from, length))
GUARDED(ssize_t, sendto,
        (int file, const void* from, size_t bytes, int flags, const struct sockaddr* to,
         socklen_t length),
        (file, from, bytes, flags, to, length))
GUARDED(ssize_t, getrandom, (void* to, size_t bytes, unsigned flags), (to, bytes, flags))
GUARDED(int, getentropy, (void* to, size_t bytes), (to, bytes))
/* the arguments behind the declared ones are one word, where there is one */
int open(const char* path, int flags, ...) {
    static int (*real)(const char*, int, ...);
    va_list arguments;
    va_start(arguments, flags);
    const unsigned mode = flags & O_CREAT ? va_arg(arguments, unsigned) : 0;
    va_end(arguments);
    check("open");
    if (!real) real = (int (*)(const char*, int, ...))dlsym(RTLD_NEXT, "open");
    return real(path, flags, mode);
}
int ioctl(int file, unsigned long request, ...) {
    static int (*real)(int, unsigned long, ...);
    va_list arguments;
    va_start(arguments, request);
    void* const argument = va_arg(arguments, void*);
    va_end(arguments);
    check("ioctl");
    if (!real) real = (int (*)(int, unsigned long, ...))dlsym(RTLD_NEXT, "ioctl");
    return real(file, request, argument);
}
GUARDED(FILE*, fopen, (const char* path, const char* mode), (path, mode))
GUARDED(int, puts, (const char* text), (text))
GUARDED(int, putchar, (int character), (character))
GUARDED(int, vprintf, (const char* format, va_list arguments), (format, arguments))
GUARDED(int, vfprintf, (FILE * file, const char* format, va_list arguments),
        (file, format, arguments))
GUARDED(size_t, fwrite, (const void* from, size_t size, size_t count, FILE* file),
        (from, size, count, file))
GUARDED(char*, getenv, (const char* name), (name))
int printf(const char* format, ...) {
    va_list arguments;
    va_start(arguments, format);
    check("printf");
    const int length = vprintf(format, arguments);
    va_end(arguments);
    return length;
}
int fprintf(FILE* file, const char* format, ...) {
    va_list arguments;
    va_start(arguments, format);
    check("fprintf");
    const int length = vfprintf(file, format, arguments);
    va_end(arguments);
    return length;
}
/* what the two above become under _FORTIFY_SOURCE */
int __printf_chk(int flag, const char* format, ...) {
    va_list arguments;
    (void)flag;
    va_start(arguments, format);
    check("printf");
    const int length = vprintf(format, arguments);
    va_end(arguments);
    return length;
}

/* --- host --- */

static struct {
    hal_pin* memory;
    hal_type type;
    hal_dir dir;
    unsigned turn;
} pins[max];
static struct {
    char name[160];
    hal_step step;
    void* self;
} functions[max];
static int pin_count, function_count, argument_count;
static char** arguments_given;
static const hal_component* component;
static const char *running = "", *phase = "constructor";

static bool accept_pin(const hal_host* host, const hal_pin_decl* decl, hal_pin* memory) {
    (void)host;
    memory->own = decl->initial;
    memory->slot = &memory->own;
    if (decl->size >= sizeof *decl && decl->pointer) {
        *decl->pointer = memory->slot;
    }
    if (pin_count < max) {
        pins[pin_count].memory = memory;
        pins[pin_count].type = decl->type;

        pins[pin_count++].dir = decl->dir;
    }
    return true;
}
static bool accept_function(const hal_host* host, const hal_function_decl* decl) {
    (void)host;
    if ((decl->flags & HAL_FUNCTION_EMERGENCY) || function_count == max) return true;
    const bool whole = component->flags & HAL_COMPONENT_WHOLE_NAMES;
    char* const name = functions[function_count].name;
    if (whole) {
        snprintf(name, sizeof functions->name, "%s", decl->name);
    } else {
        const char* const separator = *decl->name ? "." : "";
        snprintf(name, sizeof functions->name, "%s%s%s", component->name, separator, decl->name);
    }
    functions[function_count].step = decl->step;
    functions[function_count++].self = decl->self;
    return true;
}
static const char* give_argument(const hal_host* host, const hal_argument_decl* decl) {
    (void)host;
    const size_t length = strlen(decl->name);
    for (int i = 0; i < argument_count; ++i) {
        if (strncmp(arguments_given[i], decl->name, length) == 0 &&
            arguments_given[i][length] == '=') {
            return arguments_given[i] + length + 1;
        }
    }
    return decl->fallback;
}
static void* allocate(const hal_host* host, size_t bytes, size_t align) {
    (void)host;
    const size_t at_least_16 = align < 16 ? 16 : align;
    void* const memory = __libc_memalign(at_least_16, bytes ? bytes : 1);
    return memory ? memset(memory, 0, bytes) : NULL;
}
static void report_failure(const hal_host* host, const char* reason) {
    (void)host;
    printf("%s: %s\n", strcmp(phase, "start()") == 0 ? "start fails" : "rejected", reason);
}
static void report_rejection(const hal_host* host, const hal_rejection* rejection) {
    report_failure(host, rejection->text);
}
static const void* no_extension(const hal_host* host, const char* id) {
    return (void)host, (void)id, NULL;
}

/* --- values --- */

static uint64_t random_bits(void) {
    static uint64_t state = 88172645463325252u;
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state;
}

/* `turn`: counts the extreme values of a pin, so that each of them occurs */
static hal_value some_value(hal_type type, bool extreme, unsigned turn) {
    static const double edges[] = {0.0,    -0.0,     -1.0,      1e300, -1e300,
                                   1e-310, INFINITY, -INFINITY, NAN};
    const uint64_t bits = random_bits() >> 11;
    const bool odd = bits & 1;
    hal_value value = {0};
    if (extreme) {
        switch (type) {
        case HAL_TYPE_BIT: value.bit = odd; break;
        case HAL_TYPE_FLOAT: value.real = edges[turn % (sizeof edges / sizeof *edges)]; break;
        case HAL_TYPE_S32: value.s32 = odd ? INT32_MIN : INT32_MAX; break;
        case HAL_TYPE_U32: value.u32 = odd ? 0 : UINT32_MAX; break;
        case HAL_TYPE_S64: value.s64 = odd ? INT64_MIN : INT64_MAX; break;
        case HAL_TYPE_U64: value.u64 = odd ? 0 : UINT64_MAX; break;
        case HAL_TYPE_PORT: break;
        }
        return value;
    }
    switch (type) {
    case HAL_TYPE_BIT: value.bit = odd; break;
    case HAL_TYPE_FLOAT: value.real = (double)bits / 9007199254740992.0 * 20.0 - 10.0; break;
    case HAL_TYPE_S32: value.s32 = (int32_t)(bits % 21) - 10; break;
    case HAL_TYPE_U32: value.u32 = (uint32_t)(bits % 20); break;
    case HAL_TYPE_S64: value.s64 = (int64_t)(bits % 21) - 10; break;
    case HAL_TYPE_U64: value.u64 = bits % 20; break;
    case HAL_TYPE_PORT: break;
    }
    return value;
}

static int64_t now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID,
                  &now); /* what others do to this machine is not the component's fault */
    return now.tv_sec * 1000000000ll + now.tv_nsec;
}

static void put(const char* text) {
    if (write(STDOUT_FILENO, text, strlen(text)) < 0) {
        _exit(3);
    }
}

/* prints the callers in the plugin as addresses for addr2line: of the call, not behind it */
static void put_callers(void) {
    Dl_info plugin, caller;
    if (!dladdr(component, &plugin)) return;
    put("callers:");
    for (int i = 0; i < caller_count; ++i) {
        if (!dladdr(callers[i], &caller) || caller.dli_fbase != plugin.dli_fbase) continue;
        char text[32];
        const ptrdiff_t offset = (char*)callers[i] - (char*)plugin.dli_fbase;
        snprintf(text, sizeof text, " %#tx", offset - 1);
        put(text);
    }
    put("\n");
}

static void ended(int number) {
    const bool cycle = in_cycle;
    in_cycle = false;
    put(cycle ? "function '" : "outside: its ");
    put(cycle ? running : phase);
    put(cycle ? "' " : " ");
    if (number == SIGALRM) {
        put(cycle ? "does not return: it ran for ten seconds\n"
                  : "does not return within ten seconds\n");
    } else if (number == SIGABRT && thrown) {
        put("throws ");
        put(thrown);
        put(cycle ? " in a cycle\n" : ", which nothing catches\n");
        if (cycle) put_callers();
    } else {
        put(number == SIGABRT ? "aborts" : "crashes");
        put(cycle ? " in a cycle\n" : "\n");
    }
    _exit(2);
}

static int run_function(int f) {
    int64_t shortest = INT64_MAX;
    forbidden = NULL;
    running = functions[f].name;
    alarm(10);
    hal_cycle cycle = {.size = sizeof cycle, .period_ns = period_ns, .period_s = 1e-3};
    for (int i = 0; i < cycles && !forbidden; ++i, ++cycle.number, cycle.start_ns += period_ns) {
        for (int p = 0; p < pin_count; ++p) {
            if (pins[p].type != HAL_TYPE_PORT && pins[p].dir != HAL_DIR_OUT &&
                random_bits() % 4 == 0) {
                const bool extreme = i >= cycles / 2 && random_bits() % 4 == 0;
                *pins[p].memory->slot =
                    some_value(pins[p].type, extreme, extreme ? pins[p].turn++ : 0);
            }
        }
        const int64_t begin = now_ns();
        in_cycle = true;
        functions[f].step(functions[f].self, &cycle);
        in_cycle = false;
        const int64_t took = now_ns() - begin;
        if (took < shortest) {
            shortest = took;
        }
        if (took > 5 * period_ns) {
            shortest = took;
            i = cycles; /* already conclusive */
        }
    }
    alarm(0);
    if (forbidden && strcmp(forbidden, "throw") == 0) {
        printf("function '%s' throws %s in a cycle\n", running, thrown ? thrown : "an exception");
    } else if (forbidden) {
        printf("function '%s' calls %s in a cycle\n", running, forbidden);
    }
    if (forbidden) {
        fflush(stdout); /* put() has no buffer */
        put_callers();
    } else if (shortest > period_ns) {
        printf("function '%s' takes %.3g ms, longer than a period of 1 ms\n", running,
               (double)shortest * 1e-6);
    }
    return forbidden || shortest > period_ns;
}

int main(int argc, char** argv) {
    void* const library = argc > 1 ? dlopen(argv[1], RTLD_NOW) : NULL;
    component = library ? dlsym(library, "hal_plugin") : NULL;
    if (!component) {
        printf("rejected: it cannot be opened\n");
        return 3;
    }
    arguments_given = argv + 2;
    argument_count = argc - 2;
    for (int number = 0; number < 6; ++number) {
        signal((const int[]){SIGSEGV, SIGFPE, SIGBUS, SIGILL, SIGALRM, SIGABRT}[number], ended);
    }
    const hal_host host = {sizeof host,     NULL,          accept_pin,
                           accept_function, give_argument, allocate,
                           report_failure,  no_extension,  report_rejection};
    void* const instance = allocate(&host, component->instance_size, component->instance_align);
    alarm(10);
    if (!component->create(&host, instance)) {
        fflush(stdout);
        return 3;
    }
    phase = "start()";
    if (!component->start(instance, &host)) {
        fflush(stdout);
        return 3;
    }
    alarm(0);
    phase = "thread"; /* one that it started */
    int bad = 0;
    for (int f = 0; f < function_count; ++f) {
        bad += run_function(f);
    }
    alarm(10);
    phase = "stop()";
    component->stop(instance);
    phase = "destructor";
    component->destroy(instance);
    alarm(0);
    if (!bad) {
        printf("%d function%s ran %d cycles each with random and extreme values\n", function_count,
               function_count == 1 ? "" : "s", cycles);
    }
    fflush(stdout);
    return bad ? 2 : 0;
}
