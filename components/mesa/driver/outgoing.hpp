// SPDX-License-Identifier: MIT
// What a cycle writes to the card.
#pragma once

#include <cstdint>

#include "mesa/lbp16/packet.hpp"

namespace hal::mesa {

/// A register that is written when its value changes. Used by one thread.
class Setting {
public:
    explicit Setting(std::uint16_t address = 0) noexcept : address_(address) {}
    std::uint16_t address() const noexcept { return address_; }

private:
    friend class Outgoing;
    std::uint16_t address_;
    bool is_sent_ = false;
    std::uint32_t sent_ = 0;
};

/// The writes of one cycle. All functions are [realtime].
class Outgoing {
public:
    /// `rewrites`: all settings are written, not only those that have changed.
    Outgoing(Request& request, bool rewrites) noexcept : request_(request), rewrites_(rewrites) {}

    /// Writes a register in each cycle.
    void put(std::uint16_t address, std::uint32_t value) noexcept {
        is_complete_ = request_.write32(address, value).has_value() && is_complete_;
    }
    /// Writes a register when its value has changed, or all are written. What does not fit into the
    /// datagram is written in the next cycle.
    void put(Setting& setting, std::uint32_t value) noexcept {
        if (setting.is_sent_ && setting.sent_ == value && !rewrites_) return;
        setting.is_sent_ = request_.write32(setting.address_, value).has_value();
        setting.sent_ = value;
        is_complete_ = is_complete_ && setting.is_sent_;
    }
    /// False: something did not fit.
    bool is_complete() const noexcept { return is_complete_; }

private:
    Request& request_;
    const bool rewrites_;
    bool is_complete_ = true;
};

}  // namespace hal::mesa
