// SPDX-License-Identifier: MIT
// What happened on the segment, in sentences.
#pragma once

#include <algorithm>
#include <string>
#include <utility>

#include "schedule.hpp"

namespace hal::tdma {

/// What a station told, as the cycle keeps it.
struct Happened {
    Event   event = Event::running;
    Address who{};
    Time    value = 0;
};

/// One line is printed per subject and second. [setup]
inline std::string subject(const Happened& h) {
    return std::to_string(static_cast<int>(h.event)) + ' ' + ethernet::to_string(h.who);
}

class EventWords {
public:
    /// The schedule outlives it. `again`: what is typed to make a withdrawn master begin anew; `known_as`: the IP address of a station
    /// without a schedule, when it goes by that. [setup]
    EventWords(const config::Schedule& schedule, std::string again, std::string known_as = {})
        : schedule_(schedule), again_(std::move(again)), known_as_(std::move(known_as)) {}

    /// What is said of it. [setup]
    std::string operator()(const Happened& h) const {
        const std::string who = called(h.who), value = std::to_string(h.value);
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
            return "second master on the segment: " + who +
                   " sends the syncs of another schedule; they are not followed. Remove it, or make it a backup-master:";
        case Event::other_master_gone: return "the second master " + who + " is gone";
        case Event::withdrew:
            return "stepped down as master: " + who + " is a master with a smaller address, and no station follows this one; "
                   "resumes when that one is gone, or by: " + again_;
        case Event::stranger_sync:
            return "sync from " + who + " ignored: it is not one of the addresses (mac) that the configuration gives the master and its backups";
        case Event::foreign_frame: return who + " sends in slot " + value + " of this station; compare the configurations of both";
        case Event::babbling: return who + " babbles: " + value + " frames in one cycle";
        case Event::master_changed: return "the syncs come from " + who + " now";
        case Event::master_there:
            return "the segment has a master already, " + who + "; this station starts to send when that one is gone, or by: " + again_ +
                   ". To keep both, make one of them a backup-master:";
        case Event::other_schedule:
            return "the syncs of " + who + " are not followed: one comes every " + config::microseconds(h.value) +
                   ", this station's cycle is another; give both the same";
        case Event::no_carrier: return "the line has no carrier: nothing is sent or received; is the cable in, the switch on?";
        case Event::carrier: return "the line has a carrier again";
        case Event::out_of_step:
            return "the sync of " + who + " is heard, but this thread is " + config::microseconds(h.value) +
                   " off and comes no nearer; do the threads of this process follow another instance?";
        case Event::wrong_period:
            return "the thread's period is " + config::microseconds(h.value) + ", the configuration's cycle is " +
                   (schedule_.cycle != 0 ? config::microseconds(schedule_.cycle) : "another, as the master sent it") +
                   "; nothing is sent: make them equal";
        case Event::unheard: return "no sync is heard; does the segment's master run, and is this its segment?";
        case Event::unconfigured:
            return "has no schedule and waits for the master of the segment to send it one (RTcfg); the master's file must have a block "
                   "with '" +
                   (known_as_.empty() ? "mac " + who : "ip " + known_as_) + "'";
        case Event::other_server: return "a second RTcfg server, " + who + ", is not listened to; this station has its configuration";
        case Event::other_configuration:
            return who +
                   " sends another configuration than the one in use; it is taken when the sync was lost: stop the master for a moment";
        case Event::reported_dead: return "the master says that " + who + " is dead";
        case Event::station_ready: return "station " + of_schedule(h) + " is configured";
        case Event::station_dead:
            return "station " + of_schedule(h) + " is dead: no heartbeat for " + std::to_string(2 * schedule_.heartbeat_ms) +
                   " ms; all were told, and it is invited again";
        case Event::station_too_long:
            return "nothing is heard of " + schedule_.stations.at(static_cast<std::size_t>(h.value)).name +
                   "; if it waits for its configuration: this master's slot 0 is too short for it, " + std::to_string(longest_stage_1()) +
                   " bytes are needed";
        }
        return {};
    }

private:
    /// "x (02:00:00:00:00:02)", or the address alone.
    std::string called(const Address& who) const {
        for (const config::StationEntry& s : schedule_.stations)
            if (s.mac == who) return s.name + " (" + ethernet::to_string(who) + ")";
        return ethernet::to_string(who);
    }
    std::string of_schedule(const Happened& h) const {
        return schedule_.stations.at(static_cast<std::size_t>(h.value)).name + " (" + ethernet::to_string(h.who) + ")";
    }
    std::size_t longest_stage_1() const {
        std::size_t longest = 0;
        for (std::size_t i = 0; i < schedule_.stations.size(); ++i)
            longest = std::max(longest, config::block_of(schedule_, i).size() + (schedule_.stations[i].ip ? 13 : 5));
        return longest;
    }

    const config::Schedule& schedule_;
    const std::string       again_, known_as_;
};

}  // namespace hal::tdma
