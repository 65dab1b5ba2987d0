// SPDX-License-Identifier: MIT
#include "bus/config/object_address.hpp"
#include "bus/config/value_types.hpp"
#include "bus/config/values.hpp"
#include "canopen/master/config/master_config.hpp"

namespace hal::bus {
namespace {

TEST(ObjectAddress, Index_is_hexadecimal_and_sub_index_is_decimal) {
    for (const char* text : {"6099:12", "0x6099:12", "0X6099:012", "0x6099:0xC", "6099:0x0c"}) {
        const auto address = parse_object_address(text);
        ASSERT_TRUE(address) << text;
        EXPECT_EQ(address->index, 0x6099) << text;
        EXPECT_EQ(address->sub, 12) << text;
        EXPECT_TRUE(address->has_sub) << text;
    }
    EXPECT_FALSE(parse_object_address("6099")->has_sub);
    EXPECT_EQ(parse_object_address("0x5")->index, 5);
    EXPECT_EQ(object_text(0x6099, 12), "0x6099:12");
    EXPECT_EQ(index_text(0x60), "0x0060");
}

TEST(ObjectAddress, Forms_of_earlier_versions_are_marked) {
    EXPECT_EQ(parse_object_address("6000:9")->form, SubForm::plain);
    EXPECT_EQ(parse_object_address("6000:09")->form, SubForm::plain);
    EXPECT_EQ(parse_object_address("6000:0x10")->form, SubForm::plain);
    EXPECT_EQ(parse_object_address("6000:10")->form, SubForm::two_digits);
    EXPECT_EQ(parse_object_address("6000:100")->form, SubForm::plain);
    EXPECT_EQ(parse_object_address("6000:1f")->form, SubForm::bare_hex);
    EXPECT_EQ(parse_object_address("6000:1f")->sub, 31);
}

TEST(ObjectAddress, Anything_else_is_rejected) {
    for (const char* text : {"", ":", "6099:", ":1", "609", "60990", "0x", "0x60990", "6099:256",
                             "6099:0x100", "6099:1:2", "6099:-1", "6099:1ff", "xyzt", "6099:g"}) {
        EXPECT_FALSE(parse_object_address(text)) << text;
    }
}

TEST(ValueType, Old_names_are_found_and_marked) {
    EXPECT_EQ(parse_value_type("s16").type, ValueType::s16);
    EXPECT_FALSE(parse_value_type("S16").is_old);
    EXPECT_EQ(parse_value_type("i16").type, ValueType::s16);
    EXPECT_TRUE(parse_value_type("i16").is_old);
    EXPECT_STREQ(parse_value_type("real64").name, "f64");
    EXPECT_EQ(parse_value_type("u17").name, nullptr);
    EXPECT_EQ(parse_esi_type("DWORD").type, ValueType::u32);
    EXPECT_EQ(parse_esi_type("s16").name, nullptr);
}

std::string messages(const canopen::config::ReadResult& reading) {
    std::string out;
    for (const auto& m : reading.messages) {
        out += text::message_text("m.canopen", m.severity, m.at, m.sentence, m.help) + "\n";
    }
    return out;
}

TEST(CanopenForms, Objects_need_no_prefix_and_old_types_are_reported) {
    const auto reading = canopen::config::read(
        "[bus]\nsync = cycle\n[node 1 a]\ndevice = cia402\nrpdo1 = 6040, 2000:10 i16\n"
        "tpdo1 = 0x6041, 0x2000:1F real32\nwrite 6099:0x1 = 5\nwrite 2001 bool = 1\n"
        "2000:10.scale = 2\n",
        "m.canopen");
    EXPECT_EQ(messages(reading),
              "m.canopen:5:23: warning: 'i16' is the old name of the type s16; later versions "
              "reject it; write s16\n"
              "m.canopen:6:17: warning: the sub-index of '0x2000:1F' is hexadecimal without 0x; "
              "later versions reject it; write 0x2000:31, or 0x2000:0x1F\n"
              "m.canopen:6:27: warning: 'real32' is the old name of the type f32; later versions "
              "reject it; write f32\n"
              "m.canopen:8:12: warning: 'bool' is the old name of the type bit; later versions "
              "reject it; write bit\n");
    const auto& received = reading.config.nodes[0].pdos[0].objects;
    ASSERT_EQ(received.size(), 2U);
    EXPECT_EQ(received[1].index, 0x2000);
    EXPECT_EQ(received[1].sub, 10);
    EXPECT_EQ(received[1].pin, "0x2000-10") << "the same pin as with 0x";
    EXPECT_EQ(received[1].scale, 2.0);
    EXPECT_EQ(reading.config.nodes[0].pdos[1].objects[1].sub, 31);
}

TEST(ConfigForms, Units_of_times_are_in_lower_case) {
    std::int64_t time = 7;
    const auto value = bus::time([&](int&) -> std::int64_t& { return time; }, 0, 1'000'000'000);
    int target = 0;
    Entry entry;
    entry.value.text = "1MS";
    EXPECT_FALSE(value.parse(target, entry));
    entry.value.text = "1ms";
    EXPECT_TRUE(value.parse(target, entry));
    EXPECT_EQ(time, 1'000'000);
    entry.value.text = "None";
    EXPECT_TRUE(value.or_none().parse(target, entry));
    EXPECT_EQ(time, 0);
}

}  // namespace
}  // namespace hal::bus
