/* SPDX-License-Identifier: MIT */
/* Byte streams: the numbers of a program's port pins. A number holds the places of the component
 * and of its pin, so it needs no table. */
#include "linuxcnc/programs/ports.h"

#include "linuxcnc/inside.h"
#include "linuxcnc/program.h"

enum { pins_per_program = 1 << 20 };

int halcyon_number_of_port(const hal_pin* pin) {
    int number = 0;
    const locale_t before = halcyon_lock();
    for (int place = 0; place < halcyon_most_programs; ++place) {
        for (size_t i = 0; i < halcyon_programs[place].link_count; ++i) {
            if (halcyon_programs[place].links[i].pin == pin) {
                number = place * pins_per_program + (int)i + 1;
            }
        }
    }
    halcyon_unlock(before);
    return number;
}

static const struct halcyon_link* link_of(int number) {
    if (number < 1 || (number - 1) / pins_per_program >= halcyon_most_programs) return NULL;
    const struct halcyon_program* const of = &halcyon_programs[(number - 1) / pins_per_program];
    const size_t place = (size_t)((number - 1) % pins_per_program);
    return *of->name && place < of->link_count && of->links[place].type == HAL_TYPE_PORT
               ? &of->links[place]
               : NULL;
}

bool halcyon_use_port_number(int port, const char* verb, char* to, const char* from, unsigned count,
                             const char* key, unsigned* number) {
    if (key) {
        *number = 0;
    }
    const locale_t before = halcyon_lock();
    const struct halcyon_link* const one = link_of(port);
    const bool done = one && halcyon_use_port(one, verb, to, from, count, key, number);
    halcyon_unlock(before);
    return done;
}
