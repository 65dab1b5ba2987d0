// SPDX-License-Identifier: MIT
#include "recording/mcap/writer.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "recording/mcap/bytes.hpp"
#include "recording/mcap/crc.hpp"

namespace hal::mcap {
namespace {

std::string pairs(const std::map<std::string, std::string>& entries) {
    std::string content;
    for (const auto& [key, value] : entries) {
        put_text(content, key);
        put_text(content, value);
    }
    std::string text;
    put_text(text, content);
    return text;
}

std::string content(const Schema& schema) {
    std::string to;
    put(to, schema.id);
    put_text(to, schema.name);
    put_text(to, schema.encoding);
    put_text(to, schema.data);
    return to;
}

std::string content(const Channel& channel) {
    std::string to;
    put(to, channel.id);
    put(to, channel.schema);
    put_text(to, channel.topic);
    put_text(to, channel.encoding);
    return to + pairs(channel.metadata);
}

std::string content(const ChunkIndex& index) {
    std::string to;
    for (const std::uint64_t field :
         {index.begin_time, index.end_time, index.offset, index.length}) {
        put(to, field);
    }
    std::string offsets;
    for (const auto& [channel, offset] : index.message_indexes) {
        put(offsets, channel);
        put(offsets, offset);
    }
    put_text(to, offsets);
    put(to, index.message_index_length);
    put_text(to, index.compression);
    put(to, index.compressed_size);
    put(to, index.size);
    return to;
}

}  // namespace

Writer::Writer(std::string path, std::string_view profile)
    : path_(std::move(path)), held_(hold_part(path_)), file_(held_.file), error_(held_.error) {
    if (file_ < 0) return;
    std::string header;
    put_text(header, profile);
    put_text(header, "halcyon");
    write(magic);
    record(op_header, header);
}

Writer::~Writer() { close(); }

// A failed write leaves the file as it was before: it always ends with a whole record.
bool Writer::write(std::string_view bytes) {
    if (error_ != 0 || file_ < 0) return false;
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t n = ::write(file_, bytes.data() + done, bytes.size() - done);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) {
            error_ = n < 0 ? errno : ENOSPC;
            if (::ftruncate(file_, static_cast<off_t>(size_)) != 0 ||
                ::lseek(file_, static_cast<off_t>(size_), SEEK_SET) < 0) {
                return false;
            }
            return false;
        }
        done += static_cast<std::size_t>(n);
    }
    crc_ = crc32(bytes, crc_);
    size_ += bytes.size();
    return true;
}

bool Writer::record(std::uint8_t opcode, std::string_view content) {
    std::string bytes;
    put_record(bytes, opcode, content);
    return write(bytes);
}

std::uint16_t Writer::add_schema(std::string_view name, std::string_view encoding,
                                 std::string_view data) {
    const Schema& schema =
        schemas_.emplace_back(Schema{static_cast<std::uint16_t>(schemas_.size() + 1),
                                     std::string(name), std::string(encoding), std::string(data)});
    put_record(declared_, op_schema, content(schema));
    if (!chunk_.empty()) {
        put_record(chunk_, op_schema, content(schema));
    }
    return schema.id;
}

std::uint16_t Writer::add_channel(std::uint16_t schema, std::string_view topic,
                                  std::string_view encoding,
                                  std::map<std::string, std::string> metadata) {
    const Channel& channel = channels_.emplace_back(
        Channel{static_cast<std::uint16_t>(channels_.size() + 1), schema, std::string(topic),
                std::string(encoding), std::move(metadata)});
    put_record(declared_, op_channel, content(channel));
    if (!chunk_.empty()) {
        put_record(chunk_, op_channel, content(channel));
    }
    return channel.id;
}

bool Writer::message(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns,
                     std::string_view payload) {
    if (error_ != 0) return false;
    if (!chunk_.empty() &&
        (chunk_.size() >= chunk_bytes ||
         (time_ns > chunk_begin_ && time_ns - chunk_begin_ >= chunk_ns)) &&
        !flush()) {
        return false;
    }
    if (chunk_.empty()) {
        chunk_ = declared_;  // each chunk can be read by itself
        chunk_begin_ = chunk_end_ = time_ns;
    }
    chunk_begin_ = std::min(chunk_begin_, time_ns);
    chunk_end_ = std::max(chunk_end_, time_ns);
    std::string& index = indexes_[channel];
    put(index, time_ns);
    put(index, std::uint64_t{chunk_.size()});
    chunk_ += static_cast<char>(op_message);
    put(chunk_, std::uint64_t{22 + payload.size()});
    put(chunk_, channel);
    put(chunk_, sequence);
    put(chunk_, time_ns);
    put(chunk_, time_ns);
    chunk_ += payload;
    return true;
}

