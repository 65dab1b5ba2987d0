/* SPDX-License-Identifier: MIT */
/*
 * What stands behind hal.h in a program: its pins live in the running machine, which is reached by the control socket
 * (docs/protocol.md). `hal compile` compiles this file with the user's main(), or with that of comp_program.c.
 *
 * Every pin has a value in this process, where the program reads and writes it. A thread of ours exchanges all of them some 400
 * times a second: what changed here is written there, what changed there is stored here, unless the program has changed it in
 * that very moment; then it goes the other way next time. When the machine is gone, HALCYON_LOST=end (which loadusr sets) makes the
 * program end as by SIGTERM; otherwise the thread looks for the machine until it is back.
 */
#define _GNU_SOURCE
#include <locale.h>
#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "inside.h"
#include "program.h"

enum { round_ns = 2500000, look_for_ns = 200000000, settle_ns = 100000000 };

struct link {
    hal_pin *pin;
    hal_type type;
    hal_dir dir;
    bool read_only, fresh; /* fresh: written whatever it is */
    bool safe;             /* has a declared value: */
    double safe_value;
    char *prefix, *name, *doc;
    uint64_t last, before; /* what both sides had; before the last change from here */
    long long written_ns;
};
static struct link *links;
static size_t link_count, link_room;

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER; /* of all here; never held while the program's code runs */
static pthread_t helper;
static bool helping, ending, ready;
static volatile sig_atomic_t asked_to_end;
static int connection = -1;
static char name_of_program[HAL_NAME_LEN + 1];
static long machine;       /* its process */
static bool tied, lost_said; /* the kernel ends this process with the machine; its loss has been reported */
static unsigned every_ms, timeout_ms;
static bool alive;          /* reported by the program since the last exchange */
static long long alive_ns;  /* time of the last report to the machine */
static char *rejected; /* why the host rejected the request, until it is printed */

/* --- text ------------------------------------------------------------------------------------------------------------------ */

static struct text {
    char *at;
    size_t length, room;
} request, reply;
static size_t taken; /* of the reply: the line that was looked at */

static void add(const char *format, ...) __attribute__((format(printf, 1, 2)));
static void add(const char *format, ...) {
    for (;;) {
        va_list arguments;
        va_start(arguments, format);
        const size_t room = request.room - request.length;
        const int length = vsnprintf(request.at ? request.at + request.length : NULL, room, format, arguments);
        va_end(arguments);
        if (length < 0) return;
        if ((size_t)length < room) {
            request.length += (size_t)length;
            return;
        }
        char *const larger = realloc(request.at, request.room * 2 + (size_t)length + 256);
        if (!larger) return; /* the request is truncated, and rejected */
        request.at = larger;
        request.room = request.room * 2 + (size_t)length + 256;
    }
}
static void add_string(const char *text) {
    add("\"");
    for (; *text; ++text) {
        if ((unsigned char)*text < 0x20) add("\\u%04x", *text);
        else add(*text == '"' || *text == '\\' ? "\\%c" : "%c", *text);
    }
    add("\"");
}
static void add_value(hal_type type, hal_value value) {
    switch (type) {
        case HAL_TYPE_BIT: add(value.bit ? "true" : "false"); break;
        case HAL_TYPE_FLOAT:
            if (isnan(value.real)) add("\"nan\"");
            else if (isinf(value.real)) add(value.real < 0 ? "\"-inf\"" : "\"inf\"");
            else add("%.17g", value.real);
            break;
        case HAL_TYPE_S32: add("%d", (int)value.s32); break;
        case HAL_TYPE_U32: add("%u", (unsigned)value.u32); break;
        case HAL_TYPE_S64: add("%lld", (long long)value.s64); break;
        case HAL_TYPE_U64: add("%llu", (unsigned long long)value.u64); break;
        case HAL_TYPE_PORT: add("null"); break;
    }
}

static void add_number(hal_type type, double value) {
    if (type == HAL_TYPE_FLOAT) add_value(type, (hal_value){.real = value});
    else if (type == HAL_TYPE_BIT) add(value != 0 ? "true" : "false");
    else add("%.0f", value);
}

