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
          online_(c, f, (name_ + "online").c_str(), "a frame of it came within a second"),
          frames_(c, f, (name_ + "frames").c_str(), "frames of it that came here"),
          late_(c, f, (name_ + "late").c_str(), "of them: those that came outside of its slots"),
          since_(c, f, (name_ + "since").c_str(), "for how long it has been online, or offline", {.unit = "s"}),
          drift_(c, f, (name_ + "drift").c_str(), "of its clock, from its calibrations with this station and its answers to pings",
                 {.unit = "ppm"}),
          drift_known_(c, f, (name_ + "drift-known").c_str(), "drift is measured: two stamps of that clock came, 0.3 s apart"),
          ping_(c, f, (name_ + "ping").c_str(), "another number than before asks the station for an answer"),
          ping_done_(c, f, (name_ + "ping-done").c_str(), "the newest such number that was answered or given up"),
          ping_result_(c, f, (name_ + "ping-result").c_str(),
                       "of that one: 1 answered; 2 no answer within a second (or 20 cycles); not sent: 3 no room in the own slots, 4 the "
                       "station's address is not known, 5 this station does not run"),
          ping_time_(c, f, (name_ + "ping-time").c_str(), "of the newest that was answered: from the question on the line to the answer",
                     {.unit = "us"}),
          ping_held_(c, f, (name_ + "ping-held").c_str(), "of that time: at the other station, which waited for its slot", {.unit = "us"}),
          ping_cycles_(c, f, (name_ + "ping-cycles").c_str(), "the same time in cycles") {
        for (const config::SlotEntry& s : station.slots) slots_.emplace_back(c, f, name_, s.setup);
    }

    /// A ping, when one is wanted. [realtime]
    void ask(Station& station, std::size_t n) noexcept {
        if (ping_ == asked_) return;
        asked_ = ping_;
        station.ping(n, asked_);
    }
    void show(const Heard& h, const Pings::Asked& ping, Time now, Time cycle) noexcept {  // [realtime]
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
    /// Where in the cycle a slot of it is; constant.
    struct SlotPins {
        hal::Out<double>        offset;
        hal::Out<std::uint32_t> period;

        SlotPins(hal::Component& c, const hal::Function& f, const std::string& station, const SlotSetup& slot)
            : offset(c, f, (station + "slot-" + std::to_string(slot.id) + ".offset").c_str(), "when the slot begins, from the sync",
                     {.initial = static_cast<double>(slot.offset) * 1e-3, .unit = "us"}),
              period(c, f, (station + "slot-" + std::to_string(slot.id) + ".period").c_str(), "it is used in one of so many cycles",
                     {.initial = slot.period}) {}
    };

    const std::string       name_;
    std::uint32_t           asked_ = 0;
    hal::Out<bool>          online_;
    hal::Out<std::uint64_t> frames_, late_;
    hal::Out<double>        since_, drift_;
    hal::Out<bool>          drift_known_;
    hal::In<std::uint32_t>  ping_;
    hal::Out<std::uint32_t> ping_done_;
    hal::Out<std::int32_t>  ping_result_;
    hal::Out<double>        ping_time_, ping_held_, ping_cycles_;
    std::deque<SlotPins>    slots_;
};

}  // namespace hal::tdma
