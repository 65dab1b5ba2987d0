// SPDX-License-Identifier: MIT
// What a module does to the machine as a whole: signals, links, aliases, threads, values and locks.
// While it is loaded each call is a part of the transaction that loads it; while it is unloaded its
// pins are linked to nothing and its functions are in no thread any more.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "linuxcnc/binary/module.hpp"

namespace hal::modules {
namespace {

enum Type { bit = 1, real = 2, s32 = 3, u32 = 4, port = 5, s64 = 6, u64 = 7 };

int fail(const char* function, const char* name, const char* why, int result = -EINVAL) {
    if (in_cycle) {
        return result;  // the result is enough, in every cycle
    }
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: '%s': %s\n", function, name ? name : "(null)", why);
    return result;
}

constexpr const char* only_while_loaded = "only while a module is loaded, in rtapi_app_main";

void report_afterwards(const char* why) {
    rtapi_print_msg(RTAPI_MSG_ERR, "what a module wanted when it was unloaded failed: %s\n", why);
}

/// In rtapi_app_exit(): after the transaction that unloads the module.
int give_afterwards(const char* function, const char* command, const char* name) {
    const Module& module = *Module::unloading();
    if (module.calls().afterwards(module.machine(), command, name, report_afterwards)) return 0;
    return fail(function, name, "unknown name");
}

/// LinuxCNC's number of a type of values, or 0.
int type_of(hal_type type) {
    switch (type) {
    case HAL_TYPE_BIT: return bit;
    case HAL_TYPE_FLOAT: return real;
    case HAL_TYPE_S32: return s32;
    case HAL_TYPE_U32: return u32;
    case HAL_TYPE_S64: return s64;
    case HAL_TYPE_U64: return u64;
    default: return 0;
    }
}
int width_of(int type) {
    if (type == bit) return 1;
    if (type == s32 || type == u32) return 4;
    return 8;
}

/// Sets a parameter of another component, or of one that is being loaded.
int set_parameter(const char* name, int type, const void* value) {
    Module* const module = Module::current();
    if (!module) return fail("hal_param_set", name, only_while_loaded, -EPERM);
    if (!name || !value || type < bit || type > u64 || type == port) {
        return fail("hal_param_set", name, "no value, or an unsupported type");
    }
    hal_type there{};
    hal_value before{};
    bool linked = false;
    if (!module->calls().value(module->host(), HAL_MODULE_PARAMETER, name, &there, &before,
                               &linked)) {
        return fail("hal_param_set", name, "unknown parameter");
    }
    if (type_of(there) != type) {
        return fail("hal_param_set", name, "the parameter has another type");
    }
    char text[40];
    const auto as = [value]<class T>(T to) {
        std::memcpy(&to, value, sizeof to);
        return to;
    };
    switch (type) {
    case bit: std::snprintf(text, sizeof text, "%d", as(char{}) != 0); break;
    case real: std::snprintf(text, sizeof text, "%.17g", as(double{})); break;
    case s32: std::snprintf(text, sizeof text, "%d", as(std::int32_t{})); break;
    case s64: std::snprintf(text, sizeof text, "%lld", as(static_cast<long long>(0))); break;
    case u64:
        std::snprintf(text, sizeof text, "%llu", as(static_cast<unsigned long long>(0)));
        break;
    default: std::snprintf(text, sizeof text, "%u", as(std::uint32_t{})); break;
    }
    if (const int wrong = give_command("hal_param_set", "setp", {name, text}); wrong != 0) {
        return wrong;
    }
    // its own variable has the value at once
    if (const Parameter* const own = module->parameters.find(name)) {
        std::memcpy(const_cast<void*>(own->value), value, static_cast<std::size_t>(width_of(type)));
    }
    return 0;
}

/// `data` leads to a copy, which the next call overwrites: where a value is changes with every
/// edit.
int value_of(const char* function, int kind, const char* name, int* type, void** data,
             bool* linked) {
    static hal_value copy;
    const Module* const module = Module::current();
    if (!module) return fail(function, name, only_while_loaded, -EPERM);
    hal_type there{};
    bool flag = false;
    if (!name || !type || !data ||
        !module->calls().value(module->host(), kind, name, &there, &copy, &flag)) {
        return fail(function, name, "unknown name");
    }
    const int number = type_of(there);
    if (number == 0 || (number >= s64 && module->interface() != Interface::v2_10)) {
        return fail(function, name,
                    number == 0 ? "it is a port, which has no value"
                                : "LinuxCNC 2.9 has no values of 64 bit");
    }
    *type = number;
    *data = &copy;
    if (linked) {
        *linked = flag;
    }
    return 0;
}

}  // namespace

int give_command(const char* function, const char* command,
                 std::initializer_list<const char*> words) {
    return guarded([&] {
        std::vector<const char*> all{command};
        for (const char* const word : words) {
            if (!word) break;
            all.push_back(word);
        }
        const bool is_alias = all.size() > 2 && std::strstr(command, "alias");
        const std::size_t name_index = is_alias ? 2 : 1;
        const char* const name = all.size() > 1 ? all[name_index] : "";
        if (all.size() > 1 && !*name) return fail(function, name, "the name is empty");
        const Module* const module = Module::current();
        if (!module) return fail(function, name, only_while_loaded, -EPERM);
        char why[512] = "";
        const int result =
            module->calls().command(module->host(), all.data(), all.size(), why, sizeof why);
        if (result != 0) {
            rtapi_print_msg(RTAPI_MSG_ERR, *name ? "%s: '%s': %s\n" : "%s: %.0s%s\n", function,
                            name, why);
        }
        return result;
    });
}

namespace {

/// Returns the type as `newsig` has it; nullptr: unsupported.
const char* word_of(int type) {
    switch (type) {
    case bit: return "bit";
    case real: return "float";
    case s32: return "s32";
    case u32: return "u32";
    case port: return "port";
    case s64: return "s64";
    case u64: return "u64";
    default: return nullptr;
    }
}

}  // namespace

}  // namespace hal::modules

