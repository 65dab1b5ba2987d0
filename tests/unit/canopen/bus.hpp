// SPDX-License-Identifier: MIT
// A wire between nodes that exists only in a test: every n-th frame can be lost, doubled or
// delayed, and time is a number.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "canopen/master/network.hpp"
#include "canopen/protocol/device.hpp"

namespace hal::canopen::test {

struct Faults {
    unsigned lose = 0;
    unsigned repeat = 0;
    unsigned delay = 0;  ///< every n-th frame; 0: none
};

/// Nodes are pairs of a queue and a taker. Frames go to all but their sender, in order unless
/// delayed.
class Bus {
public:
    using Take = std::function<void(const Frame&, Time)>;
    void attach(FrameQueue& out, Take take) { nodes_.push_back({&out, std::move(take)}); }
    void attach(Device& d) {
        attach(d.out(), [&d](const Frame& f, Time now) { d.handle(f, now); });
    }
    Faults faults;
    std::vector<Frame> log;
    bool logging = true;
    std::size_t carried = 0;

    /// Carries all that is queued and what follows from it. True: there was something.
    bool exchange(Time now) {
        bool any = false;
        for (bool more = true; more;) {
            more = false;
            for (std::size_t from = 0; from < nodes_.size(); ++from) {
                Frame f;
                if (!nodes_[from].out->pop(f)) continue;
                more = any = true;
                carry(from, f, now);
            }
        }
        if (held_) {
            const auto [from, f] = *held_;
            held_.reset();
            deliver(from, f, now);
            exchange(now);
        }
        return any;
    }
    /// As if a tool on the bus had sent it.
    void inject(const Frame& f, Time now) { deliver(nodes_.size(), f, now); }

    /// The frames logged since, with that identifier.
    std::vector<Frame> sent(std::uint32_t id) const {
        std::vector<Frame> result;
        for (const auto& f : log) {
            if (f.id == id) {
                result.push_back(f);
            }
        }
        return result;
    }

private:
    struct Node {
        FrameQueue* out;
        Take take;
    };
    void carry(std::size_t from, const Frame& f, Time now) {
        ++carried;
        const auto each = [&](unsigned n) { return n != 0 && carried % n == 0; };
        if (each(faults.lose)) return;
        if (each(faults.delay) && !held_) {
            held_ = {from, f};
            return;
        }
        deliver(from, f, now);
        if (each(faults.repeat)) {
            deliver(from, f, now);
        }
        if (held_) {  // overtaken by one frame
            const auto [held_from, held] = *held_;
            held_.reset();
            deliver(held_from, held, now);
        }
    }
    void deliver(std::size_t from, const Frame& f, Time now) {
        if (logging) {
            log.push_back(f);
        }
        for (std::size_t to = 0; to < nodes_.size(); ++to) {
            if (to != from) {
                nodes_[to].take(f, now);
            }
        }
    }
    std::vector<Node> nodes_;
    std::optional<std::pair<std::size_t, Frame>> held_;
};

/// Records the events of a device for inspection.
struct Recorder : DeviceEvents {
    std::vector<NmtState> states;
    std::vector<unsigned> rpdos, late;
    std::vector<std::uint8_t> syncs;
    struct Node {
        std::uint8_t id;
        NodeEvent event;
        NmtState state;
    };
    std::vector<Node> nodes;
    std::vector<std::pair<std::uint8_t, Emergency>> emergencies;
    std::vector<bool> resets, life;
    std::vector<TimeOfDay> times;
    int communication_errors = 0;
    int collisions = 0;
    int syncs_lost = 0;
    int stored = 0;
    int restored = 0;
    std::uint32_t allowed_rate = 500'000;
    std::uint32_t activated_rate = 0;
    std::function<void()> at_sync;

