// SPDX-License-Identifier: MIT
#include "linuxcnc/binary/handles.hpp"

#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <string>
#include <unistd.h>

#include "linuxcnc/binary/module.hpp"

namespace hal::modules {
namespace {

enum Type { bit = 1, real = 2, s32 = 3, u32 = 4, s64 = 6, u64 = 7 };

hal_value value_of(bool value) { return {.u64 = value}; }
hal_value value_of(double value) { return {.real = value}; }
hal_value value_of(std::int32_t value) { return {.s64 = value}; }
hal_value value_of(std::uint32_t value) { return {.u64 = value}; }
hal_value value_of(std::int64_t value) { return {.s64 = value}; }
hal_value value_of(std::uint64_t value) { return {.u64 = value}; }

int by_handle(const char* function, bool parameter, int type, int dir, void** handle,
              hal_value initial, int comp, const char* format, va_list arguments) {
    return guarded([&] {
        char name[256];
        if (const int wrong = format_name(name, function, format, arguments); wrong != 0) {
            return wrong;
        }
        return new_slot(function, parameter, name, type, dir, handle, initial, comp);
    });
}

}  // namespace
}  // namespace hal::modules

using namespace hal::modules;

extern "C" {

#define HALCYON_NAMED(call)    \
    va_list arguments;         \
    va_start(arguments, name); \
    const int result = call;   \
    va_end(arguments);         \
    return result;
#define HALCYON_HANDLE(suffix, type, of)                                                           \
    int hal_pin_new_##suffix(int comp, int dir, void** handle, type initial, const char* name,     \
                             ...) {                                                                \
        HALCYON_NAMED(by_handle("hal_pin_new_" #suffix, false, of, dir, handle, value_of(initial), \
                                comp, name, arguments))                                            \
    }                                                                                              \
    int hal_param_new_##suffix(int comp, int dir, void** handle, type initial, const char* name,   \
                               ...) {                                                              \
        HALCYON_NAMED(by_handle("hal_param_new_" #suffix, true, of, dir, handle,                   \
                                value_of(initial), comp, name, arguments))                         \
    }
HALCYON_HANDLE(bool, bool, bit)
HALCYON_HANDLE(real, double, real)
HALCYON_HANDLE(si32, std::int32_t, s32)
HALCYON_HANDLE(ui32, std::uint32_t, u32)
HALCYON_HANDLE(sint, std::int64_t, s64)
HALCYON_HANDLE(uint, std::uint64_t, u64)
#undef HALCYON_HANDLE

int hal_pin_new_port(int comp, int dir, void** handle, const char* name, ...) {
    char text[256];
    const auto made = [&](va_list arguments) {
        return guarded([&] {
            if (const int wrong = format_name(text, "hal_pin_new_port", name, arguments);
                wrong != 0) {
                return wrong;
            }
            return new_port_pin(text, dir, handle, comp);
        });
    };
    HALCYON_NAMED(made(arguments))
}

int hal_param_new_fake(int, void** handle) {
    if (!handle) return -EINVAL;
    *handle = hal_malloc(sizeof(hal_value));
    return *handle ? 0 : -ENOMEM;
}

int hal_export_functf(void (*code)(void*, long), void* arg, int uses_fp, int reentrant, int comp,
                      const char* name, ...) {
    char text[256];
    const auto made = [&](va_list arguments) {
        const int wrong =
            guarded([&] { return format_name(text, "hal_export_functf", name, arguments); });
        return wrong != 0 ? wrong : hal_export_funct(text, code, arg, uses_fp, reentrant, comp);
    };
    HALCYON_NAMED(made(arguments))
}
#undef HALCYON_NAMED

int hal_init_funct_to_thread(const char* function, const char* thread, int position) {
    if (!function || !thread) return -EINVAL;
    return give_command("hal_init_funct_to_thread", "initf",
                        {function, thread, std::to_string(position).c_str()});
}

int hal_is_init() { return hal_shmem_base != nullptr ? 1 : 0; }

const char* hal_strerror(int error) {
    const char* const text = strerrordesc_np(error < 0 ? -error : error);
    return text ? text : "unknown error";
}

int hal_get_realtime_type() {
    const int preempt_rt = 3;
    return ::access("/sys/kernel/realtime", F_OK) == 0 ? preempt_rt : 0;
}
int rtapi_get_realtime_type() { return hal_get_realtime_type(); }
void rtapi_task_self_resync() {}
}
