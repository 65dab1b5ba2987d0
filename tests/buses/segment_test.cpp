// SPDX-License-Identifier: MIT
// The Ethernet segment in memory: times, stations, queues, disturbances.
#include "segment_world.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

namespace hal::ethernet {
namespace {

using namespace segment_world;

TEST(Segment, a_frame_takes_its_time_on_two_lines_and_in_the_switch) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    EXPECT_EQ(a->send(frame_to(broadcast, *a, 0x88b5, {7}), {}, ms), Sent::queued);
    EXPECT_TRUE(all(*b, ms + one_way_ns - 1).empty());
    const auto got = all(*b, ms + one_way_ns);
    ASSERT_EQ(got.size(), 1U);
    EXPECT_EQ(got[0].time_ns, ms + one_way_ns);
    EXPECT_EQ(got[0].bytes.size(), smallest_frame);  // padded
    EXPECT_EQ(got[0].bytes[14], 7);
    EXPECT_EQ(got[0].bytes[59], 0);
    EXPECT_TRUE(all(*a, 2 * ms).empty());  // not to its sender
    EXPECT_EQ(a->statistics().sent, 1U);
    EXPECT_EQ(b->statistics().received_bytes, 60U);
    EXPECT_EQ(to_string(a->address()), "02:48:41:4c:00:01");
}

TEST(Segment, a_slower_switch_keeps_a_frame_longer) {
    const auto net = fresh();
    auto a = open_or_fail(net + "?forward=12.5us");
    auto b = open_or_fail(net);
    a->send(frame_to(broadcast, *a, 0x88b5, {7}), {}, ms);
    const auto got = all(*b, 2 * ms);
    ASSERT_EQ(got.size(), 1U);
    EXPECT_EQ(got[0].time_ns, ms + 2 * minimum_ns + 12'500);
    EXPECT_EQ(open(net + "?forward=2us").problem,
              net +
                  "?forward=2us: the switch already has a delay of 12500 ns; use the "
                  "same forward everywhere, or give it in the first place only");
    EXPECT_TRUE(open(net + "?forward=12500ns"));
}

TEST(Segment, a_long_frame_takes_longer_and_a_faster_line_less) {
    auto net = fresh();
    auto a = open_or_fail(net + "?speed=1000");
    auto b = open_or_fail(net);
    a->send(frame_to(broadcast, *a, 0x88b5, Bytes(1500)), {}, ms);
    const auto got = all(*b, 2 * ms);
    ASSERT_EQ(got.size(), 1U);
    EXPECT_EQ(got[0].time_ns, ms + 2 * 1538 * 8 + 2 * us);
    EXPECT_EQ(b->statistics().speed, 1000U);
    EXPECT_EQ(open(net + "?speed=100").problem,
              net +
                  "?speed=100: the segment already runs at 1000 Mbit/s; use the same speed "
                  "everywhere, or give it in one place "
                  "only");
}

TEST(Segment, the_switch_sends_a_frame_to_whom_it_is_for_and_an_unknown_one_to_nobody) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    auto c = open_or_fail(net);

    auto ear = open_or_fail(net + "?promiscuous");
    a->send(frame_to(b->address(), *a, 0x88b5, {1}), {}, ms);
    a->send(frame_to({2, 9, 9, 9, 9, 9}, *a, 0x88b5, {2}), {}, ms);
    a->send(frame_to({1, 0, 0x5e, 0, 0, 1}, *a, 0x88b5, {3}), {}, ms);
    EXPECT_EQ(firsts(all(*b, 2 * ms)), "13");
    EXPECT_EQ(firsts(all(*c, 2 * ms)), "3");
    EXPECT_EQ(firsts(all(*ear, 2 * ms)), "123");
}

TEST(Segment, types_choose_what_a_port_receives) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net, {.types = {0x9021, 0x9022}});
    for (std::uint8_t i = 0; i < 4; ++i) {
        a->send(frame_to(broadcast, *a, static_cast<std::uint16_t>(0x9020 + i), {i}), {}, ms);
    }
    EXPECT_EQ(firsts(all(*b, 2 * ms)), "12");
}

