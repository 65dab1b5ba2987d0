// SPDX-License-Identifier: MIT
#include "recording/mcap/reader.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "recording/mcap/bytes.hpp"
#include "recording/mcap/compression.hpp"
#include "recording/mcap/crc.hpp"

namespace hal::mcap {
namespace {

constexpr std::size_t record_head = 9;
constexpr std::size_t footer_bytes = record_head + 20;

constexpr std::size_t message_head = 2 + 4 + 8 + 8;

class FileSource final : public Source {
public:
    explicit FileSource(int file, std::uint64_t size) : file_(file), size_(size) {}
    ~FileSource() override { ::close(file_); }
    std::uint64_t size() const override { return size_; }
    bool read(std::uint64_t offset, std::size_t count, std::string& to) override {
        if (offset > size_ || count > size_ - offset) return false;
        to.resize(count);
        for (std::size_t done = 0; done < count;) {
            const ssize_t n =
                ::pread(file_, to.data() + done, count - done, static_cast<off_t>(offset + done));
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) return false;
            done += static_cast<std::size_t>(n);
        }
        return true;
    }

private:
    int file_;
    std::uint64_t size_;
};

class BytesSource final : public Source {
public:
    explicit BytesSource(std::string_view bytes) : bytes_(bytes) {}
    std::uint64_t size() const override { return bytes_.size(); }
    bool read(std::uint64_t offset, std::size_t count, std::string& to) override {
        if (offset > bytes_.size() || count > bytes_.size() - offset) return false;
        to = bytes_.substr(static_cast<std::size_t>(offset), count);
        return true;
    }

private:
    std::string_view bytes_;
};

std::map<std::string, std::string> read_pairs(std::string_view text) {
    std::map<std::string, std::string> entries;
    for (Fields fields(text); fields.more();) {
        const std::string_view key = fields.text();
        const std::string_view value = fields.text();
        if (fields.good()) {
            entries.emplace(key, value);
        }
    }
    return entries;
}

/// States why a file without the magic bytes of MCAP is not read.
std::string not_mcap(Source& source) {
    struct Format {
        std::string_view magic;
        const char* sentence;
    };
    constexpr Format formats[] = {
        {std::string_view("\x28\xb5\x2f\xfd", 4),
         "it is compressed as a whole, with zstd; type: zstd -d FILE"},
        {std::string_view("\x04\x22\x4d\x18", 4),
         "it is compressed as a whole, with lz4; type: lz4 -d FILE"},
        {std::string_view("\x1f\x8b", 2),
         "it is compressed as a whole, with gzip; type: gunzip FILE"},
        {"SQLite format 3",
         "it is an SQLite database, a .db3 of ROS 2; convert it with rosbags-convert"},
        {"#ROSBAG V", "it is a bag of ROS 1; convert it with rosbags-convert"},
    };
    std::string begin;
    source.read(0, static_cast<std::size_t>(std::min<std::uint64_t>(source.size(), 16)), begin);
    for (const Format& format : formats) {
        if (std::string_view(begin).starts_with(format.magic)) {
            return std::string("not an MCAP file: ") + format.sentence;
        }
    }
    return "not an MCAP file: it does not begin with the bytes that such a file has";
}

Message read_message(std::string_view content) {
    Fields fields(content);
    Message message;
    message.channel = fields.get<std::uint16_t>();
    message.sequence = fields.get<std::uint32_t>();
    message.log_time = fields.get<std::uint64_t>();
    message.publish_time = fields.get<std::uint64_t>();
    message.payload = fields.rest();
    return message;
}

}  // namespace

std::unique_ptr<Source> open_file(const std::string& path, std::string& problem) {
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK);
    struct stat about{};
    if (file >= 0 && ::fstat(file, &about) == 0 && S_ISREG(about.st_mode)) {
        return std::make_unique<FileSource>(file, static_cast<std::uint64_t>(about.st_size));
    }
    const char* const other = S_ISDIR(about.st_mode) ? "it is a folder; name the .mcap file in it"
                                                     : "it is not a regular file";
    problem = "cannot read '" + path + "': " + (file < 0 ? std::strerror(errno) : other);
    if (file >= 0) {
        ::close(file);
    }
    return nullptr;
}

std::unique_ptr<Source> open_bytes(std::string_view bytes) {
    return std::make_unique<BytesSource>(bytes);
}

bool Reader::open(std::unique_ptr<Source> source) {
    source_ = std::move(source);
    std::string begin;
    if (!source_->read(0, magic.size(), begin) || begin != magic) return fail(not_mcap(*source_));
    const bool summary = read_summary();
    const bool footer = ends_;
    if (!summary) {
        schemas_.clear();
        channels_.clear();
        chunks_.clear();
        metadata_.clear();
        channel_count_.reset();
    }
    const bool indexed = !chunks_.empty();
    scan(!summary_has_channels());
    unfinished_ = !indexed && !(ends_ && (summary || footer));
    return true;
}