/* Of a slot, what counts: the rest of the eight bytes may be anything. */
static uint64_t meant(hal_type type, uint64_t raw) {
    const hal_value value = {.raw = raw};
    return type == HAL_TYPE_BIT ? value.bit : type == HAL_TYPE_S32 || type == HAL_TYPE_U32 ? value.u32 : raw;
}

/* One value of a reply, as it stands in a slot; `at` moves behind it. */
static hal_value take_value(const char **at, hal_type type) {
    const bool quoted = **at == '"';
    if (quoted) ++*at;
    hal_value value = {.raw = 0};
    char *end = (char *)*at;
    if (strncmp(end, "true", 4) == 0) value.bit = true;
    else if (type == HAL_TYPE_FLOAT) value.real = strtod(*at, &end);
    else if (type == HAL_TYPE_U32 || type == HAL_TYPE_U64) value.u64 = strtoull(*at, &end, 10);
    else if (type == HAL_TYPE_S32 || type == HAL_TYPE_S64) value.s64 = strtoll(*at, &end, 10);
    *at = end + strcspn(end, ",]");
    if (**at == ',') ++*at;
    return value;
}

/* --- the connection ------------------------------------------------------------------------------------------------------------ */

static void disconnect(void) {
    if (connection >= 0) close(connection);
    connection = -1;
    reply.length = taken = 0;
}

/* The next line of the machine's, without its end. */
static char *line(void) {
    reply.length -= taken;
    if (taken > 0) memmove(reply.at, reply.at + taken, reply.length);
    taken = 0;
    for (size_t looked = 0;;) {
        char *const end = reply.length > looked ? memchr(reply.at + looked, '\n', reply.length - looked) : NULL;
        if (end) {
            *end = '\0';
            taken = (size_t)(end - reply.at) + 1;
            return reply.at;
        }
        looked = reply.length;
        if (reply.room - reply.length < 4096) {
            char *const larger = realloc(reply.at, reply.room * 2 + 8192);
            if (!larger) return NULL;
            reply.at = larger;
            reply.room = reply.room * 2 + 8192;
        }
        const ssize_t got = recv(connection, reply.at + reply.length, reply.room - reply.length, 0);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return NULL;
        reply.length += (size_t)got;
    }
}

/* Sends the request; NULL when it was rejected or the machine is lost, with the reason in `rejected`. */
static char *ask(void) {
    add("\n");
    for (size_t sent = 0; connection >= 0 && sent < request.length;) {
        const ssize_t n = send(connection, request.at + sent, request.length - sent, MSG_NOSIGNAL);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) disconnect();
        else sent += (size_t)n;
    }
    request.length = 0;
    char *const answer = connection >= 0 ? line() : NULL;
    if (!answer) disconnect();
    if (answer && strstr(answer, "\"ok\":true")) return answer;
    char *error = answer ? strstr(answer, "\"error\":\"") : NULL;
    free(rejected);
    rejected = strdup(error ? error + 9 : "the machine does not respond");
    if (error && rejected) rejected[strcspn(rejected, "\"")] = '\0';
    return NULL;
}

static const char *instance(void) {
    const char *const named = getenv("HALCYON_INSTANCE");
    return named && *named ? named : "default";
}

static bool find_machine(void) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const char *const runtime = getenv("XDG_RUNTIME_DIR");
    if (runtime && *runtime == '/') snprintf(address.sun_path, sizeof address.sun_path, "%s/halcyon/%s.sock", runtime, instance());
    else snprintf(address.sun_path, sizeof address.sun_path, "/tmp/halcyon-%u/%s.sock", (unsigned)getuid(), instance());
    disconnect();
    connection = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const struct timeval patience = {.tv_sec = 10};
    setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    const char *hello = connect(connection, (struct sockaddr *)&address, sizeof address) == 0 ? line() : NULL;
    if (hello && strncmp(hello, "{\"halcyon\":1,", 13) == 0) {
        const char *const pid = strstr(hello, "\"pid\":");
        int death_signal = 0;
        machine = pid ? strtol(pid + 6, NULL, 10) : 0;
        tied = prctl(PR_GET_PDEATHSIG, &death_signal) == 0 && death_signal != 0 && getppid() == machine;
        lost_said = false;
        return true;
    }
    disconnect();
    return false;
}