TEST(Segment, users_of_one_station_share_its_line_and_its_address) {
    const auto net = fresh();
    auto bus = open_or_fail(net + "/master", {.types = {0x9021}});

    auto can = open_or_fail(net + "/master", {.types = {0x9023}});
    auto b = open_or_fail(net + "/slave");
    EXPECT_EQ(bus->address(), can->address());
    EXPECT_EQ(bus->segment()->port(), can->segment()->port());
    EXPECT_NE(b->segment()->port(), can->segment()->port());
    bus->send(frame_to(broadcast, *bus, 0x9021, {1}), {}, ms);
    can->send(frame_to(broadcast, *can, 0x9023, {2}), {}, ms);
    const auto got = all(*b, 2 * ms);
    ASSERT_EQ(firsts(got), "12");
    EXPECT_EQ(got[1].time_ns - got[0].time_ns, minimum_ns);  // one after the other
    EXPECT_TRUE(all(*can, 2 * ms).empty());
    b->send(frame_to(can->address(), *b, 0x9023, {3}), {}, 2 * ms);
    EXPECT_TRUE(all(*bus, 3 * ms).empty());
    EXPECT_EQ(firsts(all(*can, 3 * ms)), "3");
    const auto problem = open(net + "/slave?mac=02:00:00:00:00:07").problem;
    EXPECT_NE(problem.find("station slave already has the address 02:48:41:4c:00:02"),
              problem.npos);
}

TEST(Segment, a_frame_leaves_at_its_time_and_is_stamped_then) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    Bytes first = frame_to(broadcast, *a, 0x9021, Bytes(20));
    Bytes second = first;
    first[14] = 1;
    second[14] = 2;
    EXPECT_EQ(a->send(first, {.at_ns = 3 * ms, .stamp_at = 22, .stamp_add_ns = 5}, ms),
              Sent::queued);
    EXPECT_EQ(a->send(second, {.at_ns = 2 * ms}, ms), Sent::queued);
    const auto got = all(*b, 4 * ms);
    ASSERT_EQ(firsts(got), "21");  // in order of their times
    EXPECT_EQ(got[0].time_ns, 2 * ms + one_way_ns);
    EXPECT_EQ(got[1].time_ns, 3 * ms + one_way_ns);
    std::int64_t stamp = 0;
    for (int i = 22; i < 30; ++i) {
        stamp = stamp << 8 | got[1].bytes[static_cast<std::size_t>(i)];
    }
    EXPECT_EQ(stamp, 3 * ms + 5);
    EXPECT_EQ(a->statistics().launch_error_ns, 0);
}

TEST(Segment, a_frame_later_than_its_guard_is_dropped_and_counted) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    const auto f = frame_to(broadcast, *a, 0x9021, {1});
    EXPECT_EQ(a->send(f, {.at_ns = ms, .guard_ns = 10 * us}, ms + 11 * us), Sent::late);
    EXPECT_EQ(a->send(f, {.at_ns = ms, .guard_ns = 20 * us}, ms + 11 * us), Sent::queued);
    EXPECT_EQ(a->send(f, {.at_ns = 2 * ms}, ms + 11 * us), Sent::queued);
    // the line is busy with the one before
    EXPECT_EQ(a->send(f, {.at_ns = 2 * ms, .guard_ns = us}, ms + 11 * us), Sent::queued);
    EXPECT_EQ(all(*b, 3 * ms).size(), 2U);
    EXPECT_EQ(a->statistics().late, 2U);
    EXPECT_EQ(a->statistics().dropped, 0U);
    EXPECT_EQ(a->statistics().launch_error_ns, 0);
}

