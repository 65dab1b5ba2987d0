// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "tests/unit/ethercat/mailbox_slave.hpp"

namespace {

using namespace hal::ethercat;
using namespace hal::ethercat::master;
using hal::Task;
using hal::ethercat::tests::Bytes;
using hal::ethercat::tests::MailboxSlave;

Bytes numbers(std::size_t count) {
    Bytes bytes(count);
    for (std::size_t i = 0; i < count; ++i) {
        bytes[i] = static_cast<std::uint8_t>(i * 7 + i / 256);
    }
    return bytes;
}

/// A CoE server with objects by index << 8 | sub, written from the standard's text alone.
struct CoeSlave : MailboxSlave {
    std::map<std::uint32_t, Bytes> objects;
    Bytes* target = nullptr;  // of the transfer under way
    std::size_t at = 0;
    std::size_t size = 0;
    std::uint8_t toggle = 0;
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    unsigned emergencies = 0;  // sent before each reply

    explicit CoeSlave(std::uint16_t bytes = 64) : MailboxSlave(bytes) {
        on_request = [this](const MailboxMessage& m) { serve(m); };
    }
    void answer(Bytes payload) {
        for (unsigned i = 0; i < emergencies; ++i) {
            reply(MailboxType::coe, {0x00, 0x10, 0x11, 0x86, 1, 1, 2, 3, 4, 5});
        }
        reply(MailboxType::coe, payload);
    }
    void abort(std::uint32_t code) {
        Bytes p(10);
        coe::write_sdo(p.data(), coe::Service::sdo_response, {0x80, index, sub, code});
        answer(p);
    }
    void serve(const MailboxMessage& m) {
        ASSERT_EQ(m.type, MailboxType::coe);
        ASSERT_GE(m.payload.size(), 3U);
        const std::uint8_t command = m.payload[2];
        const std::size_t capacity = bus.area().in_size - 6U;
        Bytes p(10);
        if (coe::service_of(m.payload.data()) == coe::Service::sdo_information) {
            return information(m);
        }
        switch (command >> 5) {
        case 1:
        case 2: {
            const auto request = *coe::read_sdo(m.payload);
            index = request.index;
            sub = request.sub;
            const auto found = objects.find(index << 8U | sub);
            if (found == objects.end()) return abort(0x06020000);
            target = &found->second;
            toggle = 0;
            if (command >> 5 == 2) {
                size = target->size();
                if (size <= 4 && size != 0) {
                    std::uint32_t value = 0;
                    std::memcpy(&value, target->data(), size);
                    coe::write_sdo(
                        p.data(), coe::Service::sdo_response,
                        {static_cast<std::uint8_t>(0x43 | (4 - size) << 2), index, sub, value});
                    return answer(p);
                }
                at = std::min(size, capacity - 10);
                coe::write_sdo(p.data(), coe::Service::sdo_response,
                               {0x41, index, sub, static_cast<std::uint32_t>(size)});
                p.insert(p.end(), target->begin(), target->begin() + static_cast<long>(at));
                return answer(p);
            }
            target->clear();
            size = request.value;
            if (request.expedited()) {
                size = request.expedited_bytes();
                target->assign(m.payload.begin() + 6,
                               m.payload.begin() + 6 + static_cast<long>(size));
            } else {
                target->assign(m.payload.begin() + 10, m.payload.end());
            }
            coe::write_sdo(p.data(), coe::Service::sdo_response, {0x60, index, sub, 0});
            return answer(p);
        }
        case 3: {
            if ((command & 0x10) != toggle) return abort(0x05030000);
            const std::size_t count = std::min(size - at, capacity - 3);
            p.resize(3);
            p[0] = 0;
            p[1] = 0x30;
            p[2] = static_cast<std::uint8_t>(toggle | (count < 7 ? (7 - count) << 1 : 0) |
                                             (at + count == size ? 1 : 0));
            p.insert(p.end(), target->begin() + static_cast<long>(at),
                     target->begin() + static_cast<long>(at + count));
            if (p.size() < 10) {
                p.resize(10);
            }
            at += count;
            toggle ^= 0x10;
            return answer(p);
        }
        case 0: {
            if ((command & 0x10) != toggle) return abort(0x05030000);
            const auto data = coe::segment_of(m.payload);
            target->insert(target->end(), data.begin(), data.end());
            p.assign({0, 0x30, static_cast<std::uint8_t>(0x20 | toggle), 0, 0, 0, 0, 0, 0, 0});
            toggle ^= 0x10;
            return answer(p);
        }
        default: return;
        }
    }
    void information(const MailboxMessage& m) {
        const std::size_t capacity = bus.area().in_size - 6U;
        Bytes data;
        if (m.payload[2] == 1) {
            data = {m.payload[6], m.payload[7]};
            for (const auto& [key, value] : objects) {
                data.push_back(static_cast<std::uint8_t>(key >> 8));

                data.push_back(static_cast<std::uint8_t>(key >> 16));
            }
        } else if (m.payload[2] == 3) {
            data = {m.payload[6], m.payload[7], 7, 0, 3, 9};
            for (const char c :
                 std::string("A name longer than one mailbox of 64 bytes can hold in one go")) {
                data.push_back(static_cast<std::uint8_t>(c));
            }
        } else {
            data = {m.payload[6], m.payload[7], m.payload[8], 0, 5, 0, 8, 0, 0x3f, 0, 'V'};
        }
        const std::size_t chunk = (capacity - 6) / 2 * 2;
        const std::size_t fragments = (data.size() + chunk - 1) / chunk;
        for (std::size_t i = 0; i < fragments; ++i) {
            Bytes p(6);
            coe::write_information(
                p.data(), {static_cast<coe::Information>(m.payload[2] + 1), i + 1 < fragments,
                           static_cast<std::uint16_t>(fragments - 1 - i)});
            p.insert(p.end(), data.begin() + static_cast<long>(i * chunk),
                     data.begin() + static_cast<long>(std::min(data.size(), (i + 1) * chunk)));
            answer(p);
        }
    }
};

struct Fixture {
    CoeSlave slave;
    Mailboxes mailboxes{1};
    CoeClient client{mailboxes};
    ObjectInformation objects{mailboxes};
    EmergencyQueue emergencies;
    SdoResult result;
    Bytes buffer = Bytes(4096);

