// SPDX-License-Identifier: MIT
// A master and devices on the wire of bus.hpp, for the tests of booting. Time is a number; devices
// have a plug and can be spoilt.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "bus.hpp"
#include "canopen/master/boot/nmt_master.hpp"

namespace hal::canopen::test {

/// A device with a plug: without power it neither hears nor sends. What it sends can be changed,
/// dropped or delayed.
struct Station : Recorder {
    Station(std::uint8_t id, const Description& d, bool auto_start = false)
        : device(d, {.node_id = id, .queue = 256, .auto_start = auto_start}, *this) {}

    void plug(bool in, Time now) {
        if (in == powered) return;
        powered = in;
        device.out().clear();
        late.clear();
        if (in) {
            booted ? device.command(NmtCommand::reset_node, now) : device.start(now);
        }
        booted = true;
        send(now);
    }
    void take(const Frame& f, Time now) {
        if (!powered) return;
        ++heard;
        device.handle(f, now);
        send(now);
    }
    void poll(Time now) {
        if (!powered) return;
        device.poll(now);
        send(now);
    }
    void send(Time now) {
        for (Frame f; device.out().pop(f);) {
            if (tamper && !tamper(f)) continue;
            late.push_back({now + delay, f});
        }
        while (!late.empty() && late.front().first <= now) {
            wire.push(late.front().second);
            late.pop_front();
        }
    }

    Device device;
    FrameQueue wire{256};
    bool powered = false;
    bool booted = false;
    Time delay = 0;
    std::function<bool(Frame&)> tamper;
    std::deque<std::pair<Time, Frame>> late;
    std::size_t heard = 0;
};

/// Rejects or overrides the accesses to an object.
struct Spoil : Handler {
    std::function<Abort(Entry&)> read;
    std::function<Abort(Entry&, std::span<const std::uint8_t>)> write;
    std::function<void(Entry&)> after;
    Abort reading(Entry& e) noexcept override { return read ? read(e) : Abort::none; }
    Abort writing(Entry& e, std::span<const std::uint8_t> value) noexcept override {
        return write ? write(e, value) : Abort::none;
    }
    void written(Entry& e) noexcept override {
        if (after) {
            after(e);
        }
    }
};

struct Bed : MasterEvents {
    explicit Bed(MasterSetup s) : setup(std::move(s)) {
        own = std::make_unique<Device>(basic_device({.vendor = 1, .heartbeat_ms = 50}),
                                       DeviceSettings{.node_id = setup.id, .nmt_slave = false},
                                       own_events);
        master = std::make_unique<Master>(setup, own->out(), *this);
        bus.attach(own->out(), [this](const Frame& f, Time t) {
            if (!alive) return;
            own->handle(f, t);
            master->handle(f, t);
        });
        bus.logging = false;
    }
    Station& add(std::uint8_t id, const Description& d, bool auto_start = false) {
        stations.push_back(std::make_unique<Station>(id, d, auto_start));
        auto& s = *stations.back();
        bus.attach(s.wire, [&s](const Frame& f, Time t) { s.take(f, t); });
        return s;
    }
    void power() {
        for (auto& s : stations) {
            s->plug(true, now);
        }
    }
    /// All on, the master started.
    void start() {
        own->start(now);
        master->start(now);
    }
    void step() {
        now += dt;
        if (alive) {
            own->poll(now);
            master->poll(now);
        }
        for (auto& s : stations) {
            s->poll(now);
        }
        bus.exchange(now);
    }
    void run(Time time) {
        for (const Time end = now + time; now < end;) {
            step();
        }
    }
    template <class Condition>
    bool until(Condition condition, Time at_most = 60 * second) {
        for (const Time end = now + at_most; now < end;) {
            if (condition()) return true;
            step();
        }
        return condition();
    }
    bool operational(Time at_most = 60 * second) {
        return until([&] { return master->status().state == NetworkState::operational; }, at_most);
    }
    bool ended(std::uint8_t id, Time at_most = 60 * second) {
        return until([&] {
            return status(id).result != BootResult::none && status(id).step >= Step::ready;
        }, at_most);
    }
    const NodeStatus& status(std::uint8_t id) const { return master->status(id); }
    NmtState state(std::size_t station) { return stations[station]->device.state(); }
    std::uint32_t value(std::size_t station, std::uint16_t index, std::uint8_t sub) {
        return stations[station]->device.dictionary().get<std::uint32_t>(index, sub);
    }
    /// The steps a node went through, as words.
    std::string way(std::uint8_t id) const {
        std::string result;
        for (const auto& [node, step] : steps) {
            if (node == id) {
                result += (result.empty() ? "" : ", ") + std::string(to_string(step));
            }
        }
        return result;
    }

