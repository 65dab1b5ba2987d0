// SPDX-License-Identifier: MIT
// Pins and parameters. A pin's slot, a pointer in the module's memory, follows the pin when it is
// linked (hal_pin_decl.pointer).
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>

#include "linuxcnc/binary/module.hpp"

namespace hal::modules {

namespace {

enum Type { bit = 1, real = 2, s32 = 3, u32 = 4, port = 5, s64 = 6, u64 = 7 };
enum Direction { in = 16, out = 32, io = 48, read_only = 64, read_write = 192 };

bool type_of(int type, hal_type& to, std::uint32_t& width) {
    switch (type) {
    case bit:
        to = HAL_TYPE_BIT;
        width = 1;
        return true;
    case real:
        to = HAL_TYPE_FLOAT;
        width = 8;
        return true;
    case s32:
        to = HAL_TYPE_S32;
        width = 4;
        return true;
    case u32:
        to = HAL_TYPE_U32;
        width = 4;
        return true;
    case s64:
        to = HAL_TYPE_S64;
        width = 8;
        return true;
    case u64:
        to = HAL_TYPE_U64;
        width = 8;
        return true;
    default: return false;
    }
}

int fail(const char* function, const char* name, const char* why) {
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: '%s': %s\n", function, name, why);
    return -EINVAL;
}

int new_pin(const char* name, int type, int dir, void** slot, int comp) {
    if (type == port) return new_port_pin(name, dir, slot, comp);
    return new_slot("hal_pin_new", false, name, type, dir, slot, hal_value{.raw = 0}, comp);
}

int new_parameter(const char* name, int type, int dir, void* value, int comp) {
    if (const int wrong = declaring("hal_param_new", name, comp); wrong != 0) return wrong;
    Module& module = *Module::current();
    hal_pin_decl decl{};
    decl.size = sizeof decl;
    std::uint32_t width = 0;
    if (!value) return fail("hal_param_new", name, "no variable");
    if (!type_of(type, decl.type, width)) return fail("hal_param_new", name, "unsupported type");
    if (dir != read_only && dir != read_write) {
        return fail("hal_param_new", name, "invalid direction");
    }
    if (!module.reserve_name(true, name)) {
        return fail("hal_param_new", name, "duplicate parameter name");
    }
    const hal_host* const host = module.host();
    void* const memory = host->allocate(host, sizeof(Parameter), alignof(Parameter));
    if (!memory) return -ENOMEM;
    Parameter* const parameter = new (memory) Parameter{{}, value, hal_value{.raw = 0}, width};
    std::memcpy(&parameter->last, value, width);
    decl.dir = HAL_DIR_PARAM;
    decl.flags = dir == read_only ? HAL_PIN_READ_ONLY : 0;
    decl.name = name;
    decl.doc = decl.unit = "";
    decl.initial = parameter->last;
    if (!host->pin(host, &decl, &parameter->pin)) return -EINVAL;
    module.parameters.add(name, parameter);
    return 0;
}

}  // namespace

int new_slot(const char* function, bool parameter, const char* name, int type, int dir, void** slot,
             hal_value initial, int comp) {
    if (const int wrong = declaring(function, name, comp); wrong != 0) return wrong;
    Module& module = *Module::current();
    hal_pin_decl decl{};
    decl.size = sizeof decl;
    std::uint32_t width = 0;
    if (!slot) return fail(function, name, "no pointer");
    if (!type_of(type, decl.type, width)) return fail(function, name, "unsupported type");
    if (parameter ? dir != read_only && dir != read_write : dir != in && dir != out && dir != io) {
        return fail(function, name, "invalid direction");
    }
    if (!module.reserve_name(parameter, name)) {
        return fail(function, name, parameter ? "duplicate parameter name" : "duplicate pin name");
    }
    const hal_host* const host = module.host();
    hal_pin* const pin =
        static_cast<hal_pin*>(host->allocate(host, sizeof(hal_pin), alignof(hal_pin)));
    if (!pin) return -ENOMEM;
    if (parameter) {
        decl.dir = HAL_DIR_PARAM;
    } else if (dir == in) {
        decl.dir = HAL_DIR_IN;
    } else if (dir == out) {
        decl.dir = HAL_DIR_OUT;
    } else {
        decl.dir = HAL_DIR_IO;
    }
    decl.flags = dir == read_only ? HAL_PIN_READ_ONLY : 0;
    decl.name = name;
    decl.doc = decl.unit = "";
    decl.initial = initial;
    decl.pointer = reinterpret_cast<hal_value**>(slot);
    if (!host->pin(host, &decl, pin)) return -EINVAL;
    module.slots.push_back(decl.pointer);
    return 0;
}

int format_name(char (&name)[256], const char* function, const char* format, va_list arguments) {
    const int length = std::vsnprintf(name, sizeof name, format, arguments);
    if (length >= 0 && static_cast<std::size_t>(length) <= longest_name()) return 0;
    fail(function, name, too_long().c_str());
    return -ENOMEM;
}

namespace {

/// Formats the name and passes it on; one that is too long has an error of its own.
template <class Action>
int formatted(const char* format, va_list arguments, Action action) {
    char name[256];
    if (const int wrong =
            guarded([&] { return format_name(name, "hal_pin_newf", format, arguments); });
        wrong != 0) {
        return wrong;
    }
    return guarded([&] { return action(name); });
}

}  // namespace
}  // namespace hal::modules

