/* SPDX-License-Identifier: MIT */
/* What the modules of these tests need of LinuxCNC's binary interface: own declarations, none of LinuxCNC's text. */
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>

enum { BIT = 1, FLOAT, S32, U32, IN = 16, OUT = 32, IO = 48, RO = 64, RW = 192 };

int hal_init(const char* name);
int hal_ready(int comp);
int hal_exit(int comp);
int hal_set_unready(int comp);
void* hal_malloc(long bytes);
char* hal_comp_name(int comp);
int hal_export_funct(const char* name, void (*code)(void*, long), void* arg, int fp, int reentrant,
                     int comp);
int hal_create_thread(const char* name, unsigned long period, int fp);
int hal_stop_threads(void);
int hal_pin_new(const char* name, int type, int dir, void** slot, int comp);
int hal_pin_bit_newf(int dir, volatile bool** slot, int comp, const char* format, ...);
int hal_pin_float_newf(int dir, volatile double** slot, int comp, const char* format, ...);
int hal_pin_s32_newf(int dir, volatile int32_t** slot, int comp, const char* format, ...);
int hal_pin_u32_newf(int dir, volatile uint32_t** slot, int comp, const char* format, ...);
int hal_param_s32_newf(int dir, volatile int32_t* value, int comp, const char* format, ...);
int hal_param_float_newf(int dir, volatile double* value, int comp, const char* format, ...);
int hal_param_bit_newf(int dir, volatile bool* value, int comp, const char* format, ...);
int hal_param_alias(const char* name, const char* alias);
struct stream {
    int comp, segment;
    void* fifo;
};
union stream_value {
    double f;
    bool b;
    int32_t s;
    uint32_t u;
    uint64_t raw;
};
int hal_stream_create(struct stream*, int comp, int key, int depth, const char* types);
void hal_stream_destroy(struct stream*);
int hal_stream_read(struct stream*, union stream_value*, unsigned* number);
int hal_stream_write(struct stream*, union stream_value*);
int hal_stream_depth(struct stream*);
void rtapi_print(const char* format, ...);
void rtapi_print_msg(int level, const char* format, ...);
int rtapi_set_msg_level(int level);
int rtapi_get_msg_level(void);
typedef void (*handler)(int level, const char* format, va_list);
handler rtapi_get_msg_handler(void);
void rtapi_set_msg_handler(handler);
int rtapi_snprintf(char* to, unsigned long size, const char* format, ...);
long long rtapi_get_time(void);
int rtapi_task_self(void);
int hal_unready(int comp);
int hal_set_constructor(int comp, int (*make)(char* prefix, char* argument));
int hal_add_funct_to_thread(const char* function, const char* thread, int position);
int hal_del_funct_from_thread(const char* function, const char* thread);
int hal_start_threads(void);
int hal_signal_new(const char* name, int type);
int hal_signal_delete(const char* name);
int hal_link(const char* pin, const char* signal);
int hal_unlink(const char* pin);
int hal_pin_alias(const char* name, const char* alias);
int hal_param_bit_set(const char* name, int value);
int hal_param_float_set(const char* name, double value);
int hal_param_s32_set(const char* name, long value);
int hal_get_pin_value_by_name(const char* name, int* type, void** data, bool* connected);
int hal_get_signal_value_by_name(const char* name, int* type, void** data, bool* has_writers);
int hal_get_param_value_by_name(const char* name, int* type, void** data);
int hal_set_lock(unsigned char lock);
unsigned char hal_get_lock(void);
int hal_port_alloc(unsigned size);
#ifndef PORT
#define PORT int /* how 2.9 gives a port */
#endif
bool hal_port_write(PORT port, const char* from, unsigned count);
bool hal_port_read(PORT port, char* to, unsigned count);
unsigned hal_port_buffer_size(PORT port);
int rtapi_init(const char* name);
int rtapi_exit(int id);
int rtapi_is_realtime(void);
int rtapi_is_kernelspace(void);
long rtapi_clock_set_period(long ns);
long long rtapi_task_pll_get_reference(void);
int rtapi_task_pll_set_correction(long value);
int rtapi_prio_highest(void);
int rtapi_prio_lowest(void);
int rtapi_prio_next_higher(int priority);
int rtapi_prio_next_lower(int priority);
int rtapi_task_new(void (*code)(void*), void* arg, int priority, int owner, unsigned long stack,
                   int fp);
int rtapi_task_start(int task, unsigned long period);
int rtapi_task_delete(int task);
int rtapi_task_pause(int task);
int rtapi_task_resume(int task);
void rtapi_wait(void);
int rtapi_shmem_new(int key, int comp, unsigned long size);
int rtapi_shmem_getptr(int segment, void** address);
int rtapi_shmem_delete(int segment, int comp);
int rtapi_spawn_as_root(int* process, const char* path, const void*, const void*,
                        char* const argv[], char* const envp[]);
int rtapi_open_as_root(const char* path, int flags);
char** rtapi_argv_split(int flags, const char* text, int* count);
void rtapi_argv_free(char** words);

/* How a module describes its parameters: exported variables with these names. */
#define PARAMETER(name, letter, text)                                                   \
    const char *rtapi_info_type_##name = letter, *rtapi_info_description_##name = text; \
    void* rtapi_info_address_##name = &name;
#define ARRAY(name, letter, number, text)                                               \
    const char *rtapi_info_type_##name = letter, *rtapi_info_description_##name = text; \
    int rtapi_info_size_##name = number;                                                \
    void* rtapi_info_address_##name = name;
#define DESCRIPTION(text) const char *rtapi_info_description = text, *rtapi_info_license = "MIT";