bool Writer::flush() {
    if (chunk_.empty()) return error_ == 0;
    compressor_.compress(chunk_, compressed_);
    ChunkIndex index{chunk_begin_,       chunk_end_,         size_,        0, {}, 0,
                     Compressor::name(), compressed_.size(), chunk_.size()};
    std::string head;
    put(head, chunk_begin_);
    put(head, chunk_end_);
    put(head, std::uint64_t{chunk_.size()});
    put(head, crc32(chunk_));
    put_text(head, index.compression);
    put(head, std::uint64_t{compressed_.size()});
    index.length = 9 + head.size() + compressed_.size();
    std::string bytes;
    bytes.reserve(index.length + 1024);
    bytes += static_cast<char>(op_chunk);
    put(bytes, std::uint64_t{head.size() + compressed_.size()});
    bytes += head;
    bytes += compressed_;
    for (const auto& [channel, entries] : indexes_) {
        index.message_indexes[channel] = size_ + bytes.size();
        std::string content;
        put(content, channel);
        put_text(content, entries);
        put_record(bytes, op_message_index, content);
    }
    index.message_index_length = bytes.size() - index.length;
    chunk_.clear();
    const auto indexes = std::exchange(indexes_, {});
    if (!write(bytes)) return false;
    auto& counts = counts_.emplace_back();
    for (const auto& [channel, entries] : indexes) {
        counts[channel] = entries.size() / 16;
    }
    chunks_.push_back(std::move(index));
    return true;
}

bool Writer::metadata(std::string_view name, const std::map<std::string, std::string>& entries) {
    if (!flush()) return false;
    std::string content;
    put_text(content, name);
    content += pairs(entries);
    metadata_.push_back({size_, content.size() + 9, 0, 0, std::string(name), ""});
    if (record(op_metadata, content)) return true;
    metadata_.pop_back();
    return false;
}

bool Writer::attachment(std::string_view name, std::string_view media_type, std::string_view data,
                        std::uint64_t time_ns) {
    if (!flush()) return false;
    std::string content;
    put(content, time_ns);
    put(content, time_ns);
    put_text(content, name);
    put_text(content, media_type);
    put(content, std::uint64_t{data.size()});
    content += data;
    put(content, crc32(content));
    attachments_.push_back({size_, content.size() + 9, time_ns, data.size(), std::string(name),
                            std::string(media_type)});
    if (record(op_attachment, content)) return true;
    attachments_.pop_back();
    return false;
}

