/* SPDX-License-Identifier: MIT */
/* Pins, parameters and signals by name: the machine describes them. */
#include <stdio.h>
#include <string.h>

#include "commands.h"
#include "linuxcnc/inside.h"
#include "linuxcnc/program.h"

/* The member of that key of the object that begins at `object`: what follows the key, or NULL. */
static const char* member(const char* object, const char* key) {
    const char *const end = strchr(object, '}'), *const at = strstr(object, key);
    return at && (!end || at < end) ? at + strlen(key) : NULL;
}
static void copy_text(char (*to)[256], const char* from) {
    const size_t length = from ? strcspn(from, "\"") : 0;
    snprintf(*to, sizeof *to, "%.*s", (int)length, from ? from : "");
}
static int count_texts(const char* from) {
    int quotes = 0;
    for (; from && *from && *from != ']'; ++from) {
        quotes += *from == '"';
    }
    return quotes / 2;
}

static bool take(const char* object, struct halcyon_object* to) {
    static const struct {
        const char* word;
        hal_type_t type;
        hal_type own;
    } types[] = {{"bit\"", HAL_BIT, HAL_TYPE_BIT}, {"float\"", HAL_FLOAT, HAL_TYPE_FLOAT},
                 {"s32\"", HAL_S32, HAL_TYPE_S32}, {"u32\"", HAL_U32, HAL_TYPE_U32},
                 {"s64\"", HAL_S64, HAL_TYPE_S64}, {"u64\"", HAL_U64, HAL_TYPE_U64}};
    static const struct {
        const char* word;
        hal_pdir_t dir;
    } dirs[] = {{"IN\"", HAL_IN},
                {"OUT\"", HAL_OUT},
                {"I/O\"", HAL_IO},
                {"RO\"", HAL_RO},
                {"RW\"", HAL_RW}};
    const char *const word = member(object, "\"type\":\""), *const dir =
                                                                member(object, "\"dir\":\"");
    const char* value = member(object, "\"value\":");
    size_t i = 0;
    while (word && i < sizeof types / sizeof *types &&
           strncmp(word, types[i].word, strlen(types[i].word)) != 0) {
        ++i;
    }
    if (!word || !value || i == sizeof types / sizeof *types) return false;
    *to = (struct halcyon_object){.type = (int)types[i].type};
    to->value.raw = halcyon_take_value(&value, types[i].own).raw;
    for (size_t d = 0; dir && d < sizeof dirs / sizeof *dirs; ++d) {
        if (strncmp(dir, dirs[d].word, strlen(dirs[d].word)) == 0) {
            to->dir = (int)dirs[d].dir;
        }
    }
    copy_text(&to->signal, member(object, "\"signal\":\""));
    copy_text(&to->component, member(object, "\"component\":\""));
    to->has_writer = member(object, "\"writer\":\"") != NULL;
    to->pins = count_texts(member(object, "\"pins\":["));
    return true;
}

bool halcyon_component_exists(const char* name) {
    const locale_t before = halcyon_lock();
    bool found = false;
    if (halcyon_connection >= 0) {
        halcyon_add("{\"list\":\"comp\",\"patterns\":[");
        halcyon_add_string(name);
        halcyon_add("]}");
        const char* const answer = halcyon_ask();
        char quoted[256]; /* names of components have no character that JSON writes otherwise */
        const int length = snprintf(quoted, sizeof quoted, "\"%s\"", name);
        const char* const names = answer ? strstr(answer, "\"names\":[") : NULL;
        found = names && length > 0 && length < (int)sizeof quoted && strstr(names, quoted);
    }
    halcyon_unlock(before);
    return found;
}

int halcyon_look_up(const char* kind, const char* name, struct halcyon_object* to) {
    if (!name || !*name || strlen(name) > HAL_NAME_LEN) return -ENOENT;
    const locale_t before = halcyon_lock();
    int result = -ENOENT;
    if (halcyon_connection >= 0) {
        halcyon_add("{\"describe\":\"%s\",\"patterns\":[", kind);
        halcyon_add_string(name);
        halcyon_add("]}");
        const char* const answer = halcyon_ask();
        char wanted[HAL_NAME_LEN + 16];
        snprintf(wanted, sizeof wanted, "{\"name\":\"%s\"", name);
        const char* const object = answer ? strstr(answer, wanted) : NULL;
        if (object && take(object, to)) {
            result = 0;
        }
    }
    halcyon_unlock(before);
    return result;
}
