// SPDX-License-Identifier: MIT
#include "ethercat/esc/line.hpp"

#include <algorithm>

#include "ethercat/wire/byte_order.hpp"

namespace hal::ethercat::esc {

namespace line_facts {
constexpr std::int64_t smallest_frame = 60;
constexpr std::int64_t overhead = 4;  ///< bytes; overhead: the check sequence
constexpr std::uint16_t circulating = 0x4000;
constexpr std::uint8_t local_address = 0x02;  ///< which the source address of a frame becomes
/// Returns the port that follows in a controller: 0, 3, 1, 2.
constexpr unsigned next_port(unsigned port) noexcept { return std::array{3U, 2U, 0U, 1U}[port]; }
}  // namespace line_facts

Line::Line() { nodes_.reserve(64); }

bool Line::is_free(int slave, unsigned port) const noexcept {
    if (slave < 0 || static_cast<std::size_t>(slave) >= nodes_.size() || port >= ports) {
        return false;
    }
    const Node& n = nodes_[static_cast<std::size_t>(slave)];
    return n.controller->settings().port_kinds[port] >= PortKind::ebus &&
           n.cables[port].slave == nowhere;
}

int Line::add(SlaveOnLine slave) {
    const int number = static_cast<int>(nodes_.size());
    const int parent = slave.parent == SlaveOnLine::previous ? number - 1 : slave.parent;
    if (slave.port >= ports || slave.controller.port_kinds[slave.port] < PortKind::ebus) return -1;
    if (parent < 0 ? end_of(End::primary).slave != nowhere : !is_free(parent, slave.parent_port)) {
        return -1;
    }
    Node node;
    node.controller =
        std::make_unique<Controller>(slave.controller, std::move(slave.sii), slave.application);
    node.processing_ns = slave.controller.processing_ns;
    node.forwarding_ns = slave.controller.forwarding_ns;
    interests_.emplace_back();
    node.interest = &interests_.back();
    node.controller->show_interest(interests_.back());
    interests_.back().ways_are_known = &ways_are_known_;
    if (parent < 0) {
        node.cables[slave.port] = {at_end, static_cast<unsigned>(End::primary), slave.cable_ns};
        end_of(End::primary) = {number, slave.port, slave.cable_ns};
    } else {
        node.cables[slave.port] = {parent, slave.parent_port, slave.cable_ns};
        nodes_[static_cast<std::size_t>(parent)].cables[slave.parent_port] = {number, slave.port,
                                                                              slave.cable_ns};
    }
    nodes_.push_back(std::move(node));
    for (Way& way : ways_) {
        way.visits.reserve(nodes_.size());
    }
    ways_are_known_ = false;
    update_links(static_cast<std::size_t>(number));
    return number;
}

bool Line::close_ring(unsigned slave, unsigned port, std::int64_t cable_ns) {
    if (end_of(End::secondary).slave != nowhere || !is_free(static_cast<int>(slave), port)) {
        return false;
    }
    nodes_[slave].cables[port] = {at_end, static_cast<unsigned>(End::secondary), cable_ns};
    end_of(End::secondary) = {static_cast<int>(slave), port, cable_ns};
    ways_are_known_ = false;
    update_links(slave);
    return true;
}

// Links: a port has one when its cable is whole and both sides have power.

bool Line::is_linked(std::size_t slave, unsigned port) const noexcept {
    const Connection& c = nodes_[slave].cables[port];
    if (c.slave == nowhere || c.broken || !nodes_[slave].controller->powered()) return false;
    return c.slave == at_end || nodes_[static_cast<std::size_t>(c.slave)].controller->powered();
}

void Line::update_port(std::size_t slave, unsigned port) noexcept {
    nodes_[slave].controller->set_link(port, is_linked(slave, port));
    const Connection& c = nodes_[slave].cables[port];
    if (c.slave < 0) return;
    const auto peer = static_cast<std::size_t>(c.slave);
    nodes_[peer].controller->set_link(c.port, is_linked(peer, c.port));
}

void Line::update_links(std::size_t slave) noexcept {
    for (unsigned port = 0; port < ports; ++port) {
        update_port(slave, port);
    }
}

void Line::power_on(std::int64_t now_ns) noexcept {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
        set_power(i, true, now_ns);
    }
}