// The records of the summary in groups, then where each group is. The file has `size_` bytes when
// this is called.
std::string Writer::summary() const {
    std::string all, offsets;
    const auto group = [&](std::uint8_t opcode, const auto& items, auto content_of) {
        const std::size_t begin = all.size();
        for (const auto& item : items) {
            put_record(all, opcode, content_of(item));
        }
        if (all.size() == begin) return;
        std::string content(1, static_cast<char>(opcode));
        put(content, size_ + begin);
        put(content, std::uint64_t{all.size() - begin});
        put_record(offsets, op_summary_offset, content);
    };
    group(op_schema, schemas_, [](const Schema& one) { return content(one); });
    group(op_channel, channels_, [](const Channel& one) { return content(one); });
    std::map<std::uint16_t, std::uint64_t> messages;
    std::uint64_t all_messages = 0;
    std::uint64_t first_time = chunks_.empty() ? 0 : UINT64_MAX;
    std::uint64_t last_time = 0;
    for (const auto& chunk : counts_) {
        for (const auto& [channel, count] : chunk) {
            messages[channel] += count;
            all_messages += count;
        }
    }
    for (const ChunkIndex& chunk : chunks_) {
        first_time = std::min(first_time, chunk.begin_time);

        last_time = std::max(last_time, chunk.end_time);
    }
    std::string statistics, counts;
    put(statistics, all_messages);
    put(statistics, static_cast<std::uint16_t>(schemas_.size()));
    for (const std::size_t count :
         {channels_.size(), attachments_.size(), metadata_.size(), chunks_.size()}) {
        put(statistics, static_cast<std::uint32_t>(count));
    }
    put(statistics, first_time);
    put(statistics, last_time);
    for (const auto& [channel, count] : messages) {
        put(counts, channel);
        put(counts, count);
    }
    put_text(statistics, counts);
    group(op_statistics, std::vector<std::string>{statistics},
          [](const std::string& one) { return one; });
    group(op_chunk_index, chunks_, [](const ChunkIndex& one) { return content(one); });
    group(op_attachment_index, attachments_, [](const Place& one) {
        std::string to;
        for (const std::uint64_t field :
             {one.offset, one.length, one.time_ns, one.time_ns, one.size}) {
            put(to, field);
        }
        put_text(to, one.name);
        put_text(to, one.media_type);
        return to;
    });
    group(op_metadata_index, metadata_, [](const Place& one) {
        std::string to;
        put(to, one.offset);
        put(to, one.length);
        put_text(to, one.name);
        return to;
    });
    const std::uint64_t offsets_begin = size_ + all.size();
    all += offsets;
    const std::uint64_t begin = size_;
    std::string footer(1, static_cast<char>(op_footer));
    put(footer, std::uint64_t{20});
    put(footer, begin);
    put(footer, offsets_begin);
    put(footer, crc32(footer, crc32(all)));
    return all + footer + std::string(magic);
}

bool Writer::close() {
    if (file_ < 0) return error_ == 0;
    flush();
    // On a full disk the space of the newest chunk is given to the summary: a recording that ends
    // early can be opened.
    const int failed = std::exchange(error_, 0);
    const auto finish = [&] {
        std::string end;
        put(end, crc_);
        return record(op_data_end, end) && write(summary());
    };
    const std::uint64_t data_end = size_;
    if (!finish()) {
        error_ = 0;
        std::uint64_t back = data_end;
        if (!chunks_.empty()) {
            back = chunks_.back().offset;
            chunks_.pop_back();
            counts_.pop_back();
            const auto gone = [back](const Place& place) { return place.offset >= back; };
            std::erase_if(attachments_, gone);
            std::erase_if(metadata_, gone);
        }
        size_ = back;
        if (::ftruncate(file_, static_cast<off_t>(size_)) == 0 &&
            ::lseek(file_, static_cast<off_t>(size_), SEEK_SET) >= 0) {
            std::string end;
            // 0: no CRC; computing it would mean reading the file again
            put(end, std::uint32_t{0});
            if (record(op_data_end, end)) {
                write(summary());
            }
        }
        if (error_ == 0) {
            error_ = ENOSPC;
        }
    }
    if (failed != 0) {
        error_ = failed;
    }
    if (::fsync(file_) != 0 && errno != EINVAL && error_ == 0) {
        error_ = errno;
    }
    // Under the lock, so that no other recorder takes the part for one that was left.
    if (error_ != 0 && messages() == 0) {
        removed_ = ::unlink(held_.path.c_str()) == 0;
    } else if (std::rename(held_.path.c_str(), held_.target.c_str()) == 0) {
        named_ = true;
    } else if (error_ == 0) {
        error_ = errno;
    }
    if (::close(file_) != 0 && error_ == 0) {
        error_ = errno;
    }
    file_ = -1;
    return error_ == 0;
}

std::string Writer::where() const {
    if (named_) return path_;
    if (removed_ || held_.error != 0) return "";
    return held_.path;
}

std::uint64_t Writer::messages() const {
    std::uint64_t sum = 0;
    for (const auto& chunk : counts_) {
        for (const auto& [channel, count] : chunk) {
            sum += count;
        }
    }
    return sum;
}

std::uint64_t Writer::messages(std::uint16_t channel) const {
    std::uint64_t sum = 0;
    for (const auto& chunk : counts_) {
        if (const auto at = chunk.find(channel); at != chunk.end()) {
            sum += at->second;
        }
    }
    return sum;
}

}  // namespace hal::mcap
