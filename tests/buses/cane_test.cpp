// SPDX-License-Identifier: MIT
// CAN in Ethernet frames: which station has which node, what is lost, and links on a segment in
// memory.
#include <gtest/gtest.h>

#include "can/cane/cane_format.hpp"
#include "can/cane/cane_stations.hpp"
#include "cane_bench.hpp"
#include "discipline/discipline.hpp"

namespace hal::can::cane::test {
namespace {

TEST(CaneNodes, where_a_node_lives_is_learnt_from_what_it_sends) {
    Nodes nodes;
    EXPECT_FALSE(nodes.where(0x205, false));
    EXPECT_TRUE(nodes.learn(0x705, b, 0));
    EXPECT_EQ(nodes.where(0x205, false), b);
    EXPECT_EQ(nodes.where(0x605, false), b);
    EXPECT_FALSE(nodes.where(0x080, false));
    EXPECT_FALSE(nodes.where(0x000, false));
    EXPECT_FALSE(nodes.where(0x7e5, false));
    EXPECT_FALSE(nodes.where(0x585, false));  // nobody asked yet
    nodes.learn(0x605, a, 0);
    EXPECT_EQ(nodes.where(0x585, false), a);
    EXPECT_FALSE(nodes.where(0x185, true));
    nodes.learn(0x000, c, 0);
    EXPECT_EQ(nodes.where(0x185, true), c);
    EXPECT_FALSE(nodes.where(0x185, false));
}

TEST(CaneNodes, one_heard_from_two_stations_is_reached_by_all_until_one_is_silent) {
    Nodes nodes;
    nodes.learn(0x705, b, 0);
    EXPECT_FALSE(nodes.learn(0x705, c, 1000));
    EXPECT_FALSE(nodes.where(0x205, false));
    EXPECT_FALSE(nodes.learn(0x705, b, 2000));
    EXPECT_TRUE(nodes.learn(0x705, b, 1000 + Nodes::moved_after_ns));
    EXPECT_EQ(nodes.where(0x205, false), b);
    EXPECT_TRUE(nodes.learn(0x705, c, 2000 + 2 * Nodes::moved_after_ns));  // it was replaced
    EXPECT_EQ(nodes.where(0x205, false), c);
}

TEST(CaneNodes, a_fixed_one_stays) {
    Nodes nodes;
    nodes.fix(5, b);
    EXPECT_FALSE(nodes.learn(0x705, c, 0));
    EXPECT_EQ(nodes.where(0x205, false), b);
}

TEST(CaneStreams, copies_and_overtaken_frames_are_old_and_gaps_are_counted) {
    Streams s;
    EXPECT_TRUE(s.take(a, true, {1, 10}, 0).fresh);
    EXPECT_FALSE(s.take(a, true, {1, 10}, 0).fresh);
    EXPECT_TRUE(s.take(a, false, {1, 3}, 0).fresh);  // to one and to all are counted apart
    const auto later = s.take(a, true, {1, 14}, 0);
    EXPECT_TRUE(later.fresh);
    EXPECT_EQ(later.lost, 3U);
    EXPECT_FALSE(s.take(a, true, {1, 12}, 0).fresh);
    EXPECT_TRUE(s.take(a, true, {2, 0}, 0).fresh);       // it was started again
    EXPECT_TRUE(s.take(a, true, {1, 0xffff}, 0).fresh == false);
    EXPECT_TRUE(s.take(b, true, {7, 0xffff}, 0).fresh);
    EXPECT_TRUE(s.take(b, true, {7, 0}, 0).fresh);       // wraps
}

TEST(CaneStreams, find_back_when_it_is_the_memory_that_is_wrong) {
    Streams s;
    s.take(a, true, {1, 30000}, 0);
    int refused = 0;
    for (std::uint16_t n = 0; n < 20; ++n) {
        refused += s.take(a, true, {1, n}, 0).fresh ? 0 : 1;
    }
    EXPECT_EQ(refused, 8);
}

TEST(CaneLink, carries_many_messages_in_one_frame_to_all_others) {
    auto x = opened("cane:sim:many");
    auto y = opened("cane:sim:many");
    auto z = opened("cane:sim:many");
    auto listener = ethernet::open("sim:many");
    ASSERT_TRUE(listener);
    for (std::uint8_t n = 1; n <= 6; ++n) {
        ASSERT_EQ(x->send(message(0x200U + n, {n}), 0), Sent::queued);
    }
    x->send(message(0x080, {}), 0);
    x->flush(0);
    for (auto* link : {y.get(), z.get()}) {
        const auto got = all_of(*link, 1'000'000);
        ASSERT_EQ(got.size(), 7U);
        EXPECT_TRUE(got[0].same(message(0x201, {1})));
        EXPECT_TRUE(got[6].same(message(0x080, {})));
        EXPECT_EQ(got[0].time_ns, got[6].time_ns);
        EXPECT_GT(got[0].time_ns, 0);
    }
    EXPECT_TRUE(all_of(*x, 1'000'000).empty());
    EXPECT_TRUE(listener.port->receive(1'000'000));
    EXPECT_FALSE(listener.port->receive(1'000'000)) << "one frame was enough";
    EXPECT_EQ(x->statistics().sent, 7U);
    EXPECT_EQ(y->statistics().received, 7U);
}

TEST(CaneLink, process_data_goes_before_the_rest) {
    auto x = opened("cane:sim:order");
    auto y = opened("cane:sim:order");
    x->send(message(0x605, {0x40}), 0);
    x->send(message(0x080, {}), 0);
    x->flush(0);
    const auto got = all_of(*y, 1'000'000);
    ASSERT_EQ(got.size(), 2U);
    EXPECT_EQ(got[0].id, 0x080U);
}

TEST(CaneLink, a_message_for_one_node_goes_to_its_station_alone) {
    auto master = opened("cane:sim:one");
    auto five = opened("cane:sim:one");

    auto six = opened("cane:sim:one");
    five->send(message(0x705, {0}), 0);
    five->flush(0);
    ASSERT_EQ(all_of(*master, 1'000'000).size(), 1U);
    all_of(*six, 1'000'000);
    master->send(message(0x605, {0x40}), 1'000'000);
    master->flush(1'000'000);
    EXPECT_EQ(all_of(*five, 2'000'000).size(), 1U);
    EXPECT_TRUE(all_of(*six, 2'000'000).empty());
    five->send(message(0x585, {0x43}), 2'000'000);
    five->flush(2'000'000);
    EXPECT_EQ(all_of(*master, 3'000'000).size(), 1U);
    EXPECT_TRUE(all_of(*six, 3'000'000).empty());
}

TEST(CaneLink, single_frames_carry_one_message_each_in_the_order_asked_for) {
    auto x = opened("cane:sim:single?format=single&order=little");

    auto y = opened("cane:sim:single?format=single&order=little");
    auto other = opened("cane:sim:single?format=single");
    auto listener = ethernet::open("sim:single");
    x->send(message(0x181, {1, 2}), 0);
    x->send(message(0x281, {3}), 0);
    x->flush(0);
    EXPECT_EQ(all_of(*y, 1'000'000).size(), 2U);
    for (const auto& f : all_of(*other, 1'000'000)) {
        EXPECT_TRUE(f.extended) << "read the other way round it is another message";
    }
    const auto first = listener.port->receive(1'000'000);
    ASSERT_TRUE(first);
    EXPECT_EQ(first->bytes.size(), 60U);
    EXPECT_EQ(Bytes(first->bytes.begin() + 14, first->bytes.begin() + 21),
              (Bytes{0x81, 1, 0, 0, 2, 1, 2}));
    EXPECT_TRUE(listener.port->receive(1'000'000));
}

TEST(CaneLink, lost_doubled_and_garbled_frames_are_counted_and_never_passed_on) {
    auto x = opened("cane:sim:faulty");
    auto y = opened("cane:sim:faulty");
    auto listener = ethernet::open("sim:faulty");
    auto& segment = *listener.port->segment();
    std::uint64_t now = 0;
    const auto send = [&](std::uint8_t n) {
        x->send(message(0x181, {n}), static_cast<std::int64_t>(now));
        x->flush(static_cast<std::int64_t>(now));
        now += 1'000'000;
        return all_of(*y, static_cast<std::int64_t>(now)).size();
    };
    ASSERT_EQ(send(0), 1U);
    segment.disturb({.fault = ethernet::Fault::duplicate, .every = 1});
    EXPECT_EQ(send(1), 1U);
    EXPECT_EQ(y->statistics().errors, 1U);
    segment.calm();
    segment.disturb({.fault = ethernet::Fault::garble, .every = 1});
    for (std::uint8_t n = 0; n < 50; ++n) {
        x->send(message(0x181, {n}), static_cast<std::int64_t>(now));
        x->flush(static_cast<std::int64_t>(now));
        now += 1'000'000;
        for (const auto& f : all_of(*y, static_cast<std::int64_t>(now))) {
            EXPECT_TRUE(f.same(message(0x181, {n}))) << "only its padding was hit";
        }
    }
    segment.calm();
    segment.disturb({.fault = ethernet::Fault::loss, .every = 2});
    std::size_t came = 0;
    for (std::uint8_t n = 0; n < 10; ++n) {
        came += send(n);
    }
    EXPECT_EQ(came, 5U);
    segment.calm();
    EXPECT_EQ(send(9), 1U);
    EXPECT_GE(y->statistics().lost, 5U);
}

TEST(CaneLink, is_down_without_a_cable_and_comes_back) {
    auto x = opened("cane:sim:cable/x");
    auto y = opened("cane:sim:cable");
    auto port = ethernet::open("sim:cable/x");
    auto& segment = *port.port->segment();
    Frame f;
    x->receive(f, 1000);
    EXPECT_EQ(x->state(), State::active);
    segment.cut(segment.port(), true);
    x->receive(f, 2000);
    EXPECT_EQ(x->state(), State::down);
    x->send(message(0x181, {1}), 2000);
    x->flush(2000);
    EXPECT_EQ(x->statistics().dropped, 1U);
    segment.cut(segment.port(), false);
    x->receive(f, 3000);
    EXPECT_EQ(x->state(), State::active);
    EXPECT_EQ(x->statistics().restarts, 1U);
}

/// A TDMA with one slot.
struct Slots final : ethernet::Discipline {
    std::vector<std::pair<Bytes, unsigned>> queue;
    std::size_t max = 2;
    std::uint64_t dropped = 0;
    bool is_ready = true;
    ethernet::Sent send(std::span<const std::uint8_t> frame, unsigned, unsigned priority,
                        ethernet::Finisher* finisher) noexcept override {
        if (!is_ready) {
            ++dropped;
            return ethernet::Sent::down;
        }
        if (queue.size() == max) return ethernet::Sent::full;
        queue.emplace_back(Bytes(frame.begin(), frame.end()), priority);
        if (finisher != nullptr) {
            finisher->leaves(queue.back().first);
        }
        return ethernet::Sent::queued;
    }
    void count_dropped() noexcept override { ++dropped; }
    std::size_t capacity(unsigned slot) const noexcept override { return slot == 2 ? size : 0; }
    std::size_t size = 60;
    bool ready() const noexcept override { return is_ready; }
    const Address& address() const noexcept override { return b; }
};

TEST(CaneLink, in_a_slot_keeps_what_does_not_fit_for_the_next_cycle) {
    Slots slots;
    const auto line = ethernet::open("sim:slots/x");
    ASSERT_TRUE(
        ethernet::offer_discipline(*line.port, &slots, {{2, {{.station = "y", .there_ns = 7}}}}));
    EXPECT_NE(can::open("cane:sim:slots/x?slot=3").problem, "");
    auto x = opened("cane:sim:slots/x?slot=2");
    ASSERT_EQ(x->delivery_times().size(), 1U);
    EXPECT_EQ(x->delivery_times().front().there_ns, 7);
    for (std::uint8_t n = 1; n <= 20; ++n) {
        x->send(message(0x200U + n, {n, 0, 0, 0, 0, 0, 0, 0}), 0);
    }
    x->send(message(0x605, {0x40}), 0);
    x->flush(0);
    ASSERT_EQ(slots.queue.size(), 2U);
    Unpacker u;
    ASSERT_EQ(u.open(slots.queue[0].first), Wrong::none);
    EXPECT_EQ(u.messages(), 5U);  // of ten bytes each in 60 without a header of ten
    EXPECT_EQ(u.stamp().sequence, 0);
    EXPECT_EQ(x->statistics().queued, 11U);
    slots.queue.clear();
    slots.max = 10;
    x->flush(1'000'000);
    ASSERT_EQ(slots.queue.size(), 3U);
    ASSERT_EQ(u.open(slots.queue[0].first), Wrong::none);
    EXPECT_EQ(u.stamp().sequence, 2);
    // ten of process data fill two frames, the request is alone
    EXPECT_EQ(slots.queue.back().second, 9U);
    const auto session = u.stamp().session;
    ASSERT_EQ(u.open(slots.queue.back().first), Wrong::none);
    EXPECT_EQ(u.stamp().session, session ^ 0x8000);
    EXPECT_EQ(u.stamp().sequence, 0)
        << "frames of services alone may be overtaken, and have numbers of their own";
    slots.is_ready = false;
    Frame f;
    x->receive(f, 2'000'000);
    EXPECT_EQ(x->state(), State::down);

    slots.is_ready = true;
    x->receive(f, 3'000'000);
    EXPECT_EQ(x->state(), State::active);
    ethernet::withdraw_discipline(&slots);  // unloaded while the link is in use
    x->receive(f, 4'000'000);
    EXPECT_EQ(x->state(), State::down);
    EXPECT_TRUE(x->delivery_times().empty());
    ASSERT_TRUE(ethernet::offer_discipline(*line.port, &slots));
    x->receive(f, 5'000'000);
    EXPECT_EQ(x->state(), State::active);
    ethernet::withdraw_discipline(&slots);
}

TEST(CaneLink, in_a_slot_has_the_station_count_what_it_drops) {
    for (const char* format : {"packed", "single"}) {
        Slots slots;
        const auto line = ethernet::open("sim:slots/lost");
        ASSERT_TRUE(ethernet::offer_discipline(*line.port, &slots));
        auto x = opened("cane:sim:slots/lost?slot=2&format=" + std::string(format));
        const auto send = [&](std::int64_t now) {
            EXPECT_EQ(x->send(message(0x201, {1}), now), Sent::queued);
            x->flush(now);
        };
        slots.is_ready = false;
        send(1'000'000);
        EXPECT_EQ(slots.dropped, 1U) << "no sync";
        slots.is_ready = true;
        slots.size = 4;
        send(2'000'000);
        EXPECT_EQ(slots.dropped, 2U) << "longer than the slot";
        slots.size = 60;
        auto& segment = *line.port->segment();
        segment.cut(segment.port(), true);
        Frame f;
        x->receive(f, 3'000'000);
        send(3'000'000);
        EXPECT_EQ(slots.dropped, 3U) << "no carrier";
        EXPECT_EQ(x->statistics().dropped, 3U);
        EXPECT_EQ(x->statistics().sent, 0U);
        EXPECT_TRUE(slots.queue.empty());
        ethernet::withdraw_discipline(&slots);
    }
}

TEST(CaneLink, that_missed_a_turn_sends_the_newest_in_the_next) {
    Slots slots;
    const auto line = ethernet::open("sim:slots/late");
    ASSERT_TRUE(ethernet::offer_discipline(*line.port, &slots));
    for (const char* format : {"packed", "single"}) {
        auto x = opened(std::string("cane:sim:slots/late?slot=2&format=") + format);
        slots.max = 0;  // the last cycle's frames wait in the slot
        for (std::uint8_t cycle = 1; cycle <= 5; ++cycle) {
            x->send(message(0x080, {}), 0);
            x->send(message(0x000, {1, cycle}), 0);  // each NMT command counts
            x->send(message(0x201, {cycle}), 0);
            x->send(message(0x605, {0x40, cycle}), 0);
            if (cycle == 4) {
                x->send(message(0x202, {cycle}), 0);
            }
            x->flush(0);
        }
        slots.max = 100;
        x->flush(0);
        Bytes sent;  // the cycle that each message is of; SYNC has none
        const auto note = [&sent](const Frame& f) {
            sent.push_back(f.id == 0x080 ? 0x80 : f.data[f.length - 1]);
        };
        for (auto& [whole, priority] : slots.queue) {
            Frame f;
            Unpacker packed_frame;
            if (packed_frame.open(whole) == Wrong::none) {
                while (packed_frame.next(f)) {
                    note(f);
                }
            } else if (get_single(std::span(whole).subspan(ethernet::header_bytes), Order::big,
                                  f) == Wrong::none) {
                note(f);
            }
        }
        EXPECT_EQ(sent, (Bytes{0x80, 1, 5, 2, 3, 4, 4, 5, 1, 2, 3, 4, 5})) << format;
        EXPECT_EQ(x->statistics().dropped, 8U) << "four SYNCs, four PDOs";
        slots.queue.clear();
    }
    ethernet::withdraw_discipline(&slots);
}

TEST(CaneDescribe, names_the_segment_without_opening_it) {
    EXPECT_EQ(can::describe("cane:enp3s0?slot=2&key=/nowhere").segment, "eth:enp3s0");
    EXPECT_EQ(can::describe("cane:enp3s0?slot=2").address, "cane:enp3s0?slot=2");
    EXPECT_TRUE(can::describe("cane:sim:bus0").in_memory);
    EXPECT_FALSE(can::describe("cane:sim:bus0").has_bit_rate);
    EXPECT_TRUE(can::describe("sim:bus0").has_bit_rate);
    EXPECT_EQ(can::describe("can:can0?bitrate=500k").interface, "can0");
    EXPECT_EQ(can::describe("replay:a.log").file, "a.log");
    EXPECT_TRUE(can::describe("slcan:/dev/ttyACM0").fd_on_request);
    EXPECT_TRUE(can::describe("tok:en").transport.empty());
}

TEST(CaneOpen, reports_what_is_wrong_and_what_to_type) {
    EXPECT_EQ(
        can::open("cane:").problem,
        "cane:: missing interface; write cane:enp3s0, or cane:sim:bus0 for a segment in memory");
    EXPECT_EQ(can::open("cane:sim:x?format=both").problem,
              "cane:sim:x?format=both: invalid format 'both'; write single or packed");
    EXPECT_EQ(
        can::open("cane:sim:x?slot=2").problem,
        "cane:sim:x?slot=2: no TDMA runs on sim:x; loadrt tdma for it first, or remove slot=");
    EXPECT_EQ(can::open("cane:sim:x?node5=1").problem,
              "cane:sim:x?node5=1: invalid node5 '1'; write the address of a station, as in "
              "02:00:00:00:00:05");
    EXPECT_EQ(can::open("cane:sim:x?node200=02:00:00:00:00:05").problem,
              "cane:sim:x?node200=02:00:00:00:00:05: invalid node 'node200'; write "
              "node5=02:00:00:00:00:05");
    EXPECT_EQ(can::open("cane:sim:x?fd").problem,
              "cane:sim:x?fd: 0x9023 frames cannot carry CAN FD; remove fd");
}

}  // namespace
}  // namespace hal::can::cane::test