/* The machine is gone. */
static void be_lost(void) {
    if (lost_said) return;
    lost_said = true;
    const char *const wanted = getenv("HALCYON_LOST");
    const bool end = wanted && strcmp(wanted, "end") == 0;
    if (end && tied) return; /* the kernel's SIGTERM, or the machine's, is on its way */
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: the machine '%s' (process %ld) has ended; %s\n", name_of_program, instance(), machine,
                    end ? "ending" : "pins keep their values until it returns (HALCYON_LOST=end ends the program instead)");
    if (end) kill(getpid(), SIGTERM);
}

/* `whole`: with all that is declared of pins, which are there. */
static bool announce(bool is_ready, bool whole) {
    add("{\"component\":");
    add_string(name_of_program);
    if (every_ms > 0) add(",\"every_ms\":%u,\"timeout_ms\":%u", every_ms, timeout_ms);
    bool first = true;
    for (size_t i = 0; whole && i < link_count; ++i) {
        if (!links[i].safe) continue;
        add(first ? ",\"safe\":[%zu," : ",%zu,", i);
        add_number(links[i].type, links[i].safe_value);
        first = false;
    }
    add(first ? ",\"ready\":%s}" : "],\"ready\":%s}", is_ready ? "true" : "false");
    return ask();
}

static bool declare(struct link *one) {
    add("{\"component\":");
    add_string(name_of_program);
    add(",\"prefix\":");
    add_string(one->prefix);
    add(",\"pins\":[{\"name\":");
    add_string(one->name);
    static const char *const types[] = {"bit", "float", "s32", "u32", "s64", "u64", "port"}, *const dirs[] = {"in", "out", "io", "rw"};
    add(",\"type\":\"%s\",\"dir\":\"%s\",\"doc\":", types[one->type], one->read_only ? "ro" : dirs[one->dir]);
    add_string(one->doc);
    if (one->type != HAL_TYPE_PORT) {
        add(",\"value\":");
        add_value(one->type, *one->pin->slot);
    }
    add("}]}");
    const char *const answer = ask();
    const char *at = answer ? strstr(answer, "\"values\":[") : NULL;
    if (!at) return false;
    at += 10;
    one->fresh = one->dir == HAL_DIR_OUT || one->read_only;
    if (one->type == HAL_TYPE_PORT || one->fresh) return true;
    *one->pin->slot = take_value(&at, one->type); /* of a predecessor's pin: what that has */
    one->last = meant(one->type, one->pin->slot->raw);
    return true;
}

static void leave(void) {
    if (connection >= 0) {
        add("{\"exit\":");
        add_string(name_of_program);
        add("}");
        ask();
    }
    disconnect();
}

/* --- exchange --------------------------------------------------------------------------------------------------------------------- */

static bool own(const struct link *one) { return one->dir == HAL_DIR_OUT || one->read_only; }

