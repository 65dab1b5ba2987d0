// SPDX-License-Identifier: MIT
// Time slots on a CAN bus in memory: how exactly a node whose clock is 100 ppm off meets its slot,
// how much of the idle slots is used, the throughput against plain CAN, and how fast a bus of 20
// nodes is simulated.
#include "scocan.hpp"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/core.h>
#include <memory>

#include "drivers/link/timing.hpp"
#include "fieldbus/scocan/station/station.hpp"

namespace hal::bench {
namespace {

using namespace hal::scocan;
constexpr Time us = 1000;
constexpr Time ms = 1'000'000;

struct Nothing final : Events {
    void on_frame(const can::Frame&, Time) noexcept override {}
    void on_event(Event, std::uint32_t, std::uint32_t, Time) noexcept override {}
};
Nothing nothing;

/// Nodes on a bus of their own, stepped by virtual time.
class Simulated {
public:
    Simulated(const std::string& name, const Table& table)
        : name_(name), table_(table), listener_(open()) {}
    Station& add(std::size_t node, StationOptions options = {}) {
        links_.push_back(open());
        stations_.push_back(std::make_unique<Station>(table_, node, options, nothing));
        stations_.back()->attach(*links_.back());
        return *stations_.back();
    }
    template <class Each, class Seen>
    void run(Time duration, Time period, Each each, Seen seen) {
        for (const Time end = now_ + duration; now_ < end; now_ += period) {
            for (auto& s : stations_) {
                s->receive(now_);
            }
            for (can::Frame f; listener_->receive(f, now_);) {
                seen(f, f.time_ns - can::duration_ns(
                                        {can::frame_bits(f).nominal - can::intermission_bits, 0},
                                        table_.bit_rate));
            }
            each();
            for (auto& s : stations_) {
                s->transmit(now_, period);
            }
        }
    }
    Time now() const { return now_; }

private:
    std::unique_ptr<can::Link> open() {
        return can::open("sim:" + name_, {.bit_rate = table_.bit_rate,
                                          .own_frames = true,
                                          .receive_capacity = Station::receive_capacity})
            .link;
    }
    const std::string name_;
    const Table& table_;
    std::unique_ptr<can::Link> listener_;
    std::vector<std::unique_ptr<can::Link>> links_;
    std::vector<std::unique_ptr<Station>> stations_;
    Time now_ = 1'000 * ms;
};

Table table_of(std::size_t nodes, const char* bit_rate = "1M") {
    std::string text = fmt::format("bitrate {}\nnode clock A sync\n", bit_rate);
    std::string slots = "mode 0 run\n0 sync\n";
    for (std::size_t i = 1; i < nodes; ++i) {
        text += fmt::format("node n{} A\n", i);
        if (i < 16) {
            slots += fmt::format("{} private n{} 0x{:03X}\n", i, i, 0x100 + i);
        }
    }
    return read(text + slots).table;
}

void start_error(const Options& options, Report& report) {
    const Table table = table_of(3);
    for (const Time tick : {Time{250}, Time{1000}}) {
        double worst = 0;
        for (const double ppm : {-100.0, -41.0, 73.0, 100.0}) {
            Simulated bus("bench-error", table);
            bus.add(0);
            Station& node = bus.add(1, {.crystal = {.ppm = ppm, .tick = tick}});
            Time sync = 0;
            const Time settled = bus.now() + 1000 * ms;
            bus.run(options.quick ? 5'000 * ms : 60'000 * ms, 330 * us,
                    [&] { node.send({0x101, {1}}, true); }, [&](const can::Frame& f, Time begin) {
                if (f.id == 0) {
                    sync = begin;
                }
                // of its own slot, 1; not of idle ones
                const auto error = std::abs(static_cast<double>(begin - sync - table.slot()));
                if (f.id != 0 && begin > settled && 2 * error < static_cast<double>(table.slot())) {
                    worst = std::max(worst, error);
                }
            });
        }
        report.row({.what = fmt::format(
                        "worst error of a slot's begin, clock up to 100 ppm off, {:g} us tick",
                        static_cast<double>(tick) / 1e3),
                    .unit = "us",
                    .ours = worst / 1e3,
                    .peer = "offset without rate, computed",
                    .theirs = tick == 1000 ? 1.4 : 1.0,
                    .goal = limit(0.5)});
    }
}

/// Returns frames of 8 bytes per second through slots, with 15 idle private ones; `idle_used`:
/// share of the idle slots that carried some.
double through_slots(const Options& options, const char* bit_rate, double& idle_used) {
    const Table table = table_of(16, bit_rate);
    Simulated bus("bench-slots", table);
    bus.add(0);
    Station& node = bus.add(1);
    std::uint64_t frames = 0;
    std::uint64_t cycles = 0;
    std::uint64_t used = 0;
    std::uint32_t number = 0;
    Time sync = 0;
    std::int64_t last = -1;
    const Time settled = bus.now() + 100 * ms;
    const Time duration = options.quick ? 1'000 * ms : 10'000 * ms;
    bus.run(duration + 100 * ms, table.slot(), [&] {
        while (node.waiting() < 16) {
            node.send(
                {0x300, std::array<std::uint8_t, 8>{0x5a, 0xc3, static_cast<std::uint8_t>(++number),
                                                    0x96, 0x3c, 0xa5, 0x69, 0x5a}},
                false);
        }
    }, [&](const can::Frame& f, Time begin) {
        if (f.id == 0) {
            sync = begin;
            last = -1;
            cycles += begin > settled;
        }
        if (f.id != 0x300 || begin <= settled) return;
        ++frames;
        const std::int64_t slot = (begin - sync) / table.slot();
        if (slot < 16 && slot != last) {
            ++used;
            last = slot;
        }
    });
    idle_used =
        static_cast<double>(used) / static_cast<double>(std::max<std::uint64_t>(cycles, 1)) / 15;
    return static_cast<double>(frames) * 1e9 / static_cast<double>(duration);
}

double plain(const Options& options, std::uint32_t bit_rate) {
    auto a = can::open("sim:bench-plain", {.bit_rate = bit_rate}).link;

    auto b = can::open("sim:bench-plain", {.bit_rate = bit_rate}).link;
    const Time duration = options.quick ? 1'000 * ms : 10'000 * ms;
    std::uint64_t frames = 0;
    std::uint32_t number = 0;
    for (Time now = 0; now < duration; now += 500 * us) {
        while (a->statistics().queued < 16) {
            a->send(
                {0x300, std::array<std::uint8_t, 8>{0x5a, 0xc3, static_cast<std::uint8_t>(++number),
                                                    0x96, 0x3c, 0xa5, 0x69, 0x5a}},
                now);
        }
        a->flush(now);
        for (can::Frame f; b->receive(f, now);) {
            ++frames;
        }
    }
    return static_cast<double>(frames) * 1e9 / static_cast<double>(duration);
}

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec) / 1e9;
}

