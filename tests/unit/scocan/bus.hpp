// SPDX-License-Identifier: MIT
// Stations on a bus in memory, stepped by virtual time.
#pragma once

#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "components/fieldbus/scocan/station/station.hpp"
#include "drivers/link/simulation.hpp"
#include "drivers/link/timing.hpp"

namespace hal::scocan::test {

inline constexpr Time us = 1000;
inline constexpr Time ms = 1'000'000;

/// Five nodes, 1 ms in ten slots: 1 a private slot of `ir`, 2 of `motor`, 3 of `us`; the others are
/// shared. Mode 1 swaps two of them.
inline constexpr const char* table_text = R"(
bitrate 1M
cycle 5ms
slots 10
node clock A sync
node spare A backup 1
node ir A
node motor A
node us B
node watch B monitor
mode 0 run
0 sync
1 private ir 0x100
2 private motor 0x10A
3 private us 0x110
mode 1 swapped
0 sync
1 private motor 0x10A
2 private ir 0x100
3 private us 0x110
)";

struct EventRecord {
    Event event;
    std::uint32_t who, id;
    Time value;
};
struct Seen {
    can::Frame frame;
    Time begin;
};

/// One station with its link; keeps what it reports.
struct Member final : Events {
    Member(const Table& table, const std::string& name, const std::string& bus,
           StationOptions options = {})
        : station(table, table.find(name).value(), options, *this) {
        auto opened = can::open("sim:" + bus, {.bit_rate = table.bit_rate, .own_frames = true});
        link = std::move(opened.link);
        station.attach(*link);
    }
    void on_frame(const can::Frame& f, Time begin) noexcept override {
        received.push_back({f, begin});
    }
    void on_sent(const can::Frame& f, Time begin) noexcept override { sent.push_back({f, begin}); }
    void on_event(Event e, std::uint32_t who, std::uint32_t id, Time value) noexcept override {
        events.push_back({e, who, id, value});
    }
    std::size_t times(Event e) const {
        return static_cast<std::size_t>(std::count_if(
            events.begin(), events.end(), [&](const EventRecord& h) { return h.event == e; }));
    }
    std::size_t count(std::uint32_t id) const {
        return static_cast<std::size_t>(std::count_if(
            received.begin(), received.end(), [&](const Seen& s) { return s.frame.id == id; }));
    }

    std::unique_ptr<can::Link> link;
    Station station;
    std::vector<Seen> received, sent;
    std::vector<EventRecord> events;
};

struct Bus {
    explicit Bus(const char* text = table_text, const char* bus_name = "scocan-test")
        : name(bus_name) {
        ReadResult reading = read(text);
        EXPECT_TRUE(reading.good()) << text::errors_text(reading.messages, "table");
        table = std::move(reading.table);
        listener = can::open("sim:" + name, {.bit_rate = table.bit_rate}).link;
    }
    Member& add(const std::string& node, StationOptions options = {}) {
        return nodes.emplace_back(table, node, name, options);
    }
    /// Runs all stations; `each` is called in every cycle of the thread between receive and
    /// transmit.
    template <class Each>
    void run(Time duration, Time period, Each each) {
        for (const Time end = now + duration; now < end; now += period) {
            for (Member& n : nodes) {
                if (n.link) {
                    n.station.receive(now);
                }
            }
            for (can::Frame f; listener->receive(f, now);) {
                wire.push_back(
                    {f, f.time_ns - can::duration_ns(
                                        {can::frame_bits(f).nominal - can::intermission_bits, 0},
                                        table.bit_rate)});
            }
            each();
            for (Member& n : nodes) {
                if (n.link) {
                    n.station.transmit(now, period);
                }
            }
        }
    }
    void run(Time duration, Time period = 500 * us) {
        run(duration, period, [] {});
    }
    can::Simulation& faults() { return *listener->simulation(); }

    std::string name;
    Table table;
    std::unique_ptr<can::Link> listener;
    std::deque<Member> nodes;
    std::vector<Seen> wire;  ///< all frames on the bus
    Time now = 1'000'000'000;
};

}  // namespace hal::scocan::test