static void exchange(void) {
    bool read = false, write = false;
    const long long now = rtapi_get_time();
    look_at_parameters();
    uint64_t seen[link_count + 1];
    add("{\"exchange\":");
    add_string(name_of_program);
    for (size_t i = 0; i < link_count; ++i) {
        struct link *const one = &links[i];
        seen[i] = __atomic_load_n(&one->pin->slot->raw, __ATOMIC_ACQUIRE);
        if (one->type == HAL_TYPE_PORT) continue;
        read = read || !own(one);
        if (one->dir == HAL_DIR_IN || (!one->fresh && meant(one->type, seen[i]) == one->last)) continue;
        add(write ? ",%zu," : ",\"write\":[%zu,", i);
        add_value(one->type, (hal_value){.raw = seen[i]});
        write = true;
        one->fresh = false;
        one->before = one->last;
        one->last = meant(one->type, seen[i]);
        one->written_ns = now;
    }
    if (write) add("]");
    const bool lives = __atomic_exchange_n(&alive, false, __ATOMIC_ACQ_REL);
    const bool tells = every_ms > 0 && lives && (read || now - alive_ns > every_ms * 250000LL);
    if (every_ms > 0 && !lives) add(",\"alive\":false");
    if (tells || (write && lives)) alive_ns = now;
    else if (lives && !write) __atomic_store_n(&alive, true, __ATOMIC_RELEASE); /* with the next one */
    add(read ? ",\"read\":true}" : "}");
    if (!read && !write && !tells) {
        request.length = 0;
        return;
    }
    const char *const answer = ask(), *at = answer ? strstr(answer, "\"values\":[") : NULL;
    if (!answer) return disconnect();
    if (!at) return;
    at += 10;
    for (size_t i = 0; i < link_count; ++i) {
        struct link *const one = &links[i];
        if (own(one)) continue;
        const hal_value value = take_value(&at, one->type);
        const uint64_t there = meant(one->type, value.raw);
        if (one->type == HAL_TYPE_PORT || there == one->last) continue;
        /* what was written takes a cycle to arrive: until then the old value is still there */
        if (one->dir != HAL_DIR_IN && there == one->before && now - one->written_ns < settle_ns) continue;
        if (__atomic_compare_exchange_n(&one->pin->slot->raw, &seen[i], value.raw, false, __ATOMIC_ACQ_REL, __ATOMIC_RELAXED))
            one->last = there;
    }
    look_at_parameters();
}

static bool gone(void) {
    struct pollfd look = {.fd = connection, .events = POLLIN};
    return connection < 0 || (poll(&look, 1, 0) > 0 && (look.revents & (POLLHUP | POLLERR)));
}

static void come_back(void) {
    if (!find_machine()) return be_lost();
    bool good = announce(false, false);
    for (size_t i = 0; good && i < link_count; ++i) good = declare(&links[i]);
    if (good) exchange();
    if (!good || connection < 0 || !announce(ready, true)) disconnect();
}

static void *help(void *unused) {
    uselocale(newlocale(LC_ALL_MASK, "C", (locale_t)0)); /* a number has a point, whatever the program has chosen */
    for (bool on = true; on;) {
        const bool lost = gone();
        const struct timespec pause = {0, lost ? look_for_ns : round_ns};
        nanosleep(&pause, NULL);
        pthread_mutex_lock(&mutex);
        on = !ending;
        if (asked_to_end) {
            leave();
            fflush(stdout);
            _exit(0);
        }
        if (on && lost) come_back();
        else if (on) exchange();
        pthread_mutex_unlock(&mutex);
    }
    return unused;
}

static void end_soon(int signal) {
    (void)signal;
    if (!helping) _exit(0);
    asked_to_end = 1;
}

/* --- the host ------------------------------------------------------------------------------------------------------------------- */

static locale_t enter(void) {
    static locale_t plain;
    pthread_mutex_lock(&mutex);
    if (!plain) plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    return uselocale(plain);
}
static void depart(locale_t before) {
    uselocale(before);
    pthread_mutex_unlock(&mutex);
}

static bool complain(const char *of) {
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: %s: %s\n", name_of_program, of, rejected ? rejected : "out of memory");
    return false;
}

