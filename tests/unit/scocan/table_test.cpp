// SPDX-License-Identifier: MIT
// Tables: reading, errors, the normalised form; plans.
#include <gtest/gtest.h>

#include "components/fieldbus/scocan/plan/plan.hpp"
#include "components/fieldbus/scocan/wire/wire.hpp"

namespace {

using namespace hal::scocan;

constexpr const char* head = "node clock A sync\nnode ir A\nnode motor A\nnode us B\n";
constexpr const char* run = "mode 0 run\n0 sync\n";

std::string errors(const std::string& text) {
    return hal::text::errors_text(read(text).messages, "t");
}

TEST(Table, has_the_defaults_of_the_source_system) {
    const ReadResult r = read(std::string(head) + run);
    ASSERT_TRUE(r.good()) << errors(std::string(head) + run);
    EXPECT_EQ(1'000'000U, r.table.bit_rate);
    EXPECT_EQ(10'000'000, r.table.cycle);
    EXPECT_EQ(500'000, r.table.slot());
    EXPECT_EQ(4'000, r.table.guard) << "3 bits + 0.3 us + 4 ppm of 10 cycles, in whole us";
    EXPECT_EQ(16'000, r.table.idle);
    EXPECT_EQ(10'000, r.table.enabled());
    EXPECT_EQ(500'000 - 135'000 - 20'000 - 4'000, r.table.last_start(8));
}

TEST(Table, has_the_crc_of_its_normalised_form) {
    const ReadResult a = read(std::string(head) + run +
                              "2 private motor 0x10A\nmessage position 0x10A fields a:s32,b:s32\n");
    const ReadResult b = read("# a comment\n" + std::string(head) +
                              "\n\nmode  0   run # another\n0 sync\n2 private motor 266\nmessage "
                              "position 0x10A fields a:s32,b:s32 node motor\n");
    ASSERT_TRUE(a.good() && b.good());
    EXPECT_EQ(normalised(a.table), normalised(b.table));
    EXPECT_EQ(a.table.crc, b.table.crc);
    EXPECT_NE(a.table.crc,
              read(std::string(head) + run +
                   "3 private motor 0x10A\nmessage position 0x10A fields a:s32,b:s32\n")
                  .table.crc);
    EXPECT_EQ(0x29b1, crc16("123456789"));
}

TEST(Table, that_cannot_work_is_rejected_with_the_calculation) {
    EXPECT_EQ(
        "t:8:1: error: slot 2 is too short for 0x10A: 8 bytes take 135 bits + 20 bits for an error "
        "at 250000 bit/s, with the guard of 13 "
        "us 633 us; the slot has 500 us; "
        "use fewer slots, a longer cycle, a higher bit rate or a shorter message",
        errors(std::string("bitrate 250k\n") + head + run + "2 private motor 0x10A\n"));
    EXPECT_EQ(
        "t:8:1: error: slot 2 is used twice in the same cycle: first in line 7; use another slot, "
        "or different cycles: every 2 offset 0, "
        "every 2 offset 1",
        errors(std::string(head) + run + "2 private motor 0x10A\n2 private ir 0x100\n"));
    EXPECT_EQ(
        "t:8:1: error: identifier 0x100 has two senders: motor in line 7, and ir; two nodes that "
        "send the same identifier destroy each "
        "other's frames; use another one",
        errors(std::string(head) + run + "2 private motor 0x100\n3 private ir 0x100\n"));
    EXPECT_EQ("t:1:6: error: no SYNC node; add a line: node clock A sync",
              errors("node ir A\nmode 0 run\n0 sync\n"));
    EXPECT_EQ("t:6:6: error: duplicate backup 1: node 'b' in line 5 is it; a bus has one",
              errors(std::string(head) + "node b A backup 1\nnode c A backup 1\n" + run));
    EXPECT_EQ(
        "t:5:6: error: the SYNC of backup 7 does not fit in slot 0: it ends 8 x (75 + 20 bits + "
        "guard) = 792 us behind its start, the slot "
        "has 500 us; use fewer "
        "backups or longer slots",
        errors(std::string(head) + "node b A backup 7\n" + run));
    EXPECT_EQ(
        "t:2:6: error: guard 1 us is too short: 3 bits + 0.3 us + 4 ppm of the 10 cycles that "
        "nodes coast = 3.7 us; delete the line guard, "
        "write a longer time, or fewer cycles in the line lost",
        errors(std::string("guard 1us\n") + head + run));
    EXPECT_EQ(
        "t:7:9: error: identifier 0x150 of 'a' is in the range of private slots (0x100..0x2FF) and "
        "has none; give it a slot: 3 private ir "
        "0x150, or use 0x300..0x77F",
        errors(std::string(head) + run + "message a 0x150 node ir\n"));
}

TEST(Guard, covers_the_time_that_nodes_coast) {
    EXPECT_EQ(
        "t:3:6: error: guard 4 us is too short: 3 bits + 0.3 us + 4 ppm of the 1000 cycles that "
        "nodes coast = 43.3 us; delete the line "
        "guard, write a longer time, or fewer cycles in the line lost",
        errors(std::string("lost 1000\nguard 4us\n") + head + run));
    EXPECT_EQ("", errors(std::string("lost 1000\nguard 44us\n") + head + run));
    EXPECT_EQ(44'000, read(std::string("lost 1000\n") + head + run).table.guard);
}

TEST(Message, that_contradicts_itself_or_the_pins_of_its_components_is_rejected) {
    const std::string table = std::string(head) + run + "2 private motor 0x10A\n";
    for (const char* name : {"send", "sent", "fresh", "received", "age", "interval", "invalid"}) {
        EXPECT_EQ("t:8:42: error: reserved field name '" + std::string(name) +
                      "'; messages have pins send, sent, fresh, received, age, interval and "
                      "invalid; choose another name",
                  errors(table + "message position 0x10A fields a:s16,b:s8," + name + ":s32\n"));
    }
    EXPECT_EQ("", errors(table + "message position 0x10A fields send-a:s16,data:s32\n"));
    EXPECT_EQ(
        "t:8:36: error: period and event are both given; delete one of them; event T is the "
        "shortest interval of an event",
        errors(table + "message m 0x011 node ir period 1ms event 2ms\n"));
    EXPECT_EQ(
        "t:8:35: error: period and event are both given; delete one of them; event T is the "
        "shortest interval of an event",
        errors(table + "message m 0x011 node ir event 1ms period 2ms\n"));
    EXPECT_EQ("t:8:33: error: duplicate key 'bytes'; first in line 8; delete one of them",
              errors(table + "message m 0x011 node ir bytes 1 bytes 2\n"));
}

TEST(Slot, may_be_shared_by_cycles) {
    const ReadResult r =
        read(std::string(head) + run +
             "2 private motor 0x10A every 2 offset 0\n2 private ir 0x100 every 4 offset 1\n");
    ASSERT_TRUE(r.good());
    EXPECT_EQ(2U, r.table.use(0, 2, 0)->node);
    EXPECT_EQ(1U, r.table.use(0, 2, 1)->node);
    EXPECT_EQ(nullptr, r.table.use(0, 2, 3)) << "shared";
}

TEST(Frames, are_read_as_they_were_written) {
    Sync s;
    ASSERT_TRUE(decode(encode(Sync{true, 63, 5, 2, true}), s));
    EXPECT_EQ(63, s.counter);
    EXPECT_EQ(5, s.mode);
    EXPECT_EQ(2, s.sender);
    EXPECT_TRUE(s.pending);
    ASSERT_TRUE(decode(hal::can::Frame(0, {}), s));
    EXPECT_FALSE(s.numbered);
    EXPECT_FALSE(decode(hal::can::Frame(0, {64, 0}), s));
    EXPECT_FALSE(decode(hal::can::Frame(0, {1}), s));
    Request r;
    ASSERT_TRUE(decode(encode(Request{5, Request::What::prepare, 3, 0xbeef, 17}), r));
    EXPECT_EQ(5U, r.sender);
    EXPECT_EQ(0xbeef, r.crc);
    EXPECT_EQ(17, r.at_counter);
    Answer a;
    ASSERT_TRUE(decode(encode(Answer{7, 3, Answer::Reason::unknown_mode, 0xbeef}), a));
    EXPECT_EQ(7U, a.node);
    EXPECT_EQ(Answer::Reason::unknown_mode, a.reason);
}

constexpr const char* yair = R"(
node clock A sync
node ir A
node motor A
node us B
node pc A bridge
mode 0 run
0 sync
1 private ir 0x100
6 private ir 0x101
11 private ir 0x102
16 private ir 0x103
2 private motor 0x10A
17 private pc 0x10B
message alarm 0x010 node motor bytes 1 event 50ms
message ir0 0x100
message position 0x10A period 10ms jitter 100us
message velocity 0x10B bytes 4 period 20ms
message mode 0x300 node pc bytes 1 period 100ms
message ultrasound 0x310 node us event 6.4ms
)";

TEST(Plan, of_the_robot) {
    const ReadResult r = read(yair);
    ASSERT_TRUE(r.good()) << errors(yair);
    const plan::Plan p = plan::plan_of(r.table, 0);
    ASSERT_EQ(6U, p.latencies.size());
    EXPECT_TRUE(p.fits);
    EXPECT_EQ(13U, p.shared_slots);
    const auto& alarm = p.latencies[0];
    // Queued just behind the begin of slot 19: that slot, three that are not shared, its frame, the
    // guard.
    EXPECT_EQ(500'000 + 1'500'000 + 65'000 + 4'000, alarm.worst);
    const auto& position = p.latencies[2];
    EXPECT_TRUE(position.priv);
    EXPECT_EQ(10'000'000 + 100'000 + 4'000 + 135'000, position.worst);
    EXPECT_LT(position.jitter, 5'000);
    EXPECT_GT(position.plain_jitter, 300'000);
}

}  // namespace
