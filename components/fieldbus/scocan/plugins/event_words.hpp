// SPDX-License-Identifier: MIT
// Formats the events of a station, and the fault messages of those that are faults.
#pragma once

#include <cstdlib>
#include <map>
#include <string>

#include "fieldbus/scocan/station/station.hpp"
#include "hal/message_log.hpp"

namespace hal::scocan {

/// An event as the cycle records it.
struct Happened {
    Event event = Event::running;
    std::uint32_t who = no_node;
    std::uint32_t id = 0;
    Time value = 0;
};

class EventWords {
public:
    /// The table outlives it. `reset`: the command that resumes a silenced node. [setup]
    EventWords(const Table& table, std::size_t node, std::string reset)
        : t_(table), own_(table.nodes[node].name), reset_(std::move(reset)) {}

    /// Formats the message of an event. [setup]
    std::string operator()(const Happened& h) const {
        const std::string value = std::to_string(h.value);
        switch (h.event) {
        case Event::running: return "running: synchronised, sends in its slots";
        case Event::sync_lost:
            return "no SYNC for " + value + " cycles (limit " + std::to_string(t_.lost) +
                   "); sends nothing until the next SYNC; check node " + sync_node();
        case Event::sync_late:
            return "SYNC " + microseconds(std::abs(h.value)) + (h.value > 0 ? " late" : " early") +
                   ", ignored; if this repeats, disable automatic retransmission on node " +
                   sync_node();
        case Event::sync_doubled:
            return "second SYNC in one cycle ignored; disable automatic retransmission on node " +
                   sync_node();
        case Event::sync_off_rate:
            return "not synchronised: the interval of the SYNC is " + value +
                   " ppm off the cycle (limit 1000 ppm); correct the clock of this node or of "
                   "node " +
                   sync_node();
        case Event::sync_jumped: return "the SYNC has a new phase, followed";
        case Event::other_sync:
            return "second SYNC node on the bus; this one is on standby; remove one of them, or "
                   "make it a backup";
        case Event::leading: return "sends the SYNC";
        case Event::standby: return "on standby: another node sends the SYNC";
        case Event::other_table:
            return "table differs from that of the SYNC node (CRC " + hexadecimal(t_.crc) +
                   ", there " + hexadecimal(static_cast<std::uint32_t>(h.value)) +
                   "); receives only; give all nodes the same file";
        case Event::table_agrees: return "table agrees with that of the SYNC node";
        case Event::unknown_mode:
            return "mode " + value + " of the SYNC is not in the table; receives only";
        case Event::foreign_frame: return foreign(h.id, h.who, value);
        case Event::babbling:
            return "babbling node: " + value +
                   " frames outside of their slots in one cycle, the last " + named(h.id) +
                   owner(h.who, h.id);
        case Event::slot_missed:
            return "frame " + named(h.id) + " missed its slot: no cycle of the thread of " +
                   microseconds(h.value) + " began within its transmit window of " +
                   microseconds(t_.enabled()) + "; use a faster thread, or a longer idle time";
        case Event::late_frame:
            return "own frame " + named(h.id) + " started " + microseconds(h.value) +
                   " behind its transmit window; use a faster thread, or a longer idle time";
        case Event::silenced:
            return "silenced: 3 own frames outside of their slots in 1 s; correct the cause, then "
                   "type: " +
                   reset_;
        case Event::silenced_by_monitor:
            return "silenced by the monitor; correct the cause, then type: " + reset_;
        case Event::bus_off: return "controller off the bus; sends nothing until it has recovered";
        case Event::bus_on: return "controller on the bus again";
        case Event::mode_changed:
            return "mode " + value + " (" +
                   (t_.mode(static_cast<std::uint32_t>(h.value)) != nullptr
                        ? t_.mode(static_cast<std::uint32_t>(h.value))->name
                        : "") +
                   ")";
        case Event::mode_refused: return refused(h);
        case Event::monitor_lost:
            return "idle slots are not announced any more: monitor lost; nodes of type B do not "
                   "use idle slots";
        case Event::monitor_found: return "idle slots are announced again";
        case Event::frame_too_long:
            return "frame " + named(h.id) + " with " + value + " bytes does not fit into any slot";
        case Event::not_allowed:
            return "frame " + named(h.id) + " not sent: " +
                   (is_reserved(h.id) ? "reserved identifier; use 0x010..0x77F"
                                      : "identifier of node " + t_.nodes[h.who].name +
                                            "; use one of node " + own_) +
                   "; further ones are counted in dropped";
        }
        return {};
    }

