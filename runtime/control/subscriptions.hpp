// SPDX-License-Identifier: MIT
// The subscriptions of one client: which values it is sent, and when. Internal to the server.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "machine/session.hpp"

namespace hal {

/// Nothing of it is reached but through its members, and each of them takes its mutex: they may be
/// called from any thread, also while another thread executes a request of the same client.
/// publish() takes the session's lock after it; who holds that lock must not call anything here.
/// [any]
class Subscriptions {
public:
    static constexpr std::size_t max = 64;  ///< of one client

    /// Adds a subscription to the values of `names` and returns its number; 0 when there are
    /// `max`.
    std::uint64_t add(std::vector<std::string> names, std::int64_t every_ns, bool changes_only);
    /// Returns false when there is no subscription of this number.
    bool remove(std::uint64_t id);
    bool empty() const;
    /// Returns when the next one is due, on the steady clock; INT64_MAX without a subscription.
    std::int64_t next_due_ns() const;
    /// Appends an event line for each that is due. With `congested` counts it as skipped instead.
    void publish(Session& session, std::int64_t now_ns, bool congested, std::string& events);

private:
    struct Subscription {
        std::uint64_t id;
        std::vector<std::string> names;
        std::int64_t every_ns, due_ns;
        bool changes_only;
        std::vector<std::optional<Reading>> last = {};
        std::uint64_t skipped = 0;
    };

    mutable std::mutex mutex_;
    std::vector<Subscription> all_;  ///< guarded by mutex_, as is next_
    std::uint64_t next_ = 1;
};

/// Appends the values as a JSON array; null for a missing value.
void append_values(std::string& to, const std::vector<std::optional<Reading>>& readings);

}  // namespace hal
