// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <time.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "can/slcan/slcan_line.hpp"
#include "can/udp/datagram.hpp"
#include "link/can.hpp"
#include "link/capture.hpp"

namespace hal::can {
namespace {

std::vector<Frame> frames_of_every_kind() {
    std::mt19937 random(3);
    std::vector<Frame> all;
    for (int i = 0; i < 400; ++i) {
        Frame f;
        f.fd = i % 3 == 0;
        f.extended = i % 2 == 0;
        f.remote = !f.fd && i % 7 == 0;
        f.bit_rate_switch = f.fd && i % 4 == 0;
        f.error_state = f.fd && i % 5 == 0;
        f.id = static_cast<std::uint32_t>(random()) & (f.extended ? 0x1fffffffU : 0x7ffU);
        f.length = f.fd ? length_of_code(static_cast<unsigned>(random() % 16))
                        : static_cast<std::uint8_t>(random() % 9);
        f.time_ns = 1'700'000'000'000'000'000LL + i * 1'234'567LL;
        for (std::size_t k = 0; k < f.bytes().size(); ++k) {
            f.data[k] = static_cast<std::uint8_t>(random());
        }
        all.push_back(f);
    }
    return all;
}

std::vector<std::uint8_t> bytes(std::string_view hex) {
    std::vector<std::uint8_t> out;
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
        out.push_back(
            static_cast<std::uint8_t>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16)));
    }
    return out;
}

TEST(Datagram, is_the_published_example_byte_by_byte) {
    canudp::Datagram out;
    const auto size = canudp::encode({0x123, {0x11, 0x22, 0x33}}, 0, out);
    EXPECT_EQ(size, 157U);
    const std::string head = "\x8b\xa9timestamp\xcb";
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(out.data()), head.size()), head);
    const std::string tail =
        "\xa3"
        "dlc\x03\xa4"
        "data\xc4\x03\x11\x22\x33\xa5"
        "is_fd\xc2\xae"
        "bitrate_switch\xc2\xb5"
        "error_state_indicator\xc2";
    EXPECT_EQ(
        std::string(reinterpret_cast<const char*>(out.data()) + size - tail.size(), tail.size()),
        tail);
}

TEST(Datagram, every_frame_survives_the_way_there_and_back) {
    for (const auto& f : frames_of_every_kind()) {
        canudp::Datagram out;
        const auto size = canudp::encode(f, 1, out);
        Frame back;
        ASSERT_TRUE(canudp::decode({out.data(), size}, back));
        EXPECT_TRUE(back.same(f));
        for (std::size_t cut = 0; cut < size; ++cut) {
            EXPECT_FALSE(canudp::decode({out.data(), cut}, back));
        }
    }
}

TEST(Datagram, other_orders_widths_and_keys_are_understood) {
    Frame f;
    // {"dlc": uint16 2, "data": bin16 0102, "x": nil, "arbitration_id": uint64 0x7ff}
    EXPECT_TRUE(canudp::decode(bytes("84a3646c63cd0002a464617461c500020102a178c0ae61726269747261746"
                                     "96f6e5f6964cf00000000000007ff"),
                               f));
    EXPECT_TRUE(f.same({0x7ff, {1, 2}}));
    EXPECT_FALSE(canudp::decode(bytes("81a3646c6302"), f));  // no identifier
    // dlc is not the length
    EXPECT_FALSE(
        canudp::decode(bytes("83a3646c6303a464617461c4020102ae6172626974726174696f6e5f696401"), f));
}

TEST(Line, every_frame_survives_the_way_there_and_back) {
    slcan::Decoder decoder;
    for (const auto& f : frames_of_every_kind()) {
        slcan::Line line;
        const auto size = slcan::encode(f, line);
        for (std::size_t i = 0; i + 1 < size; ++i) {
            ASSERT_EQ(decoder.take(line[i]), slcan::Decoder::Found::nothing);
        }
        ASSERT_EQ(decoder.take(line[size - 1]), slcan::Decoder::Found::frame);
        EXPECT_TRUE(decoder.frame().same(f));
    }
}

