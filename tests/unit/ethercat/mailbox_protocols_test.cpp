// SPDX-License-Identifier: MIT
// FoE, SoE, AoE, EoE and VoE against scripted slaves, and requests of other threads.
#include <gtest/gtest.h>

#include <random>

#include "ethercat/master/request_queue.hpp"
#include "tests/unit/ethercat/mailbox_slave.hpp"

namespace {

using namespace hal::ethercat;
using namespace hal::ethercat::master;
using hal::ethercat::tests::Bytes;
using hal::ethercat::tests::MailboxSlave;
using Outcome = MailboxResult::Outcome;
using Kind = MailboxRequest::Kind;

Bytes pattern(std::size_t count) {
    Bytes bytes(count);
    for (std::size_t i = 0; i < count; ++i) {
        bytes[i] = static_cast<std::uint8_t>(i * 11 + i / 256);
    }
    return bytes;
}

/// Drives requests through the server's worker to the slave.
struct Served {
    MailboxSlave slave;
    Mailboxes mailboxes{1};
    RequestServer server{mailboxes,
                         [this](std::uint16_t n) { return n == 0 ? &slave.bus : nullptr; }, 1};
    RequestPort& port = server.open();
    MailboxRequest request;
    Bytes buffer = Bytes(5000);
    FoeProgress progress;

    /// Checks that the tasks of the worker had memory to spare.
    ~Served() { EXPECT_LT(server.channel(0).max_task_share(), 0.75); }
    explicit Served(std::uint16_t size = 64) : slave(size) {
        request.data = buffer;
        request.progress = &progress;
    }
    MailboxResult run(unsigned cycles = 200000) {
        EXPECT_TRUE(port.submit(request));
        for (unsigned i = 0; i < cycles && !port.finished(request); ++i) {
            server.step(slave.now_ns);
            slave.step(server.channel(0));
        }
        EXPECT_TRUE(port.finished(request)) << "does not end";
        return request.result;
    }
    Bytes got() const {
        return {buffer.begin(), buffer.begin() + static_cast<long>(request.result.length)};
    }
};

/// A file server.
struct FoeServed : Served {
    Bytes file;
    std::size_t at = 0;
    std::uint32_t packet = 0;
    std::uint32_t busy_every = 0;
    std::uint32_t data_packets = 0;
    std::uint32_t password = 0;

