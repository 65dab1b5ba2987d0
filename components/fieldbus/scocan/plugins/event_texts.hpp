// SPDX-License-Identifier: MIT
// The events of a station: the lines that are printed, and the texts of those that are faults.
#pragma once

#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bus/events/event_rows.hpp"
#include "fieldbus/scocan/station/station.hpp"
#include "hal/message_log.hpp"

namespace hal::scocan {

inline constexpr bus::EventRow<Event> event_rows[] = {
    {Event::running, bus::Effect::ends, "running: synchronised, sends in its slots"},
    {Event::sync_lost, bus::Effect::raises,
     "no SYNC for {value} cycles (limit {lost}); sends nothing until the next SYNC[; check node "
     "{sync}]"},
    {Event::sync_late, bus::Effect::none,
     "SYNC {us} {side}, ignored; if this repeats, disable automatic retransmission on node {sync}"},
    {Event::sync_doubled, bus::Effect::none,
     "second SYNC in one cycle ignored; disable automatic retransmission on node {sync}"},
    {Event::sync_off_rate, bus::Effect::raises,
     "not synchronised: the interval of the SYNC is {value} ppm off the cycle (limit 1000 ppm)[; "
     "correct the clock of this node or of node {sync}]"},
    {Event::sync_jumped, bus::Effect::none, "the SYNC has a new phase, followed"},
    {Event::other_sync, bus::Effect::raises,
     "second SYNC node on the bus; this one is on standby[; remove one of them, or make it a "
     "backup]"},
    {Event::leading, bus::Effect::none, "sends the SYNC"},
    {Event::standby, bus::Effect::none, "on standby: another node sends the SYNC"},
    {Event::other_table, bus::Effect::raises,
     "table differs from that of the SYNC node[ (CRC {crc}, there {other_crc})]; receives only[; "
     "give all nodes the same file]"},
    {Event::table_agrees, bus::Effect::ends, "table agrees with that of the SYNC node"},
    {Event::unknown_mode, bus::Effect::raises,
     "mode {value} of the SYNC is not in the table; receives only"},
    {Event::foreign_frame, bus::Effect::raises,
     "frame {frame} in slot {value}, outside of its own{owner}"},
    {Event::babbling, bus::Effect::raises,
     "babbling node: {value} frames outside of their slots in one cycle[, the last "
     "{frame}{owner}]"},
    {Event::slot_missed, bus::Effect::none,
     "frame {frame} missed its slot: no cycle of the thread of {us} began within its transmit "
     "window of {window}; use a faster thread, or a longer idle time"},
    {Event::late_frame, bus::Effect::none,
     "own frame {frame} started {us} behind its transmit window; use a faster thread, or a longer "
     "idle time"},
    {Event::silenced, bus::Effect::raises,
     "silenced: 3 own frames outside of their slots in 1 s[; correct the cause, then type: "
     "{reset}]"},
    {Event::silenced_by_monitor, bus::Effect::raises,
     "silenced by the monitor[; correct the cause, then type: {reset}]"},
    {Event::bus_off, bus::Effect::raises,
     "controller off the bus; sends nothing until it has recovered"},
    {Event::bus_on, bus::Effect::ends, "controller on the bus again"},
    {Event::mode_changed, bus::Effect::none, "mode {value} ({mode})"},
    {Event::mode_refused, bus::Effect::raises, "mode change[ to {id}] cancelled: {rejection}"},
    {Event::monitor_lost, bus::Effect::raises,
     "monitor lost: idle slots are not announced any more; nodes of type B do not use them"},
    {Event::monitor_found, bus::Effect::ends, "idle slots are announced again"},
    {Event::frame_too_long, bus::Effect::none,
     "frame {frame} with {value} bytes does not fit into any slot"},
    {Event::not_allowed, bus::Effect::none,
     "frame {frame} not sent: {rule}; further ones are counted in dropped"},
};
static_assert(bus::in_order(event_rows));

/// An event as the cycle records it.
struct EventRecord {
    Event event = Event::running;
    std::uint32_t who = no_node;
    std::uint32_t id = 0;
    Time value = 0;
};

/// Formats the events of a station.
class EventTexts {
public:
    /// The table outlives it. `reset`: the command that resumes a silenced node. [setup]
    EventTexts(const Table& table, std::size_t node, std::string reset)
        : t_(table), own_(table.nodes[node].name), reset_(std::move(reset)) {
        for (const std::uint32_t id : {sync_id, announce_id, configuration_ids, node_id}) {
            add_frame(id, no_node);
        }
        // the owner of a slot takes precedence, as in the line
        for (const Message& m : t_.messages) {
            add_frame(m.id, static_cast<std::uint32_t>(m.node));
        }
        for (const Mode& mode : t_.modes) {
            for (const auto& uses : mode.slots) {
                for (const Use& u : uses) {
                    for (const std::uint32_t id : u.ids) {
                        add_frame(id, static_cast<std::uint32_t>(u.node));
                    }
                }
            }
        }
        faults_.emplace(event_rows, frames_.size(),
                        [this](Event event, std::size_t frame, std::string_view name) {
            return value_of_fault(event, frame, name);
        });
    }