void speed(const Options& options, Report& report) {
    const Table table = table_of(20);
    Simulated bus("bench-speed", table);
    std::vector<Station*> nodes;
    for (std::size_t i = 0; i < 20; ++i) {
        nodes.push_back(&bus.add(i));
    }
    const Time duration = options.quick ? 5'000 * ms : 30'000 * ms;
    std::uint64_t frames = 0;
    std::uint8_t number = 0;
    constexpr int runs = 6;
    double best = 0;
    double total = 0;
    const auto began = std::chrono::steady_clock::now();
    for (int run = 0; run < runs; ++run) {
        const double before = cpu_seconds();
        bus.run(duration / runs, table.slot(), [&] {
            const std::uint8_t n = ++number;
            for (std::uint32_t i = 1; i < 16; ++i) {
                nodes[i]->send({0x100 + i, {n, 2, 3, 4, 5, 6, 7, n}}, true);
            }
            for (std::uint32_t i = 16; i < 20; ++i) {
                if (nodes[i]->waiting() < 2) {
                    nodes[i]->send({0x300 + i, {1, 2, n, 4, 5, n, 7, 8}}, false);
                }
            }
        }, [&](const can::Frame&, Time) { ++frames; });
        const double cpu = cpu_seconds() - before;
        best = std::max(best, static_cast<double>(duration / runs) / 1e9 / cpu);
        total += cpu;
    }
    const double took =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    const double simulated = static_cast<double>(duration) / 1e9;
    report.row({.what = "simulated time per CPU time, 20 nodes, 1 Mbit/s, best of 6",
                .unit = "x",
                .ours = best,
                .goal = at_least(50)});
    report.row({.what = "the same, mean of 6", .unit = "x", .ours = simulated / total});
    report.row({.what = "the same, per time of day beside other programs",
                .unit = "x",
                .ours = simulated / took});
    report.note(fmt::format("{:.0f} frames per simulated second",
                            static_cast<double>(frames) * 1e9 / static_cast<double>(duration)));
}

}  // namespace

void scocan(const Options& options, Report& report) {
    report.section("scocan: time slots on a CAN bus in memory");
    start_error(options, report);
    for (const auto& [name, rate] : {std::pair{"1M", 1'000'000U}, std::pair{"500k", 500'000U}}) {
        double idle = 0;
        const double slots = through_slots(options, name, idle);
        report.row(
            {.what = fmt::format("idle private slots that carry shared frames, {}bit/s", name),
             .unit = "%",
             .ours = 100 * idle,
             .goal = at_least(100)});
        report.row({.what = fmt::format(
                        "frames of 8 bytes per second, all slots shared or idle, {}bit/s", name),
                    .unit = "1/s",
                    .ours = slots,
                    .peer = "plain CAN",
                    .theirs = plain(options, rate)});
    }
    speed(options, report);
}

}  // namespace hal::bench
