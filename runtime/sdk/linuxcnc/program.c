/* SPDX-License-Identifier: MIT */
/*
 * hal.h in a program: its pins live in the running machine, which it reaches by the control socket (docs/protocol.md). `hal compile`
 * compiles this file with the user's main(), or with that of comp_program.c.
 *
 * Every pin has a value in this process, where the program reads and writes it. A helper thread exchanges all values some 400 times
 * a second: it sends what the program has changed and stores what the machine has changed, unless the program has changed the same
 * pin in the meantime; then the program's value is sent with the next exchange. When the machine ends, HALCYON_LOST=end (which
 * loadusr sets) ends the program as SIGTERM does; otherwise the thread tries to reconnect until the machine is back.
 */
#define _GNU_SOURCE
#include <locale.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

#include "inside.h"
#include "program.h"

enum { round_ns = 2500000, reconnect_ns = 200000000, settle_ns = 100000000 };

const hal_host *halcyon_current_host; /* set by hal_init() */
struct halcyon_link *halcyon_links;
size_t halcyon_link_count;
static size_t link_capacity;

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER; /* of everything below and of the connection; never held while the program's code runs */
static pthread_t helper;
static bool helper_runs, ending, ready;
static volatile sig_atomic_t asked_to_end;
static char program_name[HAL_NAME_LEN + 1];
static long machine;       /* its process ID */
static bool tied;          /* the kernel ends this process with the machine */
static bool loss_reported;
static unsigned every_ms, timeout_ms;
static bool alive;          /* reported by the program since the last exchange */
static long long alive_ns;  /* time of the last report to the machine */

static bool find_machine(void) {
    const long pid = halcyon_connect();
    if (pid < 0) return false;
    machine = pid;
    int death_signal = 0;
    tied = prctl(PR_GET_PDEATHSIG, &death_signal) == 0 && death_signal != 0 && getppid() == machine;
    loss_reported = false;
    return true;
}
static void report_loss(void) {
    if (loss_reported) return;
    loss_reported = true;
    const char *const wanted = getenv("HALCYON_LOST");
    const bool end = wanted && strcmp(wanted, "end") == 0;
    if (end && tied) return; /* the kernel's SIGTERM, or the machine's, is on its way */
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: the machine '%s' (process %ld) has ended; %s\n", program_name, halcyon_instance(), machine,
                    end ? "ending" : "pins keep their values until it returns (HALCYON_LOST=end ends the program instead)");
    if (end) kill(getpid(), SIGTERM);
}

/* Registers the program; `whole`: with the safe values of its pins, which are declared. */
static bool announce(bool is_ready, bool whole) {
    halcyon_add("{\"component\":");
    halcyon_add_string(program_name);
    if (every_ms > 0) halcyon_add(",\"every_ms\":%u,\"timeout_ms\":%u", every_ms, timeout_ms);
    bool first = true;
    for (size_t i = 0; whole && i < halcyon_link_count; ++i) {
        if (!halcyon_links[i].safe) continue;
        halcyon_add(first ? ",\"safe\":[%zu," : ",%zu,", i);
        halcyon_add_number(halcyon_links[i].type, halcyon_links[i].safe_value);
        first = false;
    }
    halcyon_add(first ? ",\"ready\":%s}" : "],\"ready\":%s}", is_ready ? "true" : "false");
    return halcyon_ask();
}

static bool declare(struct halcyon_link *one) {
    halcyon_add("{\"component\":");
    halcyon_add_string(program_name);
    halcyon_add(",\"prefix\":");
    halcyon_add_string(one->prefix);
    halcyon_add(",\"pins\":[{\"name\":");
    halcyon_add_string(one->name);
    static const char *const types[] = {"bit", "float", "s32", "u32", "s64", "u64", "port"}, *const dirs[] = {"in", "out", "io", "rw"};
    halcyon_add(",\"type\":\"%s\",\"dir\":\"%s\",\"doc\":", types[one->type], one->read_only ? "ro" : dirs[one->dir]);
    halcyon_add_string(one->doc);
    if (one->type != HAL_TYPE_PORT) {
        halcyon_add(",\"value\":");
        halcyon_add_value(one->type, *one->pin->slot);
    }
    halcyon_add("}]}");
    const char *const answer = halcyon_ask();
    const char *at = answer ? strstr(answer, "\"values\":[") : NULL;
    if (!at) return false;
    at += 10;
    one->fresh = one->dir == HAL_DIR_OUT || one->read_only;
    if (one->type == HAL_TYPE_PORT || one->fresh) return true;
    *one->pin->slot = halcyon_take_value(&at, one->type); /* of a predecessor's pin: what that has */
    one->last = halcyon_significant(one->type, one->pin->slot->raw);
    return true;
}

