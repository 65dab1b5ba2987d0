// SPDX-License-Identifier: MIT
// Formats the events of a segment.
#pragma once

#include <algorithm>
#include <string>
#include <utility>

#include "hal/message_log.hpp"
#include "schedule.hpp"

namespace hal::tdma {

/// An event as the cycle records it.
struct Happened {
    Event event = Event::running;
    Address who{};
    Time value = 0;
};

/// Returns the subject for rate limiting. The station is the detail: frames with random addresses
/// are one kind. [setup]
inline MessageSubject subject(const Happened& h) {
    return {std::to_string(static_cast<int>(h.event)), ethernet::to_string(h.who)};
}

class EventWords {
public:
    /// The schedule must outlive it. `again`: the command that resumes a master that stepped down;
    /// `known_as`: the IP address of a station without a schedule, if it is identified by that.
    /// [setup]
    EventWords(const config::Schedule& schedule, std::string again, std::string known_as = {})
        : schedule_(schedule), again_(std::move(again)), known_as_(std::move(known_as)) {}

    /// Formats the message of an event. [setup]
    std::string operator()(const Happened& h) const {
        const std::string who = called(h.who);
        const std::string value = std::to_string(h.value);
        switch (h.event) {
        case Event::synchronised: return "synchronised to " + who;
        case Event::calibrated:
            return "calibrated: frames take " + config::microseconds(h.value) + " from or to " +
                   who;
        case Event::running: return "runs: its slots may be used";
        case Event::uncalibrated:
            return "calibration failing: " + who + " did not answer " + value +
                   " requests; still trying. Check for another " +
                   "station in the first slot of this one, and for a cable that carries frames in "
                   "one direction only";
        case Event::sync_lost:
            return "lost the sync of " + who + "; this station stops sending until the next sync";
        case Event::leading: return "active as master";
        case Event::yielded:
            return "higher-priority master " + who + " resumed; returning to standby";
        case Event::other_master:
            return "second master on the segment: " + who +
                   " sends the syncs of another schedule; they are not followed. Remove it, or "
                   "make it a backup-master:";
        case Event::other_master_gone: return "the second master " + who + " is gone";
        case Event::withdrew:
            return "stepped down as master: " + who +
                   " is a master with a smaller address, and no station follows this one; "
                   "resumes when that one is gone, or by: " +
                   again_;
        case Event::unknown_master:
            return "sync from " + who +
                   " ignored: it is not one of the addresses (mac) that the configuration gives "
                   "the master and its backups";
        case Event::foreign_frame:
            return who + " sends in slot " + value +
                   " of this station; compare the configurations of both";
        case Event::duplicate_slot:
            return "two stations send in the slots of " + of_index(duplicate_index(h.value)) +
                   ": " + ethernet::to_string(duplicate_address(h.value)) + " and " +
                   ethernet::to_string(h.who) +
                   "; give each a block of its own, or stop one of them";
        case Event::babbling:
            return "babbling station: " + who + " sends " + value + " frames in one cycle";
        case Event::master_changed: return "new master: " + who;
        case Event::master_there:
            return "the segment has a master already, " + who +
                   "; this station starts to send when that one is gone, or by: " + again_ +
                   ". To keep both, make one of them a backup-master:";
        case Event::other_schedule:
            return "syncs of " + who + " ignored: its cycle is " + config::microseconds(h.value) +
                   ", that of this station differs; configure the same cycle on both";
        case Event::no_carrier:
            return "no carrier: nothing is sent or received; check the cable and the switch";
        case Event::carrier: return "carrier detected again";
        case Event::out_of_step:
            return "cannot synchronise to " + who + ": the offset of this thread stays at " +
                   config::microseconds(h.value) +
                   "; check whether the threads of this process follow another instance";
        case Event::wrong_period:
            return "the period of the thread is " + config::microseconds(h.value) +
                   ", the cycle of the schedule " +
                   (schedule_.cycle != 0 ? "is " + config::microseconds(schedule_.cycle)
                                         : "of the master differs") +
                   "; nothing is sent until they are equal";
        case Event::unheard:
            return "no sync received; check that the master runs and is on this segment";
        case Event::unconfigured:
            return "has no schedule and waits for the master of the segment to send it one "
                   "(RTcfg); the master's file must have a block "
                   "with '" +
                   (known_as_.empty() ? "mac " + who : "ip " + known_as_) + "'";
        case Event::other_server:
            return "second RTcfg server " + who +
                   " ignored; this station already has a configuration";
        case Event::other_configuration:
            return who +
                   " sends a configuration that differs from the one in use; it is applied after a "
                   "loss of sync: stop the master briefly";
        case Event::reported_dead: return "the master reports " + who + " dead";
        case Event::station_ready: return "station " + of_schedule(h) + " is configured";
        case Event::station_dead:
            return "station " + of_schedule(h) + " is dead: no heartbeat for " +
                   std::to_string(2 * schedule_.heartbeat_ms) +
                   " ms; all stations were notified, and it is invited again";
        case Event::station_too_long:
            return "no frame from " +
                   schedule_.stations.at(static_cast<std::size_t>(h.value)).name +
                   "; its configuration needs a slot 0 of " + std::to_string(longest_stage_1()) +
                   " bytes at the master, which is too short";
        }
        return {};
    }

private:
    /// "x (02:00:00:00:00:02)", or the address alone.
    std::string called(const Address& who) const {
        for (const config::StationEntry& s : schedule_.stations) {
            if (s.mac == who) return s.name + " (" + ethernet::to_string(who) + ")";
        }
        return ethernet::to_string(who);
    }
    std::string of_index(std::size_t index) const {
        return index < schedule_.stations.size() ? schedule_.stations[index].name
                                                 : "station " + std::to_string(index);
    }
    std::string of_schedule(const Happened& h) const {
        return schedule_.stations.at(static_cast<std::size_t>(h.value)).name + " (" +
               ethernet::to_string(h.who) + ")";
    }
    std::size_t longest_stage_1() const {
        std::size_t longest = 0;
        for (std::size_t i = 0; i < schedule_.stations.size(); ++i) {
            longest = std::max(longest, config::block_of(schedule_, i).size() +
                                            (schedule_.stations[i].ip ? 13 : 5));
        }
        return longest;
    }

    const config::Schedule& schedule_;
    const std::string again_, known_as_;
};

}  // namespace hal::tdma