    void on_step(const NodeStatus& s) noexcept override {
        if (steps.empty() || steps.back() != std::pair{s.id, s.step}) {
            steps.emplace_back(s.id, s.step);
        }
    }
    void on_network(const NetworkStatus& s) noexcept override { networks.push_back(s.state); }
    void on_own_state(NmtState s) noexcept override {
        own->command(
            s == NmtState::operational ? NmtCommand::start : NmtCommand::enter_pre_operational,
            now);
    }
    void on_emergency(std::uint8_t id, const Emergency& e) noexcept override {
        emergencies.emplace_back(id, e);
    }

    MasterSetup setup;
    Time now = 1 * second;
    Time dt = 1 * millisecond;
    bool alive = true;
    Bus bus;
    Recorder own_events;
    std::unique_ptr<Device> own;
    std::unique_ptr<Master> master;
    std::vector<std::unique_ptr<Station>> stations;
    std::vector<std::pair<std::uint8_t, Step>> steps;
    std::vector<NetworkState> networks;
    std::vector<std::pair<std::uint8_t, Emergency>> emergencies;
};

/// Node 5 as example() is.
inline NodeSetup example_node(std::uint8_t id = 5) {
    NodeSetup n;
    n.id = id;
    n.device_type = 0x191;
    n.vendor = 1;
    n.product = 2;
    n.revision = 3;
    n.serial = 4;
    n.heartbeat_ms = 50;
    n.retry = 200 * millisecond;
    n.retry_max = 2 * second;
    n.boot_limit = 3 * second;
    return n;
}
inline MasterSetup network_of(std::vector<NodeSetup> nodes) {
    MasterSetup s;
    s.nodes = std::move(nodes);
    s.sdo = {.timeout = 50 * millisecond};
    return s;
}

/// A master and three example devices as nodes 5, 6 and 7; `change` adapts the set-up of each,
/// `network` that of the master.
struct Three : Bed {
    explicit Three(const std::function<void(std::uint8_t, NodeSetup&)>& change = {},
                   const std::function<void(MasterSetup&)>& network = {})
        : Bed([&] {
              std::vector<NodeSetup> nodes;
              for (std::uint8_t id = 5; id <= 7; ++id) {
                  nodes.push_back(example_node(id));
                  if (change) {
                      change(id, nodes.back());
                  }
              }
              auto s = network_of(nodes);
              if (network) {
                  network(s);
              }
              return s;
          }()) {
        for (std::uint8_t id = 5; id <= 7; ++id) {
            add(id, example());
        }
        bus.logging = true;
    }
    std::vector<std::uint8_t> started() const {
        std::vector<std::uint8_t> ids;
        for (const auto& f : bus.sent(0)) {
            if (f.data[0] == 1) {
                ids.push_back(f.data[1]);
            }
        }
        return ids;
    }
};

/// A master and one example device as node 5.
struct Configured : Bed {
    explicit Configured(const std::function<void(NodeSetup&)>& change = {},
                        Description d = example(), bool auto_start = false)
        : Bed([&] {
              auto n = example_node();
              if (change) {
                  change(n);
              }
              return network_of({n});
          }()),
          station(add(5, d, auto_start)) {
        bus.logging = true;
        power();
    }
    /// Returns the number of SDO requests with this client command specifier for `index`; index 0:
    /// for any object.
    std::size_t requests(unsigned specifier, std::uint16_t index = 0) const {
        const auto sent = bus.sent(0x605);
        return static_cast<std::size_t>(std::ranges::count_if(sent, [&](const Frame& f) {
            return f.data[0] >> 5 == specifier &&
                   (index == 0 || load<std::uint16_t>(f.data.data() + 1) == index);
        }));
    }
    std::size_t writes(std::uint16_t index = 0) const { return requests(1, index); }
    std::size_t reads(std::uint16_t index = 0) const { return requests(2, index); }
    Station& station;
};
inline void two_objects(NodeSetup& n) {
    n.writes = {object_write(0x2000, 0, std::uint32_t{9}, "gain"),
                object_write(0x2001, 0, std::int16_t{-5}, "offset")};
}

}  // namespace hal::canopen::test