TEST(Line, says_what_the_format_says) {
    slcan::Line line;
    EXPECT_EQ(std::string(line.data(), slcan::encode({0x12, {0xab, 0x01}}, line)), "t0122AB01\r");
    EXPECT_EQ(std::string(line.data(), slcan::encode(Frame::request(0x12345678, 4), line)),
              "R123456784\r");
    const auto last = [](std::string_view text) {
        slcan::Decoder d;
        auto found = slcan::Decoder::Found::nothing;
        for (const char c : text) {
            found = d.take(c);
        }
        return found;
    };
    using Found = slcan::Decoder::Found;
    EXPECT_EQ(last("t1232AABB1F00\r"), Found::frame);  // with a time stamp
    EXPECT_EQ(last("zt1231AA\r"), Found::frame);
    EXPECT_EQ(last("z\r"), Found::nothing);
    EXPECT_EQ(last("V1013\r"), Found::nothing);
    EXPECT_EQ(last("F24\r"), Found::status);
    EXPECT_EQ(last("\a"), Found::error);
    EXPECT_EQ(last("t1239\r"), Found::error);
    EXPECT_EQ(last("t8001AA\r"), Found::error);  // twelve bits
    EXPECT_EQ(last("t1232AA\r"), Found::error);
    EXPECT_EQ(last("t123xAA\r"), Found::error);
    EXPECT_EQ(last(std::string("t1231AA").append(500, '0').append("\r")), Found::error);
    EXPECT_EQ(last(std::string(500, '0').append("\rt1230\r")), Found::frame);
}

TEST(Capture, log_lines_are_candumps) {
    Frame f;
    ASSERT_TRUE(parse_log_line("(1436509052.249713) vcan0 044#2A366C2BBA", f));
    EXPECT_EQ(f.time_ns, 1'436'509'052'249'713'000);
    EXPECT_TRUE(f.same({0x44, {0x2a, 0x36, 0x6c, 0x2b, 0xba}}));
    EXPECT_EQ(log_line(f, "vcan0"), "(1436509052.249713) vcan0 044#2A366C2BBA");
    f.time_ns += 987;  // canplayer reads nine digits as that many microseconds
    EXPECT_EQ(log_line(f, "vcan0"), "(1436509052.249713) vcan0 044#2A366C2BBA");
    ASSERT_TRUE(parse_log_line("(0.5) can0 00000123##1AA", f));
    EXPECT_TRUE(f.extended && f.fd && f.bit_rate_switch && f.length == 1);
    ASSERT_TRUE(parse_log_line("(1.0) can0 20000088#0000000000000000", f));
    EXPECT_TRUE(f.error && f.id == 0x88);
    for (const char* wrong : {"", "(1) can0", "(x) can0 123#", "(1) can0 12#", "(1) can0 123#1",
                              "(1) can0 123#112233445566778899", "(1) can0 923#R9"}) {
        EXPECT_FALSE(parse_log_line(wrong, f)) << wrong;
    }
}

TEST(Capture, log_lines_of_every_writer_are_read) {
    struct Case {
        const char* line;
        Frame frame;
    };
    Frame fd(0x123, {0x11, 0x22, 0x33});
    fd.fd = fd.bit_rate_switch = fd.error_state = true;
    const Frame eight(0x123, {1, 2, 3, 4, 5, 6, 7, 8});
    for (const auto& [line, frame] : std::vector<Case>{
             {"(1436509052.249713)  vcan0 044#2A R",
              {0x44, {0x2a}}},                 // candump -x, a channel with a shorter name
             {"(1436509052.249713) vcan0 044#2A T\r", {0x44, {0x2a}}},
             {"(1436509052.249713) vcan0 044#2a t", {0x44, {0x2a}}},
             {"(1436509052.249713123) vcan0 044#2A", {0x44, {0x2a}}},  // candump -N
             {"(0.000000) vcan0 044#2A R", {0x44, {0x2a}}},  // python-can
             {"(0.000000) can0 044#R R", Frame::request(0x44, 0)},
             {"(1.0) can0 044#R8_E", Frame::request(0x44, 8)},  // the raw DLC
             {"(1.0) can0 123#0102030405060708_9", eight},
             {"(1.0) can0 123#01.02.03.04.05.06.07.08", eight},  // cansend's separators
             {"(1.0) can0 123##3.11.22.33", fd},
             {"(1.0) can0 123##7112233 R", fd}}) {  // with the mark of FD
        Frame f;
        ASSERT_TRUE(parse_log_line(line, f)) << line;
        EXPECT_TRUE(f.same(frame)) << line;
    }
    for (const char* wrong :
         {"(1) can0 123#R9", "(1) can0 123#R8_", "(1) can0 123#0102_9", "(1) can0 123#.",
          "(1) can0 123#1.2", "(2026-13-01) can0 123#", "(1) can0 123##101_9",
          "(2026-11-28 18:00) can0 123#", "(1) 123#11"}) {
        Frame f;
        EXPECT_FALSE(parse_log_line(wrong, f)) << wrong;
    }
}