TEST(Segment, what_is_no_frame_is_refused) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    EXPECT_EQ(a->send(Bytes(13), {}, ms), Sent::rejected);
    EXPECT_EQ(a->send(Bytes(1515), {}, ms), Sent::rejected);
    EXPECT_EQ(a->send(Bytes(29), {.stamp_at = 22}, ms), Sent::rejected);
    EXPECT_EQ(a->send(Bytes(14), {}, ms), Sent::queued);
    EXPECT_EQ(a->send(Bytes(1514), {}, ms), Sent::queued);
    EXPECT_EQ(a->send(Bytes(30), {.stamp_at = 22}, ms), Sent::queued);
    EXPECT_EQ(a->statistics().dropped, 3U);
    EXPECT_EQ(a->statistics().errors, 3U);
}

TEST(Segment, a_full_queue_drops_and_counts_at_both_ends) {
    const auto net = fresh();
    auto a = open_or_fail(net + "?sendqueue=8");
    auto b = open_or_fail(net + "?receivequeue=4");
    const auto f = frame_to(broadcast, *a, 0x9021, {1});
    for (int i = 0; i < 8; ++i) {
        EXPECT_EQ(a->send(f, {}, ms), Sent::queued);
    }
    EXPECT_EQ(a->send(f, {}, ms), Sent::full);
    EXPECT_EQ(all(*b, 9 * ms).size(), 4U);
    EXPECT_EQ(b->statistics().lost, 4U);
    EXPECT_EQ(a->statistics().dropped, 1U);
    EXPECT_EQ(a->send(f, {}, 9 * ms), Sent::queued);
    EXPECT_EQ(all(*b, 10 * ms).size(), 1U);
}

TEST(Segment, two_senders_meet_on_the_line_of_their_receiver) {
    const auto net = fresh();
    auto c = open_or_fail(net);
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    b->send(frame_to(c->address(), *b, 0x9021, {2}), {}, ms);
    a->send(frame_to(c->address(), *a, 0x9021, {1}), {}, ms);
    const auto got = all(*c, 2 * ms);
    ASSERT_EQ(firsts(got), "12");  // of one instant: in order of the stations, not of the calls
    EXPECT_EQ(got[0].time_ns, ms + one_way_ns);
    EXPECT_EQ(got[1].time_ns, ms + one_way_ns + minimum_ns);
}

TEST(Segment, every_nth_frame_is_lost_doubled_delayed_cut_or_garbled) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    auto c = open_or_fail(net);
    auto& segment = *a->segment();
    std::int64_t now = 0;
    const auto run = [&](const Disturbance& d) {
        segment.calm();
        EXPECT_EQ(segment.disturb(d), 0);
        for (int i = 0; i < 100; ++i) {
            a->send(frame_to(broadcast, *a, 0x9021, {static_cast<std::uint8_t>(i), 0x55}), {},
                    now += ms);
            all(*c, now);
        }
        now += 20 * ms;
        all(*c, now);
        return all(*b, now);
    };
    EXPECT_EQ(run({.fault = Fault::loss, .every = 4}).size(), 75U);
    EXPECT_EQ(segment.hits(0), 25U);
    EXPECT_EQ(run({.fault = Fault::loss, .every = 4, .to = 2}).size(), 100U);
    EXPECT_EQ(run({.fault = Fault::loss, .every = 4, .to = 1}).size(), 75U);
    EXPECT_EQ(run({.fault = Fault::loss, .every = 4, .from = 1}).size(), 100U);
    EXPECT_EQ(run({.fault = Fault::loss, .every = 4, .type = 0x9022}).size(), 100U);
    EXPECT_EQ(run({.fault = Fault::loss, .every = 1, .count = 7}).size(), 93U);
    EXPECT_EQ(run({.fault = Fault::duplicate, .every = 10}).size(), 110U);
    EXPECT_EQ(run({.fault = Fault::duplicate, .every = 10, .to = 1}).size(), 110U);
    for (const int to : {-1, 1}) {
        const auto delayed =
            run({.fault = Fault::delay, .every = 50, .to = to, .delay_ns = ms + ms / 2});
        ASSERT_EQ(delayed.size(), 100U);
        EXPECT_EQ(delayed[49].first(), 50);  // overtaken
        EXPECT_EQ(delayed[50].first(), 49);
        EXPECT_EQ(delayed[50].time_ns - delayed[48].time_ns, 2 * ms + ms / 2);
    }
    const auto cut = run({.fault = Fault::cut, .every = 2, .length = 20});
    EXPECT_EQ(cut[0].bytes.size(), 60U);
    EXPECT_EQ(cut[1].bytes.size(), 20U);
    EXPECT_EQ(run({.fault = Fault::cut, .every = 2, .length = 13}).size(), 50U);
    EXPECT_EQ(b->statistics().errors, 50U);
    int wrong = 0;
    for (const auto& g : run({.fault = Fault::garble, .every = 2})) {
        auto wanted = frame_to(broadcast, *a, 0x9021, {g.bytes[14], 0x55});
        wanted.resize(60);
        int different = 0;
        for (std::size_t i = 0; i < 60; ++i) {
            different += wanted[i] != g.bytes[i];
        }
        EXPECT_LE(different, 1);
        wrong += different;
    }
    EXPECT_GE(wrong, 40);  // those whose first payload byte was hit compare equal
    const auto drawn = run({.fault = Fault::loss, .probability = 0.5}).size();
    EXPECT_GT(drawn, 25U);
    EXPECT_LT(drawn, 75U);
    segment.calm();
    EXPECT_EQ(segment.hits(0), 0U);
}

