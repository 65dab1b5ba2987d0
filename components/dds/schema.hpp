// SPDX-License-Identifier: MIT
// A group of pins as one type: its fields, their offsets, its name. Known when the netlist is
// loaded, so that a cycle only stores values at known offsets.
//
// XCDR1, little-endian, final, no key (DDS-XTypes 1.3, 7.4.1; DDSI-RTPS 2.3, 10.2): after the
// header of four bytes a primitive is aligned to its size, counted from the end of the header; a
// string is a 32-bit length that includes its 0, then the bytes; a sequence is a 32-bit count, then
// the elements.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/abi.h"

namespace hal::dds {

/// A field of the topic and its pin. Ports cannot be fields.
struct Field {
    std::string name;  ///< of the pin
    hal_type type = HAL_TYPE_FLOAT;
    std::optional<hal_value> safe;  ///< subscribers: value of the pin while the topic is not valid
};

/// A value within a sample.
struct Place {
    std::uint32_t offset = 0;  ///< bytes from the beginning, header included
    hal_type type = HAL_TYPE_FLOAT;
};

/// The type of one topic.
struct Schema {
    std::string type;  ///< name on the wire
    /// of the topic name on the wire: "rt/" for ROS 2 types, else ""
    std::string prefix;
    std::vector<std::string> names;  ///< joints of a JointState
    std::vector<Field> fields;  ///< in the order of the pins
    std::vector<std::uint8_t> sample;  ///< a complete sample with all values 0, header included
    std::vector<Place> places;  ///< offset of each field in `sample`
    /// offset of a ROS header's stamp (int32 sec, uint32 nanosec) in `sample`; 0: no stamp
    std::uint32_t stamp = 0;
    /// "std_msgs/Float64", or "" for a type derived from the fields
    std::string ros;
    /// format for decode(), for strings and sequences of any length
    std::string layout;

    /// Parses "angle:float,ready:bit,joint:float*6,effort:float=0": NAME:TYPE, *N for N fields
    /// (joint-0, joint-1 ...), =VALUE for the value of a subscriber's pin while the topic is not
    /// valid. Types: bit, float, s32, u32, s64, u64. An empty `type` derives the name from the
    /// fields, so that different groups never match. Throws std::invalid_argument. [setup]
    static Schema of_fields(std::string_view fields, std::string type = "");
    /// Builds a ROS 2 type: std_msgs/Float64 Bool Int32 UInt32 Int64 UInt64, geometry_msgs/Twist
    /// WrenchStamped, sensor_msgs/JointState Image (its header and format, without pixels). `names`
    /// are the joints of a JointState, `frame` the header's frame_id, `encoding` that of an Image.
    /// ROS 2's spelling with a folder, geometry_msgs/msg/Twist, is the same type.
    /// Throws std::invalid_argument. [setup]
    static Schema of_ros(std::string_view written, const std::vector<std::string>& names = {},
                         std::string_view frame = "", std::string_view encoding = "bgr8");
};

/// Decodes the values of the fields, in their order, from an untrusted sample; joints that a
/// JointState does not contain keep their value. `has_joint`, if it is not empty, has an element for
/// each joint, which is set for those that it contains with a value. Returns false and leaves
/// `values` unchanged when the bytes are not of this type. Allocates nothing. [any]
bool decode(const Schema&, std::span<const std::uint8_t> bytes, std::span<hal_value> values,
            std::span<bool> has_joint = {}) noexcept;

}  // namespace hal::dds
