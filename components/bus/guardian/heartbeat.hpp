// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace hal::bus {

/// Detects that no cycle has run. It does so from the first cycle on.
class Heartbeat {
public:
    /// Returns whether no cycle has run for longer than `limit_ns`.
    bool is_missing(std::uint64_t cycles, std::int64_t limit_ns, std::int64_t now_ns) noexcept {
        if (cycles != cycles_) {
            cycles_ = cycles;
            last_ns_ = now_ns;
        }
        return cycles != 0 && now_ns - last_ns_ > limit_ns;
    }

private:
    std::uint64_t cycles_ = 0;
    std::int64_t last_ns_ = 0;
};

}  // namespace hal::bus
