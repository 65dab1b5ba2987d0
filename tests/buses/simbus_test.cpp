// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "link/can.hpp"
#include "link/simulation.hpp"
#include "link/timing.hpp"

namespace hal::can {
namespace {

constexpr std::int64_t ms = 1'000'000;

std::unique_ptr<Link> open_or_fail(const std::string& address, const Options& o = {}) {
    auto opened = open(address, o);
    EXPECT_TRUE(opened) << opened.problem;
    return std::move(opened.link);
}
std::string fresh(const std::string& keys = {}) {  // a bus of its own for every test
    static int count = 0;
    return "sim:test" + std::to_string(++count) + keys;
}
std::vector<Frame> all(Link& link, std::int64_t now) {
    std::vector<Frame> frames;
    for (Frame f; link.receive(f, now);) {
        frames.push_back(f);
    }
    return frames;
}
std::int64_t on_wire(const Frame& f) {  // until its last bit, without the intermission
    auto bits = frame_bits(f);
    bits.nominal -= intermission_bits;
    return duration_ns(bits, 1'000'000);
}

TEST(Simbus, a_frame_arrives_when_its_last_bit_does) {
    const auto bus = fresh();
    auto a = open_or_fail(bus);
    auto b = open_or_fail(bus);
    const Frame f(0x181, {1, 2, 3});
    EXPECT_EQ(a->send(f, 5 * ms), Sent::queued);
    a->flush(5 * ms);
    EXPECT_TRUE(all(*b, 5 * ms).empty());
    EXPECT_TRUE(all(*b, 5 * ms + on_wire(f) - 1).empty());
    const auto got = all(*b, 5 * ms + on_wire(f));
    ASSERT_EQ(got.size(), 1U);
    EXPECT_TRUE(got[0].same(f));
    EXPECT_EQ(got[0].time_ns, 5 * ms + on_wire(f));
    EXPECT_TRUE(all(*a, 9 * ms).empty());  // not to the sender
    EXPECT_EQ(a->statistics().sent, 1U);
    EXPECT_EQ(b->statistics().received_bytes, 3U);
}

TEST(Simbus, the_lowest_identifier_wins_whoever_asked_first) {
    const auto bus = fresh();
    auto a = open_or_fail(bus);
    auto b = open_or_fail(bus);
    auto c = open_or_fail(bus);
    a->send({0x300, {1}}, ms);
    a->send({0x080, {2}}, ms);  // behind 0x300 in its own queue: a controller sends in order
    b->send({0x200, {3}}, ms);
    b->send({0x100, {4}}, ms);
    const auto got = all(*c, 3 * ms);
    std::vector<std::uint32_t> ids;
    for (const auto& f : got) {
        ids.push_back(f.id);
    }
    EXPECT_EQ(ids, (std::vector<std::uint32_t>{0x200, 0x100, 0x300, 0x080}));
    std::int64_t at = ms;
    for (const auto& f : got) {
        EXPECT_EQ(f.time_ns, at + on_wire(f));
        at = f.time_ns + 3000;  // three bits of intermission
    }
}

TEST(Simbus, a_frame_that_has_begun_is_not_interrupted) {
    const auto bus = fresh();
    auto a = open_or_fail(bus);
    auto b = open_or_fail(bus);
    auto c = open_or_fail(bus);
    a->send({0x700, {1, 2, 3, 4, 5, 6, 7, 8}}, ms);
    a->flush(ms);
    b->send({0x001, {}}, ms + 10'000);
    const auto got = all(*c, 3 * ms);
    ASSERT_EQ(got.size(), 2U);
    EXPECT_EQ(got[0].id, 0x700U);
}

TEST(Simbus, load_is_the_share_of_time_in_use) {
    const auto bus = fresh();
    auto a = open_or_fail(bus);
    auto b = open_or_fail(bus);
    const Frame f(0x123, {1, 2, 3, 4, 5, 6, 7, 8});
    for (int i = 0; i <= 300; ++i) {
        all(*b, i * ms);
        a->send(f, i * ms);
    }
    EXPECT_NEAR(b->statistics().load, static_cast<double>(frame_bits(f).total()) / 1000.0, 0.01);
}

TEST(Simbus, errors_count_to_bus_off_and_the_node_returns) {
    const auto bus = fresh("?errors");
    auto a = open_or_fail(bus);
    auto b = open_or_fail(bus);
    Disturbance d;
    d.fault = Fault::error;
    d.every = 1;
    EXPECT_EQ(a->simulation()->disturb(d), 0);
    a->send({0x10, {1}}, ms);
    std::vector<State> seen{State::active};
    std::int64_t now = ms;
    for (int i = 0; i < 100 && a->state() != State::bus_off; ++i) {
        now += 10'000;
        for (const auto& f : all(*a, now)) {
            EXPECT_TRUE(f.error);
        }
        if (a->state() != seen.back()) {
            seen.push_back(a->state());
        }
    }
    for (; a->state() != State::bus_off && now < 100 * ms; now += 10'000) {
        all(*a, now);
        if (a->state() != seen.back()) {
            seen.push_back(a->state());
        }
    }
    EXPECT_EQ(seen,
              (std::vector<State>{State::active, State::warning, State::passive, State::bus_off}));
    EXPECT_EQ(a->simulation()->hits(0), 32U);  // 32 errors of 8 are 256
    EXPECT_EQ(a->statistics().bus_offs, 1U);
    EXPECT_EQ(a->statistics().dropped, 1U);
    EXPECT_EQ(b->statistics().receive_errors, 32U);
    EXPECT_EQ(a->send({0x10, {1}}, now), Sent::bus_off);
    a->simulation()->calm();
    const auto off = now;
    while (a->state() == State::bus_off && now < off + 200 * ms) {
        all(*a, now += 10'000);
    }
    EXPECT_NEAR(static_cast<double>(now - off), 100.0 * ms + 128 * 11 * 1000, 200'000.0);
    EXPECT_EQ(a->statistics().restarts, 1U);
    EXPECT_EQ(a->statistics().send_errors, 0U);
    EXPECT_EQ(a->send({0x10, {1}}, now), Sent::queued);
    Frame back;
    for (std::int64_t end = now + ms; now < end && (!b->receive(back, now) || back.error);) {
        now += 10'000;
    }
    EXPECT_EQ(back.id, 0x10U);
}

TEST(Simbus, restart_ends_bus_off_when_the_link_does_not_by_itself) {
    const auto bus = fresh("?restart=0");
    auto a = open_or_fail(bus);
    auto b = open_or_fail(bus);
    Disturbance d;
    d.fault = Fault::error;
    d.every = 1;
    d.count = 32;
    a->simulation()->disturb(d);
    a->send({0x10, {1}}, ms);
    all(*b, 50 * ms);
    ASSERT_EQ(a->state(), State::bus_off);
    all(*b, 5000 * ms);
    ASSERT_EQ(a->state(), State::bus_off);
    a->restart();
    all(*b, 5001 * ms);
    all(*b, 5003 * ms);
    EXPECT_EQ(a->state(), State::active);
}

TEST(Simbus, a_node_alone_is_not_acknowledged_and_becomes_passive_but_not_bus_off) {
    const auto bus = fresh();
    auto a = open_or_fail(bus);
    a->send({0x10, {1}}, ms);
    all(*a, 1'000'000 * ms);  // a long time at once
    EXPECT_EQ(a->state(), State::passive);
    EXPECT_EQ(a->statistics().queued, 1U);
    auto b = open_or_fail(bus);
    EXPECT_EQ(all(*b, 1'000'001 * ms).size(), 1U);  // repeated until another node is on the bus
}

TEST(Simbus, a_cut_wire_isolates_and_heals) {
    const auto bus = fresh();
    auto a = open_or_fail(bus);
    auto b = open_or_fail(bus);
    auto c = open_or_fail(bus);
    a->simulation()->cut(a->simulation()->node(), true);
    a->send({0x10, {1}}, ms);
    b->send({0x20, {2}}, ms);
    EXPECT_EQ(all(*c, 20 * ms).size(), 1U);
    EXPECT_TRUE(all(*a, 20 * ms).empty());
    EXPECT_EQ(a->state(), State::passive);
    a->simulation()->cut(a->simulation()->node(), false);
    EXPECT_EQ(all(*c, 22 * ms).size(), 1U);
}

TEST(Simbus, loss_duplicate_and_delay_hit_every_nth_frame) {
    const auto bus = fresh();
    auto a = open_or_fail(bus);
    auto b = open_or_fail(bus);
    auto& sim = *a->simulation();
    const auto count = [&](Disturbance d) {
        static std::int64_t now = 0;
        sim.calm();
        sim.disturb(d);
        for (int i = 0; i < 100; ++i) {
            now += ms;
            a->send({0x10, {static_cast<std::uint8_t>(i)}}, now);
            all(*a, now);
        }
        now += 20 * ms;
        return all(*b, now);
    };
    EXPECT_EQ(count({.fault = Fault::loss, .every = 4}).size(), 75U);
    EXPECT_EQ(count({.fault = Fault::duplicate, .every = 10}).size(), 110U);
    EXPECT_EQ(count({.fault = Fault::loss, .every = 2, .id = 0x11, .mask = 0x7ff}).size(), 100U);
    // repeated until it is through
    EXPECT_EQ(count({.fault = Fault::error, .every = 5}).size(), 100U);
    const auto delayed = count({.fault = Fault::delay, .every = 50, .delay_ns = 3 * ms});
    EXPECT_EQ(delayed.size(), 100U);
    EXPECT_GT(delayed[49].time_ns - delayed[48].time_ns, 3 * ms);
    const auto drawn = count({.fault = Fault::loss, .probability = 0.5}).size();
    EXPECT_GT(drawn, 25U);
    EXPECT_LT(drawn, 75U);
}

TEST(Simbus, a_babbling_node_takes_the_bus) {
    const auto bus = fresh();
    auto a = open_or_fail(bus);
    auto b = open_or_fail(bus);
    auto c = open_or_fail(bus);
    a->simulation()->babble({0x000, {0}}, 1);
    std::size_t others = 0;
    std::size_t babbled = 0;
    for (int i = 1; i < 300; ++i) {
        b->send({0x100, {1}}, i * ms);
        for (const auto& f : all(*c, i * ms)) {
            ++(f.id == 0 ? babbled : others);
        }
    }
    EXPECT_EQ(others, 0U);
    EXPECT_GT(babbled, 4000U);
    EXPECT_GT(c->statistics().load, 0.95);
    a->simulation()->calm();
    EXPECT_GT(all(*c, 340 * ms).size(), 100U);
}

TEST(Simbus, two_nodes_with_one_identifier_destroy_each_other_unless_they_say_the_same) {
    const auto bus = fresh("?restart=0");
    auto a = open_or_fail(bus);
    auto b = open_or_fail(bus);
    auto c = open_or_fail(bus);
    a->send({0x701, {5}}, ms);
    b->send({0x701, {5}}, ms);
    EXPECT_EQ(all(*c, 5 * ms).size(), 1U);
    EXPECT_EQ(b->statistics().sent, 1U);
    a->send({0x701, {5}}, 6 * ms);
    b->send({0x701, {4}}, 6 * ms);
    EXPECT_EQ(all(*c, 100 * ms).size(), 0U);
    EXPECT_EQ(a->state(), State::bus_off);
    EXPECT_EQ(b->state(), State::bus_off);
}

TEST(Simbus, the_same_seed_gives_the_same_bytes) {
    const auto record = [] {
        const auto bus = fresh("?fd&datarate=4M");
        std::vector<std::unique_ptr<Link>> nodes;
        for (int i = 0; i < 5; ++i) {
            nodes.push_back(open_or_fail(bus));
        }
        auto& sim = *nodes[0]->simulation();
        sim.seed(7);
        sim.disturb({.fault = Fault::error, .probability = 0.05});
        sim.disturb({.fault = Fault::loss, .probability = 0.05});
        sim.disturb({.fault = Fault::duplicate, .probability = 0.02});
        sim.disturb({.fault = Fault::delay, .probability = 0.05, .delay_ns = 150'000});
        std::string text;
        for (int cycle = 1; cycle < 500; ++cycle) {
            const auto now = cycle * 500'000;
            for (std::uint32_t n = 0; n < 5; ++n) {
                for (const auto& f : all(*nodes[n], now)) {
                    text += std::to_string(f.time_ns) + ":" + std::to_string(f.id) + " ";
                }
                Frame f(0x100 + n * 3,
                        std::vector<std::uint8_t>(n * 4, static_cast<std::uint8_t>(cycle)));
                f.fd = true;
                f.bit_rate_switch = n % 2 == 0;
                f.length = length_of_code(code_of_length(f.length));
                nodes[n]->send(f, now);
            }
        }
        return text;
    };
    const auto first = record();
    EXPECT_GT(first.size(), 10000U);
    EXPECT_EQ(first, record());
}

TEST(Simbus, filters_pass_what_matches_and_full_queues_are_counted) {
    const auto bus = fresh();
    auto a = open_or_fail(bus);
    Options small;
    small.receive_capacity = 4;
    small.send_capacity = 4;
    small.own_frames = true;
    auto b = open_or_fail(bus, small);
    const Filter only[] = {{0x180, 0x780, false}};
    ASSERT_TRUE(b->set_filters(only));
    for (std::uint32_t i = 0; i < 20; ++i) {
        a->send({0x178 + i, {1}}, ms);
    }
    EXPECT_EQ(all(*b, 20 * ms).size(), 4U);
    EXPECT_EQ(b->statistics().lost, 8U);
    for (int i = 0; i < 6; ++i) {
        EXPECT_EQ(b->send({0x10, {1}}, 21 * ms), i < 4 ? Sent::queued : Sent::full);
    }
    EXPECT_EQ(b->statistics().dropped, 2U);
    const auto own = all(*b, 30 * ms);
    ASSERT_EQ(own.size(), 4U);
    EXPECT_TRUE(own[0].own);
}

TEST(Simbus, without_a_bit_rate_frames_arrive_in_the_call_that_sends_them) {
    const auto bus = fresh("?bitrate=unlimited");
    auto a = open_or_fail(bus);
    auto b = open_or_fail(bus);
    a->send({0x10, {1}}, ms);
    a->flush(ms);
    EXPECT_EQ(all(*b, ms).size(), 1U);
    b->send({0x11, {1}}, unclocked);
    b->flush(unclocked);
    EXPECT_EQ(all(*a, unclocked).size(), 1U);
}

TEST(Simbus, many_threads_lose_nothing) {
    for (const char* keys : {"?bitrate=unlimited", ""}) {
        const auto bus = fresh(keys);
        constexpr std::size_t threads = 4;
        constexpr std::size_t frames = 2000;
        std::vector<std::unique_ptr<Link>> nodes;
        Options roomy;
        roomy.receive_capacity = 16384;
        for (std::size_t i = 0; i < threads; ++i) {
            nodes.push_back(open_or_fail(bus, roomy));
        }
        std::atomic<std::size_t> finished{0};
        std::atomic<std::int64_t> clock{ms};
        std::vector<std::size_t> got(threads), disorder(threads);
        std::vector<std::thread> running;
        for (std::size_t t = 0; t < threads; ++t) {
            running.emplace_back([&, t] {
                Link& link = *nodes[t];
                std::int64_t now = 0;
                std::size_t sent = 0;
                bool complete = false;
                std::vector<std::uint32_t> next(threads);
                // One clock for all, as in the runtime; a finished thread keeps it going for the
                // others.
                while (finished < threads && now < 1'000'000 * ms) {
                    now = clock.fetch_add(50'000);
                    if (sent < frames) {
                        Frame f(static_cast<std::uint32_t>(0x100 + t), {0, 0});
                        f.data[0] = static_cast<std::uint8_t>(sent);

                        f.data[1] = static_cast<std::uint8_t>(sent >> 8);
                        if (link.send(f, now) == Sent::queued) {
                            ++sent;
                        }
                    }
                    link.flush(now);
                    for (Frame f; link.receive(f, now);) {
                        auto& wanted = next[f.id - 0x100];
                        if ((f.data[0] | f.data[1] << 8) != static_cast<int>(wanted)) {
                            ++disorder[t];
                        }
                        ++wanted;
                        ++got[t];
                    }
                    if (!complete && sent == frames && got[t] == (threads - 1) * frames) {
                        complete = true;
                        ++finished;
                    }
                    if (sent == frames) {
                        std::this_thread::yield();
                    }
                }
            });
        }
        for (auto& t : running) {
            t.join();
        }
        for (std::size_t t = 0; t < threads; ++t) {
            EXPECT_EQ(got[t], (threads - 1) * frames) << keys;
            EXPECT_EQ(disorder[t], 0U) << keys;
        }
    }
}

TEST(Open, reports_what_is_wrong_and_what_to_type) {
    EXPECT_EQ(open("can0").problem,
              "'can0' is not the address of a CAN bus; write can:can0 for an interface of this "
              "machine, sim:NAME for a bus in memory, udp:239.74.163.2:43113 for a bus in UDP "
              "datagrams, slcan:/dev/ttyACM0 for an adapter on a serial line, cane:enp3s0 for CAN "
              "in Ethernet frames, scocan:NODE for the slots of a node or replay:FILE for a "
              "recorded bus");
    EXPECT_EQ(open("sim:").problem, "sim:: missing name of the bus; write sim:bus0");
    EXPECT_EQ(open("sim:x?bitrate=fast").problem,
              "sim:x?bitrate=fast: invalid bitrate 'fast'; write bits per second, as in 500000, "
              "500k or 1M");
    EXPECT_EQ(
        open("sim:x?rate=1").problem,
        "sim:x?rate=1: unknown option 'rate'; options are"
        " bitrate, datarate, fd, listen, own, errors, stamps, restart, sendqueue, receivequeue");
    EXPECT_EQ(open("slcan:/dev/null?bitrate=300k").problem,
              "slcan:/dev/null?bitrate=300k: unsupported bit rate 300000 of a serial-line adapter; "
              "use 10k, 20k, 50k, 100k, 125k, 250k, 500k, "
              "800k or 1M");
    EXPECT_EQ(open("slcan:/dev/null?datarate=3M").problem,
              "slcan:/dev/null?datarate=3M: unsupported data rate 3000000 of a serial-line "
              "adapter; use 2M or 5M");
    EXPECT_EQ(open("slcan:/dev/null?own").problem,
              "slcan:/dev/null?own: slcan does not support the option 'own'; remove it");
    EXPECT_EQ(open("replay:none.log?own=1&fd").problem,
              "replay:none.log?own=1&fd: replay does not support the option 'own'; remove it");
    EXPECT_EQ(open("udp:?restart=5").problem,
              "udp:?restart=5: udp does not support the option 'restart'; remove it");
    auto one = open("sim:rates?bitrate=250k");
    ASSERT_TRUE(one);
    EXPECT_EQ(one.link->description().bit_rate, 250'000U);
    EXPECT_EQ(open("sim:rates?bitrate=500k").problem,
              "sim:rates?bitrate=500k: the bus already runs at 250000 bit/s; "
              "use the same bitrate everywhere, or give it in one place only");
    EXPECT_FALSE(open("can:no_such_interface_name"));
    EXPECT_FALSE(open("can:lo"));
}

}  // namespace
}  // namespace hal::can
