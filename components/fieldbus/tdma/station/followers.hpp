// SPDX-License-Identifier: MIT
// The stations that follow this master's schedule: those that calibrated with it, and those whose
// frames it receives.
#pragma once

#include <algorithm>
#include <array>

#include "station_setup.hpp"

namespace hal::tdma {

class Followers {
public:
    static constexpr std::size_t max_count = 64;

    /// Notes a calibration request. [realtime]
    void calibrated(const Address& who, Time now) noexcept { heard(who, now); }
    /// Notes any other frame; `elsewhere`: it was in a slot of another master's schedule.
    /// [realtime]
    void sent(const Address& who, Time now, bool elsewhere) noexcept {
        Follower* const f = heard(who, now);
        f->sends = true;
        if (elsewhere) {
            f->elsewhere = now;
        }
    }
    /// Returns true when there is a station that sends, and in no other schedule: it was heard
    /// within `timeout` (ns), and not elsewhere. [realtime]
    bool proven(Time now, Time timeout) const noexcept {
        return std::any_of(list_.begin(), list_.begin() + static_cast<std::ptrdiff_t>(used_),
                           [&](const Follower& f) {
            const bool was_elsewhere = f.elsewhere != 0 && now - f.elsewhere <= timeout;
            return f.sends && now - f.heard <= timeout && !was_elsewhere;
        });
    }
    /// Returns true when there is a follower: a sending station heard within `timeout` (ns), or one
    /// that calibrated and never sends. [realtime]
    bool any(Time now, Time timeout) const noexcept {
        return std::any_of(list_.begin(), list_.begin() + static_cast<std::ptrdiff_t>(used_),
                           [&](const Follower& f) { return !f.sends || now - f.heard <= timeout; });
    }
    /// Forgets all followers. [realtime]
    void clear() noexcept { used_ = 0; }

private:
    struct Follower {
        Address who{};
        Time heard = 0;
        bool sends = false;
        Time elsewhere = 0;  ///< last frame in another schedule; 0: none
    };
    /// Returns its entry; a new one replaces the least recently heard when the list is full.
    Follower* heard(const Address& who, Time now) noexcept {
        const auto end = list_.begin() + static_cast<std::ptrdiff_t>(used_);
        auto f = std::find_if(list_.begin(), end, [&](const Follower& x) { return x.who == who; });
        if (f == end) {
            f = used_ < max_count ? list_.begin() + static_cast<std::ptrdiff_t>(used_++)
                                  : std::min_element(list_.begin(), list_.end(),
                                                     [](const auto& a, const auto& b) {
                return a.heard < b.heard;
            });
            *f = {who, now, false, 0};
        }
        f->heard = now;
        return &*f;
    }

    std::array<Follower, max_count> list_{};
    std::size_t used_ = 0;
};

}  // namespace hal::tdma