static void unregister(void) {
    if (halcyon_connection >= 0) {
        halcyon_add("{\"exit\":");
        halcyon_add_string(program_name);
        halcyon_add("}");
        halcyon_ask();
    }
    halcyon_disconnect();
}

/* --- exchange --------------------------------------------------------------------------------------------------------------------- */

static bool own(const struct halcyon_link *one) { return one->dir == HAL_DIR_OUT || one->read_only; }

static void exchange(void) {
    bool read = false, write = false;
    const long long now = rtapi_get_time();
    halcyon_sync_parameters();
    uint64_t seen[halcyon_link_count + 1];
    halcyon_add("{\"exchange\":");
    halcyon_add_string(program_name);
    for (size_t i = 0; i < halcyon_link_count; ++i) {
        struct halcyon_link *const one = &halcyon_links[i];
        seen[i] = __atomic_load_n(&one->pin->slot->raw, __ATOMIC_ACQUIRE);
        if (one->type == HAL_TYPE_PORT) continue;
        read = read || !own(one);
        if (one->dir == HAL_DIR_IN || (!one->fresh && halcyon_significant(one->type, seen[i]) == one->last)) continue;
        halcyon_add(write ? ",%zu," : ",\"write\":[%zu,", i);
        halcyon_add_value(one->type, (hal_value){.raw = seen[i]});
        write = true;
        one->fresh = false;
        one->before = one->last;
        one->last = halcyon_significant(one->type, seen[i]);
        one->written_ns = now;
    }
    if (write) halcyon_add("]");
    const bool lives = __atomic_exchange_n(&alive, false, __ATOMIC_ACQ_REL);
    const bool reports = every_ms > 0 && lives && (read || now - alive_ns > every_ms * 250000LL);
    if (every_ms > 0 && !lives) halcyon_add(",\"alive\":false");
    if (reports || (write && lives)) alive_ns = now;
    else if (lives && !write) __atomic_store_n(&alive, true, __ATOMIC_RELEASE); /* with the next one */
    halcyon_add(read ? ",\"read\":true}" : "}");
    if (!read && !write && !reports) return halcyon_drop_request();
    const char *const answer = halcyon_ask(), *at = answer ? strstr(answer, "\"values\":[") : NULL;
    if (!answer) return halcyon_disconnect();
    if (!at) return;
    at += 10;
    for (size_t i = 0; i < halcyon_link_count; ++i) {
        struct halcyon_link *const one = &halcyon_links[i];
        if (own(one)) continue;
        const hal_value value = halcyon_take_value(&at, one->type);
        const uint64_t there = halcyon_significant(one->type, value.raw);
        if (one->type == HAL_TYPE_PORT || there == one->last) continue;
        /* what was written takes a cycle to arrive: until then the old value is still there */
        if (one->dir != HAL_DIR_IN && there == one->before && now - one->written_ns < settle_ns) continue;
        if (__atomic_compare_exchange_n(&one->pin->slot->raw, &seen[i], value.raw, false, __ATOMIC_ACQ_REL, __ATOMIC_RELAXED))
            one->last = there;
    }
    halcyon_sync_parameters();
}

static void reconnect(void) {
    if (!find_machine()) return report_loss();
    bool good = announce(false, false);
    for (size_t i = 0; good && i < halcyon_link_count; ++i) good = declare(&halcyon_links[i]);
    if (good) exchange();
    if (!good || halcyon_connection < 0 || !announce(ready, true)) halcyon_disconnect();
}

static void *run_helper(void *unused) {
    uselocale(newlocale(LC_ALL_MASK, "C", (locale_t)0)); /* a number has a point, whatever the program has chosen */
    for (bool on = true; on;) {
        const bool lost = halcyon_connection_lost();
        const struct timespec pause = {0, lost ? reconnect_ns : round_ns};
        nanosleep(&pause, NULL);
        pthread_mutex_lock(&mutex);
        on = !ending;
        if (asked_to_end) {
            unregister();
            fflush(stdout);
            _exit(0);
        }
        if (on && lost) reconnect();
        else if (on) exchange();
        pthread_mutex_unlock(&mutex);
    }
    return unused;
}

