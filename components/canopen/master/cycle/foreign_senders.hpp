// SPDX-License-Identifier: MIT
// Frames of other devices under identifiers that only this master may use.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <vector>

#include "canopen/protocol/frames.hpp"
#include "link/can.hpp"

namespace hal::canopen {

/// A report about a foreign sender.
struct ForeignFrames {
    std::uint16_t id = 0;
    std::array<std::uint8_t, 2> data{};
    std::uint32_t frames = 0;  ///< since the last report
    bool sync = false;
    bool rpdo = false;
    bool begins = false;  ///< after a second without it
};

/// Counts foreign frames per identifier; see the top of this file.
class ForeignSenders {
public:
    ForeignSenders() : counts_(identifiers) {}

    /// Only this master sends frames with `id`. [setup]
    void add(std::uint32_t id) { ours_.set(id); }
    /// The same for an RPDO of a node. [setup]
    void add_rpdo(std::uint32_t id) {
        ours_.set(id);
        rpdos_.set(id);
    }
    /// The same for the SYNC. [setup]
    void add_sync(std::uint32_t id) {
        ours_.set(id);
        sync_ = id;
    }

    /// Ignores frames until then: those of an instance before this one still arrive. [realtime]
    void begin(Time from) noexcept { from_ = from; }
    /// Counts a frame of another device. Returns a report when its sender begins, and once a second
    /// while it continues. [realtime]
    std::optional<ForeignFrames> count(const can::Frame&, Time now) noexcept;

private:
    static constexpr std::size_t identifiers = 2048;
    struct Count {
        Time last = 0;
        Time reported = 0;
        std::uint32_t frames = 0;
    };
    std::vector<Count> counts_;  // by identifier
    std::bitset<identifiers> ours_;
    std::bitset<identifiers> rpdos_;
    std::uint32_t sync_ = identifiers;  // none
    Time from_ = 0;
};

}  // namespace hal::canopen
