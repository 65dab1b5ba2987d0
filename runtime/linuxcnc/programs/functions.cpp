// SPDX-License-Identifier: MIT
// What a program needs beside streams.cpp and shared_memory.cpp of runtime/linuxcnc/binary: ports,
// and waiting for a port or a stream. It has no cycles.
#include <cstdint>
#include <ctime>
#include <vector>

#include "linuxcnc/binary/rtapi_interface.hpp"
#include "linuxcnc/binary/segments.hpp"
#include "linuxcnc/programs/ports.h"

namespace hal::modules {

constinit thread_local bool in_cycle __attribute__((tls_model("initial-exec"))) = false;
const bool runs_modules = false;

}  // namespace hal::modules

namespace {

/// Waits until `ready`, or until the program's flag is set.
template <class Ready>
void wait_until(const volatile int* stop, Ready ready) {
    const timespec pause{0, 10'000'000};
    while (!(stop && *stop) && !ready()) {
        nanosleep(&pause, nullptr);
    }
}

/// The handle of a port is a number; what lies above it in the register is undefined.
int handle_of(std::intptr_t given) { return static_cast<int>(given); }

unsigned number_of(std::intptr_t port, const char* key) {
    unsigned number = 0;
    halcyon_use_port_number(handle_of(port), "", nullptr, nullptr, 0, key, &number);
    return number;
}

}  // namespace

extern "C" {

void hal_stream_wait_readable(halcyon_stream* stream, const volatile int* stop) {
    wait_until(stop, [=] { return hal_stream_readable(stream); });
}
void hal_stream_wait_writable(halcyon_stream* stream, const volatile int* stop) {
    wait_until(stop, [=] { return hal_stream_writable(stream); });
}

unsigned hal_port_buffer_size(std::intptr_t port) { return number_of(port, "\"size\":"); }
unsigned hal_port_readable(std::intptr_t port) { return number_of(port, "\"readable\":"); }
unsigned hal_port_writable(std::intptr_t port) { return number_of(port, "\"writable\":"); }
bool hal_port_peek(std::intptr_t port, char* to, unsigned count) {
    return count > 0 &&
           halcyon_use_port_number(handle_of(port), "peek", to, nullptr, count, nullptr, nullptr);
}
bool hal_port_read(std::intptr_t port, char* to, unsigned count) {
    return count > 0 &&
           halcyon_use_port_number(handle_of(port), "read", to, nullptr, count, nullptr, nullptr);
}
bool hal_port_peek_commit(std::intptr_t port, unsigned count) {
    std::vector<char> nowhere(count);
    return hal_port_read(port, nowhere.data(), count);
}
bool hal_port_write(std::intptr_t port, const char* from, unsigned count) {
    return count > 0 &&
           halcyon_use_port_number(handle_of(port), "", nullptr, from, count, nullptr, nullptr);
}
void hal_port_clear(std::intptr_t port) { hal_port_peek_commit(port, hal_port_readable(port)); }
void hal_port_wait_readable(volatile int** port, unsigned count, const volatile int* stop) {
    wait_until(stop, [=] { return hal_port_readable(**port) >= count; });
}
void hal_port_wait_writable(volatile int** port, unsigned count, const volatile int* stop) {
    wait_until(stop, [=] { return hal_port_writable(**port) >= count; });
}
}
