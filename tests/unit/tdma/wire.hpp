// SPDX-License-Identifier: MIT
// A segment for stations with clocks of their own. True time is the wire's; a port's user sees only
// its own clock.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "components/fieldbus/tdma/station/station.hpp"
#include "components/fieldbus/tdma/wire/big_endian.hpp"

namespace tdma_tests {

using namespace hal::tdma;
namespace ethernet = hal::ethernet;

/// local = true (1 + skew) + offset
struct Clock {
    double skew = 0.0;
    Time offset = 0;
    Time local(Time t) const { return t + std::llround(skew * static_cast<double>(t)) + offset; }
    Time real(Time l) const { return std::llround(static_cast<double>(l - offset) / (1.0 + skew)); }
};

inline Address mac(int n) { return {0x02, 0, 0, 0, 0, static_cast<std::uint8_t>(n)}; }

class Wire {
public:
    static constexpr Time path = 15'440;  // of 60 bytes at 100 Mbit/s through a switch

    struct Frame {
        std::vector<std::uint8_t> bytes;
        int from = 0;
        Time left = 0;
        Time arrives = 0;
    };

    class Port final : public ethernet::Port {
    public:
        Port(Wire& wire, int number, Clock clock)
            : wire_(wire), number_(number), clock_(clock), address_(mac(number)) {}
        const Address& address() const noexcept override { return address_; }
        ethernet::Sent send(std::span<const std::uint8_t> frame, const ethernet::Launch& launch,
                            std::int64_t now) noexcept override {
            if (cut) {
                ++statistics_.dropped;
                return ethernet::Sent::down;
            }
            const Time at = launch.at_ns == 0 ? now : launch.at_ns;
            farthest = std::max(farthest, at - now);
            if (now > at + (launch.guard_ns == 0 ? INT64_MAX / 4 : launch.guard_ns)) {
                ++statistics_.late;
                return ethernet::Sent::late;
            }
            Frame f{
                {frame.begin(), frame.end()}, number_, clock_.real(std::max(at, now)) + late, 0};
            if (f.bytes.size() < ethernet::smallest_frame) {
                f.bytes.resize(ethernet::smallest_frame);
            }
            if (launch.stamp_at != 0) {
                put(f.bytes, launch.stamp_at, clock_.local(f.left) + launch.stamp_add_ns);
            }
            wire_.queue(std::move(f));
            return ethernet::Sent::queued;
        }
        std::optional<ethernet::Arrival> receive(std::int64_t now) noexcept override {
            wire_.run(clock_.real(now));
            if (next_ == inbox_.size()) {
                inbox_.clear();
                next_ = 0;
                return {};
            }
            const Frame& f = inbox_[next_++];
            return ethernet::Arrival{f.bytes, clock_.local(f.arrives) + wire_.noise()};
        }
        bool wait(std::int64_t) noexcept override { return false; }
        ethernet::Statistics statistics() const noexcept override { return statistics_; }
        const ethernet::Description& description() const noexcept override { return description_; }
        const Clock& clock() const { return clock_; }

        bool cut = false;
        Time farthest = 0;  // ahead of its thread that a frame was handed over
        Time late = 0;  // how much later than asked its frames leave

    private:
        friend class Wire;
        Wire& wire_;
        int number_;
        Clock clock_;
        Address address_;
        std::vector<Frame> inbox_;
        std::size_t next_ = 0;
        ethernet::Description description_;
        ethernet::Statistics statistics_;
    };

    Port& port(int number, Clock clock = {}) {
        ports_.push_back(std::make_unique<Port>(*this, number, clock));
        return *ports_.back();
    }
    /// Whatever may happen to a frame, before anybody gets it: true, it is delivered.
    std::function<bool(Frame&)> fault;
    std::vector<Frame> seen;  // all that left, in order, when `watching`
    bool watching = false;
    double noise_ns = 0.0;
    std::vector<int> deaf;  // ports that get nothing but what is for them alone

    void inject(std::vector<std::uint8_t> bytes, int from, Time at) {
        queue({std::move(bytes), from, at, 0});
    }
    void queue(Frame f) { waiting_.emplace(f.left, std::move(f)); }

