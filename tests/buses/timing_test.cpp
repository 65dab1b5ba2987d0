// SPDX-License-Identifier: MIT
#include "link/timing.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace hal::can {
namespace {

Frame fd(std::uint32_t id, std::vector<std::uint8_t> bytes, bool switched = true) {
    Frame f(id, bytes);
    f.fd = true;
    f.bit_rate_switch = switched;
    return f;
}

/// The frame spelled out as a text of bits, stuffed by a rule written a second time: slow, but
/// simple to check.
std::string spelled(const Frame& f) {
    std::string s = "0";
    const auto put = [&](std::uint32_t v, int width) {
        for (int i = width - 1; i >= 0; --i) {
            s += (v >> i & 1U) != 0 ? '1' : '0';
        }
    };
    if (f.extended) {
        put(f.id >> 18, 11);
        s += "11";
        put(f.id & 0x3ffff, 18);
        s += f.remote ? "1" : "0";

        s += "00";
    } else {
        put(f.id, 11);
        s += f.remote ? "1" : "0";
        s += "00";
    }
    put(f.length, 4);
    for (const auto b : f.bytes()) {
        put(b, 8);
    }
    // Division of the bits by x^15+x^14+x^10+x^8+x^7+x^4+x^3+1, by hand.
    std::string rest = s + std::string(15, '0');
    const std::string divisor = "1100010110011001";
    for (std::size_t i = 0; i + 15 < rest.size(); ++i) {
        if (rest[i] == '1') {
            for (std::size_t k = 0; k < 16; ++k) {
                rest[i + k] = rest[i + k] == divisor[k] ? '0' : '1';
            }
        }
    }
    s += rest.substr(rest.size() - 15);
    std::string out;
    for (const char c : s) {
        out += c;
        if (out.size() >= 5 &&
            out.substr(out.size() - 5).find_first_not_of(c) == std::string::npos) {
            // Five alike: but only those since the last stuff bit, which is itself one of them when
            // it is alike.
            out += c == '0' ? '1' : '0';
        }
    }
    return out;
}

TEST(Frame_bits, count_a_frame_without_any_stuffing_to_its_nominal_length) {
    // 0x555 with one byte 0x55: alternating bits, the only runs are in the CRC; so at least
    // 1+11+1+2+4+8+15+13 = 55
    const auto bits = frame_bits({0x555, {0x55}});
    EXPECT_GE(bits.nominal, 55U);
    EXPECT_LE(bits.nominal, worst_case_bits(1, false).nominal);
    EXPECT_EQ(bits.data, 0U);
}

TEST(Frame_bits, count_the_all_zero_frame_as_worked_out_by_hand) {
    // Identifier 0, no data: 19 zero bits have a CRC of zero: 34 zeros in a row. A stuff bit after
    // each five zeros (the stuff bit is a one, so the next run starts anew): 34 / 5 = 6 stuff bits.
    // 34 + 6 + 13 = 53.
    EXPECT_EQ(frame_bits(Frame(0, std::initializer_list<std::uint8_t>{})).nominal, 53U);
}

TEST(Frame_bits, agree_with_a_frame_spelled_out_for_ten_thousand_random_frames) {
    std::mt19937 random(1);
    for (int i = 0; i < 10000; ++i) {
        Frame f;
        f.extended = random() % 2 == 0;
        f.remote = random() % 8 == 0;
        f.id = static_cast<std::uint32_t>(random()) & (f.extended ? 0x1fffffff : 0x7ff);
        f.length = static_cast<std::uint8_t>(random() % 9);
        const auto kind = random() % 3;  // long runs are what matters
        for (auto& b : f.data) {
            b = static_cast<std::uint8_t>(kind == 0 ? 0 : kind == 1 ? 0xff : random());
        }
        ASSERT_EQ(frame_bits(f).nominal, spelled(f).size() + 13) << i;
        ASSERT_LE(frame_bits(f).nominal,
                  worst_case_bits(f.length, f.extended, false, false, f.remote).nominal);
    }
}

TEST(Worst_case_bits, are_those_of_the_textbook_formulas) {
    EXPECT_EQ(worst_case_bits(8, false).nominal, 135U);  // 47 + 64 + (34 + 64 - 1) / 4
    EXPECT_EQ(worst_case_bits(8, true).nominal, 160U);  // 67 + 64 + (54 + 64 - 1) / 4
    EXPECT_EQ(worst_case_bits(0, false).nominal, 55U);
    // a request carries no data
    EXPECT_EQ(worst_case_bits(8, false, false, false, true).nominal, 55U);
}

TEST(Frame_bits, of_fd_frames_follow_the_layout_of_the_standard) {
    // Standard identifier 0x555, no data, rate switch: start 1, id 11, RRS 1, IDE 1, FDF 1, res 1,
    // BRS 1 = 17 nominal, and acknowledge 1 + 1, end 7, intermission 3 = 12. No run of five: 0
    // 10101010101 0 0 1 0 1. Data phase: ESI 1, DLC 4 (00000: run of five zeros ends with the
    // fifth, where the fixed stuff bit takes over), stuff count 4, CRC 17, fixed stuff bits 6,
    // delimiter 1 = 33.
    const auto bits = frame_bits(fd(0x555, {}));
    EXPECT_EQ(bits.nominal, 29U);
    EXPECT_EQ(bits.data, 33U);
    EXPECT_EQ(frame_bits(fd(0x555, {}, false)).data, 0U);
    // BRS zero: the zeros from there on need a stuff bit
    EXPECT_EQ(frame_bits(fd(0x555, {}, false)).nominal, 63U);
    // 64 bytes 0x55: 12 more... CRC of 21 bits, 25 with the stuff count, 7 fixed stuff bits.
    const auto big = frame_bits(fd(0x555, std::vector<std::uint8_t>(64, 0x55)));
    EXPECT_EQ(big.data, 1U + 4 + 512 + 25 + 7 + 1 + 0);
}

TEST(Frame_bits, of_fd_frames_stay_below_the_worst_case) {
    std::mt19937 random(2);
    for (int i = 0; i < 5000; ++i) {
        Frame f;
        f.fd = true;
        f.bit_rate_switch = random() % 2 == 0;
        f.extended = random() % 2 == 0;
        f.id = static_cast<std::uint32_t>(random()) & (f.extended ? 0x1fffffff : 0x7ff);
        if (random() % 3 == 0) {
            f.id = 0;
        }
        f.length = length_of_code(static_cast<unsigned>(random() % 16));
        const auto kind = random() % 3;
        for (auto& b : f.data) {
            b = static_cast<std::uint8_t>(kind == 0 ? 0 : kind == 1 ? 0xff : random());
        }
        const auto max = worst_case_bits(f.length, f.extended, true, f.bit_rate_switch);
        const auto bits = frame_bits(f);
        ASSERT_LE(bits.nominal, max.nominal) << i;
        ASSERT_LE(bits.total(), max.total()) << i;
    }
}

TEST(Arbitration_rank, orders_as_the_bus_does) {
    const auto extended = [](std::uint32_t id) {
        Frame f;
        f.id = id;
        f.extended = true;
        return f;
    };
    const Frame data(0x100, {1});
    EXPECT_LT(arbitration_rank(Frame(0x0ff, {1})), arbitration_rank(data));
    EXPECT_LT(arbitration_rank(data), arbitration_rank(Frame::request(0x100, 1)));
    // same first eleven bits
    EXPECT_LT(arbitration_rank(Frame::request(0x100, 1)), arbitration_rank(extended(0x100U << 18)));
    EXPECT_LT(arbitration_rank(extended(0x100U << 18)),
              arbitration_rank(extended((0x100U << 18) + 1)));
    EXPECT_LT(arbitration_rank(extended((0x100U << 18) + 1)), arbitration_rank(Frame(0x101, {1})));
}

TEST(Duration_ns, adds_both_phases_and_rounds_up) {
    EXPECT_EQ(duration_ns({100, 0}, 1'000'000), 100'000);
    EXPECT_EQ(duration_ns({100, 50}, 500'000, 2'000'000), 200'000 + 25'000);
    EXPECT_EQ(duration_ns({1, 0}, 3), 333'333'334);
    EXPECT_EQ(duration_ns({100, 0}, 0), 0);
}

TEST(Frame, knows_what_a_controller_could_send) {
    EXPECT_TRUE(Frame(0x7ff, {1, 2, 3, 4, 5, 6, 7, 8}).valid());
    Frame f(0x123, {1});
    f.length = 9;
    EXPECT_FALSE(f.valid());
    f.length = 8;
    f.id = 0x800;
    EXPECT_FALSE(f.valid());
    f.extended = true;
    EXPECT_TRUE(f.valid());
    f.fd = true;
    f.length = 10;
    EXPECT_FALSE(f.valid());
    f.length = 12;
    EXPECT_TRUE(f.valid());
    f.remote = true;
    EXPECT_FALSE(f.valid());
    for (std::size_t n = 0; n <= 64; ++n) {
        EXPECT_GE(length_of_code(code_of_length(n)), n);
    }
}

}  // namespace
}  // namespace hal::can