void Line::set_power(std::size_t slave, bool on, std::int64_t now_ns) noexcept {
    Controller& c = *nodes_[slave].controller;
    if (c.powered() == on) return;
    if (on) {
        c.power_on(now_ns);
    } else {
        c.power_off();
    }
    update_links(slave);
}

void Line::set_cable(std::size_t slave, unsigned port, bool connected) noexcept {
    Connection& c = nodes_[slave].cables[port];
    if (c.slave == nowhere) return;
    c.broken = !connected;
    ways_are_known_ = false;
    if (c.slave == at_end) {
        ends_[c.port].broken = !connected;
    } else {
        nodes_[static_cast<std::size_t>(c.slave)].cables[c.port].broken = !connected;
    }
    update_port(slave, port);
}

void Line::set_cable(End end, bool connected) noexcept {
    if (const Connection& c = end_of(end); c.slave >= 0) {
        set_cable(static_cast<std::size_t>(c.slave), c.port, connected);
    }
}

bool Line::cable(std::size_t slave, unsigned port) const noexcept {
    const Connection& c = nodes_[slave].cables[port];
    return c.slave != nowhere && !c.broken;
}

int Line::disturb(const LineDisturbance& what) noexcept {
    if (disturbance_count_ == disturbances_.size()) return -1;
    disturbances_[disturbance_count_] = {what, 0, 0};
    return static_cast<int>(disturbance_count_++);
}

std::uint64_t Line::hits(int number) const noexcept {
    return number >= 0 && static_cast<std::size_t>(number) < disturbance_count_
               ? disturbances_[static_cast<std::size_t>(number)].hits
               : 0;
}

// The way of a frame.

struct Line::Walk {
    std::span<std::uint8_t> frame;
    Controller::Frame content;
    FrameAddresses addresses;
    std::int64_t time_ns = 0;
    bool ethercat = false;  ///< a frame with datagrams
    /// marked: a controller has seen the wrong check sequence
    bool corrupted = false;
    bool marked = false;
    unsigned copies = 1;
    Passage out;
};

void Line::advance(std::int64_t now_ns) noexcept {
    take_commands(now_ns);
    for (Node& n : nodes_) {
        if (now_ns >= n.interest->due_ns) {
            n.controller->advance(now_ns);
        }
    }
}

Line::Passage Line::process(std::span<std::uint8_t> frame, End end,
                            std::int64_t first_bit_ns) noexcept {
    advance(first_bit_ns);
    Walk w;
    w.frame = frame;
    w.time_ns = first_bit_ns;
    ++number_;
    FrameReader reader(frame);
    std::size_t count = 0;
    w.ethercat = reader.valid();
    while (auto d = reader.next()) {
        if (count == datagrams_.size()) break;
        datagrams_[count++] = *d;
    }
    w.corrupted = reader.valid() && reader.malformed();
    const auto bytes =
        std::max(static_cast<std::int64_t>(frame.size()), line_facts::smallest_frame) +
        line_facts::overhead;
    w.content = {{datagrams_.data(), count}, bytes * 8000 / speed_, number_};
    w.addresses.read(w.content.datagrams);
    if (!ways_are_known_) {
        find_ways();
    }
    const Way& way = ways_[static_cast<std::size_t>(end)];
    const bool is_disturbed = disturbance_count_ != 0 || w.corrupted;
    if (way.leads_out && w.ethercat && !is_disturbed && !w.addresses.latch()) {
        follow(way, w);
    } else {
        walk(w, end_of(end));
    }
    w.out.copies = w.copies;
    return w.out;
}

void Line::find_ways() noexcept {
    ways_are_known_ = true;
    for (std::size_t end = 0; end < ways_.size(); ++end) {
        find_way(ends_[end], ways_[end]);
    }
}