// A summary may omit schemas and channels, and then lists chunks only.
bool Reader::summary_has_channels() const {
    for (const auto& [id, channel] : channels_) {
        if (channel.schema != 0 && !schemas_.contains(channel.schema)) return false;
    }
    bool listed = true;
    for (const ChunkIndex& chunk : chunks_) {
        listed = listed && !chunk.message_indexes.empty();
        for (const auto& [channel, offset] : chunk.message_indexes) {
            if (!channels_.contains(channel)) return false;
        }
    }
    return channel_count_ ? channels_.size() >= *channel_count_ : listed;
}

void Reader::add_schema(Fields fields) {
    const auto id = fields.get<std::uint16_t>();
    Schema schema{id, std::string(fields.text()), std::string(fields.text()),
                  std::string(fields.text())};
    if (fields.good() && id != 0) {
        schemas_.try_emplace(id, std::move(schema));
    }
}

void Reader::add_channel(Fields fields) {
    const auto id = fields.get<std::uint16_t>();
    const auto schema = fields.get<std::uint16_t>();
    Channel channel{id, schema, std::string(fields.text()), std::string(fields.text()),
                    read_pairs(fields.text())};
    if (fields.good()) {
        channels_.try_emplace(id, std::move(channel));
    }
}

bool Reader::add_chunk_index(Fields fields) {
    ChunkIndex index;
    index.begin_time = fields.get<std::uint64_t>();
    index.end_time = fields.get<std::uint64_t>();
    index.offset = fields.get<std::uint64_t>();
    index.length = fields.get<std::uint64_t>();
    for (Fields entries(fields.text()); entries.more();) {
        const auto channel = entries.get<std::uint16_t>();
        index.message_indexes[channel] = entries.get<std::uint64_t>();
    }
    index.message_index_length = fields.get<std::uint64_t>();
    index.compression = fields.text();
    index.compressed_size = fields.get<std::uint64_t>();
    index.size = fields.get<std::uint64_t>();
    if (!fields.good()) return fail("a chunk index is incomplete");
    chunks_.push_back(std::move(index));
    return true;
}

// Adds a schema, a channel or an index: from the summary, or found by a scan. Ignores other
// records.
bool Reader::add_entry(std::uint8_t opcode, std::string_view content) {
    if (schemas_.size() + channels_.size() + chunks_.size() + metadata_.size() > max_entries) {
        return fail("the file has too many parts");
    }
    Fields fields(content);
    switch (opcode) {
    case op_schema: add_schema(fields); break;
    case op_channel: add_channel(fields); break;
    case op_chunk_index: return add_chunk_index(fields);
    case op_metadata_index: {
        const auto offset = fields.get<std::uint64_t>();
        const auto length = fields.get<std::uint64_t>();
        metadata_.push_back({offset, length, std::string(fields.text())});
        break;
    }
    case op_statistics:
        fields.get<std::uint64_t>();
        fields.get<std::uint16_t>();
        channel_count_ = fields.get<std::uint32_t>();
        break;
    default: break;
    }
    return true;
}

bool Reader::read_summary() {
    const std::uint64_t size = source_->size();
    std::string end;
    if (size < 2 * magic.size() + footer_bytes ||
        !source_->read(size - magic.size() - footer_bytes, magic.size() + footer_bytes, end)) {
        return false;
    }
    Fields fields(end);
    if (fields.get<std::uint8_t>() != op_footer || fields.get<std::uint64_t>() != 20) return false;
    const auto begin = fields.get<std::uint64_t>();
    fields.get<std::uint64_t>();
    const auto crc = fields.get<std::uint32_t>();
    const std::uint64_t footer = size - magic.size() - footer_bytes;
    if (fields.rest() != magic) return false;
    ends_ = begin == 0;  // a file without a summary may be whole
    if (begin == 0 || begin > footer || footer - begin > max_chunk) return false;
    std::string summary;
    if (!source_->read(begin, static_cast<std::size_t>(footer - begin), summary)) return false;
    if (crc != 0 &&
        crc32(std::string_view(end).substr(0, footer_bytes - 4), crc32(summary)) != crc) {
        return false;
    }
    for (Fields records(summary); records.more();) {
        const auto opcode = records.get<std::uint8_t>();
        const std::string_view content = records.blob();
        if (!records.good() || !add_entry(opcode, content)) return false;
    }
    return true;
}

/// A record of the file, without its content.
struct Reader::RecordHead {
    std::uint8_t opcode = 0;
    std::uint64_t offset = 0;
    std::uint64_t length = 0;    ///< of the content
    std::uint64_t log_time = 0;  ///< of a message

