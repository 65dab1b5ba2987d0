// SPDX-License-Identifier: MIT
// The functions that only LinuxCNC 2.10's modules call, beside those of rtapi_interface.hpp; own
// declarations, none of LinuxCNC's text.
#pragma once

#include <cstdint>

extern "C" {

// pins and parameters by handle: [setup]. A handle leads to the 8 bytes of the value, which modules
// read and write whole, also those of 32 bit and of one: a value of a narrow type is extended to
// all 8.
#define HALCYON_HANDLE(suffix, type)                                                             \
    int hal_pin_new_##suffix(int comp, int dir, void** handle, type initial, const char* name,   \
                             ...);                                                               \
    int hal_param_new_##suffix(int comp, int dir, void** handle, type initial, const char* name, \
                               ...);
HALCYON_HANDLE(bool, bool)
HALCYON_HANDLE(real, double)
HALCYON_HANDLE(si32, std::int32_t)
HALCYON_HANDLE(ui32, std::uint32_t)
HALCYON_HANDLE(sint, std::int64_t)
HALCYON_HANDLE(uint, std::uint64_t)
#undef HALCYON_HANDLE
int hal_pin_new_port(int comp, int dir, void** handle, const char* name, ...);
// A value that has no name.
int hal_param_new_fake(int comp, void** handle);

int hal_export_functf(void (*code)(void*, long), void* arg, int uses_fp, int reentrant, int comp,
                      const char* name, ...);
// In rtapi_app_main() only, as hal_add_funct_to_thread(). [setup]
int hal_init_funct_to_thread(const char* function, const char* thread, int position);

int hal_is_init();
// A sentence about a negative errno; it stays valid. [any]
const char* hal_strerror(int error);
// 3 on a PREEMPT_RT kernel, otherwise 0: none. [setup]
int hal_get_realtime_type();
int rtapi_get_realtime_type();
// A thread of ours waits until its next period by itself. [realtime]
void rtapi_task_self_resync();

}  // extern "C"
