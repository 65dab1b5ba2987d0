// SPDX-License-Identifier: MIT
// Error control of one node: heartbeat or node guarding, with the times that its boot determined.
#pragma once

#include "canopen/master/network.hpp"
#include "node_setup.hpp"

namespace hal::canopen {

/// See the top of this file. All functions [realtime].
class NodeSupervision {
public:
    NodeSupervision(const NodeSetup& setup, RemoteNode& remote) noexcept
        : setup_(setup), remote_(remote) {}

    /// Returns true if the node is guarded: by configuration, or because it has no 1017h.
    bool guarding() const noexcept { return setup_.guard_ms != 0 || no_producer_; }
    /// Returns the guard time.
    Time guard_period() const noexcept {
        return (setup_.guard_ms != 0 ? setup_.guard_ms : setup_.heartbeat_ms) * millisecond;
    }
    /// Returns the time without a sign of life after which the node is lost; 0: unknown.
    Time limit() const noexcept {
        if (guarding()) return guard_period() * 2;
        if (setup_.heartbeat_limit > 0) return setup_.heartbeat_limit;
        return producer_ms_ * millisecond * 5 / 2;
    }
    /// Returns true if the period of the heartbeat or its limit is known.
    bool has_heartbeat() const noexcept { return producer_ms_ != 0 || setup_.heartbeat_limit != 0; }
    /// Returns 1017h of the node as far as known; 0: unknown or off.
    std::uint16_t producer_ms() const noexcept { return producer_ms_; }

    /// Forgets what an earlier boot determined.
    void reset() noexcept {
        no_producer_ = false;
        producer_ms_ = 0;
    }
    /// Sets what 1017h of the node has.
    void set_producer(std::uint16_t ms) noexcept { producer_ms_ = ms; }
    /// The node has no 1017h: it is guarded.
    void set_no_producer() noexcept { no_producer_ = true; }

    /// Starts node guarding. Returns when the first response must have arrived.
    Time guard(Time now) noexcept {
        remote_.guard(guard_period(), setup_.guard_factor, now);
        return now + guard_period() * setup_.guard_factor;
    }
    /// Starts the supervision of the heartbeat.
    void expect_heartbeat() noexcept { remote_.expect_heartbeat(limit()); }
    /// Stops both.
    void stop(Time now) noexcept {
        remote_.expect_heartbeat(0);
        remote_.guard(0, 0, now);
    }

private:
    const NodeSetup& setup_;
    RemoteNode& remote_;
    std::uint16_t producer_ms_ = 0;
    bool no_producer_ = false;
};

}  // namespace hal::canopen