    std::uint64_t whole() const { return record_head + length; }
};

/// What the summary lists.
struct Reader::Listed {
    std::set<std::uint64_t> chunks, metadata;  ///< offsets
};

// Returns false when the record is incomplete.
bool Reader::read_head(std::uint64_t offset, RecordHead& record) {
    const std::uint64_t left = source_->size() - offset;
    const std::uint64_t count = std::min<std::uint64_t>(record_head + message_head, left);
    std::string head;
    if (!source_->read(offset, static_cast<std::size_t>(count), head)) return false;
    Fields fields(head);
    record.opcode = fields.get<std::uint8_t>();
    record.offset = offset;
    record.length = fields.get<std::uint64_t>();
    fields.get<std::uint16_t>();
    fields.get<std::uint32_t>();
    record.log_time = fields.get<std::uint64_t>();
    return record.length <= left - record_head;
}

bool Reader::read_content(const RecordHead& record, std::string& content) {
    return source_->read(record.offset + record_head, static_cast<std::size_t>(record.length),
                         content);
}

bool Reader::add_message(const RecordHead& record) {
    if (record.length < message_head || record.length > max_chunk) return false;
    if (chunks_.size() >= max_entries) return false;
    add_loose(record.offset, record.whole(), record.log_time);
    return true;
}

bool Reader::add_chunk(const RecordHead& record, bool listed) {
    ChunkIndex index;
    index.offset = record.offset;
    index.length = record.whole();
    if (chunks_.size() >= max_entries || !scan_chunk(index)) return false;
    if (!listed) {
        chunks_.push_back(std::move(index));
    }
    return true;
}

void Reader::add_metadata(const RecordHead& record) {
    std::string content;
    if (metadata_.size() >= 1000 || record.length > (1 << 20)) return;
    if (!read_content(record, content)) return;
    metadata_.push_back({record.offset, record.whole(), std::string(Fields(content).text())});
}

// Returns false for a record that ends the scan: it is damaged, or there are too many.
bool Reader::add_record(const RecordHead& record, const Listed& listed, bool load_listed) {
    switch (record.opcode) {
    case op_message: return add_message(record);
    case op_chunk: {
        const bool is_listed = listed.chunks.contains(record.offset);
        return (is_listed && !load_listed) || add_chunk(record, is_listed);
    }
    case op_schema:
    case op_channel: {
        std::string content;
        if (record.length > max_chunk) return true;
        return read_content(record, content) && add_entry(record.opcode, content);
    }
    case op_metadata:
        if (!listed.metadata.contains(record.offset)) {
            add_metadata(record);
        }
        return true;
    default: return true;
    }
}

// Reads the records after each other up to the first that is incomplete. Chunks of the summary are
// read with `load_listed` only, for the schemas and channels in them; metadata of the summary is
// known.
void Reader::scan(bool load_listed) {
    Listed listed;
    for (const ChunkIndex& chunk : chunks_) {
        listed.chunks.insert(chunk.offset);
    }
    for (const Metadata& one : metadata_) {
        listed.metadata.insert(one.offset);
    }
    ends_ = false;
    RecordHead record;
    for (std::uint64_t at = magic.size(); at + record_head <= source_->size();
         at += record.whole()) {
        const bool complete = read_head(at, record);
        ends_ = record.opcode == op_data_end;
        if (!complete || ends_ || !add_record(record, listed, load_listed)) break;
    }
    problem_.clear();
    std::stable_sort(chunks_.begin(), chunks_.end(),
                     [](const ChunkIndex& a, const ChunkIndex& b) { return a.offset < b.offset; });
}

// Completes the index of a chunk from its head, and reads the schemas and channels in it. A chunk
// that cannot be expanded stays in the list: each() reports why. Returns false when its head is
// incomplete.
bool Reader::scan_chunk(ChunkIndex& index) {
    constexpr std::size_t fixed = 8 + 8 + 8 + 4 + 4;
    constexpr std::size_t max_head = 256;
    const std::uint64_t length = index.length - record_head;
    std::string head;
    if (length < fixed) return false;
    if (!source_->read(index.offset + record_head,
                       static_cast<std::size_t>(std::min<std::uint64_t>(length, max_head)), head)) {
        return false;
    }
    Fields chunk(head);
    index.begin_time = chunk.get<std::uint64_t>();
    index.end_time = chunk.get<std::uint64_t>();
    index.size = chunk.get<std::uint64_t>();
    chunk.get<std::uint32_t>();
    index.compression = chunk.text();
    index.compressed_size = chunk.get<std::uint64_t>();
    if (!chunk.good()) return false;
    std::string records;
    if (!load_chunk(index, records)) return true;
    for (Fields inner(records); inner.more();) {
        const auto kind = inner.get<std::uint8_t>();
        const std::string_view what = inner.blob();
        if (inner.good() && (kind == op_schema || kind == op_channel) && !add_entry(kind, what)) {
            return false;
        }
    }
    return true;
}