    /// Delivers what has arrived by then.
    void run(Time until) {
        while (!waiting_.empty() && waiting_.begin()->first < until) {
            Frame f = std::move(waiting_.begin()->second);
            waiting_.erase(waiting_.begin());
            if (f.arrives == 0) {
                if (watching) {
                    seen.push_back(f);
                }
                if (fault && !fault(f)) continue;
                f.arrives +=
                    f.left + path +
                    static_cast<Time>(160 * (std::max<std::size_t>(f.bytes.size(), 60) - 60));
            }
            if (f.arrives > until) {
                const Time at = f.arrives;
                waiting_.emplace(at, std::move(f));
                continue;
            }
            for (auto& p : ports_) {
                Address to{};
                if (f.bytes.size() >= 6) {
                    std::copy_n(f.bytes.begin(), 6, to.begin());
                }
                const bool shuns = to == ethernet::broadcast &&
                                   std::find(deaf.begin(), deaf.end(), p->number_) != deaf.end();
                if (p->number_ != f.from && !p->cut && !shuns &&
                    (to == ethernet::broadcast || to == p->address_ || f.bytes.size() < 6)) {
                    p->inbox_.push_back(f);
                }
            }
        }
    }
    Time noise() {
        if (noise_ns == 0.0) return 0;
        return std::llround(std::normal_distribution<double>(0.0, noise_ns)(random));
    }
    std::mt19937_64 random{1};

private:
    std::multimap<Time, Frame> waiting_;  // by when they leave, then by when they arrive
    std::vector<std::unique_ptr<Port>> ports_;
};

/// A station with its thread: cycles of its own clock, moved by half of the error each.
struct Machine final : Events {
    Machine(Wire& wire, int number, StationSetup setup, Clock clock = {})
        : port(wire.port(number, clock)), station(setup, this) {
        next = clock.local(1'000'000 + 137 * number);
        station.attach(port);
    }
    void cycle() {
        station.receive(next);
        if (in_cycle) {
            in_cycle(*this);
        }
        station.transmit(next);
        const Time error = station.error();
        const Time step = std::abs(error) > 20'000 ? error : error / 2;
        if (stiff || (station.status().leading && !follows)) {
            next += station.setup().cycle;
        } else {
            next += station.setup().cycle + step;
        }
    }
    Time due() const { return port.clock().real(next); }
    const Status& status() const { return station.status(); }
    void on_event(Event e, const Address& who, Time value) noexcept override {
        ++events[e];
        last_who[e] = who;
        last_value[e] = value;
    }

    Wire::Port& port;
    Station station;
    Time next = 0;
    bool follows = true;
    bool off = false;
    bool stiff = false;  // stiff: its thread keeps its own time
    std::function<void(Machine&)> in_cycle;
    std::map<Event, int> events;
    std::map<Event, Address> last_who;
    std::map<Event, Time> last_value;
};

/// Runs all machines, each when its cycle is due.
struct Bed {
    Wire wire;
    std::vector<std::unique_ptr<Machine>> machines;
    Time now = 0;

    Machine& add(int number, StationSetup setup, Clock clock = {}) {
        machines.push_back(std::make_unique<Machine>(wire, number, std::move(setup), clock));
        return *machines.back();
    }
    void run(Time time) {
        const Time end = now + time;
        for (;;) {
            Machine* first = nullptr;
            for (auto& m : machines) {
                if (!m->off && (first == nullptr || m->due() < first->due())) {
                    first = m.get();
                }
            }
            if (first == nullptr || first->due() > end) break;
            now = first->due();
            first->cycle();
        }
        now = end;
    }
};

inline StationSetup master(Time cycle = 1'000'000) {
    StationSetup s;
    s.role = Role::master;
    s.cycle = cycle;
    s.slots = {{.id = 0, .offset = 50'000, .size = 60}};
    return s;
}
inline StationSetup slave(Time offset, Time cycle = 1'000'000) {
    StationSetup s;
    s.cycle = cycle;
    s.slots = {{.id = 0, .offset = offset, .size = 60}};
    return s;
}
inline StationSetup backup(Time offset, Time slot) {
    StationSetup s;
    s.role = Role::backup;
    s.backup_offset = offset;
    s.phase = offset / 2;
    s.slots = {{.id = 0, .offset = slot, .size = 60}};
    return s;
}

}  // namespace tdma_tests
