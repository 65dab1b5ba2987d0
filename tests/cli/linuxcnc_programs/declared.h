/* SPDX-License-Identifier: MIT */
/* What the programs of this test use of LinuxCNC 2.9's interface for programs: names, types and values, declared from its documentation. */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { HAL_BIT = 1, HAL_FLOAT, HAL_S32, HAL_U32, HAL_PORT };
enum { HAL_IN = 16, HAL_OUT = 32, HAL_IO = 48, HAL_RO = 64, HAL_RW = 192 };
int hal_init(const char* name);
int hal_ready(int comp);
int hal_unready(int comp);
int hal_exit(int comp);
void* hal_malloc(long bytes);
int hal_pin_new(const char* name, int type, int dir, void** slot, int comp);
int hal_pin_bit_new(const char* name, int dir, volatile bool** slot, int comp);
int hal_pin_bit_newf(int dir, volatile bool** slot, int comp, const char* format, ...);
int hal_pin_float_newf(int dir, volatile double** slot, int comp, const char* format, ...);
int hal_pin_s32_newf(int dir, volatile int32_t** slot, int comp, const char* format, ...);
int hal_pin_u32_newf(int dir, volatile uint32_t** slot, int comp, const char* format, ...);
int hal_pin_port_new(const char* name, int dir, volatile int** slot, int comp);
int hal_pin_port_newf(int dir, volatile int** slot, int comp, const char* format, ...);
bool hal_port_read(int port, char* to, unsigned count);
bool hal_port_peek(int port, char* to, unsigned count);
bool hal_port_peek_commit(int port, unsigned count);
bool hal_port_write(int port, const char* from, unsigned count);
unsigned hal_port_readable(int port);
unsigned hal_port_writable(int port);
unsigned hal_port_buffer_size(int port);
void hal_port_clear(int port);
void hal_port_wait_readable(volatile int** port, unsigned count, volatile int* stop);
void hal_port_wait_writable(volatile int** port, unsigned count, volatile int* stop);
int hal_port_alloc(unsigned size);
int hal_set_lock(unsigned char lock);
unsigned char hal_get_lock(void);
int hal_param_float_newf(int dir, volatile double* value, int comp, const char* format, ...);
int hal_signal_new(const char* name, int type);
int hal_signal_delete(const char* name);
int hal_link(const char* pin, const char* signal);
int hal_unlink(const char* pin);
int hal_add_funct_to_thread(const char* function, const char* thread, int position);
int hal_start_threads(void);
int hal_param_float_set(const char* name, double value);
int hal_get_pin_value_by_name(const char* name, int* type, void** data, bool* connected);
int hal_get_signal_value_by_name(const char* name, int* type, void** data, bool* has_writers);
int hal_get_param_value_by_name(const char* name, int* type, void** data);
typedef struct {
    int comp, segment;
    void* fifo;
} hal_stream_t;
int hal_stream_attach(hal_stream_t* stream, int comp, int key, const char* types);
int hal_stream_detach(hal_stream_t* stream);
int hal_stream_read(hal_stream_t* stream, void* to, unsigned* number);
void hal_stream_wait_readable(hal_stream_t* stream, volatile int* stop);
int rtapi_shmem_new(int key, int comp, unsigned long size);
int rtapi_shmem_getptr(int segment, void** address);
int rtapi_shmem_delete(int segment, int comp);
