// SPDX-License-Identifier: MIT
// What happened on the network, in sentences on standard error.
#pragma once

#include <memory>
#include <string>

#include "canopen/master/boot/flying_master.hpp"
#include "canopen/master/boot/node_status.hpp"
#include "canopen/master/config/bus_schedule.hpp"
#include "emergency_text.hpp"
#include "event_rows.hpp"
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
    void node(const NodeStatus& s) noexcept { reported_.tell({.kind = Event::node, .of_node = s}); }
    /// What should be known of it: one bit of its notes.
    void note(NodeStatus s, Note one) noexcept {
        s.notes = one;
        reported_.tell({.kind = Event::note, .of_node = s});
    }
    void network(const NetworkStatus& n, const NodeStatus& s) noexcept {
        reported_.tell({.kind = Event::network, .of_node = s, .of_network = n});
    }
    void emergency(const NodeStatus& s, const Emergency& e) noexcept {
        reported_.tell({.of_bus = BusEvent::emergency, .of_node = s, .of_emergency = e});
    }
    void bus(BusEvent state) noexcept { reported_.tell({.of_bus = state}); }
    void rejected(const can::Rejected& what) noexcept {
        reported_.tell({.kind = Event::rejected, .of_link = what});
    }
    void cycle(Time period) noexcept { reported_.tell({.kind = Event::cycle, .period = period}); }
    void foreign(const Events::Foreign& f) noexcept {
        reported_.tell({.of_bus = foreign_event(f), .of_foreign = f});
    }
    void flying(const FlyingMaster& f) noexcept {
        if (f.master() == 0) return;
        const bool own = f.master() == config_.node_id;
        reported_.tell(
            {.of_bus = own ? BusEvent::is_master : BusEvent::on_standby, .master = f.master()});
    }

private:
    struct Event {
        enum Kind : std::uint8_t { bus, node, note, network, cycle, rejected } kind = bus;
        BusEvent of_bus{};
        NodeStatus of_node{};
        NetworkStatus of_network{};
        Emergency of_emergency{};
        Time period = 0;
        std::uint8_t master = 0;
        can::Rejected of_link{};
        Events::Foreign of_foreign{};
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
        case Event::bus: add_bus_event(e, of); break;
        case Event::cycle:
        case Event::rejected: break;
        }
        return of;
    }
    static void add_bus_event(const Event& e, MessageSubject& of) {
        const auto add = [](std::string& text, auto value) { text += ' ' + std::to_string(value); };
        switch (e.of_bus) {
        case BusEvent::emergency:
            add(of.kind, static_cast<int>(e.of_bus));
            add(of.kind, e.of_node.id);
            add(of.detail, e.of_emergency.code);
            // how much is over
            if (e.of_emergency.code == 0) {
                add(of.detail, e.of_emergency.error_register);
            }
            break;
        case BusEvent::is_master:
        case BusEvent::on_standby:
            of.kind += " flying";
            add(of.detail, e.master);
            break;
        case BusEvent::foreign_nmt:
        case BusEvent::foreign_sync:
        case BusEvent::foreign_time:
        case BusEvent::foreign_rpdo:
        case BusEvent::foreign_sdo:
        case BusEvent::foreign_id:
            of.kind += " foreign";
            add(of.detail, e.of_foreign.id);
            break;
        case BusEvent::waiting: of.kind += " waiting"; break;
        default: add(of.detail, static_cast<int>(e.of_bus)); break;
        }
    }
    static BusEvent foreign_event(const Events::Foreign& f) noexcept {
        if (f.id == 0) return BusEvent::foreign_nmt;
        if (f.sync) return BusEvent::foreign_sync;
        if (f.id == 0x100) return BusEvent::foreign_time;
        if (f.rpdo) return BusEvent::foreign_rpdo;
        if (f.id > 0x600 && f.id < 0x680) return BusEvent::foreign_sdo;
        return BusEvent::foreign_id;
    }

    std::string words(const Event& e) {
        switch (e.kind) {
        case Event::bus: return line(e);
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
        case Event::network: return network_line(e);
        case Event::rejected: return can::to_string(e.of_link);
        case Event::cycle:
            for (const config::Message& m : config::load_messages(config_, e.period, file_)) {
                return m.sentence + "; " + m.help;
            }
            break;
        }
        return {};
    }
    std::string network_line(Event e) {
        const NetworkStatus& n = e.of_network;
        if ((n.state == NetworkState::booting && n.node == 0) || n.state == NetworkState::off) {
            return {};
        }
        if (n.state != NetworkState::operational) return sentence(setup_, n, e.of_node);
        e.of_bus =
            n.begun == operational_reported_ ? BusEvent::operational_again : BusEvent::operational;
        operational_reported_ = n.begun;
        return line(e);
    }
    /// Formats the line of a row.
    std::string line(const Event& e) const {
        return bus::format(bus_event_rows[static_cast<std::size_t>(e.of_bus)].text, bus::Text::line,
                           [&](std::string_view name) { return value_of(name, e); });
    }

    template <class... Values>
    static std::string print(const char* format, Values... values) {
        char text[80];
        std::snprintf(text, sizeof text, format, values...);
        return text;
    }
    /// Returns the value of a name in a row.
    std::string value_of(std::string_view name, const Event& e) const {
        const NetworkStatus& network = e.of_network;
        const Events::Foreign& foreign = e.of_foreign;
        if (name == "node") return called(e);
        if (name == "operational") return std::to_string(network.operational);
        if (name == "nodes") return std::to_string(network.nodes);
        if (name == "s") {
            return print("%.2f s",
                         static_cast<double>(network.operational_since - network.begun) * 1e-9);
        }
        if (name == "code") return print("0x%04X", unsigned{e.of_emergency.code});
        if (name == "meaning") return emergency_text(config_, e.of_node.id, e.of_emergency.code);
        if (name == "register") return print("0x%02X", unsigned{e.of_emergency.error_register});
        if (name == "x") return print("%03Xh", unsigned{foreign.id});
        if (name == "frames") {
            return foreign.frames > 1 ? print(" (%u frames)", unsigned{foreign.frames}) : "";
        }
        if (name == "command") return command_text(foreign.data[0]);
        if (name == "pdo") return rpdo_name(foreign.id);
        return {};
    }
    /// Returns the name of the node that an event is about.
    std::string called(const Event& e) const {
        switch (e.of_bus) {
        case BusEvent::on_standby: return called(e.master);
        case BusEvent::foreign_nmt:
            return e.of_foreign.data[1] == 0 ? "all nodes" : called(e.of_foreign.data[1]);
        case BusEvent::foreign_sdo:
            return called(static_cast<std::uint8_t>(e.of_foreign.id & 0x7f));
        default: return called(e.of_node.id);
        }
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
    /// Returns the name of the RPDO of a node that this master sends with an identifier.
    std::string rpdo_name(std::uint16_t id) const {
        for (const config::Node& n : config_.nodes) {
            for (const config::Pdo& p : n.pdos) {
                if (p.to_node && cob_id(p.cob) == id) {
                    return "rpdo" + std::to_string(p.number) + " of " + called(n.setup.id);
                }
            }
        }
        return "an RPDO";
    }
    static std::string command_text(std::uint8_t command) {
        const char* const name = to_string(static_cast<NmtCommand>(command));
        return name != nullptr ? name : "command " + std::to_string(command);
    }

    const config::MasterConfig& config_;
    const MasterSetup setup_;
    const std::string file_, instance_;
    // start whose operational network was reported
    Time operational_reported_ = -1;
    hal::Reporter<Event> reported_;                   // the last: its thread uses the others
};

}  // namespace hal::canopen
