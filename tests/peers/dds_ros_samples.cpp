// SPDX-License-Identifier: MIT
// Prints a sample of each ROS 2 type, with values in all its fields: type and bytes.
#include <cstdio>
#include <cstring>

#include "dds/schema.hpp"

int main() {
    using hal::dds::Schema;
    const char* all[] = {"std_msgs/Float64",       "std_msgs/Bool",
                         "std_msgs/Int32",         "std_msgs/UInt32",
                         "std_msgs/Int64",         "std_msgs/UInt64",
                         "geometry_msgs/Twist",    "geometry_msgs/WrenchStamped",
                         "sensor_msgs/JointState", "sensor_msgs/Image"};
    for (const char* ros : all) {
        for (const char* frame : {"", "base", "a frame with a length of its own"}) {
            Schema s = Schema::of_ros(ros, {"shoulder", "elbow", "w"}, frame);
            double value = 1.25;
            for (const hal::dds::Place& p : s.places) {
                const std::int64_t whole = static_cast<std::int64_t>(value);
                if (p.type == HAL_TYPE_FLOAT) {
                    std::memcpy(s.sample.data() + p.offset, &value, 8);
                } else if (p.type == HAL_TYPE_BIT) {
                    s.sample[p.offset] = 1;
                } else {
                    std::memcpy(s.sample.data() + p.offset, &whole,
                                p.type == HAL_TYPE_S64 || p.type == HAL_TYPE_U64 ? 8 : 4);
                }
                value = -value * 3;
                if (value < 0 && p.type != HAL_TYPE_FLOAT) {
                    value = -value;
                }
            }
            if (s.stamp != 0) {
                const std::uint32_t stamp[2] = {1'700'000'000, 999'999'999};
                std::memcpy(s.sample.data() + s.stamp, stamp, sizeof stamp);
            } else if (*frame) {
                continue;
            }
            std::printf("%s ", ros);
            for (const std::uint8_t b : s.sample) {
                std::printf("%02x", b);
            }
            std::printf("\n");
        }
    }
    return 0;
}
