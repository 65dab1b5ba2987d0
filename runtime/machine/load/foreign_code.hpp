// SPDX-License-Identifier: MIT
// What is put back after code of a component ran outside of the cycle: a constructor, start, stop,
// or what a library does while it is loaded.
#pragma once

#include "base/process_copy.hpp"
#include "execute/float_modes.hpp"

namespace hal {

/// The caller's floating-point modes hold again at the end: a library that was linked with
/// -ffast-math sets others while it is loaded, and threads inherit them. A copy of the process that
/// returns from a fork() in that code ends. [setup]
class ForeignCode {
public:
    ForeignCode() noexcept = default;
    ~ForeignCode() { over(); }
    ForeignCode(const ForeignCode&) = delete;

    /// Called by the destructor; again, it does nothing more.
    void over() noexcept;

private:
    FloatModes modes_ = FloatModes::now();
    bool in_copy_ = in_process_copy;  // already, as a process that tries a plugin
};

}  // namespace hal