// A message, to the run of messages before it when that ends here.
void Reader::add_loose(std::uint64_t at, std::uint64_t length, std::uint64_t time) {
    constexpr std::uint64_t run = std::uint64_t{1} << 20;
    if (chunks_.empty() || !chunks_.back().loose ||
        chunks_.back().offset + chunks_.back().length != at || chunks_.back().length >= run) {
        ChunkIndex& index = chunks_.emplace_back();
        index.begin_time = time;
        index.end_time = time;
        index.offset = at;
        index.loose = true;
    }
    ChunkIndex& index = chunks_.back();
    index.begin_time = std::min(index.begin_time, time);
    index.end_time = std::max(index.end_time, time);
    index.length += length;
}

bool Reader::load_chunk(const ChunkIndex& chunk, std::string& records) {
    std::string bytes;
    if (chunk.loose) {
        return source_->read(chunk.offset, static_cast<std::size_t>(chunk.length), records) ||
               fail("a message is missing");
    }
    if (chunk.length < record_head || chunk.length > max_chunk || chunk.size > max_chunk) {
        return fail("a chunk is larger than 256 MiB");
    }
    if (!source_->read(chunk.offset, static_cast<std::size_t>(chunk.length), bytes)) {
        return fail("missing chunk at the position in the index: the file is damaged or truncated");
    }
    Fields fields(bytes);
    if (fields.get<std::uint8_t>() != op_chunk) {
        return fail("missing chunk at the position in the index");
    }
    Fields content(fields.blob());
    content.get<std::uint64_t>();
    content.get<std::uint64_t>();
    const auto size = content.get<std::uint64_t>();
    const auto crc = content.get<std::uint32_t>();
    const std::string_view compression = content.text();
    const std::string_view compressed = content.blob();
    if (!fields.good() || !content.good() || size > max_chunk) {
        return fail("a chunk is incomplete");
    }
    std::string problem;
    if (!expand(compression, compressed, size, records, problem)) return fail(problem);
    ++chunks_read_;
    return crc == 0 || crc32(records) == crc || fail("a chunk is damaged: its CRC is wrong");
}

std::uint64_t Reader::begin_time() const {
    std::uint64_t time = chunks_.empty() ? 0 : std::numeric_limits<std::uint64_t>::max();
    for (const ChunkIndex& chunk : chunks_) {
        time = std::min(time, chunk.begin_time);
    }
    return time;
}

std::uint64_t Reader::end_time() const {
    std::uint64_t time = 0;
    for (const ChunkIndex& chunk : chunks_) {
        time = std::max(time, chunk.end_time);
    }
    return time;
}

std::map<std::string, std::string> Reader::metadata(std::string_view name) {
    std::map<std::string, std::string> all;
    for (const Metadata& one : metadata_) {
        std::string bytes;
        if (one.name != name || one.length > (1 << 20) ||
            !source_->read(one.offset, static_cast<std::size_t>(one.length), bytes)) {
            continue;
        }
        Fields fields(bytes);
        if (fields.get<std::uint8_t>() != op_metadata) continue;
        Fields content(fields.blob());
        content.text();
        all.merge(read_pairs(content.text()));
    }
    return all;
}

bool Reader::each(const Visit& visit, std::uint64_t begin, std::uint64_t end) {
    damaged_.clear();
    std::string first_problem;
    std::string records;
    bool goes_on = true;
    for (const ChunkIndex& chunk : chunks_) {
        if (!goes_on) break;
        if (chunk.end_time < begin || chunk.begin_time >= end) continue;
        if (!load_chunk(chunk, records)) {
            if (damaged_.empty()) {
                first_problem = problem_;
            }
            damaged_.push_back(chunk);
            continue;
        }
        goes_on = each_in(records, visit, begin, end);
    }
    problem_ = first_problem;
    return damaged_.empty();
}

/// Calls `visit` for the messages of a chunk; returns what it returned last.
bool Reader::each_in(std::string_view records, const Visit& visit, std::uint64_t begin,
                     std::uint64_t end) {
    for (Fields fields(records); fields.more();) {
        const auto opcode = fields.get<std::uint8_t>();
        const std::string_view content = fields.blob();
        if (!fields.good() || opcode != op_message || content.size() < message_head) continue;
        const Message message = read_message(content);
        const bool is_wanted = message.log_time >= begin && message.log_time < end;
        if (is_wanted && !visit(message)) return false;
    }
    return true;
}

}  // namespace hal::mcap