static bool take_pin(const hal_host *host_itself, const hal_pin_decl *decl, hal_pin *pin) {
    (void)host_itself;
    const char *const dot = *program_prefix ? NULL : strchr(decl->name, '.');
    if (!*program_prefix && !dot) {
        rtapi_print_msg(RTAPI_MSG_ERR, "%s: the name of pin '%s' has no '.'\n", name_of_program, decl->name);
        return false;
    }
    const locale_t before = enter();
    bool good = true;
    if (link_count == link_room) {
        struct link *const larger = realloc(links, (link_room * 2 + 16) * sizeof *links);
        if ((good = larger)) links = larger, link_room = link_room * 2 + 16;
    }
    struct link one = {.pin = pin, .type = decl->type, .dir = decl->dir};
    one.read_only = decl->dir == HAL_DIR_PARAM && (decl->flags & HAL_PIN_READ_ONLY);
    one.prefix = dot ? strndup(decl->name, (size_t)(dot - decl->name)) : strdup(program_prefix);
    one.name = strdup(dot ? dot + 1 : decl->name);
    one.doc = strdup(decl->doc);
    pin->own = decl->initial;
    pin->slot = &pin->own;
    if (decl->pointer) *decl->pointer = pin->slot;
    good = good && one.prefix && one.name && one.doc && declare(&one);
    if (good) links[link_count++] = one;
    depart(before);
    return good || complain(decl->name);
}
static bool take_function(const hal_host *host_itself, const hal_function_decl *decl) {
    (void)host_itself;
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: '%s': a program cannot have functions for threads\n", name_of_program, decl->name);
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
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: %s\n", name_of_program, reason);
}
static const char *prefix_of(const hal_host *host_itself) { return (void)host_itself, program_prefix; }
static void no_instance(const hal_host *host_itself, const char *prefix, unsigned digits) { (void)host_itself, (void)prefix, (void)digits; }
static void no_count(const hal_host *host_itself, const char *argument, uint64_t count) { (void)host_itself, (void)argument, (void)count; }
static void no_names(const hal_host *host_itself) { (void)host_itself; }
static const hal_naming naming = {sizeof naming, no_instance, no_names, no_count, prefix_of};
static const void *extension(const hal_host *host_itself, const char *id) {
    (void)host_itself;
    return strcmp(id, HAL_NAMING) == 0 ? &naming : NULL;
}

char program_prefix[256];
const hal_host program_host = {sizeof program_host, NULL, take_pin, take_function, take_argument, allocate, take_failure, extension};

/* --- life ------------------------------------------------------------------------------------------------------------------------ */

static void on_end(int number) {
    struct sigaction now;
    if (sigaction(number, NULL, &now) != 0 || now.sa_handler != SIG_DFL) return;
    now.sa_handler = end_soon;
    sigaction(number, &now, NULL);
}

int program_begin(const char *name) {
    if (*name_of_program) return -EEXIST;
    if (!*name) return -EINVAL;
    strcpy(name_of_program, name);
    const locale_t before = enter();
    const bool found = find_machine(), good = found && announce(false, false);
    depart(before);
    const char *const missing = "%s: no machine '%s' is running (hal run FILE.hal; HALCYON_INSTANCE names another)\n";
    if (!found) rtapi_print_msg(RTAPI_MSG_ERR, missing, name, instance());
    else if (!good) complain("cannot register");
    if (!good) *name_of_program = '\0';
    if (!good) return -EINVAL;
    on_end(SIGTERM);
    on_end(SIGINT);
    return 0;
}

int program_ready(bool is_ready) {
    const locale_t before = enter();
    if (is_ready) exchange();
    const bool good = announce(is_ready, true);
    ready = is_ready;
    depart(before);
    if (!good) return complain("ready"), -EINVAL;
    if (helping || !is_ready) return 0;
    sigset_t every, mine; /* signals are the program's own thread's */
    sigfillset(&every);
    pthread_sigmask(SIG_SETMASK, &every, &mine);
    helping = pthread_create(&helper, NULL, help, NULL) == 0;
    pthread_sigmask(SIG_SETMASK, &mine, NULL);
    return helping ? 0 : -EAGAIN;
}

void program_end(void) {
    if (!*name_of_program) return;
    locale_t before = enter();
    ending = true;
    if (connection >= 0) exchange();
    depart(before);
    if (helping) pthread_join(helper, NULL);
    helping = ending = false;
    before = enter();
    leave();
    link_count = 0;
    *name_of_program = '\0';
    depart(before);
}

int program_every(unsigned every, unsigned timeout) {
    const locale_t before = enter();
    every_ms = every;
    timeout_ms = timeout;
    alive = true;
    add("{\"component\":");
    add_string(name_of_program);
    add(",\"every_ms\":%u,\"timeout_ms\":%u,\"ready\":%s}", every, timeout, ready ? "true" : "false");
    const bool good = ask();
    depart(before);
    return good ? 0 : (complain("halcyon_every"), -EINVAL);
}

