/* SPDX-License-Identifier: MIT */
/*
 * What a program and the machine exchange (docs/protocol.md): registration, declarations, and the
 * values, which a helper thread exchanges some 400 times a second. It sends what the program has
 * changed and stores what the machine has changed, unless the program has changed the same pin in
 * the meantime; then the program's value is sent with the next exchange.
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

static pthread_t helper;
static bool helper_runs;
bool halcyon_ending;
static volatile sig_atomic_t asked_to_end;
static long machine; /* its process ID */
static bool tied;    /* the kernel ends this process with the machine */
static bool loss_reported;
static unsigned loss_rounds; /* attempts to reconnect since then */
enum { patient_rounds = 10 };

bool halcyon_find_machine(void) {
    const long pid = halcyon_connect();
    if (pid < 0) return false;
    machine = pid;
    int death_signal = 0;
    tied = prctl(PR_GET_PDEATHSIG, &death_signal) == 0 && death_signal != 0 && getppid() == machine;
    loss_reported = false;
    loss_rounds = 0;
    return true;
}
static void report_loss(void) {
    if (loss_reported) return;
    const char* const wanted = getenv("HALCYON_LOST");
    const bool end = wanted && strcmp(wanted, "end") == 0;
    /* The kernel's SIGTERM, or the machine's, is on its way. A program that has a handler and
     * begins to wait after it has come needs another. */
    if (end && tied && ++loss_rounds < patient_rounds) return;
    loss_reported = true;
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: the machine '%s' (process %ld) has ended; %s\n",
                    halcyon_program_name(), halcyon_instance(), machine,
                    end ? "ending"
                        : "pins keep their values until it returns (HALCYON_LOST=end ends the "
                          "program instead)");
    if (end) {
        kill(getpid(), SIGTERM);
    }
}

bool halcyon_announce(struct halcyon_program* of, bool is_ready, bool whole) {
    halcyon_add("{\"component\":");
    halcyon_add_string(of->name);
    if (of->every_ms > 0) {
        halcyon_add(",\"every_ms\":%u,\"timeout_ms\":%u", of->every_ms, of->timeout_ms);
    }
    bool first = true;
    for (size_t i = 0; whole && i < of->link_count; ++i) {
        if (!of->links[i].safe) continue;
        halcyon_add(first ? ",\"safe\":[%zu," : ",%zu,", i);
        halcyon_add_number(of->links[i].type, of->links[i].safe_value);
        first = false;
    }
    if (!first) {
        halcyon_add("]");
    }
    halcyon_add(",\"ready\":%s}", is_ready ? "true" : "false");
    return halcyon_ask();
}

bool halcyon_declare(struct halcyon_program* of, struct halcyon_link* one) {
    halcyon_add("{\"component\":");
    halcyon_add_string(of->name);
    halcyon_add(",\"prefix\":");
    halcyon_add_string(one->prefix);
    halcyon_add(",\"pins\":[{\"name\":");
    halcyon_add_string(one->name);
    static const char *const types[] = {"bit", "float", "s32", "u32", "s64", "u64", "port"},
                             *const dirs[] = {"in", "out", "io", "rw"};
    halcyon_add(",\"type\":\"%s\",\"dir\":\"%s\",\"doc\":", types[one->type],
                one->read_only ? "ro" : dirs[one->dir]);
    halcyon_add_string(one->doc);
    if (one->type != HAL_TYPE_PORT) {
        halcyon_add(",\"value\":");
        halcyon_add_value(one->type, *one->pin->slot);
    }
    halcyon_add("}]}");
    const char* const answer = halcyon_ask();
    const char* at = answer ? strstr(answer, "\"values\":[") : NULL;
    if (!at) return false;
    at += 10;
    one->fresh = one->dir == HAL_DIR_OUT || one->read_only;
    if (one->type == HAL_TYPE_PORT || one->fresh) return true;
    *one->pin->slot =
        halcyon_take_value(&at, one->type); /* of a predecessor's pin: what that has */
    one->last = halcyon_significant(one->type, one->pin->slot->raw);
    return true;
}

void halcyon_unregister(struct halcyon_program* of) {
    if (halcyon_connection >= 0) {
        halcyon_add("{\"exit\":");
        halcyon_add_string(of->name);
        halcyon_add("}");
        halcyon_ask();
    }
    bool last = true;
    for (size_t i = 0; i < halcyon_most_programs; ++i) {
        last = last && (!*halcyon_programs[i].name || &halcyon_programs[i] == of);
    }
    if (last) {
        halcyon_disconnect();
    }
}

/* --- exchange --- */

static bool own(const struct halcyon_link* one) {
    return one->dir == HAL_DIR_OUT || one->read_only;
}

/* What a request exchanges. */
struct exchange {
    bool reads;
    bool writes;
};

/* Adds the values that the program has changed. `seen` takes the present values of all links. */
static struct exchange add_values(struct halcyon_program* of, uint64_t* seen, long long now) {
    struct exchange request = {false, false};
    for (size_t i = 0; i < of->link_count; ++i) {
        struct halcyon_link* const one = &of->links[i];
        seen[i] = __atomic_load_n(&one->pin->slot->raw, __ATOMIC_ACQUIRE);
        if (one->type == HAL_TYPE_PORT) continue;
        request.reads = request.reads || !own(one);
        /* also an input that the program itself has set, as LinuxCNC's task does: an unlinked one
         * keeps that value */
        if (!one->fresh && halcyon_significant(one->type, seen[i]) == one->last) continue;
        halcyon_add(request.writes ? ",%zu," : ",\"write\":[%zu,", i);
        halcyon_add_value(one->type, (hal_value){.raw = seen[i]});
        request.writes = true;
        one->fresh = false;
        one->before = one->last;
        one->last = halcyon_significant(one->type, seen[i]);
        one->written_ns = now;
    }
    if (request.writes) {
        halcyon_add("]");
    }
    return request;
}

