// SPDX-License-Identifier: MIT
// The events of a segment: the lines that are printed, and the texts of those that are faults.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bus/events/event_rows.hpp"
#include "hal/message_log.hpp"
#include "schedule.hpp"
#include "text/quoting.hpp"

namespace hal::tdma {

inline constexpr bus::EventRow<Event> event_rows[] = {
    {Event::synchronised, bus::Effect::none, "synchronised to {who}"},
    {Event::calibrated, bus::Effect::none, "calibrated: frames take {us} from or to {who}"},
    {Event::running, bus::Effect::ends, "runs: its slots may be used"},
    {Event::uncalibrated, bus::Effect::raises,
     "calibration failing: {who} did not answer {value} requests; still trying[. Check for another "
     "station in the first slot of this one, and for a cable that carries frames in one direction "
     "only]"},
    {Event::sync_lost, bus::Effect::raises,
     "lost the sync of {who}[; this station stops sending until the next sync]",
     " for {s} (limit {limit}); this station stops sending until the next sync"},
    {Event::new_schedule, bus::Effect::raises,
     "{who} sends the syncs of a new schedule; this station stops sending until it follows them"},
    {Event::leading, bus::Effect::none, "active as master"},
    {Event::yielded, bus::Effect::none,
     "higher-priority master {who} resumed; returning to standby"},
    {Event::other_master, bus::Effect::raises,
     "second master on the segment: {who} sends the syncs of another schedule; they are not "
     "followed[. Remove it, or make it a backup-master:]"},
    {Event::other_master_gone, bus::Effect::ends, "the second master {who} is gone"},
    {Event::withdrew, bus::Effect::raises,
     "stepped down as master: {who} is a master with a smaller address, and no station follows "
     "this one[; resumes when that one is gone, or by: {again}]"},
    {Event::unknown_master, bus::Effect::none,
     "sync from {who} ignored: it is not one of the addresses (mac) that the configuration gives "
     "the master and its backups"},
    {Event::foreign_frame, bus::Effect::raises,
     "{who} sends in slot {value} of this station[; compare the configurations of both]"},
    {Event::duplicate_slot, bus::Effect::raises,
     "two stations send in the same slots[, those of {block}: {first} and {address}; give each a "
     "block of its own, or stop one of them]"},
    {Event::babbling, bus::Effect::raises,
     "babbling station: {who} sends {value} frames in one cycle"},
    {Event::master_changed, bus::Effect::none, "new master: {who}"},
    {Event::master_there, bus::Effect::raises,
     "the segment has a master already[, {who}]; this station starts to send when that one is "
     "gone[, or by: {again}. To keep both, make one of them a backup-master:]"},
    {Event::other_schedule, bus::Effect::raises,
     "syncs of {who} ignored: its cycle is {us}, that of this station {cycle}; configure the same "
     "cycle on both"},
    {Event::no_carrier, bus::Effect::raises,
     "no carrier[: nothing is sent or received; check the cable and the switch]"},
    {Event::carrier, bus::Effect::ends, "carrier detected again"},
    {Event::unheard, bus::Effect::none,
     "no sync received; check that the master runs and is on this segment"},
    {Event::out_of_step, bus::Effect::raises,
     "cannot synchronise to {who}: the offset of this thread stays at {us}[; check whether the "
     "threads of this process follow another instance]"},
    {Event::wrong_period, bus::Effect::raises,
     "the period of the thread is {us}, the cycle of the schedule {cycle}; nothing is sent until "
     "they are equal"},
    {Event::unconfigured, bus::Effect::none,
     "has no schedule and waits for the master of the segment to send it one (RTcfg); the master's "
     "file must have a block with '{identity}'"},
    {Event::other_server, bus::Effect::none,
     "second RTcfg server {who} ignored; this station already has a configuration"},
    {Event::other_configuration, bus::Effect::none,
     "{who} sends a configuration that differs from the one in use; it is applied after a loss of "
     "sync: stop the master briefly"},
    {Event::reported_dead, bus::Effect::none, "the master reports {who} dead"},
    {Event::station_ready, bus::Effect::none, "station {station} ({address}) is configured"},
    {Event::station_dead, bus::Effect::none,
     "station {station} ({address}) is dead: no heartbeat for {heartbeat} ms; all stations were "
     "notified, and it is invited again"},
    {Event::station_too_long, bus::Effect::none,
     "no frame from {station}; its configuration needs a slot 0 of {bytes} bytes at the master, "
     "which is too short"},
};
static_assert(bus::in_order(event_rows));

/// An event as the cycle records it.
struct EventRecord {
    Event event = Event::running;
    Address who{};
    Time value = 0;
};

/// Returns the subject for rate limiting. The station is the detail: frames with random addresses
/// are one kind. [setup]
inline MessageSubject subject(const EventRecord& h) {
    return {std::to_string(static_cast<int>(h.event)), ethernet::to_string(h.who)};
}

/// Returns how a line or a fault states the cycle of a schedule, 0 without one. [setup]
inline std::string cycle_text(Event event, Time cycle) {
    if (event == Event::wrong_period) {
        return cycle != 0 ? "is " + config::microseconds(cycle) : "of the master differs";
    }
    return cycle != 0 ? config::microseconds(cycle) : "differs";
}

/// The lines of the events.
class EventTexts {
public:
    /// The schedule must outlive it. `again`: the command that resumes a master that stepped down;
    /// `known_as`: the IP address of a station without a schedule, if it is identified by that.
    /// [setup]
    EventTexts(const config::Schedule& schedule, std::string again, std::string known_as = {})
        : schedule_(schedule), again_(std::move(again)), known_as_(std::move(known_as)) {}

