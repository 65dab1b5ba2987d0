// SPDX-License-Identifier: MIT
// The verbs that look at a running machine cycle by cycle: probe, unprobe, journal, trace. Internal
// to the server.
#pragma once

#include <cstdint>
#include <string>

#include <nlohmann/json.hpp>

#include "control/probe_feeds.hpp"
#include "control/trace_feed.hpp"
#include "machine/session.hpp"

namespace hal {

/// Each verb appends the members of its reply after "ok":true, beginning with a comma, or throws
/// RequestError before anything. The verbs are for the thread in Connection::handle().
class ProbeRequests {
public:
    explicit ProbeRequests(Session& session) : probes_(session), traces_(session) {}

    void probe(const nlohmann::json& body, std::string& reply);
    void unprobe(const nlohmann::json& body, std::string& reply);
    void journal(const nlohmann::json& body);
    void trace(const nlohmann::json& body, std::string& reply);

    /// Returns true while the client receives nothing. [any]
    bool empty() const { return probes_.empty() && !traces_.on(); }
    /// Returns when the next batch is due, on the steady clock; INT64_MAX without one. [any]
    std::int64_t next_due_ns() const;
    /// Appends what is due. Takes the session's lock. [any]
    void publish(std::int64_t now_ns, bool congested, std::string& events);

private:
    ProbeFeeds probes_;
    TraceFeed traces_;
};

}  // namespace hal
