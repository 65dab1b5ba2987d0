/* SPDX-License-Identifier: MIT */
/*
 * main() of a program made of a .comp file with `option userspace`: makes the instances that count=
 * or names= ask for, then runs the file's user_mainloop(). Other words are left to its userinit().
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "comp_instance.h"
#include "inside.h"
#include "program.h"

enum { max_names = 16 };

int count;
char* names[max_names];
void user_mainloop(void);
void userinit(int argc, char** argv) __attribute__((weak));
extern const hal_component hal_plugin;

/* Returns true for an argument that count= or names= is; exits after reporting an invalid one. */
static bool take_word(char* word) {
    char* end = NULL;
    if (strncmp(word, "count=", 6) == 0) {
        const long wanted = strtol(word + 6, &end, 0);
        if (end == word + 6 || *end || wanted < 0 || wanted > 1000) {
            fprintf(stderr, "%s: %s is not a valid number of instances\n", hal_plugin.name, word);
            exit(1);
        }
        count = (int)wanted;
        return true;
    }
    if (strncmp(word, "names=", 6) != 0) return false;
    char* rest = NULL;
    int found = 0;
    for (char* name = strtok_r(word + 6, ",", &rest); name; name = strtok_r(NULL, ",", &rest)) {
        if (found == max_names) {
            fprintf(stderr, "%s: names= has more than %d names\n", hal_plugin.name, max_names);
            exit(1);
        }
        names[found++] = name;
    }
    return true;
}

bool halcyon_enter(const hal_host* of, const char* instance) {
    (void)of;
    halcyon_set_instance(instance);
    return true;
}
bool halcyon_fail_setup(const char* function, int result) {
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: %s failed: %s\n", hal_plugin.name, function,
                    strerror(-result));
    return false;
}
bool halcyon_leave(bool good) {
    halcyon_set_instance("");
    return good;
}
bool halcyon_start(void* self, const hal_host* of) { return (void)self, (void)of, true; }
void halcyon_stop(void* self) { (void)self; }
void halcyon_gone(void) {}

int main(int argc, char** argv) {
    int kept = argc > 0;
    for (int i = 1; i < argc; ++i) {
        if (!take_word(argv[i])) {
            argv[kept++] = argv[i];
        }
    }
    argv[kept] = NULL;
    if (count > 0 && names[0]) {
        fprintf(stderr, "%s: count= and names= exclude each other\n", hal_plugin.name);
        return 1;
    }
    if (userinit) {
        userinit(kept, argv);
    }
    const int component = hal_init(hal_plugin.name);
    if (component < 0) return 1;

    char stem[64];
    snprintf(stem, sizeof stem, "%s", hal_plugin.name);
    for (char* at = stem; *at; ++at) {
        if (*at == '_') {
            *at = '-';
        }
    }
    const char* const usual = strncmp(stem, "hal-", 4) == 0 ? stem + 4 : stem;
    const bool single = hal_plugin.flags & HAL_COMPONENT_SINGLETON;
    int wanted = count > 0 ? count : (int)hal_plugin.default_count;
    if (single) {
        wanted = 1;
    }
    for (int i = 0; names[0] ? i < max_names && names[i] : i < wanted; ++i) {
        if (names[0]) {
            snprintf(halcyon_program_prefix, sizeof halcyon_program_prefix, "%s", names[i]);
        } else if (single) {
            snprintf(halcyon_program_prefix, sizeof halcyon_program_prefix, "%s", usual);
        } else {
            snprintf(halcyon_program_prefix, sizeof halcyon_program_prefix, "%s.%d", usual, i);
        }
        void* const instance = halcyon_current_host->allocate(
            halcyon_current_host, hal_plugin.instance_size, hal_plugin.instance_align);
        if (!instance || !hal_plugin.create(halcyon_current_host, instance)) {
            hal_exit(component);
            return 1;
        }
    }
    if (hal_ready(component) < 0) return 1;
    user_mainloop();
    hal_exit(component);
    return 0;
}