TEST(Capture, the_terminal_format_with_times_is_read) {
    std::vector<Frame> frames;
    ASSERT_EQ(
        parse_log(" (1436509052.249713)  vcan0       044   [5]  2A 36 6C 2B BA            '*6l+.'\n"
                  " (1436509053.000001)  \x1b[1mvcan0\x1b[0m  TX B E  12345678  [02]  AA BB\n"
                  " (1436509053.000002)  vcan0  RX - -  123   {E}  01 02 03 04 05 06 07 08\n"
                  "(1436509054.0)  can1       123   [4]  remote request\r\n"
                  " (1436509055.0)  can1  20000080   [8]  00 00 00 00 00 00 00 00   ERRORFRAME\n"
                  "\tbus-error\n"
                  "DROPCOUNT: dropped 3 CAN frames on 'can1' socket (total drops 3)\n"
                  "(1436509056.0) can1 7FF#\n",  // a log that follows it
                  frames),
        "");
    ASSERT_EQ(frames.size(), 6U);
    EXPECT_TRUE(frames[0].same({0x44, {0x2a, 0x36, 0x6c, 0x2b, 0xba}}));
    EXPECT_EQ(frames[0].time_ns, 1'436'509'052'249'713'000);
    EXPECT_TRUE(frames[1].extended && frames[1].fd && frames[1].bit_rate_switch &&
                frames[1].error_state && frames[1].length == 2);
    EXPECT_TRUE(frames[2].same({0x123, {1, 2, 3, 4, 5, 6, 7, 8}}));
    EXPECT_TRUE(frames[3].same(Frame::request(0x123, 4)));
    EXPECT_TRUE(frames[4].error && frames[4].id == 0x80);
}

TEST(Capture, dates_are_in_the_zone_of_the_machine) {
    const char* const before = std::getenv("TZ");
    const std::string zone = before != nullptr ? before : "";
    ::setenv("TZ", "UTC-2", 1);
    ::tzset();
    std::vector<Frame> frames;
    EXPECT_EQ(parse_log("(2026-11-28 18:00:00.249713) can0 044#2A\n (2026-11-28 18:00:01.25)  can0 "
                        " 044   [1]  2A\n",
                        frames),
              "");
    before != nullptr ? ::setenv("TZ", zone.c_str(), 1) : ::unsetenv("TZ");
    ::tzset();
    ASSERT_EQ(frames.size(), 2U);
    EXPECT_EQ(frames[0].time_ns, 1'795'881'600'249'713'000);
    EXPECT_EQ(frames[1].time_ns, 1'795'881'601'250'000'000);
}

TEST(Capture, what_is_not_a_log_is_named) {
    const auto problem = [](std::string_view text) {
        std::vector<Frame> frames;
        return parse_log(text, frames);
    };
    EXPECT_EQ(problem("  can0  123   [2]  01 02\n"),
              "line 1: terminal format of candump, without times; record with: candump -L, or "
              "candump -ta");
    EXPECT_EQ(problem("\n  can0  TX - -  123   [0]\n"),
              "line 2: terminal format of candump, without times; record with: candump -L, or "
              "candump -ta");
    for (const char* const bytes : {"00000001 00000010", "02`01"}) {
        EXPECT_EQ(problem(std::string(" (1436509052.249713)  can0  123   [2]  ") + bytes + "\n"),
                  "line 1: terminal format of candump, not with plain hexadecimal bytes; record "
                  "with: candump -L");
    }
    EXPECT_EQ(problem("(000.000000) can0 123#\n(000.100000) can0 123#\n(000.050000) can0 123#\n"),
              "line 3: the time goes back: differences, as candump -td prints them; record with: "
              "candump -L");
    EXPECT_EQ(problem("(000.000000) can0 123#\n(000.100000) can0 123#\n"), "");
    EXPECT_EQ(problem("(5.0) can0 123#\n(4.0) can1 123#\n"), "") << "two buses, put in order";
    EXPECT_EQ(problem("(1.0) can0 00123#81:00:12345678#11223344\n"),
              "line 1: CAN XL frame; supported: classic and FD frames");
    EXPECT_EQ(problem("hello\n"),
              "line 1: invalid frame; expected `(1436509052.249713) can0 181#0102`");
    EXPECT_EQ(problem("hello"),
              "line 1: invalid frame; expected `(1436509052.249713) can0 181#0102`");
    EXPECT_EQ(problem("date Sat Nov 28 18:00:00 2026\nbase hex  timestamps absolute\n"),
              "not a candump log: it is a Vector log (.asc); convert it with: can_logconvert FILE "
              "FILE.log");
    EXPECT_EQ(problem("Timestamp:        0.000000    ID:      123    S Rx                DL:  0\n"),
              "not a candump log: it is the terminal output of python-can; record with: can_logger "
              "-f FILE.log");
}