TEST(Segment, a_cut_cable_isolates_its_station_and_heals) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    auto c = open_or_fail(net);
    const auto f = frame_to(broadcast, *a, 0x9021, {1});
    b->send(frame_to(broadcast, *b, 0x9021, {2}), {.at_ns = 3 * ms}, ms);
    a->segment()->cut(b->segment()->port(), true);
    EXPECT_FALSE(b->statistics().up);
    EXPECT_EQ(b->send(f, {}, 2 * ms), Sent::down);
    a->send(f, {}, 2 * ms);
    EXPECT_EQ(firsts(all(*c, 4 * ms)), "1");
    EXPECT_TRUE(all(*b, 4 * ms).empty());
    EXPECT_EQ(b->statistics().dropped, 2U);  // the rejected frame, and the one whose time came
    EXPECT_EQ(b->statistics().downs, 1U);
    a->segment()->cut(b->segment()->port(), false);
    a->send(f, {}, 5 * ms);
    EXPECT_EQ(all(*b, 6 * ms).size(), 1U);
    EXPECT_TRUE(b->statistics().up);
}

TEST(Segment, a_babbling_station_fills_the_lines_of_the_others_but_not_the_memory) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    auto c = open_or_fail(net);
    all(*c, ms);
    a->segment()->babble(a->segment()->port(), frame_to(broadcast, *a, 0x1234, {9}), 1);
    std::size_t babbled = 0;
    std::size_t others = 0;
    std::int64_t slowest = 0;
    for (int i = 2; i < 100; ++i) {
        b->send(frame_to(c->address(), *b, 0x9021, {1}), {}, i * ms);
        for (const auto& g : all(*c, (i + 1) * ms)) {
            ++(g.first() == 9 ? babbled : others);
            if (g.first() == 1) {
                slowest = std::max(slowest, g.time_ns - i * ms);
            }
        }
    }
    EXPECT_NEAR(static_cast<double>(babbled), 98.0 * ms / minimum_ns, 200.0);
    EXPECT_GT(others, 80U);
    EXPECT_GT(slowest, one_way_ns);
    a->segment()->calm();
    all(*c, 110 * ms);
    b->send(frame_to(c->address(), *b, 0x9021, {1}), {}, 120 * ms);
    EXPECT_EQ(firsts(all(*c, 121 * ms)), "1");
}

