// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>

#include "ethercat/master/gateway.hpp"
#include "tests/unit/ethercat/mailbox_slave.hpp"

namespace {

using namespace hal::ethercat;
using namespace hal::ethercat::master;
using hal::ethercat::tests::Bytes;
using hal::ethercat::tests::MailboxSlave;

/// A client, and the cycle of the server in its waits.
struct GatewayLine {
    MailboxSlave slave;
    Mailboxes mailboxes{1};
    RequestServer server{mailboxes, [this](std::uint16_t) { return &slave.bus; }, 2};
    RequestPort& port = server.open();
    std::string problem;
    std::unique_ptr<Gateway> gateway;
    int fd = -1;

    explicit GatewayLine(int type) {
        GatewaySetup setup;
        setup.port = 0;
        setup.slaves = [] { return std::vector<GatewaySlave>{{0x1001, 0, 2, 0x1234, 0x10000, 7}}; };
        gateway = std::make_unique<Gateway>(port, setup, problem);
        EXPECT_EQ(problem, "");
        slave.on_request = [this](const MailboxMessage& m) {
            Bytes p(10);
            coe::write_sdo(p.data(), coe::Service::sdo_response,
                           {0x43, get<std::uint16_t>(m.payload.data() + 3), m.payload[5], 0xcafe});
            slave.reply(MailboxType::coe, p);
        };
        sockaddr_in at{};
        at.sin_family = AF_INET;
        at.sin_port = htons(gateway->port());

        at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        fd = socket(AF_INET, type, 0);
        EXPECT_EQ(connect(fd, reinterpret_cast<sockaddr*>(&at), sizeof at), 0);
    }
    ~GatewayLine() {
        close(fd);
        server.stop();
    }
    void send(const Bytes& bytes) {
        EXPECT_EQ(::send(fd, bytes.data(), bytes.size(), 0), static_cast<ssize_t>(bytes.size()));
    }
    Bytes receive() {
        Bytes bytes(1500);
        for (unsigned i = 0; i < 5000; ++i) {
            const auto got = recv(fd, bytes.data(), bytes.size(), MSG_DONTWAIT);
            if (got > 0) {
                return {bytes.begin(), bytes.begin() + got};
            }
            server.step(slave.now_ns);
            slave.step(server.channel(0));
            usleep(200);
        }
        return {};
    }
    Bytes upload(std::uint16_t station, std::uint16_t index, std::uint8_t sub) {
        Bytes bytes(18);
        put<std::uint16_t>(bytes.data(), 16 | 5 << 12);
        write_mailbox_header(bytes.data() + 2, 10, station, MailboxType::coe, 2);
        coe::write_sdo(bytes.data() + 8, coe::Service::sdo_request, {0x40, index, sub, 0});
        return bytes;
    }
};

TEST(EthercatGateway, Passes_requests_to_the_slave_by_UDP_and_TCP) {
    for (const int type : {SOCK_DGRAM, SOCK_STREAM}) {
        GatewayLine f(type);
        f.send(f.upload(0x1001, 0x2000, 3));
        const Bytes reply = f.receive();
        ASSERT_EQ(reply.size(), 18U);
        EXPECT_EQ(get<std::uint16_t>(reply.data()), 16 | 5 << 12);
        EXPECT_EQ(get<std::uint16_t>(reply.data() + 4), 0x1001)
            << "the address is returned unchanged";
        EXPECT_EQ(get<std::uint32_t>(reply.data() + 14), 0xcafeU);
        f.send(f.upload(0, 0xf020, 1));
        EXPECT_EQ(get<std::uint16_t>(f.receive().data() + 14), 0x1001)
            << "dictionary of the master";
        f.send(f.upload(0, 0x8000, 6));
        EXPECT_EQ(get<std::uint32_t>(f.receive().data() + 14), 0x1234U);
        f.send(f.upload(0, 0x9999, 0));
        EXPECT_EQ(get<std::uint32_t>(f.receive().data() + 14), code_of(coe::Abort::no_object));
    }
}

TEST(EthercatGateway, Answers_a_client_that_has_closed_its_sending_direction) {
    GatewayLine line(SOCK_STREAM);
    line.send(line.upload(0x1001, 0x1018, 1));
    line.send(line.upload(0x1001, 0x1018, 2));
    EXPECT_EQ(shutdown(line.fd, SHUT_WR), 0);
    // the sub-indices of both answers, then the end of the connection
    Bytes both;
    while (both.size() < 36) {
        const Bytes part = line.receive();
        ASSERT_FALSE(part.empty());
        both.insert(both.end(), part.begin(), part.end());
    }
    ASSERT_EQ(both.size(), 36U);
    EXPECT_EQ(both[13], 1);
    EXPECT_EQ(both[31], 2);
    char more = 0;
    EXPECT_EQ(recv(line.fd, &more, 1, 0), 0);
    EXPECT_EQ(line.gateway->answered(), 2U);
}

TEST(EthercatGateway, Invalid_requests_are_dropped) {
    GatewayLine f(SOCK_DGRAM);
    std::mt19937 random(3);
    for (unsigned i = 0; i < 500; ++i) {
        Bytes bytes = f.upload(static_cast<std::uint16_t>(random() % 3),
                               static_cast<std::uint16_t>(random()), 0);
        bytes.resize(random() % 40);
        for (unsigned k = 0; k < 4 && !bytes.empty(); ++k) {
            bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
        }
        (void)!::send(f.fd, bytes.data(), bytes.size(), 0);
    }
    f.send(f.upload(0x1001, 0x2000, 3));
    for (unsigned i = 0; i < 100; ++i) {
        const Bytes reply = f.receive();
        // a full socket buffer drops requests
        if (reply.empty()) {
            f.send(f.upload(0x1001, 0x2000, 3));
        }
        if (reply.size() == 18 && get<std::uint32_t>(reply.data() + 14) == 0xcafe) return;
    }
    FAIL() << "the valid request is not answered";
}

TEST(EthercatGateway, Reports_an_invalid_address) {
    Mailboxes mailboxes(1);
    RequestServer server(mailboxes, [](std::uint16_t) { return nullptr; });
    std::string problem;
    GatewaySetup setup;
    setup.address = "localhost";
    Gateway gateway(server.open(), setup, problem);
    EXPECT_EQ(problem,
              "mailbox gateway: 'localhost' is not an IPv4 address; write for example 127.0.0.1");
}

}  // namespace
