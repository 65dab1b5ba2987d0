// SPDX-License-Identifier: MIT
// The trace of one client: what it is sent, and when. Internal to the server.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>

#include "machine/session.hpp"

namespace hal {

/// Each member takes its mutex, then the session's lock where it needs it. Who holds the session's
/// lock must not call anything here. [any]
class TraceFeed {
public:
    explicit TraceFeed(Session& session) : session_(session) {}
    ~TraceFeed();  ///< ends the trace
    TraceFeed(const TraceFeed&) = delete;

    /// Begins or ends the trace. On success appends the members of the reply and returns an empty
    /// string, otherwise returns the reason.
    std::string set(bool on, std::string& reply);
    bool on() const;
    /// Returns when the next batch is due, on the steady clock; INT64_MAX without a trace.
    std::int64_t next_due_ns() const;
    /// Appends the batch that is due. With `congested` it leaves the events in the rings.
    void publish(std::int64_t now_ns, bool congested, std::string& events);

private:
    Session& session_;
    mutable std::mutex mutex_;
    bool on_ = false;  ///< guarded by mutex_, as is all below
    std::int64_t due_ns_ = 0;
};

}  // namespace hal
