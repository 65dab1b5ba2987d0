/* SPDX-License-Identifier: MIT */
/* What the sources of liblinuxcnchal.so.0 share: commands to the machine, and what it knows by
 * name. All [setup]. */
#ifndef HALCYON_PROGRAMS_COMMANDS_H
#define HALCYON_PROGRAMS_COMMANDS_H
#include <stdbool.h>
#include <stdint.h>

/* Runs one command, given as its words up to NULL. 0, or a negative errno after printing why. Sets
 * number, if there is one, to that behind `key` in what the command prints. */
int halcyon_run(const char* const* words, const char* key, unsigned* number);
#define RUN(...) halcyon_run((const char* const[]){__VA_ARGS__, NULL}, NULL, NULL)

union halcyon_data {
    bool bit;
    double real;
    int32_t s32;
    uint32_t u32;
    int64_t s64;
    uint64_t raw;
};
struct halcyon_object {
    int type; /* a hal_type_t */
    union halcyon_data value; /* of 32 bit: extended to all 8 bytes */
    int dir; /* a hal_pdir_t; 0: a signal */
    char signal[256], component[256];
    bool has_writer; /* a signal */
    int pins; /* linked to the signal */
};
bool halcyon_component_exists(const char* name);
/* Looks one up by its whole name; the kind is "pin", "param" or "sig". 0, or -ENOENT. */
int halcyon_look_up(const char* kind, const char* name, struct halcyon_object* to);

#endif