    /// Formats the line of an event. [setup]
    std::string line(const EventRecord& h) const {
        return bus::format(event_rows[static_cast<std::size_t>(h.event)].text, bus::Text::line,
                           [&](std::string_view name) { return value_of(name, h); });
    }
    /// Subject for rate limiting. The identifier is the detail: frames with random ones are one
    /// kind. [setup]
    static MessageSubject subject(const EventRecord& h, const std::string&) {
        return {std::to_string(static_cast<int>(h.event)), std::to_string(h.id)};
    }
    /// Returns the fault of an event; nullptr when it raises none. [realtime]
    const bus::FaultTexts::Fault* fault(Event event, std::uint32_t id) const noexcept {
        return faults_->of(event, id < identifiers ? number_[id] : frames_.size());
    }

private:
    struct Frame {
        std::uint32_t id;
        std::uint32_t who;
    };

    /// The last sender of an identifier counts.
    void add_frame(std::uint32_t id, std::uint32_t who) {
        if (number_[id] < frames_.size()) {
            frames_[number_[id]].who = who;
            return;
        }
        number_[id] = static_cast<std::uint16_t>(frames_.size());
        frames_.push_back({id, who});
    }

    std::string value_of_fault(Event event, std::size_t frame, std::string_view name) const {
        if (name == "rejection") return "a node did not agree";
        if (frame < frames_.size()) {
            return value_of(name, {event, frames_[frame].who, frames_[frame].id, 0});
        }
        if (name == "frame") return "with an unknown identifier";
        if (name == "owner") return "; its sender is not in the table";
        return value_of(name, {event, no_node, 0, 0});
    }
    std::string value_of(std::string_view name, const EventRecord& h) const {
        if (name == "value") return std::to_string(h.value);
        if (name == "us") return microseconds(std::abs(h.value));
        if (name == "side") return h.value > 0 ? "late" : "early";
        if (name == "id") return std::to_string(h.id);
        if (name == "frame") return frame_text(h.id);
        if (name == "owner") return owner(h.who, h.id);
        if (name == "sync") return sync_node();
        if (name == "lost") return std::to_string(t_.lost);
        if (name == "crc") return id_text(t_.crc);
        if (name == "other_crc") return id_text(static_cast<std::uint32_t>(h.value));
        if (name == "window") return microseconds(t_.enabled());
        if (name == "mode") return mode(h.value);
        if (name == "rejection") return rejection(h);
        if (name == "rule") return rule(h);
        return reset_;
    }
    std::string sync_node() const {
        for (const Node& n : t_.nodes) {
            if (n.role == Role::sync) return n.name;
        }
        return {};
    }
    std::string frame_text(std::uint32_t id) const {
        const Message* m = t_.message(id);
        return id_text(id) + (m != nullptr ? " (" + m->name + ")" : "");
    }
    std::string owner(std::uint32_t who, std::uint32_t id) const {
        if (who >= t_.nodes.size()) {
            if (id == sync_id) return "; a SYNC, of node " + sync_node() + " or a backup";
            if (id == announce_id) return "; an idle slot announced by the monitor";
            if (is_reserved(id)) return "; reserved for the bus itself";
            return "; its sender is not in the table";
        }
        return (t_.nodes[who].name == own_ ? "; sent by this node, " : "; probably sent by node ") +
               t_.nodes[who].name;
    }
    std::string mode(Time number) const {
        const Mode* const mode = t_.mode(static_cast<std::uint32_t>(number));
        return mode != nullptr ? mode->name : "";
    }
    std::string name_of(std::uint32_t node) const {
        if (node >= t_.nodes.size()) return "node ?";
        return "node " + t_.nodes[node].name;
    }
    std::string rejection(const EventRecord& h) const {
        const std::string node = name_of(h.who);
        const bool silent = static_cast<Answer::Reason>(h.value) == Answer::Reason::offline;
        return node + (silent ? " did not answer; check that it runs with the same table"
                              : " has no such mode");
    }
    std::string rule(const EventRecord& h) const {
        if (is_reserved(h.id)) return "reserved identifier; use 0x010..0x77F";
        return "identifier of node " + t_.nodes[h.who].name + "; use one of node " + own_;
    }

    const Table& t_;
    const std::string own_, reset_;
    std::vector<Frame> frames_;  // those whose sender is known
    std::vector<std::uint16_t> number_ = std::vector<std::uint16_t>(identifiers, UINT16_MAX);
    std::optional<bus::FaultTexts> faults_;
};

}  // namespace hal::scocan