static void on_end_signal(int signal) {
    (void)signal;
    if (!helper_runs) _exit(0);
    asked_to_end = 1;
}

/* --- the host ------------------------------------------------------------------------------------------------------------------- */

locale_t halcyon_lock(void) {
    static locale_t plain;
    pthread_mutex_lock(&mutex);
    if (!plain) plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    return uselocale(plain);
}
void halcyon_unlock(locale_t before) {
    uselocale(before);
    pthread_mutex_unlock(&mutex);
}

static bool report_rejection(const char *of) {
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: %s: %s\n", program_name, of, halcyon_rejection ? halcyon_rejection : "out of memory");
    return false;
}

static bool take_pin(const hal_host *host_itself, const hal_pin_decl *decl, hal_pin *pin) {
    (void)host_itself;
    const char *const dot = *halcyon_program_prefix ? NULL : strchr(decl->name, '.');
    if (!*halcyon_program_prefix && !dot) {
        rtapi_print_msg(RTAPI_MSG_ERR, "%s: the name of pin '%s' has no '.'\n", program_name, decl->name);
        return false;
    }
    const locale_t before = halcyon_lock();
    bool good = true;
    if (halcyon_link_count == link_capacity) {
        struct halcyon_link *const larger = realloc(halcyon_links, (link_capacity * 2 + 16) * sizeof *halcyon_links);
        if ((good = larger)) halcyon_links = larger, link_capacity = link_capacity * 2 + 16;
    }
    struct halcyon_link one = {.pin = pin, .type = decl->type, .dir = decl->dir};
    one.read_only = decl->dir == HAL_DIR_PARAM && (decl->flags & HAL_PIN_READ_ONLY);
    one.prefix = dot ? strndup(decl->name, (size_t)(dot - decl->name)) : strdup(halcyon_program_prefix);
    one.name = strdup(dot ? dot + 1 : decl->name);
    one.doc = strdup(decl->doc);
    pin->own = decl->initial;
    pin->slot = &pin->own;
    if (decl->pointer) *decl->pointer = pin->slot;
    good = good && one.prefix && one.name && one.doc && declare(&one);
    if (good) halcyon_links[halcyon_link_count++] = one;
    halcyon_unlock(before);
    return good || report_rejection(decl->name);
}
static bool take_function(const hal_host *host_itself, const hal_function_decl *decl) {
    (void)host_itself;
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: '%s': a program cannot have functions for threads\n", program_name, decl->name);
    return false;
}
static const char *take_argument(const hal_host *host_itself, const hal_argument_decl *decl) {
    (void)host_itself;
    return decl->fallback;
}
static void *allocate(const hal_host *host_itself, size_t bytes, size_t align) {
    (void)host_itself;
    void *const memory = aligned_alloc(align, (bytes + align - 1) / align * align);
    return memory ? memset(memory, 0, bytes) : NULL;
}
static void take_failure(const hal_host *host_itself, const char *reason) {
    (void)host_itself;
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: %s\n", program_name, reason);
}
static const char *prefix_of(const hal_host *host_itself) { return (void)host_itself, halcyon_program_prefix; }
static void ignore_instance(const hal_host *host_itself, const char *prefix, unsigned digits) { (void)host_itself, (void)prefix, (void)digits; }
static void ignore_count(const hal_host *host_itself, const char *argument, uint64_t count) { (void)host_itself, (void)argument, (void)count; }
static void ignore_names(const hal_host *host_itself) { (void)host_itself; }
static const hal_naming naming = {sizeof naming, ignore_instance, ignore_names, ignore_count, prefix_of};
static const void *extension(const hal_host *host_itself, const char *id) {
    (void)host_itself;
    return strcmp(id, HAL_NAMING) == 0 ? &naming : NULL;
}

char halcyon_program_prefix[256];
static const hal_host program_host = {sizeof(hal_host), NULL, take_pin, take_function, take_argument, allocate, take_failure, extension};

/* --- life ------------------------------------------------------------------------------------------------------------------------ */

static void catch_end_signal(int number) {
    struct sigaction now;
    if (sigaction(number, NULL, &now) != 0 || now.sa_handler != SIG_DFL) return;
    now.sa_handler = on_end_signal;
    sigaction(number, &now, NULL);
}

