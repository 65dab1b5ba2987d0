// SPDX-License-Identifier: MIT
// Supervises the reception of one TPDO of a node, from the moment the node is operational.
#pragma once

#include <algorithm>
#include <cstdint>

#include "canopen/master/config/master_config.hpp"

namespace hal::canopen {

/// See the top of this file. All functions are called by one thread.
class PdoWatch {
public:
    /// `pdo`: with the `limit` of its configuration. [setup]
    explicit PdoWatch(const config::Pdo& pdo)
        : limit_(limit_of(pdo)), syncs_(limit_ < 0 ? missed_syncs * pdo.transmission : 0U) {
        if (limit_ < 0) {
            limit_ = min_limit;
        }
    }

    /// Runs one cycle. `received`: PDOs received so far; `syncs`: SYNCs so far. Returns true when
    /// the timeout expires. [realtime]
    bool step(bool operational, std::uint64_t received, std::uint64_t syncs, Time now) noexcept {
        if (!operational || received != received_) {
            came_ = operational && received != received_;
            received_ = received;
            since_ = now;
            syncs_then_ = syncs;
            late_ = false;
            return false;
        }
        // A node needs some time for its first one.
        const Time limit = came_ ? limit_ : std::max(limit_, first_limit);
        if (limit_ == 0 || late_ || now - since_ < limit || syncs - syncs_then_ < syncs_) {
            return false;
        }
        late_ = true;
        return true;
    }
    bool late() const noexcept { return late_; }
    /// Returns the time since the last one, or since the node is operational, ns. [realtime]
    Time silence(Time now) const noexcept { return now - since_; }

private:
    static constexpr unsigned missed_syncs = 10;
    static constexpr unsigned missed_events = 3;
    static constexpr Time min_limit = 20 * millisecond;
    static constexpr Time first_limit = 500 * millisecond;

    /// Returns the timeout in ns; 0: none, -1: counted in SYNCs.
    static Time limit_of(const config::Pdo& pdo) noexcept {
        if (pdo.limit != config::automatic_limit) return pdo.limit;
        if (pdo.multiplexed() || pdo.transmission == 0) return 0;  // sent on change
        if (pdo.synchronous()) return -1;
        const Time period = std::max(pdo.event_ms * millisecond, pdo.request);
        return period == 0 ? 0 : std::max(missed_events * period, min_limit);
    }

    Time limit_;
    std::uint64_t syncs_;
    std::uint64_t received_ = 0;
    std::uint64_t syncs_then_ = 0;
    Time since_ = 0;
    bool came_ = false;
    bool late_ = false;
};

}  // namespace hal::canopen
