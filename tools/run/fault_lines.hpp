// SPDX-License-Identifier: MIT
// Prints faults on standard error when they are raised.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <thread>

#include "hal/message_log.hpp"
#include "machine/session.hpp"

namespace hal::tools {

/// Prints "fault: SENTENCE [CODE]" for each fault of a machine with real-time threads, limited by a
/// MessageLog. Its thread takes the session's lock only after a fault was raised.
class FaultLines {
public:
    /// `sink` receives the lines instead of standard error.
    explicit FaultLines(Session& session, MessageLog::Sink sink = {});
    ~FaultLines();  ///< prints pending lines
    FaultLines(const FaultLines&) = delete;

    /// Prints the new faults. [any], but not under the session's lock
    void look(std::int64_t now_ns);

private:
    void work();

    Session& session_;
    MessageLog log_;
    // record number to its count, of the records in the session's log
    std::map<std::uint64_t, std::uint64_t> seen_;
    std::uint64_t raised_ = 0;  // fault_count() when it last changed
    // when the newest was seen: a storm queues its count up to a second later
    std::int64_t raised_ns_ = 0;
    std::mutex mutex_;
    std::condition_variable wake_;
    bool ending_ = false;
    std::thread thread_;
};

}  // namespace hal::tools
