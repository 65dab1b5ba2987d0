// SPDX-License-Identifier: MIT
// Positions, velocities and efforts as the ROS 2 message sensor_msgs/msg/JointState, for the 3D
// views of Foxglove and Lichtblick.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "control/probe_client.hpp"

namespace hal::tools {

class Joints {
public:
    static constexpr const char* message = "sensor_msgs/msg/JointState";
    /// for the eye: each cycle's values are in the rows
    static constexpr std::int64_t every_ns = 20'000'000;
    /// The definition of the message with those that it contains, as `ros2msg`.
    static const char* schema();

    /// A value in rad or m is a position, in rad/s or m/s a velocity, in N*m or N an effort. Those
    /// whose names differ in their last word only belong to one joint: `motor-position` and
    /// `motor-velocity` to `motor`.
    explicit Joints(const std::vector<ProbeColumn>& columns);
    /// Returns whether no value is a position.
    bool empty() const { return joints_.empty(); }
    /// Writes the message of a row (one word per column) as CDR.
    void write(const std::uint64_t* words, std::int64_t unix_ns, std::string& to) const;

private:
    static constexpr std::size_t none = SIZE_MAX;
    struct Joint {
        std::string name;
        std::size_t columns[3] = {none, none, none};  ///< position, velocity, effort
    };
    std::vector<Joint> joints_;
    bool any_[3] = {};  ///< a joint has one; the array is empty otherwise
};

}  // namespace hal::tools
