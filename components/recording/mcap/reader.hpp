// SPDX-License-Identifier: MIT
// Reads MCAP files of any writer. Nothing in the file is trusted: sizes are bounded, CRCs are
// checked. One thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "recording/mcap/bytes.hpp"
#include "recording/mcap/records.hpp"

namespace hal::mcap {

/// Where the bytes of a file come from.
class Source {
public:
    virtual ~Source() = default;
    virtual std::uint64_t size() const = 0;
    /// Replaces `to` by `count` bytes from `offset`. Returns false when they cannot be read.
    virtual bool read(std::uint64_t offset, std::size_t count, std::string& to) = 0;
};

/// A file, or nullptr with `problem`.
std::unique_ptr<Source> open_file(const std::string& path, std::string& problem);
/// Bytes that outlive it.
std::unique_ptr<Source> open_bytes(std::string_view bytes);

class Reader {
public:
    /// bytes of a chunk, expanded
    static constexpr std::uint64_t max_chunk = std::uint64_t{256} << 20;
    /// chunks, or other records of the summary
    static constexpr std::size_t max_entries = 1'000'000;

    /// Reads what the file contains: its summary, and the heads of its records. Where the summary
    /// is missing, or omits chunks, schemas or channels, it reads these chunks too. Messages that
    /// are in no chunk count as chunks of 1 MiB. Returns false and sets problem() when it is not an
    /// MCAP file.
    bool open(std::unique_ptr<Source> source);
    const std::string& problem() const { return problem_; }
    /// True: the file has no end, as after a power failure; it was read up to its last complete
    /// chunk or message.
    bool unfinished() const { return unfinished_; }

    const std::map<std::uint16_t, Schema>& schemas() const { return schemas_; }
    const std::map<std::uint16_t, Channel>& channels() const { return channels_; }
    const std::vector<ChunkIndex>& chunks() const { return chunks_; }
    std::uint64_t begin_time() const;
    std::uint64_t end_time() const;  ///< of the last message
    /// Returns the named entries of all metadata records of that name that the summary lists.
    std::map<std::string, std::string> metadata(std::string_view name);

    using Visit = std::function<bool(const Message&)>;
    /// Calls `visit` for the messages with begin <= log time < end, in the order of the file, until
    /// it returns false. Only chunks that may have some are read. Damaged ones are left out: then
    /// it returns false, problem() is that of the first, and damaged() are all of them.
    bool each(const Visit& visit, std::uint64_t begin = 0,
              std::uint64_t end = std::numeric_limits<std::uint64_t>::max());
    std::uint64_t chunks_read() const { return chunks_read_; }
    const std::vector<ChunkIndex>& damaged() const { return damaged_; }

private:
    struct RecordHead;
    struct Listed;

    bool fail(std::string sentence) {
        problem_ = std::move(sentence);
        return false;
    }
    bool read_summary();
    bool summary_has_channels() const;
    void scan(bool load_listed);
    bool read_head(std::uint64_t offset, RecordHead&);
    bool read_content(const RecordHead&, std::string& content);
    bool add_record(const RecordHead&, const Listed&, bool load_listed);
    bool add_message(const RecordHead&);
    bool add_chunk(const RecordHead&, bool listed);
    void add_metadata(const RecordHead&);
    bool scan_chunk(ChunkIndex& index);
    void add_loose(std::uint64_t at, std::uint64_t length, std::uint64_t time);
    bool add_entry(std::uint8_t opcode, std::string_view content);
    void add_schema(Fields);
    void add_channel(Fields);
    bool add_chunk_index(Fields);
    bool load_chunk(const ChunkIndex& chunk, std::string& records);
    static bool each_in(std::string_view records, const Visit& visit, std::uint64_t begin,
                        std::uint64_t end);

    std::unique_ptr<Source> source_;
    std::string problem_;
    // ends_: with a footer and the end of the data
    bool unfinished_ = false;
    bool ends_ = false;
    std::map<std::uint16_t, Schema> schemas_;
    std::map<std::uint16_t, Channel> channels_;
    std::vector<ChunkIndex> chunks_;
    std::vector<ChunkIndex> damaged_;  // found by the last each()
    struct Metadata {
        std::uint64_t offset, length;
        std::string name;
    };
    std::vector<Metadata> metadata_;
    std::uint64_t chunks_read_ = 0;
    std::optional<std::uint32_t> channel_count_;  // of the statistics
};

}  // namespace hal::mcap
