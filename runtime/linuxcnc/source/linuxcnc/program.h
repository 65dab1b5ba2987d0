/* SPDX-License-Identifier: MIT */
/* What the sources of a program (program*.c, comp_program.c) share; nothing for users. */
#ifndef HALCYON_LINUXCNC_PROGRAM_H
#define HALCYON_LINUXCNC_PROGRAM_H
#include <locale.h>

#include "hal/abi.h"
#include "hal/naming.h"

/* --- program.c: the components, each with its pins --- */

struct halcyon_link {
    hal_pin* pin;
    hal_type type;
    hal_dir dir;
    bool read_only;
    bool fresh; /* sent with the next exchange, whatever its value is */
    bool safe; /* safe_value is declared */
    double safe_value;
    char *prefix, *name, *doc;
    uint64_t last; /* what both sides had */
    uint64_t before; /* what they had before the last change from here */
    long long written_ns;
};
struct halcyon_program {
    char name[HAL_NAME_LEN + 1]; /* "": this place is free */
    bool ready;
    struct halcyon_link* links;
    size_t link_count, link_capacity;
    unsigned every_ms, timeout_ms;
    bool alive; /* reported by the program since the last exchange */
    long long alive_ns; /* time of the last report to the machine */
};
/* All under the lock. Most programs have one; LinuxCNC's task has one of its own and one of its
 * interpreter. Their ids count from 4, because programs print them: in LinuxCNC 1 to 3 belong to
 * the runtime. */
enum { halcyon_most_programs = 16, halcyon_first_id = 4 };
extern struct halcyon_program halcyon_programs[halcyon_most_programs];
const char* halcyon_program_name(void); /* of the first, for messages about all of them */
extern char halcyon_program_prefix[256]; /* of a .comp file's instance; "": names are whole */

/* numbers have a point until halcyon_unlock() restores the locale that this returns */
locale_t halcyon_lock(void);
void halcyon_unlock(locale_t before);

/* --- program_exchange.c: what the machine and this process exchange; all under the lock --- */

extern bool halcyon_ending; /* the helper thread is to end */
bool halcyon_find_machine(void);
bool halcyon_announce(struct halcyon_program*, bool is_ready,
                      bool whole); /* registers it; whole: with safe values of its pins */
bool halcyon_declare(struct halcyon_program*, struct halcyon_link*);
void halcyon_unregister(struct halcyon_program*);
void halcyon_exchange(struct halcyon_program*);
bool halcyon_start_helper(void); /* false when the thread cannot be made */
void halcyon_stop_helper(void); /* not under the lock */
void halcyon_catch_end_signals(void);
/* ../../programs: called by hal_init() */
__attribute__((weak)) void halcyon_begins(void);

/* --- program_protocol.c: requests and replies --- */

extern int halcyon_connection; /* -1: none */
extern char* halcyon_rejection; /* why the last request failed */

long halcyon_connect(void); /* returns the process ID of the machine; -1 when none is running */
void halcyon_disconnect(void);
bool halcyon_connection_lost(void);
const char* halcyon_instance(void); /* the name of the machine */

void halcyon_add(const char* format, ...)
    __attribute__((format(printf, 1, 2))); /* appends to the request */
void halcyon_add_string(const char* text);
void halcyon_add_value(hal_type type, hal_value value);
void halcyon_add_number(hal_type type, double value);
void halcyon_drop_request(void);
/* Reads, peeks (verb) or writes count bytes of a port, or asks for its state. Returns true when all
 * were transferred; sets number to the value of the reply's key. Under the lock. */
bool halcyon_use_port(const struct halcyon_link* port, const char* verb, char* to, const char* from,
                      unsigned count, const char* key, unsigned* number);
/* sends the request and returns the reply; NULL when it was rejected or the connection is lost */
char* halcyon_ask(void);

/* clears the bytes of a slot that the type does not use */
uint64_t halcyon_significant(hal_type type, uint64_t raw);
hal_value halcyon_take_value(const char** at,
                             hal_type type); /* reads a value of a reply and moves `at` behind it */

#endif
