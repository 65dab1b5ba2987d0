// SPDX-License-Identifier: MIT
// Devices that answer datagrams: in memory, and by UDP on the loopback interface.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <vector>

#include "link/datagram.hpp"
#include "link/system.hpp"

namespace {

namespace datagram = hal::datagram;
using Bytes = std::vector<std::uint8_t>;

/// Answers with the bytes of the request, `delay_ns` later, `copies` times.
struct Echo : datagram::Server {
    void serve(std::span<const std::uint8_t> request, std::int64_t now_ns,
               datagram::Replies& replies) noexcept override {
        last_now_ns = now_ns;
        for (int n = 0; n < copies; ++n) {
            replies.send(request, now_ns == datagram::unclocked ? 0 : now_ns + delay_ns);
        }
    }
    std::int64_t delay_ns = 0;
    std::int64_t last_now_ns = 0;
    int copies = 1;
};

Bytes received(datagram::Port& port, std::int64_t now_ns) {
    std::array<std::uint8_t, datagram::max_size> buffer{};
    const std::size_t size = port.receive(buffer, now_ns);
    return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size)};
}

TEST(DatagramPort, SimPort_receives_an_answer_when_it_is_due) {
    Echo echo;
    echo.delay_ns = 100;
    const auto attached = datagram::attach("sim:a-card", echo);
    ASSERT_TRUE(attached) << attached.problem;
    const auto opened = datagram::open("sim:a-card");
    ASSERT_TRUE(opened) << opened.problem;
    EXPECT_TRUE(opened.port->send(Bytes{1, 2, 3}, 1000));
    EXPECT_EQ(echo.last_now_ns, 1000);
    EXPECT_EQ(received(*opened.port, 1099), Bytes());
    EXPECT_EQ(received(*opened.port, 1100), (Bytes{1, 2, 3}));
    EXPECT_EQ(received(*opened.port, 2000), Bytes());
}

TEST(DatagramPort, SimPort_receives_answers_in_the_order_of_their_arrival) {
    Echo echo;
    const auto attached = datagram::attach("sim:a-card", echo);
    const auto opened = datagram::open("sim:a-card");
    echo.delay_ns = 500;
    opened.port->send(Bytes{1}, 0);
    echo.delay_ns = 100;
    opened.port->send(Bytes{2}, 0);
    opened.port->send(Bytes{3}, 0);
    EXPECT_EQ(received(*opened.port, 1000), Bytes{2});
    EXPECT_EQ(received(*opened.port, 1000), Bytes{3});
    EXPECT_EQ(received(*opened.port, 1000), Bytes{1});
}

TEST(DatagramPort, SimPort_keeps_the_answers_of_two_users_apart) {
    Echo echo;
    const auto attached = datagram::attach("sim:a-card", echo);
    const auto first = datagram::open("sim:a-card");
    const auto second = datagram::open("sim:a-card");
    first.port->send(Bytes{1}, 0);
    second.port->send(Bytes{2}, 0);
    EXPECT_EQ(received(*second.port, 0), Bytes{2});
    EXPECT_EQ(received(*second.port, 0), Bytes());
    EXPECT_EQ(received(*first.port, 0), Bytes{1});
}

TEST(DatagramPort, SimPort_loses_answers_when_its_queue_is_full) {
    Echo echo;
    echo.copies = 100;
    const auto attached = datagram::attach("sim:a-card", echo);
    const auto opened = datagram::open("sim:a-card");
    opened.port->send(Bytes{7}, 0);
    int count = 0;
    while (!received(*opened.port, 0).empty()) {
        ++count;
    }
    EXPECT_EQ(count, 16);
}

TEST(DatagramPort, SimPort_sends_nothing_without_a_card) {
    const auto opened = datagram::open("sim:nobody");
    ASSERT_TRUE(opened);
    EXPECT_FALSE(opened.port->send(Bytes{1}, 0));
    {
        Echo echo;
        const auto attached = datagram::attach("sim:nobody", echo);
        EXPECT_TRUE(opened.port->send(Bytes{1}, 0));
    }
    EXPECT_FALSE(opened.port->send(Bytes{1}, 0));
}

/// Sends to itself while it serves, as a crash handler may.
struct Recursive : datagram::Server {
    void serve(std::span<const std::uint8_t> request, std::int64_t,
               datagram::Replies&) noexcept override {
        is_sent = port->send(request, datagram::unclocked);
    }
    datagram::Port* port = nullptr;
    bool is_sent = true;
};

TEST(DatagramPort, SimPort_gives_up_when_its_server_is_in_use) {
    Recursive server;
    const auto attached = datagram::attach("sim:recursive", server);
    const auto opened = datagram::open("sim:recursive");
    server.port = opened.port.get();
    EXPECT_TRUE(opened.port->send(Bytes{1}, 0));
    EXPECT_FALSE(server.is_sent);
}