/* Adds that the program is not alive. Returns true when a sign of life is due. */
static bool add_sign_of_life(struct halcyon_program* of, struct exchange request, long long now) {
    const bool lives = __atomic_exchange_n(&of->alive, false, __ATOMIC_ACQ_REL);
    const bool is_due = request.reads || now - of->alive_ns > of->every_ms * 250000LL;
    const bool reports = of->every_ms > 0 && lives && is_due;
    if (of->every_ms > 0 && !lives) {
        halcyon_add(",\"alive\":false");
    }
    if (reports || (request.writes && lives)) {
        of->alive_ns = now;
    } else if (lives && !request.writes) {
        __atomic_store_n(&of->alive, true, __ATOMIC_RELEASE); /* with the next one */
    }
    return reports;
}

/* Takes the values of an answer for pins that the program has not set since they were `seen`. */
static void take_values(struct halcyon_program* of, const char* at, uint64_t* seen, long long now) {
    for (size_t i = 0; i < of->link_count; ++i) {
        struct halcyon_link* const one = &of->links[i];
        if (own(one)) continue;
        const hal_value value = halcyon_take_value(&at, one->type);
        const uint64_t there = halcyon_significant(one->type, value.raw);
        if (one->type == HAL_TYPE_PORT || there == one->last) continue;
        /* what was written takes a cycle to arrive: until then the old value is still there */
        if (there == one->before && now - one->written_ns < settle_ns) continue;
        if (__atomic_compare_exchange_n(&one->pin->slot->raw, &seen[i], value.raw, false,
                                        __ATOMIC_ACQ_REL, __ATOMIC_RELAXED)) {
            one->last = there;
        }
    }
}

void halcyon_exchange(struct halcyon_program* of) {
    static const char values[] = "\"values\":[";
    const long long now = rtapi_get_time();
    halcyon_sync_parameters();
    uint64_t seen[of->link_count + 1];
    halcyon_add("{\"exchange\":");
    halcyon_add_string(of->name);
    const struct exchange request = add_values(of, seen, now);
    const bool reports = add_sign_of_life(of, request, now);
    halcyon_add(request.reads ? ",\"read\":true}" : "}");
    if (!request.reads && !request.writes && !reports) {
        halcyon_drop_request();
        return;
    }
    const char* const answer = halcyon_ask();
    if (!answer) {
        halcyon_disconnect();
        return;
    }
    const char* const found = strstr(answer, values);
    if (!found) return;
    take_values(of, found + sizeof values - 1, seen, now);
    halcyon_sync_parameters();
}

static void reconnect(void) {
    if (!halcyon_find_machine()) {
        report_loss();
        return;
    }
    bool good = true;
    for (struct halcyon_program* of = halcyon_programs;
         of < halcyon_programs + halcyon_most_programs && good; ++of) {
        if (!*of->name) continue;
        good = halcyon_announce(of, false, false);
        for (size_t i = 0; good && i < of->link_count; ++i) {
            good = halcyon_declare(of, &of->links[i]);
        }
        if (good) {
            halcyon_exchange(of);
        }
        good = good && halcyon_connection >= 0 && halcyon_announce(of, of->ready, true);
    }
    if (!good) {
        halcyon_disconnect();
    }
}

static void exchange_all(void) {
    for (struct halcyon_program* of = halcyon_programs;
         of < halcyon_programs + halcyon_most_programs && halcyon_connection >= 0; ++of) {
        if (of->ready) {
            halcyon_exchange(of);
        }
    }
}

static void* run_helper(void* unused) {
    for (bool on = true; on;) {
        const bool lost = halcyon_connection_lost();
        const struct timespec pause = {0, lost ? reconnect_ns : round_ns};
        nanosleep(&pause, NULL);
        const locale_t before = halcyon_lock();
        on = !halcyon_ending;
        if (asked_to_end) {
            for (size_t i = 0; i < halcyon_most_programs; ++i) {
                if (*halcyon_programs[i].name) {
                    halcyon_unregister(&halcyon_programs[i]);
                }
            }
            fflush(stdout);
            _exit(0);
        }
        if (on && lost) {
            reconnect();
        } else if (on) {
            exchange_all();
        }
        halcyon_unlock(before);
    }
    return unused;
}

static void on_end_signal(int signal) {
    (void)signal;
    if (!helper_runs) {
        _exit(0);
    }
    asked_to_end = 1;
}

static void catch_end_signal(int number) {
    struct sigaction now;
    if (sigaction(number, NULL, &now) != 0 || now.sa_handler != SIG_DFL) return;
    now.sa_handler = on_end_signal;
    sigaction(number, &now, NULL);
}
void halcyon_catch_end_signals(void) {
    catch_end_signal(SIGTERM);
    catch_end_signal(SIGINT);
}

bool halcyon_start_helper(void) {
    if (helper_runs) return true;
    sigset_t every, mine; /* signals are the program's own thread's */
    sigfillset(&every);
    pthread_sigmask(SIG_SETMASK, &every, &mine);
    helper_runs = pthread_create(&helper, NULL, run_helper, NULL) == 0;
    pthread_sigmask(SIG_SETMASK, &mine, NULL);
    return helper_runs;
}
void halcyon_stop_helper(void) {
    if (helper_runs) {
        pthread_join(helper, NULL);
    }
    helper_runs = halcyon_ending = false;
}
