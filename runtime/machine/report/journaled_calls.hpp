// SPDX-License-Identifier: MIT
// What components ask of the C library and nobody computes: the time and random numbers. In a cycle
// with a journal they are noted, and in its re-execution given back. While an instance starts, the
// threads that it creates are counted.
#pragma once

#include <cstddef>
#include <cstdint>

namespace hal {

/// What the setup calls of components ask of the C library. On the thread that makes the call.
class SetupReader {
public:
    virtual ~SetupReader() = default;
    /// Returns what the component gets for this reading of a clock.
    virtual std::int64_t reading(std::int64_t value) = 0;
    /// A file is opened for reading. Returns the descriptor that the component gets, or -1 with
    /// errno; `open_now` is what opens the file of today.
    virtual int opened(const char* path, int (*open_now)(const char* path, int flags),
                       int flags) = 0;
};

/// Sets who gets the calls from now on; nullptr: nobody. [setup]
void set_setup_reader(SetupReader* reader) noexcept;

/// Notes a number that nobody computes, as these calls are noted. Returns `value`, or in a
/// re-execution the journaled one. With a sanitizer, always `value`. [any]
std::int64_t journaled_reading(std::int64_t value) noexcept;

/// Finds the functions of the C library before the first cycle. [setup]
void prepare_journaled_calls() noexcept;

/// Returns how many threads setup calls of components have created so far. With a sanitizer, which
/// has these functions itself, always 0. [setup]
std::size_t threads_of_components() noexcept;

}  // namespace hal