using namespace hal::modules;

extern "C" {

int hal_pin_new(const char* name, int type, int dir, void** slot, int comp) {
    return guarded([&] { return new_pin(name, type, dir, slot, comp); });
}
int hal_param_new(const char* name, int type, int dir, void* value, int comp) {
    return guarded([&] { return new_parameter(name, type, dir, value, comp); });
}

#define HALCYON_DEFINE(suffix, type)                                                         \
    int hal_pin_##suffix##_new(const char* name, int dir, void** slot, int comp) {           \
        return hal_pin_new(name, type, dir, slot, comp);                                     \
    }                                                                                        \
    int hal_param_##suffix##_new(const char* name, int dir, void* value, int comp) {         \
        return hal_param_new(name, type, dir, value, comp);                                  \
    }                                                                                        \
    int hal_pin_##suffix##_newf(int dir, void** slot, int comp, const char* format, ...) {   \
        va_list arguments;                                                                   \
        va_start(arguments, format);                                                         \
        const int result = formatted(format, arguments, [&](const char* name) {              \
            return new_pin(name, type, dir, slot, comp);                                     \
        });                                                                                  \
        va_end(arguments);                                                                   \
        return result;                                                                       \
    }                                                                                        \
    int hal_param_##suffix##_newf(int dir, void* value, int comp, const char* format, ...) { \
        va_list arguments;                                                                   \
        va_start(arguments, format);                                                         \
        const int result = formatted(format, arguments, [&](const char* name) {              \
            return new_parameter(name, type, dir, value, comp);                              \
        });                                                                                  \
        va_end(arguments);                                                                   \
        return result;                                                                       \
    }
HALCYON_DEFINE(bit, bit)
HALCYON_DEFINE(float, real)
HALCYON_DEFINE(s32, s32)
HALCYON_DEFINE(u32, u32)
HALCYON_DEFINE(s64, s64)
HALCYON_DEFINE(u64, u64)
#undef HALCYON_DEFINE

int hal_param_alias(const char* name, const char* alias) {
    return guarded([&] {
        const Module* const module = Module::current();
        if (!name || !module) return -EINVAL;
        if (module->extension().alias(module->host(), name, alias)) return 0;
        return give_command("hal_param_alias", alias ? "alias" : "unalias", {"param", name, alias});
    });
}
}
