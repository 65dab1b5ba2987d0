// SPDX-License-Identifier: MIT
// A probe for Python: hal/_probe.py makes arrays of what it returns.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <sys/types.h>

#include "control/probe_client.hpp"
#include "values.hpp"

namespace hal::python {

/// One connection with one probe, used by the process that made it. Calls release Python's lock
/// while they wait.
class Probe {
public:
    /// Throws Problem when it cannot be attached.
    Probe(const std::vector<std::string>& names, std::uint32_t every, int batch_ms, int buffer_ms);
    /// In a child process, after fork(), the probe goes on in the parent.
    ~Probe();

    /// Returns a list of (name, type letter, unit).
    py::list columns() const;
    /// Waits for the next batch and returns a list of (thread, column numbers, rows, lost, bytes),
    /// empty after the time-out. Throws Problem when the instance has ended, and in a child process.
    py::list next(int timeout_ms);
    std::int64_t unix_ns(std::int64_t time_ns) const { return probe_->unix_ns(time_ns); }
    std::uint64_t lost() const { return probe_->lost(); }

private:
    bool is_inherited() const;

    const pid_t process_;
    std::unique_ptr<Client> client_;
    std::unique_ptr<ProbeClient> probe_;
};

}  // namespace hal::python
