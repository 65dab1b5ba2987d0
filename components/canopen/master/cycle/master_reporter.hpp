// SPDX-License-Identifier: MIT
// What happened on the network, in sentences on standard error.
#pragma once

#include <memory>
#include <string>

#include "canopen/master/boot/flying_master.hpp"
#include "canopen/master/boot/node_status.hpp"
#include "canopen/master/config/bus_schedule.hpp"
#include "emergency_text.hpp"
#include "hal/reporter.hpp"
#include "link/can.hpp"
#include "runner.hpp"

namespace hal::canopen {

class Reporter {
public:
    /// All outlive it. [setup]
    Reporter(std::string instance, const config::MasterConfig& config, const std::string& file)
        : config_(config),
          setup_(config.setup()),
          file_(file),
          instance_(instance),
          reported_(std::move(instance), [this](const Event& e) { return words(e); }, 512,
                    [](const Event& e, const std::string&) { return subject(e); }) {}

    void start() { reported_.start(); }           // [setup]
    void stop() noexcept { reported_.stop(); }    // [setup]

    // By the cycle. [realtime]
    void node(const NodeStatus& s) noexcept { reported_.tell({Event::node, s, {}, {}, {}, 0}); }
    /// What should be known of it: one bit of its notes.
    void note(NodeStatus s, Note one) noexcept {
        s.notes = one;
        reported_.tell({Event::note, s, {}, {}, {}, 0});
    }
    void network(const NetworkStatus& n, const NodeStatus& s) noexcept {
        reported_.tell({Event::network, s, n, {}, {}, 0});
    }
    void emergency(const NodeStatus& s, const Emergency& e) noexcept {
        reported_.tell({Event::emergency, s, {}, e, {}, 0});
    }
    /// `had`: it was in order, now or earlier.
    void bus(can::State state, bool had) noexcept {
        reported_.tell({had ? Event::bus : Event::waiting, {}, {}, {}, state, 0});
    }
    void rejected(const can::Rejected& what) noexcept {
        Event e;
        e.kind = Event::rejected;
        e.of_link = what;
        reported_.tell(e);
    }
    void cycle(Time period) noexcept { reported_.tell({Event::cycle, {}, {}, {}, {}, period}); }
    void foreign(const RunnerEvents::Foreign& f) noexcept {
        reported_.tell({Event::foreign, {}, {}, {}, {}, 0, 0, {}, f});
    }
    void flying(const FlyingMaster& f) noexcept {
        if (f.master() != 0) {
            reported_.tell({Event::flying, {}, {}, {}, {}, 0, f.master()});
        }
    }

private:
    struct Event {
        enum Kind : std::uint8_t {
            node,
            note,
            network,
            emergency,
            bus,
            waiting,
            cycle,
            flying,
            rejected,
            foreign,
        } kind = node;
        NodeStatus of_node{};
        NetworkStatus of_network{};
        Emergency of_emergency{};
        can::State of_bus{};
        Time period = 0;
        std::uint8_t master = 0;
        can::Rejected of_link{};
        RunnerEvents::Foreign of_foreign{};
    };

