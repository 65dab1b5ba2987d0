/* SPDX-License-Identifier: MIT */
/* rtapi.h: module parameters, which loadrt gives as arguments. */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "inside.h"
#include "rtapi_app.h"

extern const struct halcyon_parameter* const __start_halcyon_parameters[]
    __attribute__((weak, visibility("hidden")));
extern const struct halcyon_parameter* const __stop_halcyon_parameters[]
    __attribute__((weak, visibility("hidden")));

static bool reject_value(const char* argument, const char* value, const char* why) {
    char text[2600];
    snprintf(text, sizeof text, "%s=%s %s", argument, value, why);
    const hal_rejection rejection = {
        sizeof rejection, HAL_SUBJECT_ARGUMENT, argument, 0, 0, "", text, ""};
    if (halcyon_current_host->size > HAL_HOST_SIZE_1_1 && halcyon_current_host->reject) {
        halcyon_current_host->reject(halcyon_current_host, &rejection);
    } else {
        halcyon_current_host->fail(halcyon_current_host, text);
    }
    return false;
}

static bool take_element(const struct halcyon_parameter* p, int index, const char* text) {
    if (p->type == 's') {
        char* const copy =
            halcyon_current_host->allocate(halcyon_current_host, strlen(text) + 1, 1);
        if (!copy) return halcyon_fail("out of memory for %s=", p->name);
        strcpy(copy, text);
        ((char**)p->place)[index] = copy;
        return true;
    }
    char* end;
    errno = 0;
    const long value = strtol(text, &end, 0);
    if (errno != 0 || end == text || *end != '\0' || (p->type == 'i' && value != (int)value)) {
        return reject_value(p->name, text, "is not a whole number");
    }
    if (p->type == 'i') {
        ((int*)p->place)[index] = (int)value;
    } else {
        ((long*)p->place)[index] = value;
    }
    return true;
}

static bool take_parameter(const struct halcyon_parameter* p) {
    char fallback[128] = "";
    if (p->max == 0) {
        if (p->type == 'i') {
            snprintf(fallback, sizeof fallback, "%d", *(int*)p->place);
        } else if (p->type == 'l') {
            snprintf(fallback, sizeof fallback, "%ld", *(long*)p->place);
        } else if (*(char**)p->place) {
            snprintf(fallback, sizeof fallback, "%s", *(char**)p->place);
        }
    }
    const hal_argument_decl decl = {sizeof decl, 0, p->name, p->doc, fallback};
    const char* const given = halcyon_current_host->argument(halcyon_current_host, &decl);
    if (!given || given == fallback) { /* a default may be written to as a given value may */
        const char* const usual = p->type == 's' && p->max == 0 ? *(char**)p->place : NULL;
        return !usual || take_element(p, 0, usual);
    }
    if (p->max == 0) return take_element(p, 0, given);
    int index = 0;
    for (const char* at = given;; ++index) {
        const char* const comma = strchrnul(at, ',');
        if (index >= p->max) {
            char why[40];
            snprintf(why, sizeof why, "has more than %d values", p->max);
            return reject_value(p->name, given, why);
        }
        char* const element = strndup(at, (size_t)(comma - at));
        const bool good = element ? take_element(p, index, element)
                                  : halcyon_fail("out of memory for %s=", p->name);
        free(element);
        if (!good) return false;
        if (*comma == '\0') return true;
        at = comma + 1;
    }
}

bool halcyon_take_arguments(void) {
    for (const struct halcyon_parameter* const* p = __start_halcyon_parameters;
         p < __stop_halcyon_parameters; ++p) {
        if (!take_parameter(*p)) return false;
    }
    return true;
}
