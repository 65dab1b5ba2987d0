// SPDX-License-Identifier: MIT
// Frames byte by byte: the golden ones follow the layouts of the RTmac, TDMA and RTcfg documents.
#include <gtest/gtest.h>

#include "components/fieldbus/tdma/wire/rtcfg_frames.hpp"
#include "components/fieldbus/tdma/wire/tdma_frames.hpp"

namespace {

using namespace hal::tdma;

constexpr Address one{0x02, 0, 0, 0, 0, 1};
constexpr Address two{0x02, 0, 0, 0, 0, 2};

std::string hex(std::span<const std::uint8_t> bytes) {
    std::string text;
    for (const std::uint8_t b : bytes) {
        char two_digits[3];
        std::snprintf(two_digits, sizeof two_digits, "%02x", b);
        text += two_digits;
    }
    return text;
}
std::string padded(std::string text) {
    return text + std::string(120 - std::min<std::size_t>(text.size(), 120), '0');
}

TEST(Frame_of_sync, matches_the_specification) {
    const Frame f = encode(one, Sync{0x01020304, 0x1112131415161718, 0x2122232425262728});
    EXPECT_EQ(padded("ffffffffffff"
                     "020000000001"
                     "9021"
                     "0001"
                     "02"
                     "00"
                     "0201"
                     "0000"
                     "01020304"
                     "1112131415161718"
                     "2122232425262728"),
              hex(f));
    const Decoded d = decode(f);
    EXPECT_EQ(Kind::sync, d.kind);
    EXPECT_EQ(0x01020304U, d.sync.cycle);
    EXPECT_EQ(0x1112131415161718, d.sync.stamp);
    EXPECT_EQ(0x2122232425262728, d.sync.scheduled);
    EXPECT_EQ(one, d.from);
    EXPECT_EQ(0x11, f[sync_stamp_at]);
}

TEST(Frame_of_request, matches_the_specification) {
    const Frame f = encode(one, two, Request{0x1112131415161718, 0x01020304, 0x2122232425262728});
    EXPECT_EQ(padded("020000000001"
                     "020000000002"
                     "9021"
                     "0001"
                     "02"
                     "00"
                     "0201"
                     "0010"
                     "1112131415161718"
                     "01020304"
                     "2122232425262728"),
              hex(f));
    const Decoded d = decode(f);
    EXPECT_EQ(Kind::request, d.kind);
    EXPECT_EQ(0x1112131415161718, d.request.stamp);
    EXPECT_EQ(0x01020304U, d.request.reply_cycle);
    EXPECT_EQ(0x2122232425262728, d.request.reply_offset);
    EXPECT_EQ(0x11, f[request_stamp_at]);
}

TEST(Frame_of_reply, matches_the_specification) {
    const Frame f =
        encode(two, one, Reply{0x1112131415161718, 0x2122232425262728, 0x3132333435363738});
    EXPECT_EQ(padded("020000000002"
                     "020000000001"
                     "9021"
                     "0001"
                     "02"
                     "00"
                     "0201"
                     "0011"
                     "1112131415161718"
                     "2122232425262728"
                     "3132333435363738"),
              hex(f));
    const Decoded d = decode(f);
    EXPECT_EQ(Kind::reply, d.kind);
    EXPECT_EQ(0x1112131415161718, d.reply.request_stamp);
    EXPECT_EQ(0x2122232425262728, d.reply.received);
    EXPECT_EQ(0x3132333435363738, d.reply.stamp);
    EXPECT_EQ(0x31, f[reply_stamp_at]);
}

TEST(Frame_decoder, rejects_truncated_and_foreign_frames) {
    const Frame whole = encode(one, Sync{1, 2, 3});
    for (std::size_t length = 0; length < 42; ++length) {
        const Decoded d = decode(std::span(whole).first(length));
        EXPECT_EQ(Kind::none, d.kind) << length;
        EXPECT_EQ(Defect::cut, d.defect) << length;
    }
    EXPECT_EQ(Kind::sync, decode(std::span(whole).first(42)).kind);
    const auto changed = [&](std::size_t at, std::uint8_t value) {
        Frame f = whole;
        f[at] = value;
        return decode(f).defect;
    };
    EXPECT_EQ(Defect::ethertype, changed(13, 0x22));
    EXPECT_EQ(Defect::version, changed(16, 1));
    EXPECT_EQ(Defect::version, changed(18, 1));
    EXPECT_EQ(Defect::discipline, changed(15, 2));
    EXPECT_EQ(Defect::frame_id, changed(21, 0x12));
}

TEST(Frame_of_another_protocol, survives_the_tunnel) {
    std::vector<std::uint8_t> packet(98, 7);
    packet[12] = 0x08;
    packet[13] = 0x00;
    std::array<std::uint8_t, 200> inside{}, back{};
    const std::size_t length = tunnel(packet, inside);
    ASSERT_EQ(102U, length);
    EXPECT_EQ(
        "9021"
        "0800"
        "02"
        "01",
        hex(std::span(inside).subspan(12, 6)));
    ASSERT_EQ(98U, untunnel(std::span(inside).first(length), back));
    EXPECT_TRUE(std::equal(packet.begin(), packet.end(), back.begin()));
    EXPECT_EQ(0U, tunnel(packet, std::span(inside).first(101))) << "no space";
    EXPECT_EQ(0U, untunnel(encode(one, Sync{}), back));
}

using rtcfg::Id;

std::string encoded(const rtcfg::Message& m) {
    std::array<std::uint8_t, 1514> out{};
    return hex(std::span(out).first(rtcfg::encode(m, out)));
}

TEST(Frame_of_rtcfg, matches_the_specification) {
    const std::uint8_t data[] = {0xaa, 0xbb, 0xcc};
    rtcfg::Message m;
    m.to = two;
    m.from = one;
    const std::string head =
        "020000000002"
        "020000000001"
        "9022";
    m.id = Id::stage_1;
    m.burst = 4;
    m.data = data;
    EXPECT_EQ(padded(head + "00"
                            "00"
                            "04"
                            "0003"
                            "aabbcc"),
              encoded(m));
    m.client = {true, {10, 0, 0, 2}};
    m.server = {true, {10, 0, 0, 1}};
    EXPECT_EQ(padded(head + "00"
                            "01"
                            "0a000002"
                            "0a000001"
                            "04"
                            "0003"
                            "aabbcc"),
              encoded(m));
    m.id = Id::announce_new;
    m.flags = rtcfg::wants_stage_2;
    EXPECT_EQ(padded(head + "01"
                            "01"
                            "0a000002"
                            "01"
                            "04"),
              encoded(m));
    m.id = Id::announce_reply;
    EXPECT_EQ(padded(head + "02"
                            "01"
                            "0a000002"
                            "01"
                            "00"),
              encoded(m));
    m.id = Id::stage_2;
    m.flags = rtcfg::is_ready;
    m.active = 5;
    m.heartbeat_ms = 1000;

    m.length = 3;
    EXPECT_EQ(padded(head + "03"
                            "02"
                            "00000005"
                            "03e8"
                            "00000003"
                            "aabbcc"),
              encoded(m));
    m.id = Id::stage_2_fragment;
    m.offset = 0x100;
    EXPECT_EQ(padded(head + "04"
                            "00000100"
                            "aabbcc"),
              encoded(m));
    m.id = Id::acknowledge;
    EXPECT_EQ(padded(head + "05"
                            "00000003"),
              encoded(m));
    m.id = Id::ready;
    EXPECT_EQ(padded(head + "06"), encoded(m));
    m.id = Id::heartbeat;
    EXPECT_EQ(padded(head + "07"), encoded(m));
    m.id = Id::dead_station;
    m.client = {};
    m.dead = two;
    EXPECT_EQ(padded(head + "08"
                            "00"
                            "020000000002"),
              encoded(m));
}

TEST(Frame_of_rtcfg, survives_the_round_trip_and_is_rejected_when_truncated) {
    const std::uint8_t data[] = {1, 2, 3, 4, 5};
    for (unsigned id = 0; id < rtcfg::ids; ++id) {
        for (const bool by_ip : {false, true}) {
            rtcfg::Message m;
            m.id = static_cast<Id>(id);
            m.to = two;
            m.from = one;
            m.client = {by_ip, {10, 0, 0, 7}};

            m.flags = 3;
            m.burst = 4;
            m.active = 9;
            m.heartbeat_ms = 77;
            m.length = 5;
            m.offset = 88;
            m.dead = two;
            m.data = data;
            std::array<std::uint8_t, 1514> out{};
            const std::size_t length = rtcfg::encode(m, out);
            ASSERT_GE(length, 60U);
            rtcfg::Message back;
            ASSERT_TRUE(rtcfg::decode(std::span(out).first(length), back)) << id;
            EXPECT_EQ(m.id, back.id);
            EXPECT_EQ(m.from, back.from);
            if (m.id <= Id::announce_reply || m.id == Id::dead_station) {
                EXPECT_TRUE(!by_ip || back.client.ip[3] == 7);
            }
            if (m.id == Id::stage_1 || m.id == Id::stage_2) {
                EXPECT_EQ(5U, back.data.size());
            }
            if (m.id == Id::stage_2_fragment) {
                EXPECT_EQ(88U, back.offset);
            }
            if (m.id == Id::dead_station) {
                EXPECT_EQ(two, back.dead);
            }
            for (std::size_t cut = 0; cut < 15; ++cut) {
                EXPECT_FALSE(rtcfg::decode(std::span(out).first(cut), back));
            }
        }
    }
    std::array<std::uint8_t, 60> frame{};
    frame[12] = 0x90;
    frame[13] = 0x22;
    frame[14] = 0;
    frame[15] = 2;
    rtcfg::Message m;
    EXPECT_FALSE(rtcfg::decode(frame, m)) << "an address type that does not exist";
    frame[15] = 0;
    frame[17] = 0xff;
    EXPECT_FALSE(rtcfg::decode(frame, m)) << "more data than the frame has";
    frame[14] = 9;
    EXPECT_FALSE(rtcfg::decode(frame, m)) << "a frame that does not exist";
}

}  // namespace
