// SPDX-License-Identifier: MIT
#include "hal/pin_codec.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace pin_codec_test {
namespace {

using hal::PinCodec;
using Format = PinCodec::Format;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

constexpr PinCodec u12{Format::unsigned_integer, 12};
constexpr PinCodec s12{Format::signed_integer, 12};
constexpr PinCodec u64{Format::unsigned_integer, 64};
constexpr PinCodec s64{Format::signed_integer, 64};
constexpr PinCodec f32{Format::real, 32};
constexpr PinCodec f64{Format::real, 64};

TEST(PinCodec, limits_integers_to_its_range) {
    EXPECT_EQ(u12.encode(4095U), 4095U);
    EXPECT_EQ(u12.encode(4096U), 4095U);
    EXPECT_EQ(u12.encode(std::int32_t{-1}), 0U);
    EXPECT_EQ(s12.encode(std::int32_t{2048}), 2047U);
    EXPECT_EQ(s12.encode(std::int32_t{-2049}), static_cast<std::uint64_t>(-2048));
    EXPECT_EQ(s12.encode(std::uint64_t{UINT64_MAX}), 2047U);
    EXPECT_EQ(s64.encode(std::int64_t{INT64_MIN}), std::uint64_t{1} << 63);
    EXPECT_EQ(s64.encode(std::uint64_t{UINT64_MAX}), std::uint64_t{INT64_MAX});
    EXPECT_EQ(u64.encode(std::uint64_t{UINT64_MAX}), UINT64_MAX);
    EXPECT_EQ(u12.encode(true), 1U);
}

TEST(PinCodec, rounds_and_limits_reals_to_an_integer_code) {
    EXPECT_EQ(u12.encode(1.5), 2U);
    EXPECT_EQ(u12.encode(2.5), 2U);  // to even
    EXPECT_EQ(u12.encode(-0.6), 0U);
    EXPECT_EQ(u12.encode(4095.6), 4095U);
    EXPECT_EQ(s12.encode(-2048.4), static_cast<std::uint64_t>(-2048));
    EXPECT_EQ(s12.encode(-infinity), static_cast<std::uint64_t>(-2048));
    EXPECT_EQ(s12.encode(infinity), 2047U);
    EXPECT_EQ(u64.encode(1e30), UINT64_MAX);
    EXPECT_EQ(u64.encode(std::nextafter(0x1p64, 0.0)), UINT64_MAX - 2047);
    EXPECT_EQ(s64.encode(1e30), std::uint64_t{INT64_MAX});
    EXPECT_EQ(s64.encode(-1e30), std::uint64_t{1} << 63);
    EXPECT_EQ(s64.encode(-3.0), static_cast<std::uint64_t>(-3));
}

TEST(PinCodec, decodes_what_it_encoded_and_ignores_bits_above) {
    EXPECT_EQ(s12.decode<std::int32_t>(0xFFF), -1);
    EXPECT_EQ(s12.decode<std::int32_t>(0xF7FF), 2047);
    EXPECT_EQ(s12.decode<std::int64_t>(0x800), -2048);
    EXPECT_EQ(u12.decode<std::uint32_t>(0xFFFF), 4095U);
    EXPECT_EQ(u12.decode<double>(0xFFF), 4095.0);
    EXPECT_EQ(s12.decode<double>(0xFFF), -1.0);
    EXPECT_EQ(u64.decode<double>(UINT64_MAX), 0x1p64);
    EXPECT_EQ(s64.decode<std::int64_t>(std::uint64_t{1} << 63), INT64_MIN);
    EXPECT_TRUE(u12.decode<bool>(0x800));
    EXPECT_FALSE(u12.decode<bool>(0x1000));
}

TEST(PinCodec, codes_reals_of_both_sizes) {
    EXPECT_EQ(f32.decode<double>(f32.encode(-1.5)), -1.5);
    EXPECT_EQ(f64.decode<double>(f64.encode(0.1)), 0.1);
    EXPECT_EQ(f32.decode<double>(f32.encode(1e300)), double{std::numeric_limits<float>::max()});
    EXPECT_EQ(f32.decode<double>(f32.encode(-infinity)), -infinity);
    EXPECT_TRUE(std::isnan(f32.decode<double>(f32.encode(nan))));
    EXPECT_EQ(f32.encode(std::int32_t{-2}), 0xC0000000U);
    EXPECT_EQ(f64.decode<std::int32_t>(f64.encode(3e9)), INT32_MAX);
    EXPECT_EQ(f64.decode<std::uint32_t>(f64.encode(-1.0)), 0U);
    EXPECT_EQ(f64.decode<std::uint64_t>(f64.encode(1e30)), UINT64_MAX);
    EXPECT_EQ(f64.decode<std::int64_t>(f64.encode(nan)), 0);
}

TEST(PinCodec, names_the_smallest_pin_type) {
    EXPECT_EQ((PinCodec{Format::unsigned_integer, 1}.pin_type()), HAL_TYPE_BIT);
    EXPECT_EQ(u12.pin_type(), HAL_TYPE_U32);
    EXPECT_EQ(s12.pin_type(), HAL_TYPE_S32);
    EXPECT_EQ((PinCodec{Format::unsigned_integer, 33}.pin_type()), HAL_TYPE_U64);
    EXPECT_EQ(s64.pin_type(), HAL_TYPE_S64);
    EXPECT_EQ(f32.pin_type(), HAL_TYPE_FLOAT);
}

TEST(Bits, are_read_and_written_at_any_offset) {
    for (unsigned bits = 1; bits <= 64; ++bits) {
        for (std::size_t at = 0; at < 16; ++at) {
            const std::uint64_t value = 0xA5C3'9671'F00D'1234U >> (64 - bits);
            std::array<std::uint8_t, 10> data;
            data.fill(0xFF);
            hal::write_bits(data, at, bits, value);
            EXPECT_EQ(hal::read_bits(data, at, bits), value) << bits << " bits at " << at;
            hal::write_bits(data, at, bits, ~std::uint64_t{0});
            for (const std::uint8_t byte : data) {
                EXPECT_EQ(byte, 0xFF) << bits << " bits at " << at;
            }
        }
    }
}

}  // namespace
}  // namespace pin_codec_test