using namespace hal::modules;

extern "C" {

int hal_signal_new(const char* name, int type) {
    const char* const word = word_of(type);
    if (!name || !word) return fail("hal_signal_new", name, word ? "no name" : "unsupported type");
    if (std::strlen(name) > longest_name()) {
        return fail("hal_signal_new", name,
                    longest_name() == 47 ? "the name is longer than 47 characters"
                                         : "the name is longer than 55 characters");
    }
    return give_command("hal_signal_new", "newsig", {name, word});
}
int hal_signal_delete(const char* name) {
    if (!name) return -EINVAL;
    const bool exiting = Module::unloading() != nullptr;
    return exiting ? give_afterwards("hal_signal_delete", "delsig", name)
                   : give_command("hal_signal_delete", "delsig", {name});
}
int hal_link(const char* pin, const char* signal) {
    return pin && signal ? give_command("hal_link", "linkps", {pin, signal})
                         : fail("hal_link", pin, "no name");
}
int hal_unlink(const char* pin) {
    if (!pin) return fail("hal_unlink", pin, "no name");
    const Module* const exiting = Module::unloading();
    if (!exiting) {
        return give_command("hal_unlink", "unlinkp", {pin});
    }
    return exiting->has_pin(pin) ? 0 : give_afterwards("hal_unlink", "unlinkp", pin);
}
int hal_pin_alias(const char* name, const char* alias) {
    if (!name) return fail("hal_pin_alias", name, "no name");
    return give_command("hal_pin_alias", alias ? "alias" : "unalias", {"pin", name, alias});
}

int hal_add_funct_to_thread(const char* function, const char* thread, int position) {
    if (!function || !thread) return fail("hal_add_funct_to_thread", function, "no name");
    return give_command("hal_add_funct_to_thread", "addf",
                        {function, thread, std::to_string(position).c_str()});
}
// The runtime has taken a module's functions out of the threads, at a cycle boundary, before
// rtapi_app_exit() runs. So what a module wants there is done: nothing of it runs. Functions of
// others go on, because their outputs may be what keeps the machine safe.
int hal_del_funct_from_thread(const char* function, const char* thread) {
    if (!function) return fail("hal_del_funct_from_thread", function, "no name");
    if (const Module* const exiting = Module::unloading()) {
        return exiting->functions.contains(function)
                   ? 0
                   : fail("hal_del_funct_from_thread", function,
                          "not a function of this module, which is being unloaded");
    }
    return thread ? give_command("hal_del_funct_from_thread", "delf", {function, thread})
                  : fail("hal_del_funct_from_thread", function, "no thread");
}
int hal_start_threads() { return give_command("hal_start_threads", "start", {}); }
int hal_stop_threads() {
    const bool exiting = Module::unloading() != nullptr;
    return exiting ? 0 : give_command("hal_stop_threads", "stop", {});
}

int hal_set_lock(unsigned char lock) {
    return give_command("hal_set_lock", "lock", {std::to_string(lock).c_str()});
}
unsigned char hal_get_lock() {
    const Module* const module = Module::current();
    return module ? static_cast<unsigned char>(module->calls().locks(module->host()))
                  : static_cast<unsigned char>(fail("hal_get_lock", "lock", only_while_loaded, 0));
}

int hal_param_set(const char* name, int type, void* value) {
    return guarded([&] { return set_parameter(name, type, value); });
}
int hal_param_bit_set(const char* name, int value) {
    bool as = value != 0;
    return hal_param_set(name, bit, &as);
}
int hal_param_float_set(const char* name, double value) {
    return hal_param_set(name, real, &value);
}
int hal_param_s32_set(const char* name, long value) {
    auto as = static_cast<std::int32_t>(value);
    return hal_param_set(name, s32, &as);
}
int hal_param_u32_set(const char* name, unsigned long value) {
    auto as = static_cast<std::uint32_t>(value);
    return hal_param_set(name, u32, &as);
}

int hal_get_pin_value_by_name(const char* name, int* type, void** data, bool* connected) {
    return guarded([&] {
        return value_of("hal_get_pin_value_by_name", HAL_MODULE_PIN, name, type, data, connected);
    });
}
int hal_get_signal_value_by_name(const char* name, int* type, void** data, bool* has_writers) {
    return guarded([&] {
        return value_of("hal_get_signal_value_by_name", HAL_MODULE_SIGNAL, name, type, data,
                        has_writers);
    });
}
int hal_get_param_value_by_name(const char* name, int* type, void** data) {
    return guarded([&] {
        return value_of("hal_get_param_value_by_name", HAL_MODULE_PARAMETER, name, type, data,
                        nullptr);
    });
}
}
