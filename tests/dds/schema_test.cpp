// SPDX-License-Identifier: MIT
// Types made of pins, byte by byte (XCDR1: DDSI-RTPS 2.3, 10.2), and decoding of untrusted bytes.
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
    for (const Field& f : s.fields) {
        all += f.name + " ";
    }
    return all;
}
std::string rejection(std::string_view fields) {
    try {
        Schema::of_fields(fields);
    } catch (const std::invalid_argument& e) {
        return e.what();
    }
    return "accepted";
}
std::vector<hal_value> decoded(const Schema& s, const Bytes& bytes) {
    std::vector<hal_value> values(s.fields.size());
    EXPECT_TRUE(decode(s, bytes, values));
    return values;
}

TEST(Schema, of_fields_aligns_each_field_after_the_header) {
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

TEST(Schema, decode_returns_the_encoded_values_of_every_type) {
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

TEST(Schema, decode_accepts_big_endian_and_XCDR2) {
    const Schema s = Schema::of_fields("n:s32,f:float");
    const Bytes big{0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 0, 0x40, 0x04, 0, 0, 0, 0, 0, 0};  // 5, 2.5
    auto v = decoded(s, big);
    EXPECT_EQ(5, v[0].s32);
    EXPECT_EQ(2.5, v[1].real);
    // no gap before the double
    const Bytes second{0, 7, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0x40};
    v = decoded(s, second);
    EXPECT_EQ(5, v[0].s32);
    EXPECT_EQ(2.5, v[1].real);
}

TEST(Schema, of_fields_expands_counts_and_parses_safe_values) {
    const Schema s = Schema::of_fields("j:float*3=-1.5,ready:bit=1");
    EXPECT_EQ("j-0 j-1 j-2 ready ", names(s));
    EXPECT_EQ(-1.5, s.fields[2].safe->real);
    EXPECT_TRUE(s.fields[3].safe->bit);
    EXPECT_FALSE(Schema::of_fields("a:float").fields[0].safe.has_value());
}

TEST(Schema, of_fields_derives_different_type_names_from_different_fields) {
    const auto type = [](const char* fields) { return Schema::of_fields(fields).type; };
    EXPECT_EQ(type("a:float,b:bit"), type("a:float=3,b:bit=1"));
    EXPECT_NE(type("a:float,b:bit"), type("b:bit,a:float"));
    EXPECT_NE(type("a:float"), type("a:s64"));
    EXPECT_NE(type("a:float"), type("b:float"));
    EXPECT_EQ("mine::State", Schema::of_fields("a:float", "mine::State").type);
}

TEST(Schema, of_fields_rejects_invalid_fields_with_the_reason) {
    EXPECT_EQ("fields: 'angle' has no type; write NAME:TYPE, as in angle:float,ready:bit",
              rejection("angle"));
    EXPECT_EQ("fields: 'angle:real': unknown type 'real'; types are bit, float, s32, u32, s64, u64",
              rejection("angle:real"));
    EXPECT_EQ("fields: 'a:float*0': invalid count after *; write 1..1024", rejection("a:float*0"));
    EXPECT_EQ("fields: 'a:float*5000': invalid count after *; write 1..1024",
              rejection("a:float*5000"));
    EXPECT_EQ("fields: 'a:s32=1.5': '1.5' is not a s32", rejection("a:s32=1.5"));
    EXPECT_EQ("fields: duplicate field 'a'", rejection("a:float,b:bit,a:bit"));
    EXPECT_EQ("fields: 'a b:float': 'a b' is not a valid pin name; use letters, digits, - _ and .",
              rejection("a b:float"));
    EXPECT_EQ("fields: '' has no type; write NAME:TYPE, as in angle:float,ready:bit",
              rejection("a:float,"));
    EXPECT_EQ("fields: more than 1024 fields; split them into two topics",
              rejection("a:bit*600,b:bit*600"));
}

TEST(Schema, of_ros_uses_the_names_and_fields_of_the_message) {
    EXPECT_EQ("std_msgs::msg::dds_::Float64_", Schema::of_ros("std_msgs/Float64").type);
    EXPECT_EQ("rt/", Schema::of_ros("std_msgs/Bool").prefix);
    EXPECT_EQ("data ", names(Schema::of_ros("std_msgs/Int32")));
    EXPECT_EQ("linear-x linear-y linear-z angular-x angular-y angular-z ",
              names(Schema::of_ros("geometry_msgs/Twist")));
    EXPECT_EQ("force-x force-y force-z torque-x torque-y torque-z ",
              names(Schema::of_ros("geometry_msgs/WrenchStamped")));
    EXPECT_EQ("a-position b-position a-velocity b-velocity a-effort b-effort ",
              names(Schema::of_ros("sensor_msgs/JointState", {"a", "b"})));
    EXPECT_EQ("height width step ", names(Schema::of_ros("sensor_msgs/Image")));
}

TEST(Schema, of_ros_accepts_the_spelling_of_the_ros2_command) {
    for (const char* const type : {"geometry_msgs/msg/Twist", "geometry_msgs/Twist"}) {
        const Schema twist = Schema::of_ros(type);
        EXPECT_EQ("geometry_msgs/Twist", twist.ros);
        EXPECT_EQ("geometry_msgs::msg::dds_::Twist_", twist.type);
    }
    EXPECT_EQ("data ", names(Schema::of_ros("std_msgs/msg/Float64")));
}

TEST(Schema, of_ros_rejects_invalid_messages_with_the_reason) {
    const auto rejection = [](const char* type,
                              const std::vector<std::string>& joints) -> std::string {
        try {
            Schema::of_ros(type, joints);
        } catch (const std::invalid_argument& e) {
            return e.what();
        }
        return "accepted";
    };
    EXPECT_EQ("ros=sensor_msgs/JointState: missing joint names; write joints=shoulder,elbow",
              rejection("sensor_msgs/JointState", {}));
    EXPECT_EQ("joints: duplicate joint 'a'", rejection("sensor_msgs/JointState", {"a", "b", "a"}));
    EXPECT_EQ("joints: 'a b': 'a b' is not a valid pin name; use letters, digits, - _ and .",
              rejection("sensor_msgs/JointState", {"a b"}));
    EXPECT_EQ("joints: more than 256 joints; split them into two topics",
              rejection("sensor_msgs/JointState", std::vector<std::string>(257, "a")));
    EXPECT_EQ(
        "ros=sensor_msgs/Imu: unsupported message type; supported are std_msgs/Float64 Bool Int32 "
        "UInt32 Int64 UInt64, "
        "geometry_msgs/Twist WrenchStamped, sensor_msgs/JointState Image; other types that consist "
        "of plain numbers: fields= and type=",
        rejection("sensor_msgs/Imu", {}));
    std::vector<std::string> long_names;
    for (int i = 0; i < 256; ++i) {
        long_names.push_back(std::to_string(i) + std::string(250, 'j'));
    }
    EXPECT_EQ(
        "ros=sensor_msgs/JointState: the message exceeds 60000 bytes; shorten joints=, frame= or "
        "encoding=",
        rejection("sensor_msgs/JointState", long_names));
}

TEST(Schema, decode_matches_joints_by_name) {
    Schema theirs =
        Schema::of_ros("sensor_msgs/JointState", {"elbow", "wrist", "shoulder"}, "base");
    for (std::size_t i = 0; i < 9; ++i) {
        put(theirs, i, static_cast<double>(i + 1));
    }
    const Schema ours = Schema::of_ros("sensor_msgs/JointState", {"shoulder", "elbow", "tool"});
    std::vector<hal_value> v(9);
    v[2].real = 77;  // the tool, a joint that the sample does not contain
    ASSERT_TRUE(decode(ours, theirs.sample, v));
    EXPECT_EQ(3, v[0].real);
    EXPECT_EQ(1, v[1].real);
    EXPECT_EQ(77, v[2].real);
    EXPECT_EQ(6, v[3].real);
    EXPECT_EQ(9, v[6].real);
}

TEST(Schema, decode_leaves_the_values_unchanged_for_a_sample_of_another_type) {
    for (const Schema& s : {Schema::of_fields("a:float,b:bit"),
                            Schema::of_ros("sensor_msgs/JointState", {"a", "b"}, "base"),
                            Schema::of_ros("sensor_msgs/Image", {}, "camera")}) {
        std::vector<hal_value> v(s.fields.size());
        for (hal_value& x : v) {
            x.raw = 0x1234;
        }
        Bytes bytes = s.sample;
        for (std::size_t i = s.places.back().offset + 1; i < bytes.size(); ++i) {
            bytes[i] = 0xff;
        }
        while (!bytes.empty()) {
            bytes.pop_back();
            ASSERT_FALSE(decode(s, bytes, v)) << bytes.size();
        }
        bytes = s.sample;
        bytes.resize(bytes.size() + 8);
        EXPECT_FALSE(decode(s, bytes, v)) << "trailing bytes";
        bytes = s.sample;
        bytes[1] = 3;  // a parameter list
        EXPECT_FALSE(decode(s, bytes, v));
        for (const hal_value& x : v) {
            EXPECT_EQ(0x1234u, x.raw);
        }
    }
}

TEST(Outbox, keeps_the_order_and_rejects_samples_when_full) {
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
