// SPDX-License-Identifier: MIT
// Types made of pins, byte by byte (XCDR1: DDSI-RTPS 2.3, 10.2), and what comes back out of bytes that anybody may have sent.
#include "dds/schema.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "dds/outbox.hpp"

namespace hal::dds {
namespace {

using Bytes = std::vector<std::uint8_t>;

template <class T>
void put(Schema& s, std::size_t field, T value) {
    std::memcpy(s.sample.data() + s.places[field].offset, &value, sizeof value);
}
std::string names(const Schema& s) {
    std::string all;
    for (const Field& f : s.fields) all += f.name + " ";
    return all;
}
std::string refusal(std::string_view fields) {
    try {
        Schema::of_fields(fields);
    } catch (const std::invalid_argument& e) { return e.what(); }
    return "accepted";
}
std::vector<hal_value> decoded(const Schema& s, const Bytes& bytes) {
    std::vector<hal_value> values(s.fields.size());
    EXPECT_TRUE(decode(s, bytes, values));
    return values;
}

TEST(Schema, fields_stand_aligned_behind_the_header) {
    const Schema s = Schema::of_fields("ready:bit,angle:float,count:s32,mode:bit,time:u64");
    ASSERT_EQ(5u, s.places.size());
    EXPECT_EQ(4u, s.places[0].offset);
    EXPECT_EQ(4u + 8, s.places[1].offset);
    EXPECT_EQ(4u + 16, s.places[2].offset);
    EXPECT_EQ(4u + 20, s.places[3].offset);
    EXPECT_EQ(4u + 24, s.places[4].offset);
    EXPECT_EQ(4u + 32, s.sample.size());
    EXPECT_EQ((Bytes{0, 1, 0, 0}), Bytes(s.sample.begin(), s.sample.begin() + 4));
}

TEST(Schema, values_come_out_as_they_went_in) {
    Schema s = Schema::of_fields("b:bit,f:float,i:s32,u:u32,l:s64,k:u64");
    put(s, 0, true);
    put(s, 1, -2.5);
    put(s, 2, std::int32_t{-7});
    put(s, 3, 0xfffffff0u);
    put(s, 4, std::int64_t{-1'000'000'000'000});
    put(s, 5, ~std::uint64_t{1});
    const auto v = decoded(s, s.sample);
    EXPECT_TRUE(v[0].bit);
    EXPECT_EQ(-2.5, v[1].real);
    EXPECT_EQ(-7, v[2].s32);
    EXPECT_EQ(0xfffffff0u, v[3].u32);
    EXPECT_EQ(-1'000'000'000'000, v[4].s64);
    EXPECT_EQ(~std::uint64_t{1}, v[5].u64);
}

TEST(Schema, other_byte_orders_and_the_second_representation_are_read) {
    const Schema s = Schema::of_fields("n:s32,f:float");
    const Bytes big{0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 0, 0x40, 0x04, 0, 0, 0, 0, 0, 0};  // 5, 2.5
    auto v = decoded(s, big);
    EXPECT_EQ(5, v[0].s32);
    EXPECT_EQ(2.5, v[1].real);
    const Bytes second{0, 7, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0x40};  // no gap before the double
    v = decoded(s, second);
    EXPECT_EQ(5, v[0].s32);
    EXPECT_EQ(2.5, v[1].real);
}

TEST(Schema, rows_and_safe_values_are_read) {
    const Schema s = Schema::of_fields("j:float*3=-1.5,ready:bit=1");
    EXPECT_EQ("j-0 j-1 j-2 ready ", names(s));
    EXPECT_EQ(-1.5, s.fields[2].safe->real);
    EXPECT_TRUE(s.fields[3].safe->bit);
    EXPECT_FALSE(Schema::of_fields("a:float").fields[0].safe.has_value());
}

TEST(Schema, groups_that_differ_have_types_that_differ) {
    const auto type = [](const char* fields) { return Schema::of_fields(fields).type; };
    EXPECT_EQ(type("a:float,b:bit"), type("a:float=3,b:bit=1"));
    EXPECT_NE(type("a:float,b:bit"), type("b:bit,a:float"));
    EXPECT_NE(type("a:float"), type("a:s64"));
    EXPECT_NE(type("a:float"), type("b:float"));
    EXPECT_EQ("mine::State", Schema::of_fields("a:float", "mine::State").type);
}

TEST(Schema, says_what_is_wrong_with_fields) {
    EXPECT_EQ("fields: 'angle' has no type; write NAME:TYPE, as in angle:float,ready:bit", refusal("angle"));
    EXPECT_EQ("fields: 'angle:real': unknown type 'real'; there are bit, float, s32, u32, s64, u64", refusal("angle:real"));
    EXPECT_EQ("fields: 'a:float*0': after * stands how many, 1 to 1024", refusal("a:float*0"));
    EXPECT_EQ("fields: 'a:float*5000': after * stands how many, 1 to 1024", refusal("a:float*5000"));
    EXPECT_EQ("fields: 'a:s32=1.5': '1.5' is not a s32", refusal("a:s32=1.5"));
    EXPECT_EQ("fields: there are two fields 'a'", refusal("a:float,b:bit,a:bit"));
    EXPECT_EQ("fields: 'a b:float': 'a b' cannot be a pin's name; letters, digits, - _ and . can", refusal("a b:float"));
    EXPECT_EQ("fields: '' has no type; write NAME:TYPE, as in angle:float,ready:bit", refusal("a:float,"));
    EXPECT_EQ("fields: more than 1024 fields; make two topics of them", refusal("a:bit*600,b:bit*600"));
}

TEST(Schema, ros_messages_have_the_names_and_pins_of_ros) {
    EXPECT_EQ("std_msgs::msg::dds_::Float64_", Schema::of_ros("std_msgs/Float64").type);
    EXPECT_EQ("rt/", Schema::of_ros("std_msgs/Bool").prefix);
    EXPECT_EQ("data ", names(Schema::of_ros("std_msgs/Int32")));
    EXPECT_EQ("linear-x linear-y linear-z angular-x angular-y angular-z ", names(Schema::of_ros("geometry_msgs/Twist")));
    EXPECT_EQ("force-x force-y force-z torque-x torque-y torque-z ", names(Schema::of_ros("geometry_msgs/WrenchStamped")));
    EXPECT_EQ("a-position b-position a-velocity b-velocity a-effort b-effort ",
              names(Schema::of_ros("sensor_msgs/JointState", {"a", "b"})));
    EXPECT_EQ("height width step ", names(Schema::of_ros("sensor_msgs/Image")));
}

TEST(Schema, says_what_is_wrong_with_a_message_of_ros) {
    const auto refused = [](const char* type, const std::vector<std::string>& joints) -> std::string {
        try {
            Schema::of_ros(type, joints);
        } catch (const std::invalid_argument& e) { return e.what(); }
        return "accepted";
    };
    EXPECT_EQ("ros=sensor_msgs/JointState needs the names of its joints: joints=shoulder,elbow", refused("sensor_msgs/JointState", {}));
    EXPECT_EQ("joints: there are two joints 'a'", refused("sensor_msgs/JointState", {"a", "b", "a"}));
    EXPECT_EQ("joints: 'a b': 'a b' cannot be a pin's name; letters, digits, - _ and . can", refused("sensor_msgs/JointState", {"a b"}));
    EXPECT_EQ("joints: more than 256 joints; make two topics of them",
              refused("sensor_msgs/JointState", std::vector<std::string>(257, "a")));
    EXPECT_EQ("ros=sensor_msgs/Imu: there are std_msgs/Float64 Bool Int32 UInt32 Int64 UInt64, geometry_msgs/Twist WrenchStamped, "
              "sensor_msgs/JointState Image; other types: fields= and type=, when they consist of plain numbers",
              refused("sensor_msgs/Imu", {}));
    std::vector<std::string> long_names;
    for (int i = 0; i < 256; ++i) long_names.push_back(std::to_string(i) + std::string(250, 'j'));
    EXPECT_EQ("ros=sensor_msgs/JointState: the message has more than 60000 bytes; shorten joints=, frame= or encoding=",
              refused("sensor_msgs/JointState", long_names));
}

TEST(Schema, joints_are_found_by_name) {
    Schema theirs = Schema::of_ros("sensor_msgs/JointState", {"elbow", "wrist", "shoulder"}, "base");
    for (std::size_t i = 0; i < 9; ++i) put(theirs, i, static_cast<double>(i + 1));
    const Schema ours = Schema::of_ros("sensor_msgs/JointState", {"shoulder", "elbow", "tool"});
    std::vector<hal_value> v(9);
    v[2].real = 77;  // the tool, which is not there
    ASSERT_TRUE(decode(ours, theirs.sample, v));
    EXPECT_EQ(3, v[0].real);
    EXPECT_EQ(1, v[1].real);
    EXPECT_EQ(77, v[2].real);
    EXPECT_EQ(6, v[3].real);
    EXPECT_EQ(9, v[6].real);
}

TEST(Schema, what_is_not_of_the_type_changes_nothing) {
    for (const Schema& s : {Schema::of_fields("a:float,b:bit"), Schema::of_ros("sensor_msgs/JointState", {"a", "b"}, "base"),
                            Schema::of_ros("sensor_msgs/Image", {}, "camera")}) {
        std::vector<hal_value> v(s.fields.size());
        for (hal_value& x : v) x.raw = 0x1234;
        Bytes bytes = s.sample;
        for (std::size_t i = s.places.back().offset + 1; i < bytes.size(); ++i) bytes[i] = 0xff;
        while (!bytes.empty()) {
            bytes.pop_back();
            ASSERT_FALSE(decode(s, bytes, v)) << bytes.size();
        }
        bytes = s.sample;
        bytes.resize(bytes.size() + 8);
        EXPECT_FALSE(decode(s, bytes, v)) << "more than the type has";
        bytes = s.sample;
        bytes[1] = 3;  // a parameter list
        EXPECT_FALSE(decode(s, bytes, v));
        for (const hal_value& x : v) EXPECT_EQ(0x1234u, x.raw);
    }
}

TEST(Outbox, hands_over_in_order_and_is_full_at_last) {
    const Schema s = Schema::of_fields("n:s32");
    Outbox box(s.sample, 4);
    std::int64_t time = 0;
    EXPECT_TRUE(box.front(time).empty());
    for (std::int32_t i = 0; i < 4; ++i) {
        std::uint8_t* to = box.begin();
        ASSERT_NE(nullptr, to);
        std::memcpy(to + s.places[0].offset, &i, sizeof i);
        box.commit(100 + i);
    }
    EXPECT_EQ(nullptr, box.begin());
    for (std::int32_t i = 0; i < 4; ++i) {
        const auto bytes = box.front(time);
        ASSERT_EQ(s.sample.size(), bytes.size());
        EXPECT_EQ(100 + i, time);
        EXPECT_EQ(i, decoded(s, Bytes(bytes.begin(), bytes.end()))[0].s32);
        box.take();
    }
    EXPECT_TRUE(box.front(time).empty());
    EXPECT_NE(nullptr, box.begin());
}

}  // namespace
}  // namespace hal::dds
