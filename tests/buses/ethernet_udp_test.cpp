// SPDX-License-Identifier: MIT
// Frames in UDP datagrams: both ends in this process.
#include <arpa/inet.h>
#include <sys/socket.h>

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <vector>

#include "link/ethernet.hpp"
#include "link/system.hpp"

namespace hal::ethernet {
namespace {

constexpr std::int64_t second = 1'000'000'000;
constexpr std::uint16_t type = 0x88a4;

/// Returns a socket on a free port of this machine.
link::Descriptor any_socket(std::uint16_t& port) {
    link::Descriptor fd(::socket(AF_INET, SOCK_DGRAM, 0));
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    (void)bind(fd.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at);
    socklen_t size = sizeof at;
    getsockname(fd.get(), reinterpret_cast<sockaddr*>(&at), &size);
    port = ntohs(at.sin_port);
    return fd;
}
std::string free_place() {
    std::uint16_t port = 0;
    any_socket(port);
    return "127.0.0.1:" + std::to_string(port);
}

std::vector<std::uint8_t> frame(std::size_t length, std::uint8_t first = 0) {
    std::vector<std::uint8_t> bytes(length);
    std::memset(bytes.data(), 0xff, 6);
    bytes[12] = type >> 8;
    bytes[13] = type & 0xff;
    for (std::size_t n = header_bytes; n < length; ++n) {
        bytes[n] = static_cast<std::uint8_t>(first + n);
    }
    return bytes;
}

struct UdpEnds : testing::Test {
    std::string address = "udp:" + free_place();
    std::unique_ptr<Port> line = open(address, {.types = {type}, .listen = true}).port;