    explicit Fixture(std::uint16_t size = 64) : slave(size) { emergencies.attach(mailboxes); }
    Task<> reading(Channel& channel, std::uint16_t index, std::uint8_t sub, bool complete) {
        result = co_await client.upload(channel, slave.bus, index, sub, complete, buffer);
    }
    Task<> writing(Channel& channel, std::uint16_t index, std::uint8_t sub, bool complete,
                   const Bytes& from) {
        result = co_await client.download(channel, slave.bus, index, sub, complete, from);
    }
    SdoResult upload(std::uint16_t index, std::uint8_t sub = 0, bool complete = false) {
        slave.channel.start([&] { return reading(slave.channel, index, sub, complete); });
        EXPECT_TRUE(slave.run()) << "does not end";
        return result;
    }
    SdoResult download(std::uint16_t index, const Bytes& from, bool complete = false) {
        slave.channel.start([&] { return writing(slave.channel, index, 0, complete, from); });
        EXPECT_TRUE(slave.run()) << "does not end";
        return result;
    }
    Bytes got() const {
        return {buffer.begin(), buffer.begin() + static_cast<long>(result.length)};
    }
};

TEST(EthercatCoe, Uploads_and_downloads_every_length) {
    for (const std::uint16_t size : {std::uint16_t{24}, std::uint16_t{64}, std::uint16_t{1486}}) {
        Fixture f(size);
        for (std::size_t length = 1; length < 300; length += length < 20 ? 1 : 13) {
            f.slave.objects[0x200000] = {};
            ASSERT_TRUE(f.download(0x2000, numbers(length)))
                << size << " " << length << " abort " << std::hex << f.result.abort;
            ASSERT_EQ(f.slave.objects[0x200000], numbers(length));
            ASSERT_TRUE(f.upload(0x2000)) << size << " " << length;
            ASSERT_EQ(f.got(), numbers(length));
        }
        EXPECT_EQ(f.mailboxes.at(0).counters().dropped, 0U);
    }
}

TEST(EthercatCoe, Complete_access_is_never_expedited) {
    Fixture f;
    f.slave.objects[0x160000] = {};
    ASSERT_TRUE(f.download(0x1600, {1, 0, 5}, true));
    EXPECT_EQ(f.slave.objects[0x160000], (Bytes{1, 0, 5}));
    ASSERT_TRUE(f.upload(0x1600, 0, true));
    EXPECT_EQ(f.got(), (Bytes{1, 0, 5}));
}

TEST(EthercatCoe, Abort_timeout_absence_and_a_small_buffer_are_told_apart) {
    Fixture f;
    f.upload(0x3000);
    EXPECT_EQ(f.result.outcome, SdoResult::Outcome::aborted);
    EXPECT_EQ(f.result.abort, 0x06020000U);
    f.slave.objects[0x200000] = numbers(300);
    f.buffer.resize(100);
    f.upload(0x2000);
    EXPECT_EQ(f.result.outcome, SdoResult::Outcome::refused);
    EXPECT_EQ(f.result.length, 300U);
    f.slave.on_request = [](const MailboxMessage&) {};
    f.upload(0x2000);
    EXPECT_EQ(f.result.outcome, SdoResult::Outcome::timed_out);
    f.slave.on_request = [&](const MailboxMessage&) {
        f.slave.reply(MailboxType::error, {1, 0, 2, 0});
    };
    f.upload(0x2000);
    EXPECT_EQ(f.result.outcome, SdoResult::Outcome::refused);
    EXPECT_EQ(f.result.abort, 2U);
    f.slave.takes = false;  // the first message stays in the mailbox
    f.upload(0x2000);
    EXPECT_EQ(f.result.outcome, SdoResult::Outcome::timed_out);
    f.upload(0x2000);
    EXPECT_EQ(f.result.outcome, SdoResult::Outcome::timed_out);
    f.slave.present = false;
    f.upload(0x2000);
    EXPECT_EQ(f.result.outcome, SdoResult::Outcome::lost);
    f.slave.present = true;
    f.slave.lose_every = 1;
    f.upload(0x2000);
    EXPECT_EQ(f.result.outcome, SdoResult::Outcome::lost);
    f.slave.bus.mailbox = {};
    f.upload(0x2000);
    EXPECT_EQ(f.result.outcome, SdoResult::Outcome::refused);
}

TEST(EthercatCoe, Every_nth_datagram_lost_and_every_nth_reply_doubled_change_no_value) {
    for (unsigned lose = 3; lose < 17; ++lose) {
        for (unsigned twice = 0; twice < 4; ++twice) {
            Fixture f(40);
            f.slave.lose_every = lose;
            f.slave.double_every = twice;
            f.slave.emergencies = lose % 3;
            for (std::size_t length : {3U, 20U, 200U, 451U}) {
                f.slave.objects[0x200000] = {};
                ASSERT_TRUE(f.download(0x2000, numbers(length)))
                    << lose << " " << twice << " " << length << " outcome " << int(f.result.outcome)
                    << std::hex << " " << f.result.abort;
                ASSERT_EQ(f.slave.objects[0x200000], numbers(length)) << lose << " " << twice;
                ASSERT_TRUE(f.upload(0x2000)) << lose << " " << twice << " " << length
                                              << " outcome " << int(f.result.outcome);
                ASSERT_EQ(f.got(), numbers(length)) << lose << " " << twice;
            }
        }
    }
}

TEST(EthercatCoe, Emergencies_arrive_once_and_in_front_of_replies) {
    Fixture f;
    f.slave.objects[0x200000] = numbers(4);
    f.slave.emergencies = 2;
    ASSERT_TRUE(f.upload(0x2000));
    EmergencyEvent event;
    for (int i = 0; i < 2; ++i) {
        ASSERT_TRUE(f.emergencies.pop(event));
        EXPECT_EQ(event.emergency.code, 0x8611);
        EXPECT_EQ(event.emergency.data[4], 5);
    }
    EXPECT_FALSE(f.emergencies.pop(event));
}

TEST(EthercatCoe, Late_reply_of_an_earlier_request_is_dropped) {
    Fixture f;
    f.slave.objects[0x200000] = {1, 2, 3, 4};
    f.slave.objects[0x200100] = {5, 6, 7, 8};
    auto serve = f.slave.on_request;
    Bytes held;
    f.slave.on_request = [&](const MailboxMessage& m) {
        held.assign(m.payload.begin(), m.payload.end());
    };
    EXPECT_EQ(f.upload(0x2000).outcome, SdoResult::Outcome::timed_out);
    f.slave.on_request = [&](const MailboxMessage& m) {
        serve({0, 0, 0, MailboxType::coe, 0, held});
        serve(m);
    };
    ASSERT_TRUE(f.upload(0x2001));
    EXPECT_EQ(f.got(), (Bytes{5, 6, 7, 8}));
    EXPECT_EQ(f.mailboxes.at(0).counters().dropped, 1U);
}

TEST(EthercatCoe, Full_flag_of_the_process_image_replaces_polling) {
    Fixture f;
    f.slave.objects[0x200000] = numbers(200);
    std::uint8_t status = 8;  // stale at times
    f.slave.bus.mailbox_status = &status;
    ASSERT_TRUE(f.upload(0x2000));
    EXPECT_EQ(f.got(), numbers(200));
}

TEST(EthercatCoe, Information_is_joined_from_fragments) {
    for (const unsigned lose : {0U, 5U, 4U, 3U}) {
        Fixture f;
        f.slave.lose_every = lose;
        f.slave.double_every = lose / 2;
        for (unsigned i = 0; i < 100; ++i) {
            f.slave.objects[(0x2000 + i) << 8] = {};
        }
        ObjectDescription object;
        EntryDescription entry;
        std::array<char, 100> name{};
        struct Run {
            static Task<> all(Channel& channel, Fixture& f, ObjectDescription& object,
                              EntryDescription& entry, std::array<char, 100>& name,
                              std::array<MailboxResult, 3>& results) {
                results[0] =
                    co_await f.objects.list(channel, f.slave.bus, coe::List::all, f.buffer);
                results[1] = co_await f.objects.object(channel, f.slave.bus, 0x2005, object, name);
                results[2] = co_await f.objects.entry(channel, f.slave.bus, 0x2005, 1, entry,
                                                      std::span<char>(name).subspan(80));
            }
        };
        std::array<MailboxResult, 3> results;
        f.slave.channel.start(
            [&] { return Run::all(f.slave.channel, f, object, entry, name, results); });
        ASSERT_TRUE(f.slave.run());
        ASSERT_TRUE(results[0]) << lose;
        ASSERT_EQ(results[0].length, 200U);
        for (unsigned i = 0; i < 100; ++i) {
            EXPECT_EQ(get<std::uint16_t>(f.buffer.data() + 2 * i), 0x2000 + i);
        }
        ASSERT_TRUE(results[1]) << lose;
        EXPECT_EQ(std::string(name.data(), object.name_length),
                  "A name longer than one mailbox of 64 bytes can hold in one go");
        EXPECT_EQ(object.max_sub, 3);
        ASSERT_TRUE(results[2]) << lose;
        EXPECT_EQ(entry.bits, 8);
        EXPECT_EQ(name[80], 'V');
    }
}

TEST(EthercatCoe, Random_replies_end_every_operation) {
    std::mt19937 random(7);
    for (unsigned round = 0; round < 3000; ++round) {
        Fixture f(32);
        f.slave.bus.timeouts.mailbox_response = 20;
        f.slave.objects[0x200000] = numbers(60);
        auto serve = f.slave.on_request;
        f.slave.on_request = [&](const MailboxMessage& m) {
            serve(m);
            if (f.slave.outbox.empty()) return;
            Bytes& last = f.slave.outbox.back();
            for (unsigned k = random() % 4; k != 0; --k) {
                last[random() % last.size()] = static_cast<std::uint8_t>(random());
            }
        };
        if (round % 2 == 0) {
            f.upload(0x2000);
        } else {
            f.download(0x2000, numbers(60));
        }
    }
}

}  // namespace