    /// Formats the line of an event. [setup]
    std::string line(const EventRecord& h) const {
        return bus::format(event_rows[static_cast<std::size_t>(h.event)].text, bus::Text::line,
                           [&](std::string_view name) { return value_of(name, h); });
    }

private:
    std::string value_of(std::string_view name, const EventRecord& h) const {
        if (name == "who") return called(h.who);
        if (name == "address") return ethernet::to_string(h.who);
        if (name == "value") return std::to_string(h.value);
        if (name == "us") return config::microseconds(h.value);
        if (name == "cycle") return cycle_text(h.event, schedule_.cycle);
        if (name == "block") return of_index(duplicate_index(h.value));
        if (name == "first") return ethernet::to_string(duplicate_address(h.value));
        if (name == "station") return of_index(static_cast<std::size_t>(h.value));
        if (name == "heartbeat") return std::to_string(2 * schedule_.heartbeat_ms);
        if (name == "bytes") return std::to_string(max_stage_1());
        if (name == "identity") {
            return known_as_.empty() ? "mac " + called(h.who) : "ip " + known_as_;
        }
        return again_;
    }
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
    std::size_t max_stage_1() const {
        std::size_t max = 0;
        for (std::size_t i = 0; i < schedule_.stations.size(); ++i) {
            max = std::max(
                max, config::block_of(schedule_, i).size() + (schedule_.stations[i].ip ? 13 : 5));
        }
        return max;
    }

    const config::Schedule& schedule_;
    const std::string again_, known_as_;
};

/// The texts of the faults of a station, of those stations whose address the schedule has.
class SegmentFaults {
public:
    /// [setup]
    SegmentFaults(const config::Schedule& schedule, const StationSetup& setup)
        : names_(known(schedule)),
          texts_(event_rows, names_.size(),
                 [&](Event event, std::size_t station, std::string_view name) {
                     if (name == "limit") return counted(setup.lost_limit, "cycle");
                     if (name == "cycle") return cycle_text(event, setup.cycle);
                     return station < names_.size() ? names_[station].second : unknown(event);
                 }) {}

    /// Returns the fault of an event; nullptr when it raises none. [realtime]
    const bus::FaultTexts::Fault* of(Event event, const Address& who) const noexcept {
        std::size_t station = 0;
        while (station < names_.size() && names_[station].first != who) {
            ++station;
        }
        return texts_.of(event, station);
    }

private:
    using Names = std::vector<std::pair<Address, std::string>>;

    static Names known(const config::Schedule& schedule) {
        Names names;
        for (const config::StationEntry& s : schedule.stations) {
            if (s.mac) {
                names.emplace_back(*s.mac, s.name);
            }
        }
        return names;
    }
    static std::string unknown(Event event) {
        const bool is_master = event == Event::sync_lost || event == Event::new_schedule ||
                               event == Event::uncalibrated || event == Event::out_of_step;
        return is_master ? "the master" : "another station";
    }

    Names names_;
    bus::FaultTexts texts_;
};

}  // namespace hal::tdma