    std::unique_ptr<Port> other() const { return open(address, {.types = {type}}).port; }
    /// Returns the next frame, or none within a second.
    static std::vector<std::uint8_t> next(Port& port) {
        if (!port.wait(link::monotonic_ns() + second)) {
            return {};
        }
        const auto arrival = port.receive(unclocked);
        return arrival ? std::vector<std::uint8_t>(arrival->bytes.begin(), arrival->bytes.end())
                       : std::vector<std::uint8_t>();
    }
    /// Takes announcements.
    void settle() const {
        for (int n = 0; n < 3; ++n) {
            line->wait(link::monotonic_ns() + second / 100);
            line->receive(unclocked);
        }
    }
};

TEST_F(UdpEnds, Payload_passes_in_both_directions_with_the_type_in_front) {
    const auto master = other();
    ASSERT_TRUE(line && master);
    settle();
    for (const std::size_t length : {smallest_frame, std::size_t{200}, max_frame}) {
        const auto sent = frame(length);
        const auto before = link::monotonic_ns();
        ASSERT_EQ(master->send(sent, {}, unclocked), Sent::queued);
        ASSERT_TRUE(line->wait(before + second));
        const auto arrival = line->receive(unclocked);
        ASSERT_TRUE(arrival);
        ASSERT_EQ(arrival->bytes.size(), length);
        EXPECT_TRUE(std::equal(sent.begin() + 12, sent.end(), arrival->bytes.begin() + 12));
        EXPECT_TRUE(std::equal(broadcast.begin(), broadcast.end(), arrival->bytes.begin()));
        EXPECT_EQ(arrival->bytes[6] & 2, 0) << "frames of the master did not pass a slave yet";
        EXPECT_GE(arrival->time_ns, before - 1'000'000);
        EXPECT_LE(arrival->time_ns, link::monotonic_ns());
        ASSERT_EQ(line->send(sent, {}, unclocked), Sent::queued);
        const auto back = next(*master);
        ASSERT_EQ(back.size(), length);
        EXPECT_EQ(back[6] & 2, 2) << "they passed one now";
    }
    EXPECT_EQ(line->statistics().received, 3U);
    EXPECT_EQ(master->statistics().sent, 3U);
    EXPECT_EQ(master->statistics().received, 3U);
}

TEST_F(UdpEnds, Short_datagrams_are_padded_and_long_ones_counted_as_errors) {
    std::uint16_t port = 0;
    const auto stranger = any_socket(port);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port =
        htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    const std::array<std::uint8_t, 1501> data{7};
    const auto post = [&](std::size_t length) {
        return sendto(stranger.get(), data.data(), length, 0,
                      reinterpret_cast<const sockaddr*>(&to), sizeof to) >= 0;
    };
    ASSERT_TRUE(post(1501) && post(0) && post(1));
    const auto short_one = next(*line);
    ASSERT_EQ(short_one.size(), smallest_frame);
    EXPECT_EQ(short_one[14], 7);
    EXPECT_EQ(short_one[15], 0);
    EXPECT_EQ(line->statistics().errors, 1U);
    EXPECT_EQ(line->statistics().received, 1U);
}

TEST_F(UdpEnds, Every_end_that_announced_itself_receives_what_the_line_sends) {
    const auto master = other();
    const auto listener = other();
    settle();
    ASSERT_EQ(line->send(frame(100, 3), {}, unclocked), Sent::queued);
    EXPECT_EQ(next(*master).size(), 100U);
    EXPECT_EQ(next(*listener).size(), 100U);
    EXPECT_FALSE(line->wait(link::monotonic_ns() + second / 100)) << "it does not receive its own";
}

TEST_F(UdpEnds, A_line_without_masters_drops_its_frames) {
    EXPECT_EQ(line->send(frame(60), {}, unclocked), Sent::full);
    EXPECT_EQ(line->statistics().dropped, 1U);
}

TEST_F(UdpEnds, The_link_is_down_while_no_program_listens) {
    const auto master = other();
    EXPECT_TRUE(master->statistics().up);
    line.reset();
    master->send(frame(60), {}, unclocked);
    master->wait(link::monotonic_ns() + second / 100);
    EXPECT_FALSE(master->statistics().up);
    EXPECT_EQ(master->statistics().downs, 1U);
    EXPECT_FALSE(other()->statistics().up) << "known when it is opened";

    line = open(address, {.types = {type}, .listen = true}).port;
    ASSERT_EQ(master->send(frame(60), {}, unclocked), Sent::queued);
    ASSERT_EQ(next(*line).size(), smallest_frame);
    line->send(frame(60), {}, unclocked);
    EXPECT_EQ(next(*master).size(), smallest_frame);
    EXPECT_TRUE(master->statistics().up);
}

TEST(UdpAddresses, Problems_name_what_to_write) {
    const Options one{.types = {type}};
    EXPECT_EQ(
        open("udp:127.0.0.1").problem,
        "udp:127.0.0.1: UDP datagrams carry frames of one type only; write eth:enp3s0 or sim:NAME");
    EXPECT_EQ(open("udp:", one).problem,
              "udp:: missing host; write udp:127.0.0.1 for this machine");
    EXPECT_EQ(open("udp:127.0.0.1:0", one).problem,
              "udp:127.0.0.1:0: invalid port '0'; write udp:127.0.0.1:34980");
    EXPECT_EQ(open("udp:127.0.0.1:", one).problem,
              "udp:127.0.0.1:: invalid port ''; write udp:127.0.0.1:34980");
    EXPECT_EQ(open("udp:127.0.0.1:7x", one).problem,
              "udp:127.0.0.1:7x: invalid port '7x'; write udp:127.0.0.1:34980");
    EXPECT_EQ(open("udp:127.0.0.1?pacer", one).problem,
              "udp:127.0.0.1?pacer: udp does not support the option 'pacer'; remove it");
    EXPECT_TRUE(open("udp:300.0.0.1", one)
                    .problem.starts_with("udp:300.0.0.1: no IPv4 address for host '300.0.0.1': "));
    EXPECT_EQ(open("udp:192.0.2.1", {.types = {type}, .listen = true}).problem,
              "udp:192.0.2.1: 192.0.2.1 is not an address of this machine; to listen on all of "
              "them, write udp:0.0.0.0");
    const auto address = "udp:" + free_place();
    const auto first = open(address, {.types = {type}, .listen = true});
    EXPECT_EQ(open(address, {.types = {type}, .listen = true}).problem,
              address + ": cannot listen on " + address.substr(4) +
                  ": Address already in use; to find the program that does: ss -ulpn");
    EXPECT_TRUE(describe("udp:127.0.0.1").datagrams);
    EXPECT_TRUE(describe("replay:seen.pcapng").recorded);
}

}  // namespace
}  // namespace hal::ethernet