int hal_init(const char *name) {
    if (!name || !*name || strlen(name) > HAL_NAME_LEN) return -EINVAL;
    if (*program_name) return -EEXIST;
    halcyon_current_host = &program_host;
    strcpy(program_name, name);
    const locale_t before = halcyon_lock();
    const bool found = find_machine(), good = found && announce(false, false);
    halcyon_unlock(before);
    const char *const missing = "%s: no machine '%s' is running (hal run FILE.hal; HALCYON_INSTANCE names another)\n";
    if (!found) rtapi_print_msg(RTAPI_MSG_ERR, missing, name, halcyon_instance());
    else if (!good) report_rejection("cannot register");
    if (!good) {
        *program_name = '\0';
        return -EINVAL;
    }
    catch_end_signal(SIGTERM);
    catch_end_signal(SIGINT);
    return component_id;
}

static int set_ready(bool is_ready) {
    const locale_t before = halcyon_lock();
    if (is_ready) exchange();
    const bool good = announce(is_ready, true);
    ready = is_ready;
    halcyon_unlock(before);
    if (!good) return report_rejection("ready"), -EINVAL;
    if (helper_runs || !is_ready) return 0;
    sigset_t every, mine; /* signals are the program's own thread's */
    sigfillset(&every);
    pthread_sigmask(SIG_SETMASK, &every, &mine);
    helper_runs = pthread_create(&helper, NULL, run_helper, NULL) == 0;
    pthread_sigmask(SIG_SETMASK, &mine, NULL);
    return helper_runs ? 0 : -EAGAIN;
}

int hal_ready(int comp) { return comp == component_id ? set_ready(true) : -EINVAL; }
int hal_unready(int comp) { return comp == component_id ? set_ready(false) : -EINVAL; }

int hal_exit(int comp) {
    if (comp != component_id) return -EINVAL;
    if (!*program_name) return 0;
    locale_t before = halcyon_lock();
    ending = true;
    if (halcyon_connection >= 0) exchange();
    halcyon_unlock(before);
    if (helper_runs) pthread_join(helper, NULL);
    helper_runs = ending = false;
    before = halcyon_lock();
    unregister();
    halcyon_link_count = 0;
    *program_name = '\0';
    halcyon_unlock(before);
    return 0;
}

char *hal_comp_name(int comp) { return comp == component_id ? program_name : NULL; }
void *hal_malloc(long size) { return size > 0 ? allocate(NULL, (size_t)size, 16) : NULL; }

int halcyon_every(int comp, unsigned every, unsigned timeout) {
    if (comp != component_id) return -EINVAL;
    const locale_t before = halcyon_lock();
    every_ms = every;
    timeout_ms = timeout;
    alive = true;
    halcyon_add("{\"component\":");
    halcyon_add_string(program_name);
    halcyon_add(",\"every_ms\":%u,\"timeout_ms\":%u,\"ready\":%s}", every, timeout, ready ? "true" : "false");
    const bool good = halcyon_ask();
    halcyon_unlock(before);
    return good ? 0 : (report_rejection("halcyon_every"), -EINVAL);
}

int halcyon_alive(int comp) {
    if (comp != component_id) return -EINVAL;
    __atomic_store_n(&alive, true, __ATOMIC_RELEASE);
    return 0;
}

int halcyon_safe(int comp, const char *pin, double value) {
    if (comp != component_id) return -EINVAL;
    const locale_t before = halcyon_lock();
    struct halcyon_link *one = NULL;
    for (size_t i = 0; i < halcyon_link_count; ++i) {
        const size_t prefix = strlen(halcyon_links[i].prefix);
        if (strncmp(pin, halcyon_links[i].prefix, prefix) == 0 && pin[prefix] == '.' && strcmp(pin + prefix + 1, halcyon_links[i].name) == 0) one = &halcyon_links[i];
    }
    const bool fits = one && one->type != HAL_TYPE_PORT;
    if (fits) {
        one->safe = true;
        one->safe_value = value;
    }
    const bool good = fits && announce(ready, true);
    if (one && !good) one->safe = false;
    halcyon_unlock(before);
    if (!fits) rtapi_print_msg(RTAPI_MSG_ERR, "%s: halcyon_safe: unknown pin '%s', or it has no value\n", program_name, pin);
    return good ? 0 : (fits ? report_rejection(pin) : false, -EINVAL);
}

bool halcyon_connected(int comp) {
    if (comp != component_id) return false;
    const locale_t before = halcyon_lock();
    const bool there = !halcyon_connection_lost();
    halcyon_unlock(before);
    return there;
}
