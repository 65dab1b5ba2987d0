// SPDX-License-Identifier: MIT
// What is heard of each other station of the schedule. A switch passes on what is for this station or for all; other frames are not seen.
#pragma once

#include <cmath>

#include "station_setup.hpp"

namespace hal::tdma {

struct Heard {
    bool          alive = false;  ///< something came within a second
    Time          since = 0;      ///< when that changed, local; 0: never
    Time          at = 0;         ///< of the newest frame, local
    Address       from{};         ///< who that is; zeros: not known yet
    std::uint64_t frames = 0;     ///< its frames, syncs included
    std::uint64_t late = 0;       ///< of them: those that came outside of its slots
    double        drift = 0.0;    ///< of its clock against global time, from its calibration requests and answers to pings, when …
    bool          drift_known = false;  ///< … there were enough
};

class Roster {
public:
    /// Names follow the setup's `others`. [setup]
    explicit Roster(std::size_t count = 0) : list_(count) {}
    const Heard& operator[](std::size_t n) const noexcept { return list_[n].heard; }
    std::size_t  size() const noexcept { return list_.size(); }

    /// A frame of that station came. [realtime]
    void frame(std::size_t n, const Address& from, Time now, bool late) noexcept {
        if (n >= list_.size()) return;
        Heard& h = list_[n].heard;
        if (!h.alive) h.alive = true, h.since = now;
        h.at = now, h.from = from;
        ++h.frames;
        if (late) ++h.late;
    }
    /// It asked for its delay, or answered a ping: two of its stamps 0.3 s apart give its drift. Its clock may have jumped. [realtime]
    void stamp(std::size_t n, Time its, Time global) noexcept {
        if (n >= list_.size()) return;
        Entry& e = list_[n];
        constexpr Time span = 300'000'000, longest = 10'000'000'000;
        if (e.stamped != 0 && global > e.stamped && global - e.stamped <= longest) {
            if (global - e.stamped < span) return;
            const double passed = static_cast<double>(its) - static_cast<double>(e.stamp);
            const double drift = passed / static_cast<double>(global - e.stamped) - 1.0;
            if (std::abs(drift) < 1e-3) {
                e.heard.drift = drift, e.heard.drift_known = true;
                return;
            }
        }
        e.stamped = global, e.stamp = its;
    }
    /// Once a cycle. [realtime]
    void look(Time now, Time silence) noexcept {
        for (Entry& e : list_)
            if (e.heard.alive && now - e.heard.at > silence) e.heard.alive = false, e.heard.since = e.heard.at;
    }
    void clear() noexcept {
        for (Entry& e : list_) e = {};
    }

private:
    struct Entry {
        Heard heard;
        Time  stamped = 0, stamp = 0;
    };
    std::vector<Entry> list_;
};

}  // namespace hal::tdma
