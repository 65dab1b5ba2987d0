/* SPDX-License-Identifier: MIT */
/* Stands in for LinuxCNC's Python module without its own copies of the variables: what it tests, calls and follows. Loaded by Python's ctypes. */
#include <stddef.h>

extern char *hal_data, *hal_shmem_base;
int hal_init(const char* name);
int hal_ready(int id);
int hal_link(const char* pin, const char* signal);
void* halpr_find_comp_by_name(const char* name);

int begin(void) {
    const int id = hal_init("walks");
    return id > 0 ? hal_ready(id) : id;
}
int has_memory(void) { return hal_shmem_base != NULL; }
int connects(const char* pin, const char* signal) {
    return hal_shmem_base ? hal_link(pin, signal) : -1;
}
int exists(const char* name) { return halpr_find_comp_by_name(name) != NULL; }
int is_ready(const char* name) { return ((const int*)halpr_find_comp_by_name(name))[8]; }
int first_pin(void) { return *(const int*)(hal_data + 64); }
