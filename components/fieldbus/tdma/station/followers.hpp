// SPDX-License-Identifier: MIT
// The stations that run on the schedule this station leads: those that calibrated with it, and those whose frames come.
#pragma once

#include <algorithm>
#include <array>

#include "station_setup.hpp"

namespace hal::tdma {

class Followers {
public:
    static constexpr std::size_t most = 64;

    /// A station asked for its delay. [realtime]
    void calibrated(const Address& who, Time now) noexcept { heard(who, now); }
    /// It sent something else. [realtime]
    void sent(const Address& who, Time now) noexcept {
        if (Follower* f = heard(who, now)) f->sends = true;
    }
    /// Whether there is one: a station that sends was heard within `silence`; one that never sends is there since it calibrated. [realtime]
    bool any(Time now, Time silence) const noexcept {
        return std::any_of(list_.begin(), list_.begin() + static_cast<std::ptrdiff_t>(used_),
                           [&](const Follower& f) { return !f.sends || now - f.heard <= silence; });
    }
    void clear() noexcept { used_ = 0; }

private:
    struct Follower {
        Address who{};
        Time    heard = 0;
        bool    sends = false;
    };
    /// Its place; the one silent for longest makes room.
    Follower* heard(const Address& who, Time now) noexcept {
        const auto end = list_.begin() + static_cast<std::ptrdiff_t>(used_);
        auto       f = std::find_if(list_.begin(), end, [&](const Follower& x) { return x.who == who; });
        if (f == end) {
            f = used_ < most ? list_.begin() + static_cast<std::ptrdiff_t>(used_++)
                             : std::min_element(list_.begin(), list_.end(), [](const auto& a, const auto& b) { return a.heard < b.heard; });
            *f = {who, now, false};
        }
        f->heard = now;
        return &*f;
    }

    std::array<Follower, most> list_{};
    std::size_t                used_ = 0;
};

}  // namespace hal::tdma
