// SPDX-License-Identifier: MIT
// What a program needs beside streams.cpp and shared_memory.cpp of runtime/modules: waiting for a stream. It has no cycles.
#include <ctime>

#include "modules/rtapi_interface.hpp"
#include "modules/segments.hpp"

namespace hal::modules {

constinit thread_local bool in_cycle __attribute__((tls_model("initial-exec"))) = false;
const bool runs_modules = false;

}  // namespace hal::modules

namespace {

void wait_for(bool (*ready)(halcyon_stream*), halcyon_stream* stream, const volatile int* stop) {
    const timespec pause{0, 10'000'000};
    while (!ready(stream) && !(stop && *stop)) nanosleep(&pause, nullptr);
}

}  // namespace

extern "C" {

void hal_stream_wait_readable(halcyon_stream* stream, const volatile int* stop) { wait_for(hal_stream_readable, stream, stop); }
void hal_stream_wait_writable(halcyon_stream* stream, const volatile int* stop) { wait_for(hal_stream_writable, stream, stop); }
}
