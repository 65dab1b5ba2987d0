// SPDX-License-Identifier: MIT
// What happened on the segment, in sentences on standard error.
#pragma once

#include <string>

#include "config.hpp"
#include "hal/reporter.hpp"

namespace hal::tdma {

class Reporter {
public:
    /// The schedule outlives it. [setup]
    Reporter(const std::string& instance, const config::Schedule& schedule)
        : instance_(instance), schedule_(schedule), told_(instance, [this](const Happened& h) { return words(h); }) {}

    void start() { told_.start(); }         // [setup]
    void stop() noexcept { told_.stop(); }  // [setup]
    /// By the cycle. What finds no room is not said. [realtime]
    void event(Event event, const Address& who, Time value) noexcept { told_.tell({event, who, value}); }

    /// "x (02:00:00:00:00:02)", or the address alone. [setup]
    static std::string called(const config::Schedule& schedule, const Address& who) {
        for (const config::StationEntry& s : schedule.stations)
            if (s.mac == who) return s.name + " (" + ethernet::to_string(who) + ")";
        return ethernet::to_string(who);
    }

private:
    struct Happened {
        Event   event = Event::running;
        Address who{};
        Time    value = 0;
    };
    std::string words(const Happened& h) const {
        const std::string who = called(schedule_, h.who), value = std::to_string(h.value);
        switch (h.event) {
        case Event::synchronised: return "the sync of " + who + " is followed";
        case Event::calibrated: return "calibrated: frames take " + config::microseconds(h.value) + " from or to " + who;
        case Event::running: return "runs: its slots may be used";
        case Event::uncalibrated:
            return who + " does not answer calibrations, " + value + " by now; it is asked on. Is there another " +
                   "station in this one's first slot, or a line that carries frames one way only?";
        case Event::sync_lost: return "the sync of " + who + " is lost; this station is silent until there is one again";
        case Event::leading: return "sends the syncs from now on";
        case Event::yielded: return "a master with more right sends the syncs again: " + who;
        case Event::other_master:
            return "there is a second master, with a schedule of its own: " + who +
                   "; one of both has to be a backup-master:, or on another segment";
        case Event::withdrew:
            return "withdrew from being master, as " + who + " is one and has the smaller address; after mending: setp " + instance_ +
                   ".reset TRUE";
        case Event::foreign_frame: return who + " sends in slot " + value + " of this station; compare the configurations of both";
        case Event::babbling: return who + " babbles: " + value + " frames in one cycle";
        case Event::master_changed: return "the syncs come from " + who + " now";
        }
        return {};
    }

    const std::string       instance_;
    const config::Schedule& schedule_;
    hal::Reporter<Happened> told_;  // the last: its thread uses the others
};

}  // namespace hal::tdma
