// SPDX-License-Identifier: MIT
// Rows of values as messages: CDR with a schema in ROS 2's notation, which Foxglove, Lichtblick and
// PlotJuggler plot field by field. Fields have names that are identifiers; the true names and units
// are in the channel's metadata.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "hal/abi.h"
#include "recording/mcap/records.hpp"
#include "recording/mcap/ros_message.hpp"

namespace hal::mcap {

struct Column {
    std::string name;  ///< of the pin or signal
    hal_type type = HAL_TYPE_FLOAT;
    std::string unit;
};

/// Returns a name as ROS wants it for fields and parts of topics: `joint.0.pos-cmd` becomes
/// `joint_0_pos_cmd`.
std::string ros_name(const std::string& name);

/// Writes rows: the fields are sorted by size, so that there is no padding.
class RowWriter {
public:
    explicit RowWriter(std::vector<Column> columns);

    std::string schema() const;  ///< text of the .msg
    std::map<std::string, std::string> metadata() const;
    /// Replaces `to` by the message of a row. `values` has a word per column: bits of a double, or
    /// an integer.
    void write(const std::uint64_t* values, std::string& to) const;

private:
    std::vector<Column> columns_;
    std::vector<std::string> fields_;  // a name for each column
    std::vector<std::size_t> order_;  // of the columns in the message
};

/// Reads rows of a channel, ours or another writer's: the numbers of its ROS 2 messages.
class RowReader {
public:
    /// Returns false when the channel has other messages, and sets problem(), as "its messages are
    /// 'json'".
    bool open(const Schema& schema, const Channel& channel);
    const std::string& problem() const { return problem_; }
    const std::vector<Column>& columns() const { return columns_; }
    /// Returns the fields that have no number, as "frame_id (string)".
    const std::vector<std::string>& skipped() const { return message_.skipped(); }
    /// Replaces `values` by a word per column. Returns false when the message is too short, or not
    /// plain CDR.
    bool read(std::string_view payload, std::vector<std::uint64_t>& values) const {
        return message_.read(payload, values);
    }

private:
    std::vector<Column> columns_;
    RosMessage message_;
    std::string problem_;
};

}  // namespace hal::mcap
