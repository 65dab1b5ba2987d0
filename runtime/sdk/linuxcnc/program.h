/* SPDX-License-Identifier: MIT */
/* What the sources of a program (program*.c, comp_program.c) share; nothing for users. */
#ifndef HALCYON_LINUXCNC_PROGRAM_H
#define HALCYON_LINUXCNC_PROGRAM_H
#include <locale.h>

#include "hal/abi.h"
#include "hal/naming.h"

/* --- program.c: the pins ---------------------------------------------------------------------------------------------------- */

struct halcyon_link {
    hal_pin *pin;
    hal_type type;
    hal_dir dir;
    bool read_only;
    bool fresh;        /* sent with the next exchange, whatever its value is */
    bool safe;         /* safe_value is declared */
    double safe_value;
    char *prefix, *name, *doc;
    uint64_t last;     /* what both sides had */
    uint64_t before;   /* what they had before the last change from here */
    long long written_ns;
};
extern struct halcyon_link *halcyon_links; /* under the lock, as everything below */
extern size_t halcyon_link_count;
extern char halcyon_program_prefix[256]; /* of a .comp file's instance; "": names are whole */

locale_t halcyon_lock(void); /* numbers have a point until halcyon_unlock() restores the locale that this returns */
void halcyon_unlock(locale_t before);

/* --- program_protocol.c: requests and replies --------------------------------------------------------------------------------- */

extern int halcyon_connection;  /* -1: none */
extern char *halcyon_rejection; /* why the last request failed */

long halcyon_connect(void); /* returns the process ID of the machine; -1 when none is running */
void halcyon_disconnect(void);
bool halcyon_connection_lost(void);
const char *halcyon_instance(void); /* the name of the machine */

void halcyon_add(const char *format, ...) __attribute__((format(printf, 1, 2))); /* appends to the request */
void halcyon_add_string(const char *text);
void halcyon_add_value(hal_type type, hal_value value);
void halcyon_add_number(hal_type type, double value);
void halcyon_drop_request(void);
char *halcyon_ask(void); /* sends the request and returns the reply; NULL when it was rejected or the connection is lost */

uint64_t halcyon_significant(hal_type type, uint64_t raw);         /* clears the bytes of a slot that the type does not use */
hal_value halcyon_take_value(const char **at, hal_type type); /* reads a value of a reply and moves `at` behind it */

#endif
