// SPDX-License-Identifier: MIT
// Writes an MCAP file: chunked, indexed, with CRCs and a summary. Until close() the file is
// NAME.part, readable up to its last chunk, and locked.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "recording/mcap/compression.hpp"
#include "recording/mcap/held_file.hpp"
#include "recording/mcap/records.hpp"

namespace hal::mcap {

/// One thread at a time.
class Writer {
public:
    static constexpr std::size_t chunk_bytes = std::size_t{1} << 20;
    /// a chunk is written after this time at the latest
    static constexpr std::uint64_t chunk_ns = 1'000'000'000;

    /// Creates PATH.part; see error(). A PATH.part that a killed recorder left gets another name,
    /// kept(). `profile` goes into the header: "ros2", or "".
    explicit Writer(std::string path, std::string_view profile = "");
    ~Writer();  ///< close()
    Writer(const Writer&) = delete;

    /// Adds a schema, or a channel, and returns its number.
    std::uint16_t add_schema(std::string_view name, std::string_view encoding,
                             std::string_view data);
    std::uint16_t add_channel(std::uint16_t schema, std::string_view topic,
                              std::string_view encoding,
                              std::map<std::string, std::string> metadata);
    /// Adds a message to the chunk. Returns false when it or an earlier one could not be written.
    bool message(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns,
                 std::string_view payload);
    bool metadata(std::string_view name, const std::map<std::string, std::string>& entries);
    bool attachment(std::string_view name, std::string_view media_type, std::string_view data,
                    std::uint64_t time_ns);
    /// Writes the chunk that is being filled.
    bool flush();
    /// Writes the summary, and gives the file its name. Returns false when anything was lost; what
    /// was written is complete even then. A file without a message that could not be written is
    /// removed.
    bool close();

    int error() const { return error_; }  ///< errno of the first failure, or 0
    /// of the file, with the chunk that is being filled
    std::uint64_t bytes() const { return size_ + chunk_.size(); }
    /// why the file could not be created; "" otherwise
    const std::string& problem() const { return held_.problem; }
    const std::string& kept() const { return held_.kept; }
    /// the file that has what was written; "" before there is a file
    std::string where() const;
    /// After close(): nothing had been written, and the file is gone.
    bool removed() const { return removed_; }
    std::uint64_t messages() const;
    std::uint64_t messages(std::uint16_t channel) const;
    const std::string& path() const { return path_; }

private:
    struct Place {
        std::uint64_t offset, length, time_ns, size;
        std::string name, media_type;
    };
    bool write(std::string_view bytes);
    bool record(std::uint8_t opcode, std::string_view content);
    std::string summary() const;

    const std::string path_;
    HeldFile held_;
    int file_ = -1;
    int error_ = 0;
    bool named_ = false;
    bool removed_ = false;
    std::uint64_t size_ = 0;
    std::uint32_t crc_ = 0;  // of all bytes so far
    std::vector<Schema> schemas_;
    std::vector<Channel> channels_;
    // all schemas and channels, as records
    std::string declared_;
    std::string chunk_, compressed_;
    std::uint64_t chunk_begin_ = 0;
    std::uint64_t chunk_end_ = 0;
    // of the chunk: time and offset of each message
    std::map<std::uint16_t, std::string> indexes_;
    std::vector<ChunkIndex> chunks_;
    std::vector<std::map<std::uint16_t, std::uint64_t>> counts_;  // of the messages in each chunk
    std::vector<Place> attachments_, metadata_;
    Compressor compressor_;
};

}  // namespace hal::mcap
