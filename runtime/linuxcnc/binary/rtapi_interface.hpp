// SPDX-License-Identifier: MIT
// The functions that LinuxCNC's compiled modules (2.9; those of 2.10 only are in handles.hpp) may
// call, declared from the documented interface: names, types and sizes. What components that are
// built from source call as well is in rtapi.h. Own text; nothing here comes from LinuxCNC's
// headers. exports.map makes exactly these visible.
#pragma once

#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <sys/types.h>

#include "linuxcnc/rtapi.h"

extern "C" {

extern char* hal_shmem_base;

// components, memory, functions, threads: [setup]
int hal_init(const char* name);
int hal_ready(int comp);
int hal_set_unready(int comp);
int hal_unready(int comp);
int hal_set_constructor(int comp, int (*make)(char* prefix, char* argument));
int hal_exit(int comp);
void* hal_malloc(long bytes);
char* hal_comp_name(int comp);
int hal_export_funct(const char* name, void (*code)(void*, long), void* arg, int uses_fp,
                     int reentrant, int comp);
int hal_create_thread(const char* name, unsigned long period_ns, int uses_fp);
int hal_add_funct_to_thread(const char* function, const char* thread, int position);
// In rtapi_app_exit() the caller's functions are in no thread: then 0 for these.
int hal_del_funct_from_thread(const char* function, const char* thread);
int hal_start_threads();
// In rtapi_app_exit() 0 without an effect: the caller's functions are in no thread then; other
// functions go on.
int hal_stop_threads();

// signals, links, values and locks by name: [setup], in rtapi_app_main(); delete and unlink in
// rtapi_app_exit() as well
int hal_signal_new(const char* name, int type);
int hal_signal_delete(const char* name);
int hal_link(const char* pin, const char* signal);
int hal_unlink(const char* pin);
int hal_pin_alias(const char* name, const char* alias);
int hal_param_set(const char* name, int type, void* value);
int hal_param_bit_set(const char* name, int value);
int hal_param_float_set(const char* name, double value);
int hal_param_s32_set(const char* name, long value);
int hal_param_u32_set(const char* name, unsigned long value);
int hal_get_pin_value_by_name(const char* name, int* type, void** data, bool* connected);
int hal_get_signal_value_by_name(const char* name, int* type, void** data, bool* has_writers);
int hal_get_param_value_by_name(const char* name, int* type, void** data);
int hal_set_lock(unsigned char lock);
unsigned char hal_get_lock();

// pins and parameters: [setup]. Types: bit 1, float 2, s32 3, u32 4, port 5, s64 6, u64 7.
// Directions: in 16, out 32, io 48, ro 64, rw 192
int hal_pin_new(const char* name, int type, int dir, void** slot, int comp);
int hal_param_new(const char* name, int type, int dir, void* value, int comp);
int hal_param_alias(const char* name, const char* alias);
#define HALCYON_BOTH_FORMS(type)                                                        \
    int hal_pin_##type##_new(const char* name, int dir, void** slot, int comp);         \
    int hal_pin_##type##_newf(int dir, void** slot, int comp, const char* format, ...); \
    int hal_param_##type##_new(const char* name, int dir, void* value, int comp);       \
    int hal_param_##type##_newf(int dir, void* value, int comp, const char* format, ...);
HALCYON_BOTH_FORMS(bit)
HALCYON_BOTH_FORMS(float)
HALCYON_BOTH_FORMS(s32)
HALCYON_BOTH_FORMS(u32)
HALCYON_BOTH_FORMS(s64)
HALCYON_BOTH_FORMS(u64)
#undef HALCYON_BOTH_FORMS

// ports, by the number that a port pin's pointer points to, or by that pointer
// (take_ports_by_pointer()): pins are [setup], the rest [any]; one thread reads, one writes. A port
// without a signal, or whose signal has no size yet, holds nothing.
int hal_pin_port_new(const char* name, int dir, void** slot, int comp);
int hal_pin_port_newf(int dir, void** slot, int comp, const char* format, ...);
unsigned hal_port_buffer_size(std::intptr_t port);
unsigned hal_port_readable(std::intptr_t port);
unsigned hal_port_writable(std::intptr_t port);
bool hal_port_peek(std::intptr_t port, char* to, unsigned count);
bool hal_port_peek_commit(std::intptr_t port, unsigned count);
bool hal_port_read(std::intptr_t port, char* to, unsigned count);
bool hal_port_write(std::intptr_t port, const char* from, unsigned count);
void hal_port_clear(std::intptr_t port);
int hal_port_alloc(unsigned size);  // [setup] a buffer of the module's own
// of programs
void hal_port_wait_readable(volatile int** port, unsigned count, const volatile int* stop);
// of programs
void hal_port_wait_writable(volatile int** port, unsigned count, const volatile int* stop);

// streams: create, attach, detach and destroy are [setup], the rest [any]
struct halcyon_stream {
    int comp, segment;
    void* fifo;
};
union halcyon_stream_value {
    double real;
    bool bit;
    std::int32_t s32;
    std::uint32_t u32;
    std::uint64_t raw;
};
int hal_stream_create(halcyon_stream* stream, int comp, int key, int depth, const char* types);
void hal_stream_destroy(halcyon_stream* stream);
int hal_stream_attach(halcyon_stream* stream, int comp, int key, const char* types);
int hal_stream_detach(halcyon_stream* stream);
void hal_stream_wait_readable(halcyon_stream* stream, const volatile int* stop);  // of programs
void hal_stream_wait_writable(halcyon_stream* stream, const volatile int* stop);  // of programs
int hal_stream_element_count(halcyon_stream* stream);
int hal_stream_element_type(halcyon_stream* stream, int index);
int hal_stream_depth(halcyon_stream* stream);
int hal_stream_maxdepth(halcyon_stream* stream);
bool hal_stream_readable(halcyon_stream* stream);
bool hal_stream_writable(halcyon_stream* stream);
int hal_stream_num_overruns(halcyon_stream* stream);
int hal_stream_num_underruns(halcyon_stream* stream);
int hal_stream_read(halcyon_stream* stream, halcyon_stream_value* to, unsigned* number);
int hal_stream_write(halcyon_stream* stream, halcyon_stream_value* from);

// the clock of the threads; other functions about time, and messages: rtapi.h
long long rtapi_task_pll_get_reference();  // [realtime]
int rtapi_task_pll_set_correction(long value);  // [realtime]

// tasks of a module's own: new, start and delete are [setup]; the id is positive
int rtapi_task_new(void (*code)(void*), void* argument, int priority, int owner,
                   unsigned long stack_bytes, int uses_fp);
int rtapi_task_start(int task, unsigned long period_ns);
int rtapi_task_delete(int task);
int rtapi_task_pause(int task);  // [any]
int rtapi_task_resume(int task);  // [any]
int rtapi_task_self();  // [any] in a thread of the machine's 0; -EINVAL: in none
void rtapi_wait();  // in a task

// shared memory by key: [setup]
int rtapi_shmem_new(int key, int comp, unsigned long size);
int rtapi_shmem_getptr(int segment, void** address);
int rtapi_shmem_delete(int segment, int comp);

// hardware and the system: [setup]
struct halcyon_parport {
    unsigned short base, base_hi;
    int fd;
};
struct halcyon_pci_id {  // 0xffffffff: any
    std::uint32_t vendor, device, subvendor, subdevice, kind, kind_mask;
};
struct halcyon_pci_bar {
    std::intptr_t start, end;
    unsigned long flags;
    void* mapped;
};
struct halcyon_pci_device {
    char name[32], path[256];
    std::uint16_t vendor, device, subvendor, subdevice;
    std::uint32_t kind;  // class, subclass and programming interface
    halcyon_pci_bar bars[6];
    void* of_driver;
};
struct halcyon_pci_driver {
    const char* name;
    const halcyon_pci_id* ids;  // the last is all 0
    int (*probe)(halcyon_pci_device* device, const halcyon_pci_id* id);
    void (*remove)(halcyon_pci_device* device);
    void* of_runtime;
};
struct halcyon_firmware {
    std::size_t size;
    const unsigned char* data;
};
int rtapi_parport_get(const char* name, halcyon_parport* port, unsigned short base,
                      unsigned short base_hi, unsigned modes);
void rtapi_parport_release(halcyon_parport* port);
int rtapi_pci_register_driver(halcyon_pci_driver* driver);
void rtapi_pci_unregister_driver(halcyon_pci_driver* driver);
int rtapi_pci_enable_device(halcyon_pci_device* device);
int rtapi_pci_disable_device(halcyon_pci_device* device);
void* rtapi_pci_ioremap_bar(halcyon_pci_device* device, int bar);
void rtapi_iounmap(void* address);
int rtapi_request_firmware(const halcyon_firmware** result, const char* name, void* device);
void rtapi_release_firmware(const halcyon_firmware* firmware);
int rtapi_spawn_as_root(pid_t* process, const char* path, const void* actions,
                        const void* attributes, char* const argv[], char* const envp[]);
int rtapi_spawnp_as_root(pid_t* process, const char* file, const void* actions,
                         const void* attributes, char* const argv[], char* const envp[]);
int rtapi_open_as_root(const char* path, int flags);
char** rtapi_argv_split(int flags, const char* text, int* count);
void rtapi_argv_free(char** words);
char* rtapi_kstrndup(const char* text, std::size_t max, int flags);
void rtapi_outb(unsigned char byte, unsigned port);  // [any]
unsigned char rtapi_inb(unsigned port);  // [any]
long simple_strtol(const char* text, char** end, unsigned base);

}  // extern "C"
