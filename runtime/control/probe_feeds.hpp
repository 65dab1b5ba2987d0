// SPDX-License-Identifier: MIT
// The probes of one client, and its journal: what it is sent, and when. Internal to the server.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "machine/session.hpp"

namespace hal {

/// Nothing of it is reached but through its members, and each of them takes its mutex, then the
/// session's lock where it needs it: they may be called from any thread. Who holds the session's
/// lock must not call anything here. [any]
class ProbeFeeds {
public:
    static constexpr std::size_t max = 64;  ///< of one client

    explicit ProbeFeeds(Session& session) : session_(session) {}
    ~ProbeFeeds();  ///< detaches all
    ProbeFeeds(const ProbeFeeds&) = delete;

    /// Attaches a probe and appends the members of the reply; or returns the reason why not.
    std::string add(const ProbeRequest& request, std::int64_t batch_ns, std::string& reply);
    /// Detaches it and returns how many rows were lost; nothing when there is no probe of this
    /// number.
    std::optional<std::uint64_t> remove(std::uint64_t id);
    /// Begins or ends sending the journal.
    void journal(bool on);
    bool empty() const;
    /// Returns when the next batch is due, on the steady clock; INT64_MAX without a probe.
    std::int64_t next_due_ns() const;
    /// Appends the batches and entries that are due. With `congested` it leaves them in the rings.
    void publish(std::int64_t now_ns, bool congested, std::string& events);

private:
    struct Feed {
        std::uint64_t id;
        std::shared_ptr<LiveProbe> probe;
        std::int64_t every_ns, due_ns, sent_ns;
    };
    void publish(Feed& feed, std::int64_t now_ns, std::string& events);

    Session& session_;
    mutable std::mutex mutex_;
    std::vector<Feed> all_;  ///< guarded by mutex_, as is all below
    std::uint64_t next_ = 1;
    std::optional<EventLog::Position> event_position_;
    std::int64_t journal_due_ns_ = 0;
};

}  // namespace hal
