// SPDX-License-Identifier: MIT
#include "link/ethernet_capture.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <unistd.h>

namespace hal::ethernet {
namespace {

constexpr std::int64_t ms = 1'000'000;

class EthernetCapture : public testing::Test {
protected:
    ~EthernetCapture() override { std::filesystem::remove(file_); }
    const std::string file_ =
        testing::TempDir() + "halcyon-capture-" + std::to_string(getpid()) + ".pcapng";
};

std::vector<std::uint8_t> frame(std::uint16_t type, std::uint8_t first, std::size_t length = 60) {
    std::vector<std::uint8_t> f(length);
    std::fill_n(f.begin(), 6, 0xff);
    f[6] = 2;
    f[11] = 7;
    f[12] = static_cast<std::uint8_t>(type >> 8);
    f[13] = static_cast<std::uint8_t>(type);
    f[14] = first;
    return f;
}
void write(const std::string& file, const std::vector<Captured>& frames) {
    std::string problem;
    auto recorder = record(file, "enp3s0", problem);
    ASSERT_TRUE(recorder) << problem;
    for (const auto& f : frames) {
        EXPECT_TRUE(recorder->write(f.time_ns, f.bytes));
    }
    EXPECT_TRUE(recorder->flush());
}
std::string output(const std::string& command) {
    std::string text;
    if (std::FILE* pipe = popen(command.c_str(), "r")) {
        for (char part[4096]; const auto n = std::fread(part, 1, sizeof part, pipe);) {
            text.append(part, n);
        }
        if (pclose(pipe) != 0) {
            text += "failed";
        }
    }
    return text;
}

TEST_F(EthernetCapture, what_is_written_is_read_in_order_of_time) {
    write(file_, {{3'000'000'001, frame(0x9021, 3, 1514)}, {1'000'000'000, frame(0x9021, 1, 61)}});
    const auto capture = read_capture(file_);
    EXPECT_EQ(capture.problem, "");
    ASSERT_EQ(capture.frames.size(), 2U);
    EXPECT_EQ(capture.frames[0].bytes, frame(0x9021, 1, 61));
    EXPECT_EQ(capture.frames[1].bytes, frame(0x9021, 3, 1514));
    EXPECT_EQ(capture.frames[1].time_ns, 3'000'000'001);
}

TEST_F(EthernetCapture, tshark_reads_what_is_written) {
    if (std::system("tshark --version >/dev/null 2>&1") != 0) {
        GTEST_SKIP() << "no tshark; type: sudo apt install tshark";
    }
    auto sync = frame(0x9021, 0x00);  // an RTmac header and the sync frame of TDMA, cycle 7
    const std::uint8_t rtmac[] = {0, 1, 2, 0, 2, 1, 0, 0, 0, 0, 0, 7};
    std::copy(std::begin(rtmac), std::end(rtmac), sync.begin() + 14);
    write(file_,
          {{1'700'000'000'123'456'789, sync}, {1'700'000'000'124'456'789, frame(0x88b5, 9)}});
    EXPECT_EQ(
        output("tshark -r " + file_ +
               " -T fields -e frame.time_epoch -e frame.interface_name -e eth.type -e frame.len "
               "-e tdma.sync.cycle 2>/dev/null"),
        "1700000000.123456789\tenp3s0\t0x9021\t60\t7\n1700000000."
        "124456789\tenp3s0\t0x88b5\t60\t\n");
}

TEST_F(EthernetCapture, a_replay_keeps_the_distances_and_then_is_down) {
    write(
        file_,
        {{500 * ms, frame(0x9021, 1)}, {501 * ms, frame(0x9022, 2)}, {503 * ms, frame(0x9021, 3)}});
    auto opened = open("replay:" + file_, {.types = {0x9021}});
    ASSERT_TRUE(opened) << opened.problem;
    Port& port = *opened.port;
    EXPECT_TRUE(port.description().simulated);
    const auto first = port.receive(10 * ms);
    ASSERT_TRUE(first);
    EXPECT_EQ(first->bytes[14], 1);
    EXPECT_EQ(first->time_ns, 10 * ms);
    EXPECT_FALSE(port.receive(12 * ms));
    EXPECT_TRUE(port.statistics().up);
    const auto last = port.receive(14 * ms);
    ASSERT_TRUE(last);
    EXPECT_EQ(last->bytes[14], 3);
    EXPECT_EQ(last->time_ns, 13 * ms);
    EXPECT_FALSE(port.receive(20 * ms));
    EXPECT_FALSE(port.statistics().up);
    EXPECT_EQ(port.statistics().received, 2U);
    EXPECT_EQ(port.send(frame(0x9021, 1), {}, 20 * ms), Sent::queued);
    EXPECT_EQ(port.send(frame(0x9021, 1), {.at_ns = ms, .guard_ns = 1}, 20 * ms), Sent::late);
    EXPECT_EQ(port.statistics().sent_bytes, 60U);
}

TEST_F(EthernetCapture, a_truncated_file_is_rejected_with_the_place) {
    write(file_, {{500 * ms, frame(0x9021, 1)}, {501 * ms, frame(0x9022, 2)}});
    const auto size = std::filesystem::file_size(file_);
    std::filesystem::resize_file(file_, size - 5);
    EXPECT_EQ(read_capture(file_).frames.size(), 1U);
    EXPECT_EQ(open("replay:" + file_).problem,
              "replay:" + file_ + ": damaged or truncated at byte " + std::to_string(size - 92));
    EXPECT_EQ(open("replay:/nosuch").problem,
              "replay:/nosuch: cannot read it: No such file or directory");
    EXPECT_EQ(open("replay:").problem, "replay:: missing file; write replay:capture.pcapng");
    std::filesystem::resize_file(file_, size - 92);
    std::filesystem::resize_file(file_, size - 184);
    EXPECT_EQ(
        open("replay:" + file_).problem,
        "replay:" + file_ +
            ": no Ethernet frames in this file; to record some: tcpdump -i enp3s0 -w capture.pcap");
    std::filesystem::resize_file(file_, 4);
    EXPECT_EQ(read_capture(file_).problem, "neither pcapng nor pcap");
}

TEST_F(EthernetCapture, incomplete_frames_are_left_out) {
    write(file_, {{ms, frame(0x9021, 1)},
                  {ms, std::vector<std::uint8_t>(13)},
                  {ms, std::vector<std::uint8_t>(1515)}});
    const auto capture = read_capture(file_);
    EXPECT_EQ(capture.frames.size(), 1U);
    EXPECT_EQ(capture.left_out, 2U);
}

}  // namespace
}  // namespace hal::ethernet