TEST(Segment, stamps_scatter_when_asked_to_and_nothing_else_does) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net + "?noise=1us");
    auto c = open_or_fail(net);
    double sum = 0;
    double squares = 0;
    for (int i = 1; i <= 1000; ++i) {
        a->send(frame_to(broadcast, *a, 0x9021, {1}), {}, i * ms);
        const auto got = all(*b, i * ms + ms / 2);
        const auto exact = all(*c, i * ms + ms / 2);
        ASSERT_EQ(got.size(), 1U);
        ASSERT_EQ(exact.at(0).time_ns, i * ms + one_way_ns);
        const auto error = static_cast<double>(got[0].time_ns - i * ms - one_way_ns);
        sum += error;
        squares += error * error;
    }
    EXPECT_NEAR(sum / 1000, 0.0, 150.0);
    EXPECT_NEAR(squares / 1000, 1e6, 2e5);
}

TEST(Segment, the_order_of_the_calls_of_one_instant_changes_nothing) {
    const auto run = [](bool turned) {
        const auto net = fresh();
        std::vector<std::unique_ptr<Port>> ports;
        for (int i = 0; i < 4; ++i) {
            ports.push_back(open_or_fail(net, {.noise_ns = i == 3 ? 500 : 0}));
        }
        ports[0]->segment()->disturb({.fault = Fault::loss, .probability = 0.2});
        ports[0]->segment()->disturb(
            {.fault = Fault::delay, .probability = 0.2, .to = 2, .delay_ns = 40 * us});
        std::string text;
        for (int cycle = 1; cycle < 200; ++cycle) {
            const auto now = cycle * 100 * us;
            std::string of[4];
            for (int k = 0; k < 4; ++k) {
                const int n = turned ? 3 - k : k;
                auto& port = *ports[static_cast<std::size_t>(n)];
                for (const auto& g : all(port, now)) {
                    of[n] += std::to_string(g.first()) + "@" + std::to_string(g.time_ns) + " ";
                }
                port.send(frame_to(broadcast, port, 0x9021, {static_cast<std::uint8_t>(n)}),
                          {.at_ns = now + (cycle % 3) * 20 * us}, now);
            }
            for (const auto& t : of) {
                text += t + "\n";
            }
        }
        return text;
    };
    const auto straight = run(false);
    EXPECT_GT(straight.size(), 10'000U);
    EXPECT_EQ(straight, run(true));
}

TEST(Segment, a_port_that_is_closed_sends_what_is_due_and_nothing_after) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    all(*b, ms);
    a->send(frame_to(broadcast, *a, 0x9021, {1}), {}, ms);
    a->send(frame_to(broadcast, *a, 0x9021, {2}), {.at_ns = 5 * ms}, ms);
    a.reset();
    EXPECT_EQ(firsts(all(*b, 9 * ms)), "1");
    auto c = open_or_fail(net);  // takes its number
    EXPECT_EQ(to_string(c->address()), "02:48:41:4c:00:01");
    c->send(frame_to(broadcast, *c, 0x9021, {3}), {}, 10 * ms);
    EXPECT_EQ(firsts(all(*b, 11 * ms)), "3");
}

TEST(Segment, serves_threads_of_one_process) {
    const auto net = fresh();
    constexpr int count = 20'000;
    auto a = open_or_fail(net + "?speed=100000", {.send_capacity = 1024});

    auto b = open_or_fail(net, {.receive_capacity = 16384});
    std::atomic<std::int64_t> now{ms};
    std::thread sender([&] {
        for (int i = 0; i < count; ++i) {
            Bytes f = frame_to(broadcast, *a, 0x9021,
                               {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8)});
            while (a->send(f, {}, now.load()) != Sent::queued) {
                now.fetch_add(us);
                std::this_thread::yield();
            }
            now.fetch_add(10);
        }
    });
    int next = 0;
    bool in_order = true;
    while (next < count) {
        now.fetch_add(100);
        while (const auto arrival = b->receive(now.load())) {
            in_order =
                in_order && (arrival->bytes[14] | arrival->bytes[15] << 8) == (next & 0xffff);
            ++next;
        }
    }
    sender.join();
    EXPECT_TRUE(in_order);
    EXPECT_EQ(b->statistics().lost, 0U);
}

}  // namespace
}  // namespace hal::ethernet
