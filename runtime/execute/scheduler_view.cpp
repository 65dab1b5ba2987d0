// SPDX-License-Identifier: MIT
#include "execute/scheduler_view.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <fcntl.h>
#include <unistd.h>

#include "hal/clock.hpp"

namespace hal {

void read_small_file(const char* path, char* to, std::size_t capacity) noexcept {
    to[0] = '\0';
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) return;
    const ssize_t got = read(file, to, capacity - 1);
    to[got > 0 ? got : 0] = '\0';
    close(file);
}

SchedulerUsage scheduler_usage(int tid) noexcept {
    char path[64];
    char text[128];
    std::snprintf(path, sizeof path, "/proc/self/task/%d/schedstat", tid);
    read_small_file(path, text, sizeof text);
    long long cpu = 0;
    long long delay = 0;
    if (std::sscanf(text, "%lld %lld", &cpu, &delay) != 2) {
        return {};
    }
    return {monotonic_ns(), cpu, delay};
}

KernelView kernel_view(int tid) noexcept {
    char path[64];
    char text[2048];
    std::snprintf(path, sizeof path, "/proc/self/task/%d/status", tid);
    read_small_file(path, text, sizeof text);
    KernelView view;
    if (const char* const at = std::strstr(text, "\nState:")) {
        const char* letter = at + 7;
        while (*letter == ' ' || *letter == '\t') {
            ++letter;
        }
        if (*letter) {
            view.state = *letter;
        }
    }
    if (const char* const at = std::strstr(text, "\nTracerPid:")) {
        view.tracer = std::atoi(at + 11);
    }
    return view;
}

}  // namespace hal
