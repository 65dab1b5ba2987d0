/* SPDX-License-Identifier: MIT */
/* Loaded before a peer's libraries: a program that may use SCHED_FIFO anyway is not rejected because of a lower limit. */
#define _GNU_SOURCE
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

int setrlimit(__rlimit_resource_t resource, const struct rlimit* limits) {
    if (resource == RLIMIT_RTPRIO || resource == RLIMIT_MEMLOCK) return 0;
    return (int)syscall(SYS_setrlimit, resource, limits);
}