TEST(DatagramPort, Attach_rejects_a_name_that_has_a_card) {
    Echo echo;
    const auto first = datagram::attach("sim:a-card", echo);
    const auto second = datagram::attach("sim:a-card", echo);
    EXPECT_EQ(second.problem, "sim:a-card: two cards have this name; each needs one of its own");
    EXPECT_EQ(datagram::attach("eth:127.0.0.1", echo).problem,
              "'eth:127.0.0.1' is not the address of a card in memory; write sim:NAME");
}

TEST(DatagramPort, Claim_gives_a_device_to_one_user_at_a_time) {
    datagram::Claimed first = datagram::claim("sim:claimed", "one");
    EXPECT_TRUE(first);
    datagram::Claimed reloaded = datagram::claim("sim:claimed", "one");
    EXPECT_TRUE(reloaded);
    first.claim.reset();
    const datagram::Claimed second = datagram::claim("sim:claimed", "two");
    EXPECT_FALSE(second);
    EXPECT_EQ(second.holder, "one");
    EXPECT_TRUE(datagram::claim("eth:127.0.0.1", "two"));
    EXPECT_TRUE(datagram::claim("sim:other", "two"));
    reloaded.claim.reset();
    EXPECT_TRUE(datagram::claim("sim:claimed", "two"));
}

TEST(DatagramPort, Open_names_what_is_wrong_in_an_address) {
    EXPECT_EQ(datagram::open("10.10.10.10").problem,
              "'10.10.10.10' is not the address of a card; write eth:10.10.10.10 for a card on the "
              "network or sim:NAME for a card in memory");
    EXPECT_EQ(datagram::open("eth:").problem, "eth:: missing host; write eth:10.10.10.10");
    EXPECT_EQ(datagram::open("eth:127.0.0.1:0").problem,
              "eth:127.0.0.1:0: invalid port 0; write a number 1..65535");
    EXPECT_EQ(datagram::open("eth:127.0.0.1:1?spin=2").problem,
              "eth:127.0.0.1:1?spin=2: invalid spin '2'; write a duration 0us..10000us");
    EXPECT_EQ(datagram::open("sim:x?spin=1us").problem,
              "sim:x?spin=1us: sim does not support the option 'spin'; remove it");
    EXPECT_EQ(datagram::open("eth:127.0.0.1:1?speed=2").problem,
              "eth:127.0.0.1:1?speed=2: unknown option 'speed'; the option is spin");
}

TEST(DatagramPort, AddressOf_completes_the_name_of_a_host) {
    EXPECT_EQ(datagram::address_of("10.10.10.10"), "eth:10.10.10.10");
    EXPECT_EQ(datagram::address_of("10.10.10.10:1"), "eth:10.10.10.10:1");
    EXPECT_EQ(datagram::address_of("sim:mill"), "sim:mill");
}

/// A socket on the loopback interface.
class Peer {
public:
    Peer() : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
        sockaddr_in at{};
        at.sin_family = AF_INET;
        at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        EXPECT_EQ(::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
        socklen_t size = sizeof at;
        getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&at), &size);
        port = ntohs(at.sin_port);
    }
    void answer() {
        std::array<std::uint8_t, 64> buffer{};
        sockaddr_in from{};
        socklen_t size = sizeof from;
        const auto got = ::recvfrom(socket_.get(), buffer.data(), buffer.size(), 0,
                                    reinterpret_cast<sockaddr*>(&from), &size);
        ASSERT_GT(got, 0);
        ::sendto(socket_.get(), buffer.data(), static_cast<std::size_t>(got), 0,
                 reinterpret_cast<const sockaddr*>(&from), size);
    }
    std::uint16_t port = 0;

private:
    hal::link::Descriptor socket_;
};

TEST(DatagramPort, UdpPort_waits_for_an_answer_and_for_no_longer_than_its_limit) {
    Peer peer;
    const auto opened = datagram::open("eth:127.0.0.1:" + std::to_string(peer.port));
    ASSERT_TRUE(opened) << opened.problem;
    EXPECT_FALSE(opened.port->wait(1'000'000));
    EXPECT_EQ(received(*opened.port, 0), Bytes());
    ASSERT_TRUE(opened.port->send(Bytes{4, 5}, 0));
    peer.answer();
    EXPECT_TRUE(opened.port->wait(1'000'000'000));
    EXPECT_EQ(received(*opened.port, 0), (Bytes{4, 5}));
}

TEST(DatagramPort, UdpPort_goes_on_after_its_peer_was_missing) {
    std::uint16_t port = 0;
    {
        const Peer gone;
        port = gone.port;
    }
    const auto opened = datagram::open("eth:127.0.0.1", {.port = port});
    ASSERT_TRUE(opened) << opened.problem;
    for (int n = 0; n < 5; ++n) {
        EXPECT_TRUE(opened.port->send(Bytes{1}, 0));
        EXPECT_FALSE(opened.port->wait(1'000'000));
        EXPECT_EQ(received(*opened.port, 0), Bytes());
    }
}

}  // namespace
