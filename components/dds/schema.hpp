// SPDX-License-Identifier: MIT
// A group of pins as one type: which fields, where they stand in the bytes, what the type is called. Known when the netlist is loaded, so
// that a cycle only stores values at known places.
//
// XCDR1, little-endian, final, no key (DDS-XTypes 1.3, 7.4.1; DDSI-RTPS 2.3, 10.2): after the header of four bytes a primitive is aligned
// to its size, counted from behind the header; a string is a 32-bit length with its 0, then the bytes; a sequence is a 32-bit count, then
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

/// A pin of the group. Ports have no place in a topic.
struct Field {
    std::string              name;                ///< of the pin
    hal_type                 type = HAL_TYPE_FLOAT;
    std::optional<hal_value> safe;   ///< subscribers: shown while the topic is not valid
};

/// A value within the bytes.
struct Place {
    std::uint32_t offset = 0;  ///< in all bytes, header included
    hal_type      type = HAL_TYPE_FLOAT;
};

/// The type of one topic.
struct Schema {
    std::string               type;                  ///< name on the wire
    std::string               prefix;  ///< of the topic's name on the wire: "rt/" for ROS 2 types, else ""
    std::vector<std::string>  names;   ///< joints of a JointState
    std::vector<Field>        fields;         ///< in the order of the pins
    std::vector<std::uint8_t> sample;  ///< one whole sample with all values 0, header included
    std::vector<Place>        places;         ///< of each field in `sample`
    std::uint32_t             stamp = 0;  ///< offset of a ROS header's stamp (int32 sec, uint32 nanosec) in `sample`; 0: it has none
    std::string               ros;  ///< "std_msgs/Float64", or "" for a type made of the fields
    std::string               layout;  ///< how decode() walks a sample whose strings and sequences are of any length

    /// "angle:float,ready:bit,joint:float*6,effort:float=0": NAME:TYPE, with *N a row (joint-0, joint-1 ...), with =VALUE what subscribers
    /// show while nothing valid is there. Types: bit, float, s32, u32, s64, u64. `type` "" derives the name from the fields, so that
    /// different groups never match. Throws std::invalid_argument.
    static Schema of_fields(std::string_view fields, std::string type = "");
    /// A type of ROS 2: std_msgs/Float64 Bool Int32 UInt32 Int64 UInt64, geometry_msgs/Twist WrenchStamped, sensor_msgs/JointState Image
    /// (its header and format, without pixels). `names` are the joints of a JointState, `frame` the header's frame_id, `encoding` of an
    /// Image. Throws std::invalid_argument.
    static Schema of_ros(std::string_view ros, const std::vector<std::string>& names = {}, std::string_view frame = "",
                         std::string_view encoding = "bgr8");
};

/// Values of the fields, in their order, out of one sample that came from anywhere; what a JointState does not have keeps its value. False,
/// and `values` untouched, when the bytes are not of this type. Takes no memory. [any]
bool decode(const Schema&, std::span<const std::uint8_t> bytes, std::span<hal_value> values) noexcept;

}  // namespace hal::dds