/// Finds the way that walk() takes where it only passes open ports of controllers with power.
void Line::find_way(Connection from, Way& way) const noexcept {
    way.visits.clear();
    way.leads_out = false;
    std::int64_t passed_ns = 0;
    while (!from.broken && from.slave >= 0) {
        passed_ns += from.delay_ns;
        const auto slave = static_cast<std::size_t>(from.slave);
        const Node& node = nodes_[slave];
        const FrameInterest& interest = *node.interest;
        if (!interest.powered || interest.can_latch || !node.is_open(from.port)) return;
        if (from.port == 0) {
            if (way.visits.size() == nodes_.size()) return;
            way.visits.push_back({slave, &interest, passed_ns});
        }
        passed_ns += from.port == 0 ? node.processing_ns : node.forwarding_ns;
        unsigned next = line_facts::next_port(from.port);
        while (!node.is_open(next)) {
            if (next == 0) return;  // it comes from behind a break
            next = line_facts::next_port(next);
        }
        from = node.cables[next];
    }
    way.leads_out = !from.broken && from.slave == at_end;
    way.end = static_cast<End>(from.port);
    way.duration_ns = passed_ns + from.delay_ns;
}

/// Takes a frame along a way. Where a controller that executes it changes the way, it goes on as
/// walk() finds it.
void Line::follow(const Way& way, Walk& w) noexcept {
    const std::int64_t entered_ns = w.time_ns;
    if (!way.visits.empty()) {
        w.frame[6] |= line_facts::local_address;
    }
    for (const Way::Visit& visit : way.visits) {
        w.time_ns = entered_ns + visit.after_ns;
        if (!w.addresses.concern(*visit.interest, w.time_ns + w.content.length_ns)) continue;
        Node& node = nodes_[visit.slave];
        node.controller->execute(w.content, w.time_ns);
        if (ways_are_known_) continue;
        w.time_ns += node.processing_ns;
        const int out = next_open(w, visit.slave, 0);
        if (out >= 0) {
            walk(w, node.cables[static_cast<unsigned>(out)]);
        }
        return;
    }
    w.out = {false, way.end, entered_ns + way.duration_ns};
}

void Line::walk(Walk& w, Connection from) noexcept {
    for (std::size_t hops = 0; hops < 8 * nodes_.size() + 8; ++hops) {
        if (from.broken) return;
        w.time_ns += from.delay_ns;
        if (from.slave == at_end) {
            w.out.lost = !arrive(w, -1, from.port) || w.corrupted;
            w.out.end = static_cast<End>(from.port);
            w.out.first_bit_ns = w.time_ns;
            return;
        }
        if (from.slave < 0) {
            return;  // a port kept open without a cable
        }
        const auto slave = static_cast<std::size_t>(from.slave);
        const Node& node = nodes_[slave];
        if (!node.interest->powered) return;
        if (!arrive(w, from.slave, from.port)) return;
        if (!node.is_open(from.port)) {
            if (!w.corrupted) {
                node.controller->frame_at_closed_port(from.port);
            }
            return;
        }
        const int out = exit_of(w, slave, from.port);
        if (out < 0) return;
        from = nodes_[slave].cables[static_cast<unsigned>(out)];
    }
}

/// Applies the disturbances of a receiver (-1: the master). Returns false if the frame is lost.
bool Line::disturb(Walk& w, int slave, unsigned port) noexcept {
    for (std::size_t i = 0; i < disturbance_count_; ++i) {
        Disturbed& d = disturbances_[i];
        if (d.what.slave != slave || d.what.port != port || d.hits >= d.what.count) continue;
        if (++d.seen % std::max(d.what.every, 1U) != 0) continue;
        ++d.hits;
        switch (d.what.fault) {
        case LineFault::loss: return false;
        case LineFault::corruption: w.corrupted = true; break;
        case LineFault::duplicate: ++w.copies; break;
        case LineFault::delay: w.time_ns += d.what.delay_ns; break;
        case LineFault::noise:
            if (slave >= 0) {
                nodes_[static_cast<std::size_t>(slave)]
                    .controller->error_counters()
                    .count_symbol_error(port);
            }
            break;
        }
    }
    return true;
}

/// Lets the frame arrive at a receiver (-1: the master). Returns false if it is lost.
bool Line::arrive(Walk& w, int slave, unsigned port) noexcept {
    if (disturbance_count_ != 0 && !disturb(w, slave, port)) return false;
    if (slave < 0) return true;
    const Node& node = nodes_[static_cast<std::size_t>(slave)];
    if (w.addresses.need_arrival(*node.interest)) {
        node.controller->arrive(port, w.time_ns, w.content.number);
    }
    if (w.corrupted) {
        Controller& c = *node.controller;
        if (w.marked) {
            c.error_counters().count_forwarded(port);
        } else {
            c.error_counters().count_invalid(port);
        }
        w.marked = true;
    }
    return true;
}

