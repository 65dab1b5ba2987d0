// SPDX-License-Identifier: MIT
// What an MCAP file contains (https://mcap.dev/spec). Times are in ns of Unix time.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace hal::mcap {

inline constexpr std::string_view magic{"\x89MCAP0\r\n", 8};

enum Opcode : std::uint8_t {
    op_header = 1,
    op_footer = 2,
    op_schema = 3,
    op_channel = 4,
    op_message = 5,
    op_chunk = 6,
    op_message_index = 7,
    op_chunk_index = 8,
    op_attachment = 9,
    op_attachment_index = 0x0a,
    op_statistics = 0x0b,
    op_metadata = 0x0c,
    op_metadata_index = 0x0d,
    op_summary_offset = 0x0e,
    op_data_end = 0x0f,
};

struct Schema {
    std::uint16_t id = 0;  ///< never 0
    std::string name, encoding, data;
};

struct Channel {
    std::uint16_t id = 0;
    std::uint16_t schema = 0;
    std::string topic, encoding;  ///< encoding: of the messages
    std::map<std::string, std::string> metadata;
};

struct Message {
    std::uint16_t channel = 0;
    std::uint32_t sequence = 0;
    std::uint64_t log_time = 0;
    std::uint64_t publish_time = 0;
    std::string_view payload;     ///< valid while the visitor runs
};

struct ChunkIndex {
    std::uint64_t begin_time = 0;
    std::uint64_t end_time = 0;
    std::uint64_t offset = 0;
    std::uint64_t length = 0;
    std::map<std::uint16_t, std::uint64_t> message_indexes;  ///< channel to place in the file
    std::uint64_t message_index_length = 0;
    std::string compression;
    std::uint64_t compressed_size = 0;
    std::uint64_t size = 0;
    /// messages that are in the file without a chunk
    bool loose = false;
};

}  // namespace hal::mcap