    void on_state(NmtState s) noexcept override { states.push_back(s); }
    void on_reset(bool application) noexcept override { resets.push_back(application); }
    void on_sync(std::uint8_t counter, Time) noexcept override {
        syncs.push_back(counter);
        if (at_sync) {
            at_sync();
        }
    }
    void on_sync_lost(Time) noexcept override { ++syncs_lost; }
    void on_time(const TimeOfDay& t, Time) noexcept override { times.push_back(t); }
    void on_rpdo(unsigned n, Time) noexcept override { rpdos.push_back(n); }
    void on_rpdo_late(unsigned n, Time) noexcept override { late.push_back(n); }
    void on_node(std::uint8_t id, NodeEvent e, NmtState s, Time) noexcept override {
        nodes.push_back({id, e, s});
    }
    void on_emergency(std::uint8_t id, const Emergency& e) noexcept override {
        emergencies.emplace_back(id, e);
    }
    void on_communication_error(Time) noexcept override { ++communication_errors; }
    void on_life_guarding(bool lost, Time) noexcept override { life.push_back(lost); }
    void on_id_collision(Time) noexcept override { ++collisions; }
    Abort on_store(std::uint8_t) noexcept override {
        ++stored;
        return Abort::none;
    }
    Abort on_restore(std::uint8_t) noexcept override {
        ++restored;
        return Abort::none;
    }
    bool on_lss_bit_rate(std::uint32_t rate) noexcept override { return rate == allowed_rate; }
    void on_lss_activate(std::uint32_t rate, Time) noexcept override { activated_rate = rate; }
};

/// Objects the tests use: plain values, strings, a domain of 1 MiB, PDO-mappable values.
inline Description example(std::uint32_t serial = 4) {
    Description d = basic_device({.device_type = 0x191,
                                  .vendor = 1,
                                  .product = 2,
                                  .revision = 3,
                                  .serial = serial,
                                  .name = "example",
                                  .heartbeat_consumers = 4,
                                  .emcy_consumers = 4});
    using enum Access;
    d.add(0x1010, 0, Type::unsigned8, constant, 1);
    d.add(0x1010, 1, Type::unsigned32, read_write, 1);
    d.add(0x1011, 0, Type::unsigned8, constant, 1);
    d.add(0x1011, 1, Type::unsigned32, read_write, 1);
    d.add(0x2000, 0, Type::unsigned32, read_write, 0x12345678).mappable();
    d.add(0x2001, 0, Type::integer16, read_write, 0).mappable().limited(-100, 100);
    d.add(0x2002, 0, Type::unsigned8, read_only, 7);
    d.add(0x2003, 0, Type::unsigned8, write_only, 7);
    d.add(0x2004, 0, Type::unsigned64, read_write, 0x0102030405060708).mappable();
    d.add_text(0x2005, 0, read_write, "hello world", 40);
    d.add_domain(0x2006, 0, read_write, 1 << 20);
    d.add(0x2007, 0, Type::boolean, read_write, 0).mappable();
    d.add(0x2008, 0, Type::unsigned8, constant, 4);
    for (std::uint8_t n = 1; n <= 4; ++n) {
        d.add(0x2008, n, Type::unsigned8, read_write, n).mappable();
    }
    d.add_real(0x2009, 0, Type::real32, read_write, 1.5).mappable();
    d.add(0x200a, 0, Type::unsigned16, read_write, 0);  // cannot be mapped
    add_rpdo(d, 1, {.mapping = {map_entry(0x2000, 0, 32), map_entry(0x2001, 0, 16)}});
    add_rpdo(d, 2,
             {.transmission = 1, .mapping = {map_entry(0x2008, 1, 8), map_entry(0x2008, 2, 8)}});
    add_tpdo(d, 1, {.mapping = {map_entry(0x2000, 0, 32)}});
    add_tpdo(d, 2,
             {.transmission = 1, .mapping = {map_entry(0x2001, 0, 16), map_entry(0x2008, 3, 8)}});
    return d;
}

}  // namespace hal::canopen::test
