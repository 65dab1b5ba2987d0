// SPDX-License-Identifier: MIT
#include "control/streams.hpp"

#include <algorithm>
#include <vector>

#include "commands/json_text.hpp"
#include "hal/stream_times.h"

namespace hal {
namespace {

std::vector<hal_type> column_types(const hal_stream& stream) {
    std::vector<hal_type> columns;
    for (std::uint32_t i = 0; i < stream.columns; ++i) {
        for (const TypeRow& row : types) {
            if (row.letter == stream.types[i]) {
                columns.push_back(row.type);
            }
        }
    }
    return columns;
}

hal_value* record_at(const hal_stream& stream, std::uint64_t count) {
    return stream.data + (count % stream.depth) * (stream.columns + 1);
}

/// Returns the losses of each record, or nullptr if the component does not publish them.
const std::uint64_t* losses_of(const hal_stream& stream) {
    if (stream.size < sizeof(hal_timed_stream)) return nullptr;
    return reinterpret_cast<const hal_timed_stream&>(stream).losses;
}

}  // namespace

void describe_stream(const hal_stream& stream, std::string& to) {
    const std::uint64_t head = __atomic_load_n(&stream.head, __ATOMIC_ACQUIRE);

    const std::uint64_t tail = __atomic_load_n(&stream.tail, __ATOMIC_ACQUIRE);
    json_quote(to += ",\"types\":", stream.types);
    to += ",\"depth\":" + std::to_string(stream.depth) +
          ",\"waiting\":" + std::to_string(head - tail) +
          ",\"lost\":" + std::to_string(__atomic_load_n(&stream.lost, __ATOMIC_RELAXED));
    if (stream.size >= HAL_TIMED_STREAM_SIZE_1) {
        to += ",\"timed\":true";
    }
}

bool pop_records(hal_stream& stream, std::uint64_t max, std::string& to, std::string& why) {
    if (stream.to_machine) {
        why = "this stream is written, not read: use records";
        return false;
    }
    const auto columns = column_types(stream);
    const std::uint64_t head = __atomic_load_n(&stream.head, __ATOMIC_ACQUIRE);
    const std::uint64_t begin = stream.tail;
    const std::uint64_t end = begin + std::min(max, head - begin);
    const auto* const timed = stream.size >= HAL_TIMED_STREAM_SIZE_1
                                  ? reinterpret_cast<const hal_timed_stream*>(&stream)
                                  : nullptr;
    const std::uint64_t* const losses = losses_of(stream);
    std::string lost_before = losses ? "],\"lost_before\":[" : "";
    std::string numbers = ",\"numbers\":[";
    std::string records = "],\"records\":[";

    std::string times = timed ? "],\"times_ns\":[" : "";
    for (std::uint64_t i = begin; i < end; ++i) {
        const hal_value* const values = record_at(stream, i);
        if (i > begin) {
            numbers += ',';
            records += ',';
            if (timed) {
                times += ',';
            }
            if (losses) {
                lost_before += ',';
            }
        }
        if (timed) {
            times += std::to_string(timed->times[i % stream.depth]);
        }
        if (losses) {
            lost_before += std::to_string(losses[i % stream.depth]);
        }
        numbers += std::to_string(values[stream.columns].s64);
        records += '[';
        for (std::uint32_t c = 0; c < stream.columns; ++c) {
            if (c > 0) {
                records += ',';
            }
            json_value(records, columns[c], values[c]);
        }
        records += ']';
    }
    __atomic_store_n(&stream.tail, end, __ATOMIC_RELEASE);
    to += numbers + records + times + lost_before + "]";
    return true;
}

bool feed_records(hal_stream& stream, const std::vector<std::vector<std::string>>& records,
                  std::string& to, std::string& why) {
    if (!stream.to_machine) {
        why = "this stream is read, not written: use take";
        return false;
    }
    const auto columns = column_types(stream);
    std::vector<hal_value> parsed;
    for (std::size_t i = 0; i < records.size(); ++i) {
        if (records[i].size() != columns.size()) {
            why = "record " + std::to_string(i) + " has " + std::to_string(records[i].size()) +
                  " values, the stream has " + std::to_string(columns.size());
            return false;
        }
        for (std::size_t c = 0; c < columns.size(); ++c) {
            const Parsed value = parse_value(columns[c], records[i][c], LeadingZero::decimal);
            if (!value.problem.empty()) {
                why = "record " + std::to_string(i) + ", value " + std::to_string(c) + ": " +
                      value.problem;
                return false;
            }
            parsed.push_back(value.value);
        }
    }
    const std::uint64_t tail = __atomic_load_n(&stream.tail, __ATOMIC_ACQUIRE);
    const std::uint64_t head = stream.head;
    const std::uint64_t taken =
        std::min<std::uint64_t>(records.size(), stream.depth - (head - tail));
    for (std::uint64_t i = 0; i < taken; ++i) {
        hal_value* const values = record_at(stream, head + i);
        std::copy_n(parsed.begin() + static_cast<std::ptrdiff_t>(i * columns.size()),
                    columns.size(), values);
        values[stream.columns].s64 = static_cast<std::int64_t>(head + i);
    }
    __atomic_store_n(&stream.head, head + taken, __ATOMIC_RELEASE);
    to += ",\"taken\":" + std::to_string(taken);
    return true;
}

}  // namespace hal