TEST(Capture, a_last_line_without_an_end_is_not_a_frame) {
    for (const char* const cut : {"(2.0) can0 201#0F00D007", "(2.0) can0 201#0F0", "(2.0) can0",
                                  " (2.0)  can0  201   [4]  0F 00 D0 07"}) {
        std::vector<Frame> frames;
        EXPECT_EQ(parse_log(std::string("(1.0) can0 702#00\n") + cut, frames),
                  "line 2: the last line has no end of line: its frame may be cut off; remove it, "
                  "or end it if it is complete");
        ASSERT_EQ(frames.size(), 1U) << cut;
        EXPECT_TRUE(frames[0].same({0x702, {0}}));
    }
    std::vector<Frame> frames;
    EXPECT_EQ(parse_log("(1.0) can0 702#00\n\r", frames), "") << "nothing was lost";
}

TEST(Capture, both_formats_give_back_what_was_recorded) {
    const auto frames = frames_of_every_kind();
    for (const char* ending : {".log", ".pcapng"}) {
        const auto file =
            testing::TempDir() + "halcyon_capture" + std::to_string(getpid()) + ending;
        std::string problem;
        auto recorder = record(file, "can0", problem);
        ASSERT_TRUE(recorder) << problem;
        for (const auto& f : frames) {
            ASSERT_TRUE(recorder->write(f));
        }
        recorder.reset();
        // A log has microseconds.
        const auto kept = [&](std::int64_t ns) {
            return file.ends_with(".log") ? ns / 1000 * 1000 : ns;
        };
        const auto capture = read_capture(file);
        EXPECT_EQ(capture.problem, "");
        ASSERT_EQ(capture.frames.size(), frames.size()) << ending;
        for (std::size_t i = 0; i < frames.size(); ++i) {
            EXPECT_TRUE(capture.frames[i].same(frames[i]));
            EXPECT_EQ(capture.frames[i].time_ns, kept(frames[i].time_ns));
        }

        auto opened = open("replay:" + file);
        ASSERT_TRUE(opened) << opened.problem;
        std::size_t count = 0;
        Frame f;
        for (std::int64_t now = 5'000; count < frames.size() && now < 1'000'000'000;
             now += 1'000'000) {
            for (; opened.link->receive(f, now); ++count) {
                EXPECT_LE(f.time_ns, now);
                EXPECT_EQ(f.time_ns, 5'000 + kept(frames[count].time_ns) - kept(frames[0].time_ns));
            }
        }
        EXPECT_EQ(count, frames.size());
        EXPECT_EQ(opened.link->state(), State::down);
        std::remove(file.c_str());
    }
}

TEST(Capture, a_damaged_file_is_rejected_with_the_place) {
    EXPECT_EQ(parse_capture("(1.0) can0 123#\nrubbish\n").problem,
              "line 2: invalid frame; expected `(1436509052.249713) can0 181#0102`");
    const std::string head(
        "\x0a\x0d\x0d\x0a\x1c\0\0\0\x4d\x3c\x2b\x1a\x01\0\0\0\xff\xff\xff\xff\xff\xff\xff\xff\x1c\0"
        "\0\0",
        28);
    EXPECT_EQ(parse_capture(head).problem, "");
    EXPECT_EQ(parse_capture(head + "more than nothing").problem, "damaged or truncated at byte 28");
    EXPECT_EQ(open("replay:/nonexistent.log").problem,
              "replay:/nonexistent.log: cannot read it: No such file or directory");
}

}  // namespace
}  // namespace hal::can