    explicit FoeServed(std::uint16_t size = 64) : Served(size) {
        request.name = "app.efw";
        slave.on_request = [this](const MailboxMessage& m) { serve(*foe::read(m.payload)); };
    }
    void send(foe::Opcode opcode, std::uint32_t value, const Bytes& data = {}) {
        Bytes p(6);
        foe::write_header(p.data(), opcode, value);
        p.insert(p.end(), data.begin(), data.end());
        slave.reply(MailboxType::foe, p);
    }
    void send_data() {
        const std::size_t capacity = foe::packet_capacity(slave.bus.area().in_size);

        const std::size_t from = (packet - 1) * capacity;
        const std::size_t count = std::min(capacity, file.size() - from);
        send(foe::Opcode::data, packet,
             {file.begin() + static_cast<long>(from),
              file.begin() + static_cast<long>(from + count)});
        at = from + count;
    }
    void serve(const foe::Message& m) {
        if (busy_every != 0 && ++data_packets % busy_every == 0) {
            return send(foe::Opcode::busy, 100U << 16 | data_packets);
        }
        switch (m.opcode) {
        case foe::Opcode::read:
            if (m.value != password) {
                return send(foe::Opcode::error, 0x800a, {'n', 'o'});
            }
            if (m.text() != "app.efw") return send(foe::Opcode::error, 0x8001);
            packet = 1;
            return send_data();
        case foe::Opcode::ack:
            if (m.value != packet) return;
            if (at == file.size() &&
                packet * foe::packet_capacity(slave.bus.area().in_size) > file.size()) {
                return;
            }
            ++packet;
            return send_data();
        case foe::Opcode::write:
            if (m.value != password) return send(foe::Opcode::error, 0x800a);
            file.clear();
            packet = 0;
            return send(foe::Opcode::ack, 0);
        case foe::Opcode::data:
            if (m.value == packet + 1) {
                file.insert(file.end(), m.data.begin(), m.data.end());
                ++packet;
            }
            return send(foe::Opcode::ack, packet);
        default: return;
        }
    }
};

TEST(EthercatFoe, Files_of_every_length_arrive_with_losses_duplicates_and_busy) {
    for (const std::size_t length : {0U, 1U, 51U, 52U, 53U, 104U, 1000U}) {
        for (const unsigned lose : {0U, 3U, 7U}) {
            for (const unsigned busy : {0U, 2U, 3U}) {
                FoeServed f;
                f.slave.lose_every = lose;
                f.slave.double_every = lose;
                f.busy_every = busy;
                f.request.kind = Kind::foe_write;
                Bytes content = pattern(length);
                f.request.data = content;
                ASSERT_TRUE(f.run()) << length << " " << lose << " " << busy << " outcome "
                                     << int(f.request.result.outcome);
                ASSERT_EQ(f.file, content) << length << " " << lose << " " << busy;
                f.request.kind = Kind::foe_read;
                f.request.data = f.buffer;
                ASSERT_TRUE(f.run()) << length << " " << lose << " " << busy << " outcome "
                                     << int(f.request.result.outcome);
                ASSERT_EQ(f.got(), content);
                EXPECT_EQ(f.progress.bytes, length);
            }
        }
    }
}

TEST(EthercatFoe, Errors_carry_their_code_and_text) {
    FoeServed f;
    f.password = 5;
    f.request.kind = Kind::foe_read;
    EXPECT_EQ(f.run().outcome, Outcome::aborted);
    EXPECT_EQ(f.request.result.abort, 0x800aU);
    EXPECT_STREQ(f.progress.text.data(), "no");
    f.request.foe.password = 5;
    f.request.name = "other";
    EXPECT_EQ(f.run().abort, 0x8001U);
    f.request.name = "app.efw";
    f.file = pattern(6000);
    EXPECT_EQ(f.run().outcome, Outcome::refused) << "the buffer is too small";
    f.busy_every = 1;
    f.request.foe.busy_ms = 500;
    f.slave.on_request = [&](const MailboxMessage&) { f.send(foe::Opcode::busy, 0); };
    EXPECT_EQ(f.run().outcome, Outcome::timed_out) << "busy for ever";
}

TEST(EthercatSoe, Reads_and_writes_in_fragments) {
    EXPECT_EQ(parse_idn("P-0-150"), 0x8096);
    EXPECT_EQ(parse_idn("S-0-0024"), 0x0018);
    EXPECT_EQ(parse_idn("0x8096"), 0x8096);
    for (const char* wrong : {"", "P-", "S-8-1", "S-0-", "S-0-4096", "X-0-1", "70000", "12x"}) {
        EXPECT_FALSE(parse_idn(wrong)) << wrong;
    }
    EXPECT_STREQ(idn_text(0x8096).data(), "P-0-0150");
    for (const unsigned lose : {0U, 3U, 4U, 9U}) {
        Served f;
        f.slave.lose_every = lose;
        f.slave.double_every = lose;
        Bytes value;
        f.slave.on_request = [&](const MailboxMessage& m) {
            const auto h = *soe::read(m.payload);
            if (h.opcode == soe::Opcode::write) {
                value.insert(value.end(), m.payload.begin() + 4, m.payload.end());
                Bytes p(4);
                soe::write(p.data(),
                           {soe::Opcode::write_response, false, false, h.drive, h.elements, h.idn});
                if (!h.incomplete) {
                    f.slave.reply(MailboxType::soe, p);
                }
                return;
            }
            const std::size_t chunk = 54;
            for (std::size_t at = 0; at < value.size(); at += chunk) {
                const std::size_t left = (value.size() - at - 1) / chunk;
                Bytes p(4);
                soe::write(p.data(),
                           {soe::Opcode::read_response, left != 0, false, h.drive, h.elements,
                            left != 0 ? static_cast<std::uint16_t>(left) : h.idn});
                p.insert(p.end(), value.begin() + static_cast<long>(at),
                         value.begin() + static_cast<long>(std::min(value.size(), at + chunk)));
                f.slave.reply(MailboxType::soe, p);
            }
        };
        Bytes content = pattern(300);
        f.request.kind = Kind::soe_write;
        f.request.index = 0x8096;
        f.request.sub = 2;

        f.request.data = content;
        ASSERT_TRUE(f.run());
        ASSERT_EQ(value, content);
        f.request.kind = Kind::soe_read;
        f.request.data = f.buffer;
        ASSERT_TRUE(f.run());
        ASSERT_EQ(f.got(), content) << lose;
        f.slave.on_request = [&](const MailboxMessage&) {
            f.slave.reply(MailboxType::soe, {0x52, 0x40, 0x96, 0x80, 0x04, 0x70});
        };
        EXPECT_EQ(f.run().abort, 0x7004U);
    }
}

TEST(EthercatAoe, Reads_and_writes_an_object) {
    Served f(128);
    Bytes value{1, 2, 3, 4};
    f.slave.on_request = [&](const MailboxMessage& m) {
        const auto h = *aoe::read(m.payload);
        const std::uint8_t* data = m.payload.data() + aoe::header_bytes;
        Bytes answer(4);
        if (get<std::uint32_t>(data + 4) != aoe::sdo_offset(0x2000, 1)) {
            put<std::uint32_t>(answer.data(), 0x06020000);
        } else if (h.command == aoe::Command::write) {
            value.assign(data + 12, data + 12 + get<std::uint32_t>(data + 8));
        } else {
            answer.push_back(static_cast<std::uint8_t>(value.size()));
            answer.resize(8);

            answer.insert(answer.end(), value.begin(), value.end());
        }
        Bytes p(aoe::header_bytes);
        aoe::write(p.data(), aoe::response_to(h, static_cast<std::uint32_t>(answer.size())));
        p.insert(p.end(), answer.begin(), answer.end());
        f.slave.reply(MailboxType::aoe, p);
    };
    Bytes content{9, 8, 7};
    f.request.kind = Kind::aoe_write;
    f.request.group = aoe::group_sdo;

    f.request.offset = aoe::sdo_offset(0x2000, 1);
    f.request.data = content;
    ASSERT_TRUE(f.run());
    f.request.kind = Kind::aoe_read;
    f.request.data = f.buffer;
    ASSERT_TRUE(f.run());
    EXPECT_EQ(f.got(), content);
    f.request.offset = 0;
    EXPECT_EQ(f.run().abort, 0x06020000U);
}

TEST(EthercatEoe, Switch_learns_and_joins_frames_and_IP_settings_are_sent_whole) {
    Served f(128);
    const std::array<EoePort, 1> with_eoe{};
    EoeSwitch frames(f.mailboxes, with_eoe);
    f.server.set_switch(&frames);
    f.server.set_poll_interval(1'000'000);
    eoe::Joiner joiner;
    unsigned whole = 0;
    Bytes settings;
    f.slave.on_request = [&](const MailboxMessage& m) {
        const auto h = *eoe::read(m.payload);
        if (h.type == eoe::Type::set_ip) {
            settings.assign(m.payload.begin() + 4, m.payload.end());
            return f.slave.reply(MailboxType::eoe, {3, 1, 0, 0});
        }
        Bytes frame;
        if (const auto got = joiner.take(m.payload); !got.empty()) {
            frame.assign(got.begin(), got.end());
        }
        if (frame.empty()) return;
        ++whole;
        std::swap_ranges(frame.begin(), frame.begin() + 6, frame.begin() + 6);  // echo
        eoe::Splitter splitter(frame, whole, 128);
        Bytes p(200);
        for (std::size_t n = splitter.next(p.data()); n != 0; n = splitter.next(p.data())) {
            f.slave.reply(MailboxType::eoe, {p.begin(), p.begin() + static_cast<long>(n)});
        }
    };
    f.slave.lose_every = 5;
    for (const std::size_t length : {60U, 96U, 97U, 1514U}) {
        EthernetFrame frame;
        frame.length = static_cast<std::uint16_t>(length);
        for (std::size_t i = 0; i < length; ++i) {
            frame.bytes[i] = static_cast<std::uint8_t>(i * 2);
        }
        ASSERT_TRUE(frames.from_host().push(frame));
        for (unsigned i = 0; i < 2000 && frames.to_host().size() == 0; ++i) {
            frames.pump();
            f.server.step(f.slave.now_ns);
            f.slave.step(f.server.channel(0));
        }
        EthernetFrame back;
        ASSERT_TRUE(frames.to_host().pop(back)) << length;
        EXPECT_EQ(back.length, length);
        EXPECT_EQ(back.bytes[0], frame.bytes[6]);
        EXPECT_EQ(back.bytes[length - 1], frame.bytes[length - 1]);
    }
    f.request.kind = Kind::set_ip;
    f.request.ip.flags = eoe::ip_flag::address;
    f.request.ip.address = 0xc0a8020a;
    ASSERT_TRUE(f.run());
    ASSERT_EQ(settings.size(), 4U + 6 + 16);
    EXPECT_EQ(settings[10], 0x0a);
    EXPECT_EQ(settings[13], 0xc0);
}

TEST(EthercatEoe, Frames_that_waited_while_the_machine_was_stopped_are_discarded_and_counted) {
    for (const unsigned steps_before : {0U, 1U, 3U}) {  // a frame is being sent, or none
        Served f(128);
        const std::array<EoePort, 1> with_eoe{};
        EoeSwitch frames(f.mailboxes, with_eoe);
        f.server.set_switch(&frames);
        eoe::Joiner joiner;
        Bytes received;  // the first byte behind the addresses of each frame
        f.slave.on_request = [&](const MailboxMessage& m) {
            if (const auto got = joiner.take(m.payload); !got.empty()) {
                received.push_back(got[12]);
            }
        };
        const auto send = [&](std::uint8_t mark) {
            EthernetFrame frame;
            frame.length = 500;
            frame.bytes[6] = 2;  // another address than that of the destination
            frame.bytes[12] = mark;
            return frames.from_host().push(frame);
        };
        const auto step = [&](unsigned count) {
            for (unsigned i = 0; i < count; ++i) {
                frames.pump();
                f.server.step(f.slave.now_ns);
                f.slave.step(f.server.channel(0));
            }
        };
        for (std::uint8_t mark = 1; mark <= 4; ++mark) {
            ASSERT_TRUE(send(mark));
        }
        step(steps_before);
        frames.discard();
        ASSERT_TRUE(send(5));
        step(2000);
        const EoeCounters counters = frames.counters(f.slave.bus);
        ASSERT_FALSE(received.empty());
        EXPECT_EQ(received.back(), 5U);
        EXPECT_LE(received.size(), 2U) << "the one that was being sent, and the fresh one";
        EXPECT_EQ(counters.to_slave, received.size()) << steps_before;
        EXPECT_EQ(counters.lost, 5U - received.size());
        EXPECT_EQ(frames.lost(), counters.lost);
    }
}

TEST(EthercatEoe, Frames_stay_at_their_interface_and_reach_the_slave_that_was_learned) {
    Mailboxes mailboxes(4);
    // two slaves at one interface, one at another
    const std::array<EoePort, 3> ports{{{0, 0}, {1, 0}, {3, 1}}};
    EoeSwitch frames(mailboxes, ports);
    ASSERT_EQ(frames.hosts(), 2U);
    std::array<BusSlave, 4> slaves;
    for (int n = 0; n < 4; ++n) {
        slaves[static_cast<std::size_t>(n)].configured = n;

        slaves[static_cast<std::size_t>(n)].state = State::op;
    }
    const auto frame = [](std::uint8_t to, std::uint8_t from) {
        EthernetFrame f;
        f.length = 60;
        if (to == 0xff) {
            std::fill_n(f.bytes.begin(), 6, std::uint8_t{0xff});
        } else {
            f.bytes[0] = 2;
            f.bytes[5] = to;
        }
        f.bytes[6] = 2;
        f.bytes[11] = from;
        return f;
    };
    const auto sent_by = [&](std::size_t slave, const EthernetFrame& f) {
        eoe::Splitter splitter({f.bytes.data(), f.length}, 1, 256);
        Bytes p(256);
        const std::size_t length = splitter.next(p.data());
        EXPECT_TRUE(
            frames.take(slaves[slave], {.type = MailboxType::eoe, .payload = {p.data(), length}}));
    };
    const auto waiting = [&] {
        std::string text;
        for (std::size_t n = 0; n < 4; ++n) {
            text += frames.pending(slaves[n]) ? '1' : '0';
        }
        return text + " " + std::to_string(frames.to_host(0).size()) +
               std::to_string(frames.to_host(1).size());
    };
    ASSERT_TRUE(frames.from_host(0).push(frame(0xff, 100)));
    frames.pump();
    EXPECT_EQ(waiting(), "1100 00") << "a broadcast reaches all slaves of that interface";
    slaves[1].state = State::init;
    EXPECT_EQ(waiting(), "1000 00") << "not before its mailbox works";
    slaves[1].state = State::op;
    sent_by(3, frame(0xff, 3));
    EXPECT_EQ(waiting(), "1100 01");
    sent_by(1, frame(100, 1));
    EXPECT_EQ(waiting(), "1100 11") << "to the host, which was learned, only";
    sent_by(0, frame(1, 0));
    EXPECT_EQ(waiting(), "1100 11") << "from slave to slave";
    sent_by(3, frame(1, 3));
    EXPECT_EQ(waiting(), "1100 12")
        << "an address that was learned at another interface is unknown here";
    EXPECT_FALSE(frames.has(slaves[2]));
}

TEST(EthercatRequest, Unknown_slave_stopped_server_and_a_passed_message) {
    Served f;
    f.request.slave = 7;
    EXPECT_EQ(f.run().outcome, Outcome::lost);
    f.request.slave = 0;
    f.request.kind = Kind::message;
    f.slave.on_request = [&](const MailboxMessage& m) {
        f.slave.reply(m.type, {m.payload.begin(), m.payload.end()});
    };
    const Bytes message{4, 0, 0x01, 0x10, 0, 0x23, 0, 0x20, 7, 8};
    std::copy(message.begin(), message.end(), f.buffer.begin());
    f.request.length = message.size();
    ASSERT_TRUE(f.run());
    EXPECT_EQ(f.request.result.length, message.size());
    EXPECT_EQ(f.buffer[2], 0x01) << "the address is returned unchanged";
    EXPECT_EQ(f.buffer[8], 7);
    f.request.kind = Kind::sdo_upload;
    ASSERT_TRUE(f.port.submit(f.request));
    f.server.step(f.slave.now_ns);
    f.server.stop();
    EXPECT_TRUE(f.port.finished(f.request));
    EXPECT_EQ(f.request.result.outcome, Outcome::lost);
    EXPECT_FALSE(f.port.submit(f.request));
}

TEST(EthercatRequest, Random_messages_end_every_protocol) {
    std::mt19937 random(11);
    for (unsigned round = 0; round < 2000; ++round) {
        Served f(48);
        const std::array<EoePort, 1> with_eoe{};
        EoeSwitch frames(f.mailboxes, with_eoe);
        EmergencyQueue emergencies;
        emergencies.attach(f.mailboxes);
        f.slave.bus.timeouts.mailbox_response = 20;
        f.slave.on_request = [&](const MailboxMessage& m) {
            for (auto k = 1 + random() % 3; k != 0; --k) {
                Bytes p(m.payload.begin(),
                        m.payload.begin() + static_cast<long>(random() % (m.payload.size() + 1)));
                p.resize(std::min<std::size_t>(42, p.size() + random() % 20));
                for (auto& byte : p) {
                    if (random() % 3 == 0) {
                        byte = static_cast<std::uint8_t>(random());
                    }
                }
                f.slave.reply(random() % 8 == 0 ? static_cast<MailboxType>(random() % 16) : m.type,
                              p);
            }
            if (!f.slave.outbox.empty() && random() % 16 == 0) {
                f.slave.outbox.back()[random() % 6] = static_cast<std::uint8_t>(random());
            }
        };
        f.request.kind = static_cast<Kind>(random() % 15);
        f.request.data = std::span(f.buffer).first(random() % 100);
        f.request.length = f.request.data.size();
        f.request.name = "x";
        f.request.foe.timeout_ms = 20;
        f.request.foe.busy_ms = 200;
        f.run();
        f.slave.on_request = [](const MailboxMessage&) {};
        f.server.stop();
    }
}

}  // namespace