    /// Subject for rate limiting. The identifier is the detail: frames with random ones are one
    /// kind. [setup]
    static MessageSubject subject(const Happened& h, const std::string&) {
        return {std::to_string(static_cast<int>(h.event)), std::to_string(h.id)};
    }

    std::string foreign(std::uint32_t id, std::uint32_t who, const std::string& slot) const {
        return "frame " + named(id) + " in slot " + slot + ", outside of its own" + owner(who, id);
    }
    std::string sync_node() const {
        for (const Node& n : t_.nodes) {
            if (n.role == Role::sync) return n.name;
        }
        return {};
    }

private:
    std::string named(std::uint32_t id) const {
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
    std::string refused(const Happened& h) const {
        const std::string node = h.who < t_.nodes.size() ? t_.nodes[h.who].name : "?";
        const bool silent = static_cast<Answer::Reason>(h.value) == Answer::Reason::offline;
        return "mode change to " + std::to_string(h.id) + " cancelled: node " + node +
               (silent ? " did not answer; check that it runs with the same table"
                       : " has no such mode");
    }
    static std::string hexadecimal(std::uint32_t value) { return id_text(value); }

    const Table& t_;
    const std::string own_, reset_;
};

/// The fault messages, formatted before the cycle that may need them. {} is the value.
class FaultWords {
public:
    FaultWords(const Table& t, const EventWords& words) {
        text_[Event::sync_lost] = "no SYNC for {} cycles (limit " + std::to_string(t.lost) +
                                  "); sends nothing until the next SYNC";
        text_[Event::sync_off_rate] =
            "not synchronised: the interval of the SYNC is {} ppm off the cycle (limit 1000 ppm)";
        text_[Event::other_sync] = "second SYNC node on the bus; this one is on standby";
        text_[Event::other_table] = "table differs from that of the SYNC node; receives only";
        text_[Event::unknown_mode] = "mode {} of the SYNC is not in the table; receives only";
        text_[Event::babbling] = "a node sends {} frames outside of their slots in one cycle";
        text_[Event::silenced] = "silenced: 3 own frames outside of their slots in 1 s";
        text_[Event::silenced_by_monitor] = "silenced by the monitor";
        text_[Event::bus_off] = "controller off the bus";
        text_[Event::mode_refused] = "mode change cancelled: a node did not agree";
        text_[Event::monitor_lost] = "monitor lost: idle slots are not announced any more";
        foreign_other_ = "frame of an unknown node in slot {}, which is private";
        for (const std::uint32_t id : {sync_id, announce_id, request_id, answer_id}) {
            foreign_[id] = words.foreign(id, no_node, "{}");
        }
        for (const Message& m : t.messages) {
            foreign_[m.id] = words.foreign(m.id, static_cast<std::uint32_t>(m.node), "{}");
        }
        for (const Mode& mode : t.modes) {
            for (const auto& uses : mode.slots) {
                for (const Use& u : uses) {
                    for (const std::uint32_t id : u.ids) {
                        foreign_[id] = words.foreign(id, static_cast<std::uint32_t>(u.node), "{}");
                    }
                }
            }
        }
    }
    /// Returns the message of a fault, or nullptr for all other events. [realtime]
    const char* of(Event e, std::uint32_t id) const noexcept {
        if (e == Event::foreign_frame) {
            const auto found = foreign_.find(id);
            return found == foreign_.end() ? foreign_other_.c_str() : found->second.c_str();
        }
        const auto found = text_.find(e);
        return found == text_.end() ? nullptr : found->second.c_str();
    }

private:
    std::map<Event, std::string> text_;
    std::map<std::uint32_t, std::string> foreign_;
    std::string foreign_other_;
};

}  // namespace hal::scocan
