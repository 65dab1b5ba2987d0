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

    explicit GatewayLine(int type, std::chrono::milliseconds max_wait = std::chrono::seconds(10)) {
        GatewaySetup setup;
        setup.max_wait = max_wait;
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

TEST(EthercatGateway, Drops_a_request_that_the_cycle_has_not_begun_in_time) {
    GatewayLine line(SOCK_DGRAM, std::chrono::milliseconds(20));
    unsigned served = 0;
    const auto answer =
        std::exchange(line.slave.on_request, [&](const MailboxMessage&) { ++served; });
    line.send(line.upload(0x1001, 0x6083, 0));
    usleep(200'000);  // the machine is stopped
    EXPECT_EQ(line.receive(), Bytes());
    EXPECT_EQ(served, 0U);
    EXPECT_EQ(line.gateway->dropped(), 1U);
    line.slave.on_request = answer;
    line.send(line.upload(0x1001, 0x6083, 0));
    EXPECT_NE(line.receive(), Bytes());
}

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

/// Answers of the master's own dictionary, without sockets.
struct MasterDictionary {
    std::vector<GatewaySlave> slaves{{0x1001, 0, 2, 0x1234, 0x10000, 7},
                                     {0x1002, 1, 2, 0x5678, 0x10000, 8}};
    std::size_t capacity = max_mailbox;

    /// Returns the payload of the answer to a CoE payload.
    Bytes ask(const Bytes& payload) const {
        Bytes message(capacity);
        write_mailbox_header(message.data(), payload.size(), 0, MailboxType::coe, 2);
        std::copy(payload.begin(), payload.end(), message.begin() + mailbox_header_bytes);
        const std::size_t length =
            answer_for_master(slaves, message, mailbox_header_bytes + payload.size());
        EXPECT_LE(length, capacity);
        const auto answer = read_mailbox(std::span(message).first(length));
        if (!answer) return {};
        type = answer->type;
        return {answer->payload.begin(), answer->payload.end()};
    }
    Bytes upload(std::uint16_t index, std::uint8_t sub, std::uint8_t command = 0x40) const {
        Bytes request(coe::sdo_bytes);
        coe::write_sdo(request.data(), coe::Service::sdo_request, {command, index, sub, 0});
        return ask(request);
    }
    Bytes describe(coe::Information opcode, const Bytes& parameters) const {
        Bytes request(coe::information_header_bytes);
        coe::write_information(request.data(), {opcode, false, 0});
        request.insert(request.end(), parameters.begin(), parameters.end());
        Bytes answer = ask(request);
        answer.erase(answer.begin(), answer.begin() + 2);  // the CoE header
        return answer;
    }
    mutable MailboxType type{};
};

Bytes with_text(Bytes bytes, std::string_view text) {
    bytes.insert(bytes.end(), text.begin(), text.end());
    return bytes;
}

TEST(EthercatMasterDictionary, Lists_its_objects) {
    MasterDictionary f;
    const Bytes all = f.describe(coe::Information::list_request, {1, 0});
    ASSERT_EQ(all.size(), 4U + 2 + 2 * (4 + 2 + 16));
    EXPECT_EQ(Bytes(all.begin(), all.begin() + 16),
              (Bytes{2, 0, 0, 0, 1, 0, 0, 0x10, 8, 0x10, 0x18, 0x10, 0, 0x80, 1, 0x80}));
    EXPECT_EQ(f.describe(coe::Information::list_request, {0, 0}),
              (Bytes{2, 0, 0, 0, 0, 0, 22, 0, 0, 0, 0, 0, 0, 0, 0, 0}))
        << "lengths of the five lists";
    EXPECT_EQ(f.describe(coe::Information::list_request, {2, 0}), (Bytes{2, 0, 0, 0, 2, 0}));
    EXPECT_EQ(f.describe(coe::Information::list_request, {6, 0})[0], 7) << "an error";
    f.slaves.resize(4000, f.slaves.front());
    EXPECT_LE(f.describe(coe::Information::list_request, {1, 0}).size(), max_mailbox);
}

TEST(EthercatMasterDictionary, Describes_objects_and_entries) {
    const MasterDictionary f;
    EXPECT_EQ(f.describe(coe::Information::object_request, {1, 0x80}),
              with_text({4, 0, 0, 0, 1, 0x80, 7, 0, 8, 9}, "Configuration of a slave"));
    EXPECT_EQ(f.describe(coe::Information::object_request, {0x20, 0xf0}),
              with_text({4, 0, 0, 0, 0x20, 0xf0, 6, 0, 2, 8}, "Configured addresses"));
    EXPECT_EQ(f.describe(coe::Information::entry_request, {0, 0x80, 5, 7}),
              with_text({6, 0, 0, 0, 0, 0x80, 5, 7, 7, 0, 32, 0, 7, 0}, "Vendor ID"));
    const auto error = [&](coe::Information opcode, const Bytes& parameters) {
        const Bytes answer = f.describe(opcode, parameters);
        EXPECT_EQ(answer[0], 7);
        return get<std::uint32_t>(answer.data() + 4);
    };
    EXPECT_EQ(error(coe::Information::object_request, {2, 0x80}), code_of(coe::Abort::no_object));
    EXPECT_EQ(error(coe::Information::entry_request, {2, 0x80, 1, 0}),
              code_of(coe::Abort::no_object));
    EXPECT_EQ(error(coe::Information::entry_request, {1, 0x80, 2, 0}), code_of(coe::Abort::no_sub));
    EXPECT_EQ(error(coe::Information::object_response, {1, 0x80}), code_of(coe::Abort::command));
    f.describe(coe::Information::entry_request, {1, 0x80});
    EXPECT_EQ(f.type, MailboxType::error) << "the sub-index is missing";
}

TEST(EthercatMasterDictionary, Uploads_whole_objects) {
    MasterDictionary f;
    constexpr std::uint8_t complete = 0x50;
    const Bytes addresses = f.upload(0xf020, 0, complete);
    EXPECT_EQ(Bytes(addresses.begin() + 2, addresses.end()),
              (Bytes{0x51, 0x20, 0xf0, 0, 6, 0, 0, 0, 2, 0, 1, 0x10, 2, 0x10}));
    const Bytes values = f.upload(0xf000, 1, complete);
    EXPECT_EQ(Bytes(values.begin() + 6, values.end()), (Bytes{4, 0, 0, 0, 1, 0, 0, 0x10}))
        << "without sub-index 0";
    EXPECT_EQ(f.upload(0x8000, 0, complete).size(), coe::sdo_bytes + 2 + 2 + 4 * 4);
    EXPECT_EQ(get<std::uint32_t>(f.upload(0x8000, 5, complete).data() + coe::sdo_data),
              code_of(coe::Abort::no_complete_access));
    f.slaves.resize(300, f.slaves.front());
    f.capacity = 128;
    EXPECT_EQ(f.upload(0xf020, 0, complete).size() % 2, 0U) << "as much as the message holds";
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
