// SPDX-License-Identifier: MIT
#include "sdo_server.hpp"

#include <algorithm>

namespace hal::canopen {

SdoServer::SdoServer(Dictionary& dictionary, FrameQueue& out, const SdoServerSettings& settings)
    : dictionary_(dictionary),
      out_(out),
      settings_(settings),
      scratch_(std::make_unique<std::uint8_t[]>(dictionary.longest())),
      scratch_size_(dictionary.longest()) {}

void SdoServer::configure(std::uint32_t request_cob, std::uint32_t answer_cob) noexcept {
    reset();
    on_ = ((request_cob | answer_cob) & cob_invalid) == 0 && cob_id(request_cob) != 0 &&
          cob_id(answer_cob) != 0;
    request_id_ = cob_id(request_cob);
    request_extended_ = (request_cob & cob_extended) != 0;
    answer_cob_ = answer_cob;
}

void SdoServer::reset() noexcept {
    if (stream_open_) {
        entry_->stream->close(*entry_, writing_, false);
    }
    stream_open_ = pending_ = repeatable_ = false;
    state_ = ended_ = State::idle;
}

void SdoServer::answer(const Bytes& bytes) noexcept {
    last_answer_ = bytes;
    Frame f = make_frame(answer_cob_, 8);
    std::copy(bytes.begin(), bytes.end(), f.data.begin());
    pending_ = !out_.push(f);
}

void SdoServer::answer_initiate(std::uint8_t command, std::uint32_t value) noexcept {
    Bytes b{command, static_cast<std::uint8_t>(index_), static_cast<std::uint8_t>(index_ >> 8),
            sub_};
    store(b.data() + 4, value);
    answer(b);
}

void SdoServer::abort(Abort why, bool notify) noexcept {
    if (stream_open_) {
        entry_->stream->close(*entry_, writing_, false);
    }
    stream_open_ = repeatable_ = false;
    state_ = ended_ = State::idle;
    last_abort_ = why;
    ++aborted_;
    if (notify) {
        answer_initiate(0x80, static_cast<std::uint32_t>(why));
    }
}

void SdoServer::finish() noexcept {
    ended_ = state_;
    state_ = State::idle;
    ++transfers_;
}

Entry* SdoServer::select(const Frame& f) noexcept {
    if (stream_open_) {
        entry_->stream->close(*entry_, writing_, false);
    }
    stream_open_ = repeatable_ = false;
    state_ = ended_ = State::idle;
    index_ = load<std::uint16_t>(f.data.data() + 1);
    sub_ = f.data[3];
    toggle_ = 0;
    offset_ = 0;
    size_ = 0;
    crc_ = 0;
    crc_until_ = 0;
    sequence_ = 0;
    held_count_ = 0;
    last_seen_ = block_sent_ = block_any_ = gap_ = acknowledged_early_ = false;
    last_acknowledgement_ = 0;
    acknowledged_ = 0;
    Abort why;
    entry_ = dictionary_.find(index_, sub_, why);
    if (entry_ == nullptr) {
        abort(why);
    }
    return entry_;
}

void SdoServer::handle(const Frame& f, Time now) noexcept {
    if (f.length != 8) return;
    now_ = heard_ = now;
    pending_ = false;  // the client did not wait for the response
    Bytes bytes;
    std::copy_n(f.data.begin(), 8, bytes.begin());
    const bool repeated = bytes == last_request_;
    last_request_ = bytes;
    const std::uint8_t command = f.data[0];
    if (command == 0x80) {
        if (state_ != State::idle) {
            abort(static_cast<Abort>(load<std::uint32_t>(f.data.data() + 4)), false);
        }
        return;
    }
    if (state_ == State::block_download) {
        // The response was lost, or the abort of the client: it repeats the request. Only a segment
        // out of sequence can look like this.
        if (bytes == block_request_ && (command & 0x7f) != sequence_ + 1) {
            return start_block_download(f);
        }
        return block_segment(f);
    }
    if (state_ == State::block_download_end && repeated) {
        return answer(
            last_answer_);  // the last segment repeated: the client missed the acknowledgement
    }
    if (repeated && repeatable_ && settings_.tolerate_repeats &&
        (command >> 5 == 0 || command >> 5 == 3)) {
        return answer(last_answer_);
    }
    switch (command >> 5) {
    case 0: return download_segment(f);
    case 1: return start_download(f);
    case 2: return start_upload(f);
    case 3: return upload_segment(f);
    case 5:
        if ((command & 3) == 0) return start_block_upload(f);
        return block_upload_command(f);
    case 6:
        if ((command & 1) == 0) return start_block_download(f);
        return end_block_download(f);
    default: break;
    }
    if (state_ == State::idle) {
        index_ = load<std::uint16_t>(f.data.data() + 1);
        sub_ = f.data[3];
    }
    abort(Abort::command);
}

bool SdoServer::open_read() noexcept {
    if (const auto why = dictionary_.prepare_read(*entry_); why != Abort::none) {
        abort(why);
        return false;
    }
    writing_ = false;
    if (entry_->stream != nullptr) {
        size_ = 0;
        if (const auto why = entry_->stream->open_read(*entry_, size_); why != Abort::none) {
            abort(why);
            return false;
        }
        stream_open_ = true;
    } else {
        size_ = std::min(entry_->size, static_cast<std::uint32_t>(scratch_size_));
        if (size_ != 0) {
            std::memcpy(scratch_.get(), entry_->data, size_);
        }
    }
    return true;
}

Abort SdoServer::read_object(std::uint32_t offset, std::span<std::uint8_t> buffer) noexcept {
    if (buffer.empty()) return Abort::none;
    if (entry_->stream != nullptr) return entry_->stream->read(*entry_, offset, buffer);
    std::memcpy(buffer.data(), scratch_.get() + offset, buffer.size());
    return Abort::none;
}

Abort SdoServer::open_write(std::uint32_t size) noexcept {
    if (!writable(entry_->access)) return Abort::read_only;
    writing_ = true;
    if (entry_->stream != nullptr) {
        if (const auto why = entry_->stream->open_write(*entry_, size); why != Abort::none) {
            return why;
        }
        stream_open_ = true;
        return Abort::none;
    }
    return size_known_ ? Dictionary::check_length(*entry_, size) : Abort::none;
}

Abort SdoServer::write_object(std::span<const std::uint8_t> bytes) noexcept {
    if (size_known_ && bytes.size() > size_ - offset_) return Abort::too_long;
    if (entry_->stream != nullptr) {
        if (const auto why = entry_->stream->write(*entry_, offset_, bytes); why != Abort::none) {
            return why;
        }
    } else {
        const auto capacity = std::min<std::size_t>(scratch_size_, entry_->capacity);
        if (bytes.size() > capacity - offset_) return Abort::too_long;
        if (!bytes.empty()) {
            std::memcpy(scratch_.get() + offset_, bytes.data(), bytes.size());
        }
    }
    offset_ += static_cast<std::uint32_t>(bytes.size());
    return Abort::none;
}

Abort SdoServer::commit() noexcept {
    if (size_known_ && offset_ != size_) return Abort::too_short;
    if (entry_->stream == nullptr) {
        return dictionary_.write(*entry_, {scratch_.get(), offset_});
    }
    stream_open_ = false;
    const auto why = entry_->stream->close(*entry_, true, true);
    if (why == Abort::none && entry_->handler != nullptr) {
        entry_->handler->written(*entry_);
    }
    return why;
}

void SdoServer::start_download(const Frame& f) noexcept {
    if (select(f) == nullptr) return;
    const bool expedited = (f.data[0] & 2) != 0;
    size_known_ = (f.data[0] & 1) != 0;
    if (expedited) {
        std::uint32_t size = 4 - (f.data[0] >> 2 & 3);
        if (!size_known_) {
            size = entry_->bits != 0 && entry_->capacity <= 4 ? entry_->capacity : 4;
        }
        size_ = size;
        size_known_ = true;
        Abort why = Abort::none;
        if (entry_->stream == nullptr) {
            why = dictionary_.write(*entry_, {f.data.data() + 4, size});
        } else {
            why = open_write(size);
            if (why == Abort::none) {
                why = write_object({f.data.data() + 4, size});
            }
            if (why == Abort::none) {
                why = commit();
            }
        }
        if (why != Abort::none) return abort(why);
        ++transfers_;
        return answer_initiate(0x60, 0);
    }
    size_ = size_known_ ? load<std::uint32_t>(f.data.data() + 4) : 0;
    if (const auto why = open_write(size_); why != Abort::none) return abort(why);
    state_ = State::download;
    repeatable_ = false;
    answer_initiate(0x60, 0);
}

void SdoServer::download_segment(const Frame& f) noexcept {
    if (state_ != State::download) return abort(Abort::command);
    if ((f.data[0] & 0x10) != toggle_) return abort(Abort::toggle);
    const std::uint32_t count = 7 - (f.data[0] >> 1 & 7);
    if (const auto why = write_object({f.data.data() + 1, count}); why != Abort::none) {
        return abort(why);
    }
    const bool last = (f.data[0] & 1) != 0;
    if (last) {
        if (const auto why = commit(); why != Abort::none) return abort(why);
    }
    answer({static_cast<std::uint8_t>(0x20 | toggle_)});
    toggle_ ^= 0x10;
    repeatable_ = true;
    if (last) {
        finish();
    }
}

void SdoServer::start_upload(const Frame& f) noexcept {
    if (select(f) == nullptr || !open_read()) return;
    if (size_ > 0 && size_ <= 4) {
        std::uint32_t value = 0;
        if (const auto why = read_object(0, {reinterpret_cast<std::uint8_t*>(&value), size_});
            why != Abort::none) {
            return abort(why);
        }
        if (stream_open_) {
            entry_->stream->close(*entry_, false, true);
        }
        stream_open_ = false;
        ++transfers_;
        return answer_initiate(static_cast<std::uint8_t>(0x43 | (4 - size_) << 2), value);
    }
    state_ = State::upload;
    answer_initiate(0x41, size_);
}

void SdoServer::upload_segment(const Frame& f) noexcept {
    if (state_ != State::upload) return abort(Abort::command);
    if ((f.data[0] & 0x10) != toggle_) return abort(Abort::toggle);
    const auto count = std::min<std::uint32_t>(7, size_ - offset_);
    Bytes b{};
    if (const auto why = read_object(offset_, {b.data() + 1, count}); why != Abort::none) {
        return abort(why);
    }
    offset_ += count;
    const bool last = offset_ == size_;
    b[0] = static_cast<std::uint8_t>(toggle_ | (7 - count) << 1 | (last ? 1 : 0));
    answer(b);
    toggle_ ^= 0x10;
    repeatable_ = true;
    if (!last) return;
    if (stream_open_) {
        entry_->stream->close(*entry_, false, true);
    }
    stream_open_ = false;
    finish();
}

void SdoServer::poll(Time now) noexcept {
    now_ = now;
    if (pending_) {
        answer(last_answer_);
    }
    if (state_ == State::idle) return;
    if (state_ == State::block_upload) {
        send_block();
    }
    if (state_ == State::block_download && now - reminded_ >= acknowledge_after() &&
        now - heard_ < settings_.timeout && (block_any_ || offset_ != 0 || held_count_ != 0)) {
        reminded_ = now;
        on_block_timeout();
    }
    if (now - heard_ < settings_.timeout) return;
    // all data was sent; only the final confirmation of the client is missing
    if (state_ == State::block_upload_end) {
        if (stream_open_) {
            entry_->stream->close(*entry_, false, true);
        }
        stream_open_ = false;
        return finish();
    }
    abort(Abort::timeout);
}

}  // namespace hal::canopen
