// SPDX-License-Identifier: MIT
// The watchdog of an emulated card.
#pragma once

#include <cstdint>

#include "mesa/hostmot2/registers.hpp"

namespace hal::mesa {

/// A counter that runs down and bites once when it passes 0. Writing the timeout or reloading it
/// lets it count again; neither clears the status. [realtime]
class WatchdogTimer {
public:
    static constexpr std::int64_t never = INT64_MAX;

    std::uint32_t read(unsigned reg) const noexcept {
        switch (reg) {
        case watchdog::timeout: return timeout_;
        case watchdog::status: return has_bitten_ ? watchdog::has_bitten : 0;
        default: return 0;
        }
    }
    void write(unsigned reg, std::uint32_t value, std::int64_t clock) noexcept {
        switch (reg) {
        case watchdog::timeout:
            timeout_ = value;
            load(clock);
            break;
        case watchdog::status:
            has_bitten_ = has_bitten_ && (value & watchdog::has_bitten) != 0;
            break;
        default:
            if (value == watchdog::reload) {
                load(clock);
            }
            break;
        }
    }
    bool has_bitten() const noexcept { return has_bitten_; }
    /// The clock at which it bites.
    std::int64_t expires() const noexcept { return expires_; }
    void bite() noexcept {
        has_bitten_ = true;
        expires_ = never;
    }

private:
    void load(std::int64_t clock) noexcept {
        expires_ = (timeout_ & watchdog::off) != 0 ? never : clock + std::int64_t{timeout_} + 1;
    }

    std::uint32_t timeout_ = 0xffffffff;
    bool has_bitten_ = false;
    std::int64_t expires_ = never;
};

}  // namespace hal::mesa
