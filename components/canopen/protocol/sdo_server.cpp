// SPDX-License-Identifier: MIT
#include "sdo_server.hpp"

#include <algorithm>

namespace hal::canopen {

namespace {
constexpr std::uint16_t index_of(const Frame& f) noexcept { return static_cast<std::uint16_t>(f.data[1] | f.data[2] << 8); }
}  // namespace

SdoServer::SdoServer(Dictionary& dictionary, FrameQueue& out, const SdoServerSettings& settings)
    : dictionary_(dictionary),
      out_(out),
      settings_(settings),
      scratch_(std::make_unique<std::uint8_t[]>(dictionary.longest())),
      scratch_size_(dictionary.longest()) {}

void SdoServer::configure(std::uint32_t request_cob, std::uint32_t answer_cob) noexcept {
    reset();
    on_ = ((request_cob | answer_cob) & cob_invalid) == 0 && cob_id(request_cob) != 0 && cob_id(answer_cob) != 0;
    request_id_ = cob_id(request_cob);
    request_extended_ = (request_cob & cob_extended) != 0;
    answer_cob_ = answer_cob;
}

void SdoServer::reset() noexcept {
    if (stream_open_) entry_->stream->close(*entry_, writing_, false);
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
    Bytes b{command, static_cast<std::uint8_t>(index_), static_cast<std::uint8_t>(index_ >> 8), sub_};
    store(b.data() + 4, value);
    answer(b);
}

void SdoServer::abort(Abort why, bool tell) noexcept {
    if (stream_open_) entry_->stream->close(*entry_, writing_, false);
    stream_open_ = repeatable_ = false;
    state_ = ended_ = State::idle;
    last_abort_ = why;
    ++aborted_;
    if (tell) answer_initiate(0x80, static_cast<std::uint32_t>(why));
}

void SdoServer::finish() noexcept {
    ended_ = state_;
    state_ = State::idle;
    ++transfers_;
}

Entry* SdoServer::select(const Frame& f) noexcept {
    if (stream_open_) entry_->stream->close(*entry_, writing_, false);
    stream_open_ = repeatable_ = false;
    state_ = ended_ = State::idle;
    index_ = index_of(f), sub_ = f.data[3];
    toggle_ = 0, offset_ = 0, size_ = 0, crc_ = 0, crc_until_ = 0, sequence_ = 0, held_count_ = 0;
    last_seen_ = block_sent_ = block_any_ = gap_ = cut_short_ = false;
    last_acknowledgement_ = 0, acknowledged_ = 0;
    Abort why;
    entry_ = dictionary_.find(index_, sub_, why);
    if (entry_ == nullptr) abort(why);
    return entry_;
}

void SdoServer::handle(const Frame& f, Time now) noexcept {
    if (f.length != 8) return;
    now_ = heard_ = now;
    pending_ = false;  // the client did not wait for it
    Bytes bytes;
    std::copy_n(f.data.begin(), 8, bytes.begin());
    const bool repeated = bytes == last_request_;
    last_request_ = bytes;
    const std::uint8_t command = f.data[0];
    if (command == 0x80) {
        if (state_ != State::idle) abort(static_cast<Abort>(load<std::uint32_t>(f.data.data() + 4)), false);
        return;
    }
    if (state_ == State::block_download) {
        // Its answer was lost, or its abort: the client asks again. Only a segment that is not due can look like this.
        if (bytes == block_request_ && (command & 0x7f) != sequence_ + 1) return start_block_download(f);
        return block_segment(f);
    }
    if (state_ == State::block_download_end && repeated)
        return answer(last_answer_);  // the last segment again: still no acknowledgement there
    if (repeated && repeatable_ && settings_.tolerate_repeats && (command >> 5 == 0 || command >> 5 == 3)) return answer(last_answer_);
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
    if (state_ == State::idle) index_ = index_of(f), sub_ = f.data[3];
    abort(Abort::command);
}

// Access to the object, by way of the scratch memory or the domain's stream.

bool SdoServer::open_read() noexcept {
    if (const auto why = dictionary_.prepare_read(*entry_); why != Abort::none) return abort(why), false;
    writing_ = false;
    if (entry_->stream != nullptr) {
        size_ = 0;
        if (const auto why = entry_->stream->open_read(*entry_, size_); why != Abort::none) return abort(why), false;
        stream_open_ = true;
    } else {
        size_ = std::min(entry_->size, static_cast<std::uint32_t>(scratch_size_));
        if (size_ != 0) std::memcpy(scratch_.get(), entry_->data, size_);
    }
    return true;
}

Abort SdoServer::give(std::uint32_t offset, std::span<std::uint8_t> room) noexcept {
    if (room.empty()) return Abort::none;
    if (entry_->stream != nullptr) return entry_->stream->read(*entry_, offset, room);
    std::memcpy(room.data(), scratch_.get() + offset, room.size());
    return Abort::none;
}

Abort SdoServer::open_write(std::uint32_t size) noexcept {
    if (!writable(entry_->access)) return Abort::read_only;
    writing_ = true;
    if (entry_->stream != nullptr) {
        if (const auto why = entry_->stream->open_write(*entry_, size); why != Abort::none) return why;
        stream_open_ = true;
        return Abort::none;
    }
    return size_told_ ? Dictionary::check_length(*entry_, size) : Abort::none;
}

Abort SdoServer::take(std::span<const std::uint8_t> bytes) noexcept {
    if (size_told_ && bytes.size() > size_ - offset_) return Abort::too_long;
    if (entry_->stream != nullptr) {
        if (const auto why = entry_->stream->write(*entry_, offset_, bytes); why != Abort::none) return why;
    } else {
        const auto room = std::min<std::size_t>(scratch_size_, entry_->capacity);
        if (bytes.size() > room - offset_) return Abort::too_long;
        if (!bytes.empty()) std::memcpy(scratch_.get() + offset_, bytes.data(), bytes.size());
    }
    offset_ += static_cast<std::uint32_t>(bytes.size());
    return Abort::none;
}

Abort SdoServer::commit() noexcept {
    if (size_told_ && offset_ != size_) return Abort::too_short;
    if (entry_->stream == nullptr) return dictionary_.write(*entry_, {scratch_.get(), offset_});
    stream_open_ = false;
    const auto why = entry_->stream->close(*entry_, true, true);
    if (why == Abort::none && entry_->handler != nullptr) entry_->handler->written(*entry_);
    return why;
}

// Expedited and segmented.

void SdoServer::start_download(const Frame& f) noexcept {
    if (select(f) == nullptr) return;
    const bool expedited = (f.data[0] & 2) != 0;
    size_told_ = (f.data[0] & 1) != 0;
    if (expedited) {
        std::uint32_t size = 4 - (f.data[0] >> 2 & 3);
        if (!size_told_) size = entry_->bits != 0 && entry_->capacity <= 4 ? entry_->capacity : 4;
        size_ = size, size_told_ = true;
        Abort why = Abort::none;
        if (entry_->stream == nullptr) {
            why = dictionary_.write(*entry_, {f.data.data() + 4, size});
        } else {
            why = open_write(size);
            if (why == Abort::none) why = take({f.data.data() + 4, size});
            if (why == Abort::none) why = commit();
        }
        if (why != Abort::none) return abort(why);
        ++transfers_;
        return answer_initiate(0x60, 0);
    }
    size_ = size_told_ ? load<std::uint32_t>(f.data.data() + 4) : 0;
    if (const auto why = open_write(size_); why != Abort::none) return abort(why);
    state_ = State::download;
    repeatable_ = false;
    answer_initiate(0x60, 0);
}

void SdoServer::download_segment(const Frame& f) noexcept {
    if (state_ != State::download) return abort(Abort::command);
    if ((f.data[0] & 0x10) != toggle_) return abort(Abort::toggle);
    const std::uint32_t count = 7 - (f.data[0] >> 1 & 7);
    if (const auto why = take({f.data.data() + 1, count}); why != Abort::none) return abort(why);
    const bool last = (f.data[0] & 1) != 0;
    if (last)
        if (const auto why = commit(); why != Abort::none) return abort(why);
    answer({static_cast<std::uint8_t>(0x20 | toggle_)});
    toggle_ ^= 0x10;
    repeatable_ = true;
    if (last) finish();
}

void SdoServer::start_upload(const Frame& f) noexcept {
    if (select(f) == nullptr || !open_read()) return;
    if (size_ > 0 && size_ <= 4) {
        std::uint32_t value = 0;
        if (const auto why = give(0, {reinterpret_cast<std::uint8_t*>(&value), size_}); why != Abort::none) return abort(why);
        if (stream_open_) entry_->stream->close(*entry_, false, true);
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
    if (const auto why = give(offset_, {b.data() + 1, count}); why != Abort::none) return abort(why);
    offset_ += count;
    const bool last = offset_ == size_;
    b[0] = static_cast<std::uint8_t>(toggle_ | (7 - count) << 1 | (last ? 1 : 0));
    answer(b);
    toggle_ ^= 0x10;
    repeatable_ = true;
    if (!last) return;
    if (stream_open_) entry_->stream->close(*entry_, false, true);
    stream_open_ = false;
    finish();
}

// Block download. A gap makes the rest of the block worthless; the acknowledgement says from where the client goes on.

void SdoServer::start_block_download(const Frame& f) noexcept {
    if (select(f) == nullptr) return;
    crc_used_ = (f.data[0] & 4) != 0;
    size_told_ = (f.data[0] & 2) != 0;
    size_ = size_told_ ? load<std::uint32_t>(f.data.data() + 4) : 0;
    if (const auto why = open_write(size_); why != Abort::none) return abort(why);
    state_ = State::block_download;
    block_request_ = last_request_;
    block_size_ = std::clamp<std::uint8_t>(settings_.block_size, 1, 127);
    reminded_ = now_;
    answer_initiate(0xa4, block_size_);
}

void SdoServer::block_segment(const Frame& f) noexcept {
    const std::uint8_t number = f.data[0] & 0x7f;
    const bool last = (f.data[0] & 0x80) != 0;
    reminded_ = now_;
    if (cut_short_ && number != 1) return;
    if (!block_any_ && number != 1 && number == acknowledged_ && std::equal(held_.begin(), held_.end(), f.data.begin() + 1)) {
        // The last segment of the block before: it came twice, or the client did not get the acknowledgement.
        if (now_ - acknowledged_at_ >= acknowledge_after() / 4) acknowledged_at_ = now_, answer({0xa2, acknowledged_, block_size_});
        return;
    }
    cut_short_ = false;
    block_any_ = true;
    if (number == sequence_ + 1 && number <= block_size_ && !last_seen_) {
        if (held_count_ != 0) {
            if (crc_used_) crc_ = crc16(held_, crc_);
            if (const auto why = take(held_); why != Abort::none) return abort(why);
        }
        std::copy_n(f.data.begin() + 1, 7, held_.begin());
        held_count_ = 7;
        sequence_ = number;
        last_seen_ = last;
    } else if (number <= sequence_ && !last && number != block_size_) {
        return;  // came twice
    } else if (number > sequence_) {
        gap_ = true;
    }
    if (number == block_size_ || last) acknowledge_block(gap_ ? Size::smaller : Size::larger);
}

void SdoServer::acknowledge_block(Size next) noexcept {
    const std::uint8_t before = block_size_;
    if (next != Size::same) block_size_ = next_block_size(before, next == Size::smaller, sequence_, settings_.block_size);
    // Of a part of a block, the same twice would be taken for the last one again.
    if (sequence_ == acknowledged_ && block_size_ == before && sequence_ != before)
        block_size_ = next_block_size(before, true, sequence_, settings_.block_size);
    acknowledged_ = sequence_;
    acknowledged_at_ = now_;
    answer({0xa2, sequence_, block_size_});
    sequence_ = 0;
    block_any_ = gap_ = false;
    if (last_seen_) state_ = State::block_download_end;
}

/// The end of the block was lost, or the client is slow: it goes on behind what is acknowledged, with a new block. With nothing of this block
/// here, the acknowledgement of the last one was lost, or all of this block: then the client finds a number it did not send, or the CRC tells.
void SdoServer::on_silence_in_block() noexcept {
    if (!block_any_) return answer({0xa2, acknowledged_, block_size_});
    acknowledge_block(gap_ ? Size::smaller : Size::same);
    cut_short_ = state_ == State::block_download;
}

void SdoServer::end_block_download(const Frame& f) noexcept {
    if (state_ == State::idle && ended_ == State::block_download_end) return answer({0xa1});  // its confirmation was lost
    if (state_ != State::block_download_end) return abort(Abort::command);
    const std::uint32_t count = 7 - (f.data[0] >> 2 & 7);
    const std::span<const std::uint8_t> rest{held_.data(), count};
    if (crc_used_ && crc16(rest, crc_) != load<std::uint16_t>(f.data.data() + 1)) return abort(Abort::crc);
    auto why = take(rest);
    if (why == Abort::none) why = commit();
    if (why != Abort::none) return abort(why);
    answer({0xa1});
    finish();
}

// Block upload.

void SdoServer::start_block_upload(const Frame& f) noexcept {
    if (f.data[4] < 1 || f.data[4] > 127) {
        index_ = index_of(f), sub_ = f.data[3];
        return abort(Abort::block_size);
    }
    if (select(f) == nullptr || !open_read()) return;
    if (size_ == 0 || (f.data[5] != 0 && size_ <= f.data[5])) {  // the client lets us choose, and segments are cheaper
        if (stream_open_) entry_->stream->close(*entry_, false, true);
        stream_open_ = false;
        return start_upload(f);
    }
    crc_used_ = (f.data[0] & 4) != 0;
    block_size_ = f.data[4];
    state_ = State::block_upload_start;
    answer_initiate(0xc6, size_);
}

void SdoServer::block_upload_command(const Frame& f) noexcept {
    switch (f.data[0] & 3) {
    case 3:
        if (state_ == State::block_upload) return;  // came twice
        if (state_ != State::block_upload_start) break;
        state_ = State::block_upload;
        return pump();
    case 2: {
        if (state_ == State::block_upload_end) return end_block_upload();  // its end frame was lost
        if (state_ == State::idle && ended_ == State::block_upload_end) return;
        if (state_ != State::block_upload) break;
        const std::uint8_t good = f.data[1], next = f.data[2];
        if (next < 1 || next > 127) return abort(Abort::block_size);
        if (good > 127) return abort(Abort::sequence);  // no segment has such a number
        const auto said = static_cast<std::uint16_t>(good << 8 | next);
        const bool again = said == last_acknowledgement_;
        if (again && (good > sequence_ || !block_sent_ || out_.taken() < block_end_)) return;  // of an earlier block
        if (good > sequence_) return abort(Abort::sequence);
        // After a loss the client never says the same of two blocks: this one came twice, or it still waits for our block.
        if (again && good != next) {
            if (now_ - acknowledged_at_ < acknowledge_after() / 4) return;
            if (good != 0) {
                acknowledged_at_ = now_;
                sequence_ = 0;
                block_sent_ = false;
                return pump();
            }
        }
        last_acknowledgement_ = said;
        acknowledged_at_ = now_;
        offset_ += std::min<std::uint32_t>(good * 7U, size_ - offset_);
        block_size_ = next;
        sequence_ = 0;
        block_sent_ = false;
        if (offset_ == size_) {
            state_ = State::block_upload_end;
            return end_block_upload();
        }
        return pump();
    }
    case 1:
        if (state_ == State::idle && ended_ == State::block_upload_end) return;  // came twice
        if (state_ != State::block_upload_end) break;
        if (stream_open_) entry_->stream->close(*entry_, false, true);
        stream_open_ = false;
        return finish();
    default: break;
    }
    abort(Abort::command);
}

void SdoServer::pump() noexcept {
    while (!block_sent_ && out_.room() > out_.reserve()) {
        const auto from = offset_ + sequence_ * 7U;
        const auto count = std::min<std::uint32_t>(7, size_ - from);
        const bool last = from + count == size_;
        Frame f = make_frame(answer_cob_, 8);
        if (const auto why = give(from, {f.data.data() + 1, count}); why != Abort::none) return abort(why);
        if (crc_used_ && from == crc_until_) crc_ = crc16({f.data.data() + 1, count}, crc_), crc_until_ += count;
        if (last) unused_ = static_cast<std::uint8_t>(7 - count);
        f.data[0] = static_cast<std::uint8_t>(++sequence_ | (last ? 0x80 : 0));
        out_.push(f);
        block_sent_ = last || sequence_ == block_size_;
        block_end_ = out_.taken() + out_.size();
        heard_ = now_;
    }
}

void SdoServer::end_block_upload() noexcept {
    Bytes b{static_cast<std::uint8_t>(0xc1 | unused_ << 2)};
    store(b.data() + 1, crc_used_ ? crc_ : std::uint16_t{0});
    answer(b);
}

void SdoServer::poll(Time now) noexcept {
    now_ = now;
    if (pending_) answer(last_answer_);
    if (state_ == State::idle) return;
    if (state_ == State::block_upload) pump();
    if (state_ == State::block_download && now - reminded_ >= acknowledge_after() && now - heard_ < settings_.timeout &&
        (block_any_ || offset_ != 0 || held_count_ != 0)) {
        reminded_ = now;
        on_silence_in_block();
    }
    if (now - heard_ < settings_.timeout) return;
    if (state_ == State::block_upload_end) {  // all was given; only the client's last word is missing
        if (stream_open_) entry_->stream->close(*entry_, false, true);
        stream_open_ = false;
        return finish();
    }
    abort(Abort::timeout);
}

}  // namespace hal::canopen