    /// A kind is an event of one node; what a device can choose, such as an error code, is the
    /// detail.
    static MessageSubject subject(const Event& e) {
        MessageSubject of{std::to_string(e.kind)};
        const auto add = [](std::string& text, auto value) { text += ' ' + std::to_string(value); };
        switch (e.kind) {
        case Event::node:
            add(of.kind, e.of_node.id);
            add(of.detail, static_cast<int>(e.of_node.cause));
            add(of.detail, e.of_node.index);
            add(of.detail, e.of_node.sub);
            break;
        case Event::note:
            add(of.kind, e.of_node.id);
            add(of.detail, e.of_node.notes);
            break;
        case Event::network:
            add(of.kind, e.of_network.node);
            add(of.detail, static_cast<int>(e.of_network.state));
            break;
        case Event::emergency:
            add(of.kind, e.of_node.id);
            add(of.detail, e.of_emergency.code);
            // how much is over
            if (e.of_emergency.code == 0) {
                add(of.detail, e.of_emergency.error_register);
            }
            break;
        case Event::bus: add(of.detail, static_cast<int>(e.of_bus)); break;
        case Event::flying: add(of.detail, e.master); break;
        case Event::foreign: add(of.detail, e.of_foreign.id); break;
        default: break;
        }
        return of;
    }
    std::string called(std::uint8_t id) const {
        for (const config::Node& n : config_.nodes) {
            if (n.setup.id == id) {
                return "node " + std::to_string(id) +
                       (n.setup.name.empty() ? "" : " (" + n.setup.name + ")");
            }
        }
        return "node " + std::to_string(id);
    }
    std::string words(const Event& e) {
        switch (e.kind) {
        case Event::node:
            for (const NodeSetup& n : setup_.nodes) {
                if (n.id == e.of_node.id) return sentence(n, e.of_node);
            }
            break;
        case Event::note:
            for (const NodeSetup& n : setup_.nodes) {
                if (n.id == e.of_node.id) return note_sentences(n, e.of_node).front();
            }
            break;
        case Event::network: {
            const NetworkStatus& n = e.of_network;
            if ((n.state == NetworkState::booting && n.node == 0) || n.state == NetworkState::off) {
                return {};
            }
            if (n.state != NetworkState::operational) return sentence(setup_, n, e.of_node);
            char text[120];
            const double after = static_cast<double>(n.operational_since - n.begun) * 1e-9;
            if (n.begun == operational_reported_) {
                std::snprintf(text, sizeof text, "the network is operational again: %u of %u nodes",
                              n.operational, n.nodes);
            } else {
                std::snprintf(text, sizeof text,
                              "the network is operational: %u of %u nodes, after %.2f s",
                              n.operational, n.nodes, after);
            }
            operational_reported_ = n.begun;
            return text;
        }
        case Event::emergency: {
            char text[160];
            const auto code = e.of_emergency.code;
            std::snprintf(text, sizeof text, "%s: emergency 0x%04X (%s), error register 0x%02X",
                          called(e.of_node.id).c_str(), code,
                          emergency_text(config_, e.of_node.id, code),
                          e.of_emergency.error_register);
            return text;
        }
        case Event::bus: return bus_words(e.of_bus);
        case Event::waiting:
            return "waits for the bus: its interface is off, or its slots may not be used yet";
        case Event::flying:
            return e.master == config_.node_id
                       ? "is the NMT master now"
                       : "node " + std::to_string(e.master) +
                             " is the NMT master; this one is ready to take over";
        case Event::foreign: return foreign_words(e.of_foreign);
        case Event::rejected: return can::to_string(e.of_link);
        case Event::cycle:
            for (const config::Message& m : config::load_messages(config_, e.period, file_)) {
                return m.sentence + "; " + m.help;
            }
            break;
        }
        return {};
    }

    std::string foreign_words(const RunnerEvents::Foreign& f) const {
        char id[8], text[64] = "";
        std::snprintf(id, sizeof id, "%03Xh", unsigned{f.id});
        if (f.frames > 1) {
            std::snprintf(text, sizeof text, " (%u frames)", unsigned{f.frames});
        }
        if (f.id == 0) {
            const auto whom = f.data[1] == 0 ? "all nodes" : called(f.data[1]);
            return "another NMT master is on the bus: it commands '" + nmt_word(f.data[0]) +
                   "' to " + whom + text;
        }
        if (f.sync) {
            return "another device produces SYNC (" + std::string(id) +
                   "), too, and nodes act on both" + text + "; clear bit 30 of its 1005h";
        }
        if (f.id == 0x100) {
            return std::string("another device produces TIME (100h), too") + text +
                   "; clear bit 30 of its 1012h";
        }
        if (f.rpdo) {
            for (const config::Node& n : config_.nodes) {
                for (const config::Pdo& p : n.pdos) {
                    if (p.to_node && cob_id(p.cob) == f.id) {
                        return "another device sends " + std::string(id) + ", which is rpdo" +
                               std::to_string(p.number) + " of " + called(n.setup.id) +
                               " and only this master's to send" + text + "; the node obeys both";
                    }
                }
            }
        }
        if (f.id > 0x600 && f.id < 0x680) {
            return "another SDO client uses the channel of " +
                   called(static_cast<std::uint8_t>(f.id & 0x7f)) + " (" + id + ")" + text +
                   "; transfers of both may be aborted";
        }
        return "another device sends " + std::string(id) + ", an identifier of this master" + text;
    }
    static std::string nmt_word(std::uint8_t command) {
        switch (static_cast<NmtCommand>(command)) {
        case NmtCommand::start: return "start";
        case NmtCommand::stop: return "stop";
        case NmtCommand::enter_pre_operational: return "pre-operational";
        case NmtCommand::reset_node: return "reset node";
        case NmtCommand::reset_communication: return "reset communication";
        }
        return "command " + std::to_string(command);
    }
    static const char* bus_words(can::State state) {
        switch (state) {
        case can::State::active: return "the bus is active again";
        case can::State::warning:
            return "the bus is warning: many frames fail; check the cable, its termination, the "
                   "bit rate, and that a node is there";
        case can::State::passive:
            return "the bus is passive: most frames fail; check the cable, its termination, the "
                   "bit rate, and that a node is there";
        case can::State::bus_off:
            return "the bus is bus off: too many errors; it is tried again by itself";
        case can::State::down:
            return "the bus is down: its interface is off or was taken away; it is tried again by "
                   "itself";
        }
        return "";
    }

    const config::MasterConfig& config_;
    const MasterSetup setup_;
    const std::string file_, instance_;
    // start whose operational network was reported
    Time operational_reported_ = -1;
    hal::Reporter<Event> reported_;                   // the last: its thread uses the others
};

}  // namespace hal::canopen
