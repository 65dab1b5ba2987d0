// SPDX-License-Identifier: MIT
// The definition of a ROS 2 message (`ros2msg`), and the numbers in its CDR encoding. Texts and
// arrays of any length are skipped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "hal/abi.h"

namespace hal::mcap {

/// Reads the numbers of one type of message. Neither the definition nor a message is trusted. One
/// thread at a time.
class RosMessage {
public:
    static constexpr std::size_t max_fields = 100'000;
    static constexpr std::size_t max_array = 64;  ///< a longer array of fixed length is skipped

    struct Number {
        /// its path, `header.stamp.sec`; elements of an array of fixed length are `v.0`, `v.1`
        std::string name;
        hal_type type = HAL_TYPE_FLOAT;
    };

    /// Parses a definition with those of the messages in it. `name` is that of the message,
    /// `sensor_msgs/msg/Imu`. Returns false and sets problem().
    bool open(std::string_view name, std::string_view definition);
    const std::string& problem() const { return problem_; }

    const std::vector<Number>& numbers() const { return numbers_; }
    /// Returns what is not read, as "frame_id (string)".
    const std::vector<std::string>& skipped() const { return skipped_; }
    /// Replaces `values` by a word per number. Returns false when the message is too short, or its
    /// encoding is not plain CDR.
    bool read(std::string_view payload, std::vector<std::uint64_t>& values) const;

    /// A field of a message, or of a message in it.
    struct Field {
        enum class Kind : std::uint8_t { number, text, message };
        enum class Count : std::uint8_t { one, fixed, any };
        std::string name, type;
        Kind kind = Kind::number;
        Count count = Count::one;
        std::size_t length = 1;  ///< of a fixed array
        std::size_t bytes = 1;  ///< of a number
        bool is_signed = false;
        bool is_float = false;
        hal_type word = HAL_TYPE_FLOAT;
        bool has_values = false;  ///< else it is skipped
        std::vector<Field> fields = {};  ///< of a message
    };

private:
    bool list(std::vector<Field>& fields, const std::string& prefix);
    bool list_array(Field& field, const std::string& path);

    std::vector<Field> fields_;
    std::vector<Number> numbers_;
    std::vector<std::string> skipped_;
    std::string problem_;
};

}  // namespace hal::mcap