/// Lets the frame pass a processing unit. Returns false if it ends there.
bool Line::pass_unit(Walk& w, std::size_t slave) noexcept {
    const Node& node = nodes_[slave];
    if (w.corrupted) {
        node.controller->error_counters().count_unit_error();
    } else if (w.ethercat) {
        w.frame[6] |= line_facts::local_address;
        if (w.addresses.concern(*node.interest, w.time_ns + w.content.length_ns)) {
            node.controller->execute(w.content, w.time_ns);
        }
    } else if (node.controller->destroys_foreign_frames()) {
        node.controller->error_counters().count_unit_error();
        return false;
    }
    w.time_ns += node.processing_ns;
    return true;
}

/// Takes a frame through a controller from one of its ports. Returns the port where it leaves, -1
/// if it is destroyed.
int Line::exit_of(Walk& w, std::size_t slave, unsigned port) noexcept {
    const Node& node = nodes_[slave];
    if (port != 0) {
        w.time_ns += node.forwarding_ns;
    } else if (!pass_unit(w, slave)) {
        return -1;
    }
    return next_open(w, slave, port);
}

/// Returns the next open port of a controller behind `port`, -1 if the frame is destroyed.
int Line::next_open(Walk& w, std::size_t slave, unsigned port) noexcept {
    const Node& node = nodes_[slave];
    for (unsigned next = line_facts::next_port(port);; next = line_facts::next_port(next)) {
        if (node.is_open(next)) return static_cast<int>(next);
        if (next != 0) continue;
        // Port 0 is closed: the frame comes from behind a break. On its second pass it circulates,
        // and is destroyed.
        if (w.ethercat && !w.content.datagrams.empty()) {
            std::uint8_t* first = w.content.datagrams.front().header;
            if ((get<std::uint16_t>(first + 6) & line_facts::circulating) != 0) return -1;
            for (const DatagramView& d : w.content.datagrams) {
                put(d.header + 6, static_cast<std::uint16_t>(get<std::uint16_t>(d.header + 6) |
                                                             line_facts::circulating));
            }
        }
        if (!pass_unit(w, slave)) return -1;
    }
}

// Faults and power on request of other threads.

bool Line::post(const LineCommand& command) noexcept {
    const std::size_t next = posted_.load(std::memory_order_relaxed);
    if (next - taken_.load(std::memory_order_acquire) == max_commands) return false;
    commands_[next % max_commands] = command;
    posted_.store(next + 1, std::memory_order_release);
    return true;
}

void Line::take_commands(std::int64_t now_ns) noexcept {
    std::size_t next = taken_.load(std::memory_order_relaxed);
    const std::size_t end = posted_.load(std::memory_order_acquire);
    if (next == end) return;
    for (; next != end; ++next) {
        execute(commands_[next % max_commands], now_ns);
    }
    taken_.store(end, std::memory_order_release);
}

void Line::execute(const LineCommand& command, std::int64_t now_ns) noexcept {
    using Kind = LineCommand::Kind;
    if (command.kind == Kind::end_cable) {
        if (command.port < ends_.size()) {
            set_cable(static_cast<End>(command.port), command.on);
        }
        return;
    }
    if (command.kind == Kind::calm) return calm();
    if (command.kind == Kind::disturb) {
        disturb(command.disturbance);
        return;
    }
    if (command.slave >= nodes_.size()) return;
    Controller& c = controller(command.slave);
    switch (command.kind) {
    case Kind::power: return set_power(command.slave, command.on, now_ns);
    case Kind::cable:
        if (command.port < ports) {
            set_cable(command.slave, command.port, command.on);
        }
        return;
    case Kind::drift: return c.set_drift(command.value, now_ns);
    case Kind::jump: return c.jump_clock(static_cast<std::int64_t>(command.value), now_ns);
    case Kind::eeprom:
        return c.eeprom().fail(command.value > 0 ? static_cast<unsigned>(command.value) : 0U);
    case Kind::checksum: return c.eeprom().damage(!command.on);
    case Kind::identity: return c.eeprom().falsify(!command.on);
    case Kind::watchdog: return c.expire_watchdog();
    case Kind::end_cable:
    case Kind::calm:
    case Kind::disturb: break;
    }
}

}  // namespace hal::ethercat::esc
