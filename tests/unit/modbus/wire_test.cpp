// SPDX-License-Identifier: MIT
#include "modbus/wire/frame.hpp"

#include "modbus/master/value_codec.hpp"
#include "tests/unit/bytes_text.hpp"

namespace hal::modbus {
namespace {

using test::hex;

std::string rtu(std::uint8_t unit, const Pdu& pdu) {
    return hex(encode(Framing::rtu, unit, 0, pdu).span());
}

TEST(Wire, Requests_are_the_bytes_of_the_specification) {
    EXPECT_EQ(rtu(1, read_request(Function::read_holding, 0x2103, 1)), "01 03 21 03 00 01 7E 36");
    EXPECT_EQ(rtu(1, write_register_request(0x2000, 1)), "01 06 20 00 00 01 43 CA");
    EXPECT_EQ(rtu(0, write_register_request(0x2000, 1)), "00 06 20 00 00 01 42 1B");
    EXPECT_EQ(rtu(1, write_coil_request(0x4b, true)), "01 05 00 4B FF 00 FC 2C");
    const std::uint8_t bits[] = {0x3c, 0x04, 0, 0};
    EXPECT_EQ(rtu(1, write_coils_request(0, 32, bits)), "01 0F 00 00 00 20 04 3C 04 00 00 89 19");
    const std::uint8_t stop[] = {0x08};
    EXPECT_EQ(rtu(1, huanyang_request(3, stop)), "01 03 01 08 F1 8E");
    const std::uint8_t speed[] = {0x4e, 0x20};
    EXPECT_EQ(rtu(1, huanyang_request(5, speed)), "01 05 02 4E 20 8C B4");
    EXPECT_EQ(hex(encode(Framing::tcp, 1, 1, write_register_request(0x2000, 1)).span()),
              "00 01 00 00 00 06 01 06 20 00 00 01");
}

TEST(Wire, Exception_is_decoded_with_its_code) {
    const std::uint8_t frame[] = {0x01, 0x83, 0x02, 0xc0, 0xf1};
    Found found;
    ASSERT_EQ(scan(Framing::rtu, Role::answers, false, frame, found), Scan::valid);
    const Answer answer = decode(read_request(Function::read_holding, 0, 1), found.pdu, false);
    EXPECT_EQ(answer.verdict, Verdict::exception);
    EXPECT_STREQ(exception_name(answer.code), "illegal data address");
}

TEST(Wire, Changed_bit_is_corrupt_and_a_part_is_incomplete) {
    const Frame frame = encode(Framing::rtu, 1, 0, write_register_request(0x2000, 1));
    for (std::size_t n = 0; n < frame.size; ++n) {
        Found found;
        EXPECT_EQ(scan(Framing::rtu, Role::answers, false, frame.span().first(n), found),
                  Scan::incomplete);
        if (n == 1) continue;  // another function has another length
        Frame changed = frame;
        changed.bytes[n] = static_cast<std::uint8_t>(changed.bytes[n] ^ 0x10);
        EXPECT_EQ(scan(Framing::rtu, Role::answers, false, changed.span(), found), Scan::corrupt);
    }
}

TEST(Wire, Answer_of_another_request_is_foreign) {
    const Pdu request = read_request(Function::read_holding, 0, 2);
    const std::uint8_t one_register[] = {0x03, 2, 0, 7};
    EXPECT_EQ(decode(request, one_register, false).verdict, Verdict::foreign);
    const std::uint8_t other_function[] = {0x04, 4, 0, 7, 0, 8};
    EXPECT_EQ(decode(request, other_function, false).verdict, Verdict::foreign);
    const std::uint8_t other_value[] = {0x06, 0x20, 0, 0, 2};
    EXPECT_EQ(decode(write_register_request(0x2000, 1), other_value, false).verdict,
              Verdict::foreign);
}

TEST(Codec, Every_type_and_order_survives_both_ways) {
    for (const bus::ValueType type :
         {bus::ValueType::u16, bus::ValueType::s16, bus::ValueType::u32, bus::ValueType::s32,
          bus::ValueType::u64, bus::ValueType::s64, bus::ValueType::f32, bus::ValueType::f64}) {
        for (const Order order : {Order::abcd, Order::cdab, Order::badc, Order::dcba}) {
            Value v;
            v.table = Table::holding;
            v.type = type;
            v.order = order;
            const bool real = pin_form(v) == PinForm::real;
            const std::uint64_t cell = real ? std::bit_cast<std::uint64_t>(12.5) : 12345;
            Registers r;
            ASSERT_TRUE(encode_value(v, cell, r));
            EXPECT_EQ(r.count, v.size());
            EXPECT_EQ(decode_value(v, r, 0), cell) << bus::to_string(type);
        }
    }
}

TEST(Codec, Orders_are_those_of_their_names) {
    Value v;
    v.table = Table::holding;
    v.type = bus::ValueType::u32;
    const auto words = [&](Order order) {
        v.order = order;
        Registers r;
        encode_value(v, 0x11223344, r);
        return std::pair(r.words[0], r.words[1]);
    };
    EXPECT_EQ(words(Order::abcd), std::pair(std::uint16_t{0x1122}, std::uint16_t{0x3344}));
    EXPECT_EQ(words(Order::cdab), std::pair(std::uint16_t{0x3344}, std::uint16_t{0x1122}));
    EXPECT_EQ(words(Order::badc), std::pair(std::uint16_t{0x2211}, std::uint16_t{0x4433}));
    EXPECT_EQ(words(Order::dcba), std::pair(std::uint16_t{0x4433}, std::uint16_t{0x2211}));
}

TEST(Codec, Values_are_limited_and_not_finite_ones_rejected) {
    Value v;
    v.table = Table::holding;
    v.type = bus::ValueType::s16;
    v.scaled = true;
    v.scale = 0.1;
    Registers r;
    const auto encoded = [&](double value) {
        EXPECT_TRUE(encode_value(v, std::bit_cast<std::uint64_t>(value), r));
        return static_cast<std::int16_t>(r.words[0]);
    };
    EXPECT_EQ(encoded(1e9), 32767);
    EXPECT_EQ(encoded(-1e9), -32768);
    EXPECT_EQ(encoded(-12.34), -123);
    for (const double value : {std::nan(""), HUGE_VAL}) {
        EXPECT_FALSE(encode_value(v, std::bit_cast<std::uint64_t>(value), r));
    }

    v.type = bus::ValueType::f32;
    v.scaled = false;
    EXPECT_TRUE(encode_value(v, std::bit_cast<std::uint64_t>(-1e39), r));
    const double limit = std::numeric_limits<float>::max();
    EXPECT_EQ(decode_value(v, r, 0), std::bit_cast<std::uint64_t>(-limit));
}

}  // namespace
}  // namespace hal::modbus