void program_alive(void) { __atomic_store_n(&alive, true, __ATOMIC_RELEASE); }

int program_safe(const char *pin, double value) {
    const locale_t before = enter();
    struct link *one = NULL;
    for (size_t i = 0; i < link_count; ++i) {
        const size_t prefix = strlen(links[i].prefix);
        if (strncmp(pin, links[i].prefix, prefix) == 0 && pin[prefix] == '.' && strcmp(pin + prefix + 1, links[i].name) == 0) one = &links[i];
    }
    const bool fits = one && one->type != HAL_TYPE_PORT;
    if (fits) {
        one->safe = true;
        one->safe_value = value;
    }
    const bool good = fits && announce(ready, true);
    if (one && !good) one->safe = false;
    depart(before);
    if (!fits) rtapi_print_msg(RTAPI_MSG_ERR, "%s: halcyon_safe: unknown pin '%s', or it has no value\n", name_of_program, pin);
    return good ? 0 : (fits ? complain(pin) : false, -EINVAL);
}

bool program_connected(void) {
    const locale_t before = enter();
    const bool there = !gone();
    depart(before);
    return there;
}

/* --- byte streams: each call asks the machine --------------------------------------------------------------------------------- */

static unsigned number_in(const char *answer, const char *key) {
    const char *const at = answer ? strstr(answer, key) : NULL;
    return at ? (unsigned)strtoul(at + strlen(key), NULL, 10) : 0;
}

/* verb: read, peek, write or nothing. True: all of it was done. `wanted` of the reply is returned in `number`. */
static bool use_port(hal_port_t port, const char *verb, char *to, const char *from, unsigned count, const char *wanted, unsigned *number) {
    const locale_t before = enter();
    const struct link *one = NULL;
    for (size_t i = 0; i < link_count; ++i)
        if ((const volatile void *)links[i].pin->slot == (const volatile void *)port) one = &links[i];
    bool done = false;
    if (one && connection >= 0) {
        add("{\"port\":\"%s.%s\"", one->prefix, one->name);
        if (to) add(",\"%s\":%u", verb, count);
        if (from) add(",\"write\":\"");
        for (unsigned i = 0; from && i < count; ++i) add("%02x", (unsigned char)from[i]);
        add(from ? "\"}" : "}");
        const char *const answer = ask(), *bytes = answer ? strstr(answer, "\"bytes\":\"") : NULL;
        done = answer && strstr(answer, "\"done\":true");
        for (unsigned i = 0; done && to && bytes && i < count; ++i) {
            const char pair[3] = {bytes[9 + 2 * i], bytes[10 + 2 * i], '\0'};
            to[i] = (char)strtoul(pair, NULL, 16);
        }
        if (wanted) *number = number_in(answer, wanted);
    }
    depart(before);
    return done;
}

bool hal_port_read(hal_port_t port, char *to, unsigned count) { return count > 0 && use_port(port, "read", to, NULL, count, NULL, NULL); }
bool hal_port_peek(hal_port_t port, char *to, unsigned count) { return count > 0 && use_port(port, "peek", to, NULL, count, NULL, NULL); }
bool hal_port_peek_commit(hal_port_t port, unsigned count) {
    char *const nowhere = malloc(count + 1);
    const bool done = nowhere && hal_port_read(port, nowhere, count);
    free(nowhere);
    return done;
}
bool hal_port_write(hal_port_t port, const char *from, unsigned count) {
    return count > 0 && use_port(port, "write", NULL, from, count, NULL, NULL);
}
static unsigned number_of(hal_port_t port, const char *key) {
    unsigned number = 0;
    use_port(port, "", NULL, NULL, 0, key, &number);
    return number;
}
unsigned hal_port_readable(hal_port_t port) { return number_of(port, "\"readable\":"); }
unsigned hal_port_writable(hal_port_t port) { return number_of(port, "\"writable\":"); }
unsigned hal_port_buffer_size(hal_port_t port) { return number_of(port, "\"size\":"); }
void hal_port_clear(hal_port_t port) { hal_port_peek_commit(port, hal_port_readable(port)); }
