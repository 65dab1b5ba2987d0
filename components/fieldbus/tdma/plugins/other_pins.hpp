// SPDX-License-Identifier: MIT
// The pins of another station of the segment.
#pragma once

#include <algorithm>
#include <deque>
#include <string>

#include "fieldbus/tdma/config/schedule.hpp"
#include "fieldbus/tdma/station/station.hpp"
#include "hal/component.hpp"

namespace hal::tdma {

class OtherPins {
public:
    OtherPins(hal::Component& c, const hal::Function& f, const config::StationEntry& station)
        : name_(station.name + "."),
          online_(c, f, (name_ + "online").c_str(),
                  "a frame of the station was received within 1 s", {.safe = false}),
          frames_(c, f, (name_ + "frames").c_str(), "frames received from the station"),
          late_(c, f, (name_ + "late").c_str(), "frames received outside its slots"),
          since_(c, f, (name_ + "since").c_str(), "time since it went online or offline",
                 {.unit = "s"}),
          drift_(c, f, (name_ + "drift").c_str(),
                 "drift of its clock, from its calibration requests and answers to pings",
                 {.unit = "ppm"}),
          drift_known_(c, f, (name_ + "drift-known").c_str(),
                       "drift is valid: measured from two time stamps 0.3 s apart"),
          ping_(c, f, (name_ + "ping").c_str(), "a new number sends a ping to the station"),
          ping_done_(c, f, (name_ + "ping-done").c_str(),
                     "number of the last ping that was answered or failed"),
          ping_result_(c, f, (name_ + "ping-result").c_str(),
                       "result of that ping: 1 answered; 2 timeout (1 s or 20 cycles); not sent: 3 "
                       "no space in the own slots, 4 unknown "
                       "address, 5 this station is not running"),
          ping_time_(c, f, (name_ + "ping-time").c_str(),
                     "round-trip time of the last answered ping", {.unit = "us"}),
          ping_held_(c, f, (name_ + "ping-held").c_str(),
                     "part of that time at the other station, waiting for its slot",
                     {.unit = "us"}),
          ping_cycles_(c, f, (name_ + "ping-cycles").c_str(), "round-trip time in cycles") {
        for (const config::SlotEntry& s : station.slots) {
            slots_.emplace_back(c, f, name_, s.setup);
        }
    }

    /// Sends a ping when the number has changed. [realtime]
    void ask(Station& station, std::size_t n) noexcept {
        if (ping_ == asked_) return;
        asked_ = ping_;
        station.ping(n, asked_);
    }
    /// Shows the state of the station and of the last ping. [realtime]
    void show(const Heard& h, const Pings::Asked& ping, Time now, Time cycle) noexcept {
        online_ = h.alive;
        frames_ = h.frames;
        late_ = h.late;
        since_ = h.since == 0 ? 0.0 : static_cast<double>(std::max<Time>(now - h.since, 0)) * 1e-9;
        drift_ = h.drift * 1e6;
        drift_known_ = h.drift_known;
        ping_time_ = static_cast<double>(ping.round_trip) * 1e-3;
        ping_held_ = static_cast<double>(ping.held) * 1e-3;
        ping_cycles_ = static_cast<double>(ping.round_trip) / static_cast<double>(cycle);
        ping_result_ = static_cast<std::int32_t>(ping.outcome);
        ping_done_ = ping.done;
    }

private:
    /// The position of one of its slots in the cycle; constant.
    struct SlotPins {
        hal::Out<double> offset;
        hal::Out<std::uint32_t> period;

        SlotPins(hal::Component& c, const hal::Function& f, const std::string& station,
                 const SlotSetup& slot)
            : offset(c, f, (station + "slot-" + std::to_string(slot.id) + ".offset").c_str(),
                     "beginning of the slot, from the sync",
                     {.initial = static_cast<double>(slot.offset) * 1e-3, .unit = "us"}),
              period(c, f, (station + "slot-" + std::to_string(slot.id) + ".period").c_str(),
                     "the slot is used every this many cycles", {.initial = slot.period}) {}
    };

    const std::string name_;
    std::uint32_t asked_ = 0;
    hal::Out<bool> online_;
    hal::Out<std::uint64_t> frames_, late_;
    hal::Out<double> since_, drift_;
    hal::Out<bool> drift_known_;
    hal::In<std::uint32_t> ping_;
    hal::Out<std::uint32_t> ping_done_;
    hal::Out<std::int32_t> ping_result_;
    hal::Out<double> ping_time_, ping_held_, ping_cycles_;
    std::deque<SlotPins> slots_;
};

}  // namespace hal::tdma
