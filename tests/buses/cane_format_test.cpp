// SPDX-License-Identifier: MIT
// CAN in Ethernet frames: bytes worked out by hand, and hostile ones.
#include <gtest/gtest.h>

#include <random>

#include "can/cane/cane_format.hpp"
#include "cane_bench.hpp"

namespace hal::can::cane::test {
namespace {

/// A packed Ethernet frame from one station to all.
Bytes packed(std::initializer_list<Frame> messages, Stamp stamp = {}) {
    Bytes whole(ethernet::max_frame);
    std::fill_n(whole.begin(), 6, std::uint8_t{0xff});
    whole[6] = 2;
    whole[11] = 9;
    whole[12] = 0x90;
    whole[13] = 0x23;
    std::size_t at = ethernet::header_bytes + packed_header;
    for (const auto& f : messages) {
        at += put_packed(f, std::span(whole).subspan(at));
    }
    whole.resize(at);
    close_packed(whole, static_cast<std::uint8_t>(messages.size()), stamp);
    return whole;
}

TEST(CaneSingle, is_what_the_source_system_sends) {
    std::array<std::uint8_t, 64> buffer{};
    ASSERT_EQ(put_single(message(0x181, {1, 2, 3}), Order::big, buffer), 8U);
    EXPECT_EQ(Bytes(buffer.begin(), buffer.begin() + 8), (Bytes{0, 0, 1, 0x81, 3, 1, 2, 3}));
    ASSERT_EQ(put_single(message(0x181, {1, 2, 3}), Order::little, buffer), 8U);
    EXPECT_EQ(Bytes(buffer.begin(), buffer.begin() + 8), (Bytes{0x81, 1, 0, 0, 3, 1, 2, 3}));
    ASSERT_EQ(put_single(Frame::request(0x1abcdef0, 4), Order::big, buffer), 5U);
    EXPECT_EQ(Bytes(buffer.begin(), buffer.begin() + 5), (Bytes{0xda, 0xbc, 0xde, 0xf0, 4}));
    Frame back;
    EXPECT_EQ(get_single(std::span(buffer).first(46), Order::big, back), Wrong::none);
    EXPECT_TRUE(back.same(Frame::request(0x1abcdef0, 4)));
}

TEST(CaneSingle, refuses_what_is_no_message) {
    Frame f;
    const auto wrong = [&](Bytes payload) { return get_single(payload, Order::big, f); };
    EXPECT_EQ(wrong({0, 0, 1, 0x81}), Wrong::cut);
    EXPECT_EQ(wrong({0, 0, 1, 0x81, 8, 1, 2}), Wrong::cut);
    EXPECT_EQ(wrong({0, 0, 1, 0x81, 9, 1, 2, 3, 4, 5, 6, 7, 8, 9}), Wrong::form);
    EXPECT_EQ(wrong({0, 0, 8, 0, 0}), Wrong::form);        // 0x800 has no 11 bits
    EXPECT_EQ(wrong({0x20, 0, 1, 0x81, 0}), Wrong::form);  // an error frame
    const auto other = packed({message(0x80, {})});
    EXPECT_EQ(get_single(std::span(other).subspan(ethernet::header_bytes), Order::big, f),
              Wrong::version);
    EXPECT_EQ(get_single(std::span(other).subspan(ethernet::header_bytes), Order::little, f),
              Wrong::version);
}

TEST(CanePacked, is_as_its_description_says) {
    const auto whole =
        packed({message(0x080, {}), message(0x201, {0xaa, 0xbb}), Frame::request(0x1abcdef0, 3)},
               {0x1234, 0x5678});
    const Bytes payload(whole.begin() + 14, whole.end());
    const Bytes head{0xec, 1, 3, 0xec, 0x34, 0x12, 0x78, 0x56};
    EXPECT_EQ(Bytes(payload.begin(), payload.begin() + 8), head);
    EXPECT_EQ(Bytes(payload.begin() + 10, payload.end()),
              (Bytes{0x80, 0x00, 0x01, 0x22, 0xaa, 0xbb, 0x00, 0xf0, 0xf0, 0xde, 0xbc, 0xda, 3}));
    // the check value of CRC-16 with this polynomial and beginning
    const std::string known = "123456789";
    EXPECT_EQ(crc16({reinterpret_cast<const std::uint8_t*>(known.data()), known.size()}), 0x29b1);
    Unpacker u;
    ASSERT_EQ(u.open(whole), Wrong::none);
    EXPECT_EQ(u.stamp().session, 0x1234);
    EXPECT_EQ(u.stamp().sequence, 0x5678);
    Frame f;
    ASSERT_TRUE(u.next(f) && f.same(message(0x080, {})));
    ASSERT_TRUE(u.next(f) && f.same(message(0x201, {0xaa, 0xbb})));
    ASSERT_TRUE(u.next(f) && f.same(Frame::request(0x1abcdef0, 3)));
    EXPECT_FALSE(u.next(f));
}

TEST(CanePacked, takes_no_frame_with_a_byte_changed_or_cut_off) {
    const auto whole = packed(
        {message(0x080, {}), message(0x201, {1, 2, 3, 4, 5, 6, 7, 8}), message(0x601, {0x40})});
    Unpacker u;
    ASSERT_EQ(u.open(whole), Wrong::none);
    for (std::size_t at = 0; at < whole.size(); ++at) {
        for (unsigned change = 1; change < 256; ++change) {
            auto other = whole;
            other[at] = static_cast<std::uint8_t>(other[at] ^ change);
            if (at == 12 || at == 13) {
                continue;  // another Ethertype does not come here
            }
            EXPECT_NE(u.open(other), Wrong::none) << "byte " << at << " with " << change;
        }
        EXPECT_NE(u.open(std::span(whole).first(at)), Wrong::none) << "cut to " << at;
    }
    auto padded = whole;
    padded.resize(60);
    EXPECT_EQ(u.open(padded), Wrong::none);
}

TEST(CanePacked, survives_random_bytes_with_a_right_check_sequence) {
    std::mt19937 random(1);
    for (int n = 0; n < 20000; ++n) {
        Bytes whole(ethernet::header_bytes + packed_header + random() % 64);
        for (auto& b : whole) {
            b = static_cast<std::uint8_t>(random());
        }
        close_packed(whole, static_cast<std::uint8_t>(random() % 12), {});
        Unpacker u;
        if (u.open(whole) != Wrong::none) continue;
        Frame f;
        unsigned count = 0;
        for (; u.next(f); ++count) {
            EXPECT_TRUE(f.valid());
        }
        EXPECT_EQ(count, u.messages());
    }
}

}  // namespace
}  // namespace hal::can::cane::test
