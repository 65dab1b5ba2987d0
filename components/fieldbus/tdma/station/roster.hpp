// SPDX-License-Identifier: MIT
// The state of each other station, from its received frames. A switch forwards only frames for this
// station or for all.
#pragma once

#include <cmath>

#include "station_setup.hpp"

namespace hal::tdma {

struct Heard {
    bool alive = false;  ///< a frame was received within a second
    Time since = 0;  ///< last change of alive, local ns; 0: never
    Time at = 0;  ///< last frame, local ns
    Address from{};  ///< its address; zeros: not known yet
    std::uint64_t frames = 0;  ///< frames received, syncs included
    std::uint64_t late = 0;  ///< frames received outside its slots
    double drift = 0.0;  ///< of its clock against global time, 1e-6 is 1 ppm
    bool drift_known = false;  ///< enough time stamps for the drift
};

class Roster {
public:
    /// Allocates an entry per station, in the order of the setup's `others`. [setup]
    explicit Roster(std::size_t count = 0) : list_(count) {}
    const Heard& operator[](std::size_t n) const noexcept { return list_[n].heard; }
    std::size_t size() const noexcept { return list_.size(); }

    /// Notes a frame of station `n`. [realtime]
    void frame(std::size_t n, const Address& from, Time now, bool late) noexcept {
        if (n >= list_.size()) return;
        Heard& h = list_[n].heard;
        if (!h.alive) {
            h.alive = true;
            h.since = now;
        }
        h.at = now;
        h.from = from;
        ++h.frames;
        if (late) {
            ++h.late;
        }
    }
    /// Notes whether a frame of station `n` was in its own slot, or in that of another one.
    /// [realtime]
    void placed(std::size_t n, bool in_own) noexcept {
        if (n >= list_.size()) return;
        list_[n].misplaced = in_own ? 0 : list_[n].misplaced + 1;
    }
    /// Returns the number of its last frames, without one in its own slots, in slots of others.
    /// [realtime]
    std::uint32_t misplaced(std::size_t n) const noexcept { return list_[n].misplaced; }
    /// Forgets a station that was taken for another one. [realtime]
    void forget(std::size_t n) noexcept { list_[n] = {}; }
    /// Uses a time stamp of its clock, from a calibration request or an answer to a ping: two of
    /// them 0.3 s to 10 s apart give its drift, unless its clock jumped. [realtime]
    void stamp(std::size_t n, Time its, Time global) noexcept {
        if (n >= list_.size()) return;
        Entry& e = list_[n];
        constexpr Time span = 300'000'000;
        constexpr Time max_span = 10'000'000'000;
        if (e.stamped != 0 && global > e.stamped && global - e.stamped <= max_span) {
            if (global - e.stamped < span) return;
            const double passed = static_cast<double>(its) - static_cast<double>(e.stamp);
            const double drift = passed / static_cast<double>(global - e.stamped) - 1.0;
            if (std::abs(drift) < 1e-3) {
                e.heard.drift = drift;
                e.heard.drift_known = true;
                return;
            }
        }
        e.stamped = global;
        e.stamp = its;
    }
    /// Marks stations offline that were not heard for `timeout` (ns); called once a cycle.
    /// [realtime]
    void expire(Time now, Time timeout) noexcept {
        for (Entry& e : list_) {
            if (e.heard.alive && now - e.heard.at > timeout) {
                e.heard.alive = false;
                e.heard.since = e.heard.at;
            }
        }
    }
    void clear() noexcept {
        for (Entry& e : list_) {
            e = {};
        }
    }

private:
    struct Entry {
        Heard heard;
        std::uint32_t misplaced = 0;
        Time stamped = 0;
        Time stamp = 0;
    };
    std::vector<Entry> list_;
};

}  // namespace hal::tdma
