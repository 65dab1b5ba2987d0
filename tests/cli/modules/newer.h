/* SPDX-License-Identifier: MIT */
/* What only LinuxCNC 2.10's modules use, declared from its documentation, beside linuxcnc.h. A handle leads to 8 bytes. */
#define PORT const volatile int*
#include "linuxcnc.h"

int hal_pin_new_bool(int comp, int dir, volatile uint64_t** handle, bool initial,
                     const char* format, ...);
int hal_pin_new_real(int comp, int dir, volatile double** handle, double initial,
                     const char* format, ...);
int hal_pin_new_si32(int comp, int dir, volatile int64_t** handle, int32_t initial,
                     const char* format, ...);
int hal_pin_new_ui32(int comp, int dir, volatile uint64_t** handle, uint32_t initial,
                     const char* format, ...);
int hal_pin_new_sint(int comp, int dir, volatile int64_t** handle, int64_t initial,
                     const char* format, ...);
int hal_pin_new_uint(int comp, int dir, volatile uint64_t** handle, uint64_t initial,
                     const char* format, ...);
int hal_pin_new_port(int comp, int dir, volatile int** handle, const char* format, ...);
int hal_param_new_sint(int comp, int dir, volatile int64_t** handle, int64_t initial,
                       const char* format, ...);
int hal_param_new_real(int comp, int dir, volatile double** handle, double initial,
                       const char* format, ...);
int hal_param_new_fake(int comp, volatile int64_t** handle);
int hal_pin_s64_newf(int dir, volatile int64_t** slot, int comp, const char* format, ...);
int hal_param_u64_newf(int dir, volatile uint64_t* value, int comp, const char* format, ...);
int hal_export_functf(void (*code)(void*, long), void* arg, int fp, int reentrant, int comp,
                      const char* format, ...);
int hal_init_funct_to_thread(const char* function, const char* thread, int position);
int hal_is_init(void);
int hal_get_realtime_type(void);
const char* hal_strerror(int error);
unsigned hal_port_readable(const volatile int* port);
