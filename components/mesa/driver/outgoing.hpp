// SPDX-License-Identifier: MIT
// What a cycle writes to the card.
#pragma once

#include <cstdint>
#include <optional>

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

class Outgoing;

/// A register whose bits switch pins on. The watchdog of the card clears it, so a bit is set only
/// by a datagram that follows a clean status of the watchdog, and never written again on suspicion.
/// Used by one thread; all functions are [realtime].
class PinSwitch {
public:
    explicit PinSwitch(std::uint16_t address = 0) noexcept : address_(address) {}
    std::uint16_t address() const noexcept { return address_; }
    /// Returns the bits that the card has, as an answer has shown.
    std::uint32_t confirmed() const noexcept { return is_confirmed_ ? sent_ : 0; }
    /// Returns what an answer shows if nobody else has written to the card; nothing: unknown.
    std::optional<std::uint32_t> expected(bool writes_arrived) const noexcept {
        const bool has_it = is_confirmed_ || (is_in_flight_ && writes_arrived);
        return has_it ? std::optional(sent_) : std::nullopt;
    }

    /// Writes the register unless the card has the value. `may_set`: bits may be set now.
    void transmit(Outgoing& out, std::uint32_t value, bool may_set) noexcept;
    /// An answer shows whether the newest writes have arrived.
    void receive(bool writes_arrived) noexcept {
        is_confirmed_ = is_confirmed_ || (is_in_flight_ && writes_arrived);
        is_in_flight_ = false;
    }
    void miss() noexcept { is_in_flight_ = false; }
    /// The card was stopped: all bits are cleared, or the next write clears them.
    void forget() noexcept {
        is_confirmed_ = false;
        is_in_flight_ = false;
    }

private:
    std::uint16_t address_;
    std::uint32_t sent_ = 0;
    bool is_confirmed_ = false;
    bool is_in_flight_ = false;  ///< in the newest datagram
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
    /// Whether all settings are written, not only those that have changed.
    bool rewrites() const noexcept { return rewrites_; }
    /// False: something did not fit.
    bool is_complete() const noexcept { return is_complete_; }

private:
    Request& request_;
    const bool rewrites_;
    bool is_complete_ = true;
};

inline void PinSwitch::transmit(Outgoing& out, std::uint32_t value, bool may_set) noexcept {
    is_in_flight_ = false;
    const bool is_known = is_confirmed_ && sent_ == value;
    if (is_known && (value != 0 || !out.rewrites())) return;
    const bool sets = (value & ~confirmed()) != 0;
    if (sets && !may_set) return;
    out.put(address_, value);
    sent_ = value;
    is_confirmed_ = false;
    is_in_flight_ = out.is_complete();
}

}  // namespace hal::mesa
