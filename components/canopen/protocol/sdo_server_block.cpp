// SPDX-License-Identifier: MIT
// SDO block transfer of the server (CiA 301). In a block download a gap invalidates the rest of the
// block; the acknowledgement names the last good segment, after which the client continues.
#include <algorithm>

#include "sdo_server.hpp"

namespace hal::canopen {

void SdoServer::start_block_download(const Frame& f) noexcept {
    if (select(f) == nullptr) return;
    crc_used_ = (f.data[0] & 4) != 0;
    size_known_ = (f.data[0] & 2) != 0;
    size_ = size_known_ ? load<std::uint32_t>(f.data.data() + 4) : 0;
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
    if (acknowledged_early_ && number != 1) return;
    if (!block_any_ && number != 1 && number == acknowledged_ &&
        std::equal(held_.begin(), held_.end(), f.data.begin() + 1)) {
        // The last segment of the previous block: a duplicate, or the client missed the
        // acknowledgement.
        if (now_ - acknowledged_at_ >= acknowledge_after() / 4) {
            acknowledged_at_ = now_;
            answer({0xa2, acknowledged_, block_size_});
        }
        return;
    }
    acknowledged_early_ = false;
    block_any_ = true;
    if (number == sequence_ + 1 && number <= block_size_ && !last_seen_) {
        if (held_count_ != 0) {
            if (crc_used_) {
                crc_ = crc16(held_, crc_);
            }
            if (const auto why = write_object(held_); why != Abort::none) return abort(why);
        }
        std::copy_n(f.data.begin() + 1, 7, held_.begin());
        held_count_ = 7;
        sequence_ = number;
        last_seen_ = last;
    } else if (number <= sequence_ && !last && number != block_size_) {
        return;  // duplicate
    } else if (number > sequence_) {
        gap_ = true;
    }
    if (number == block_size_ || last) {
        acknowledge_block(gap_ ? BlockChange::smaller : BlockChange::larger);
    }
}

void SdoServer::acknowledge_block(BlockChange change) noexcept {
    block_size_ =
        next_block_size(block_size_, change, sequence_, acknowledged_, settings_.block_size);
    acknowledged_ = sequence_;
    acknowledged_at_ = now_;
    answer({0xa2, sequence_, block_size_});
    sequence_ = 0;
    block_any_ = gap_ = false;
    if (last_seen_) {
        state_ = State::block_download_end;
    }
}

/// The end of the block was lost, or the client is slow: acknowledges what arrived, and the client
/// continues from there with a new block. If nothing of this block arrived, the last
/// acknowledgement or the whole block was lost; the client then sees an invalid segment number, or
/// the CRC fails.
void SdoServer::on_block_timeout() noexcept {
    if (!block_any_) {
        return answer({0xa2, acknowledged_, block_size_});
    }
    acknowledge_block(gap_ ? BlockChange::smaller : BlockChange::same);
    acknowledged_early_ = state_ == State::block_download;
}

void SdoServer::end_block_download(const Frame& f) noexcept {
    // the confirmation was lost
    if (state_ == State::idle && ended_ == State::block_download_end) {
        return answer({0xa1});
    }
    if (state_ != State::block_download_end) return abort(Abort::command);
    const std::uint32_t count = 7 - (f.data[0] >> 2 & 7);
    const std::span<const std::uint8_t> rest{held_.data(), count};
    if (crc_used_ && crc16(rest, crc_) != load<std::uint16_t>(f.data.data() + 1)) {
        return abort(Abort::crc);
    }
    auto why = write_object(rest);
    if (why == Abort::none) {
        why = commit();
    }
    if (why != Abort::none) return abort(why);
    answer({0xa1});
    finish();
}

void SdoServer::start_block_upload(const Frame& f) noexcept {
    if (f.data[4] < 1 || f.data[4] > 127) {
        index_ = load<std::uint16_t>(f.data.data() + 1);
        sub_ = f.data[3];
        return abort(Abort::block_size);
    }
    if (select(f) == nullptr || !open_read()) return;
    // protocol switch: size within pst, and segments are cheaper
    if (size_ == 0 || (f.data[5] != 0 && size_ <= f.data[5])) {
        if (stream_open_) {
            entry_->stream->close(*entry_, false, true);
        }
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
        if (state_ == State::block_upload) {
            return;  // duplicate
        }
        if (state_ != State::block_upload_start) break;
        state_ = State::block_upload;
        return send_block();
    case 2: {
        if (state_ == State::block_upload_end) {
            return end_block_upload();  // the end frame was lost
        }
        if (state_ == State::idle && ended_ == State::block_upload_end) return;
        if (state_ != State::block_upload) break;
        const std::uint8_t good = f.data[1];
        const std::uint8_t next = f.data[2];
        if (next < 1 || next > 127) return abort(Abort::block_size);
        if (good > 127) {
            return abort(Abort::sequence);  // invalid segment number
        }
        const auto acknowledgement = static_cast<std::uint16_t>(good << 8 | next);
        const bool again = acknowledgement == last_acknowledgement_;
        // refers to an earlier block
        if (again && (good > sequence_ || !block_sent_ || out_.popped() < block_end_)) return;
        if (good > sequence_) return abort(Abort::sequence);
        // After a loss the client never acknowledges two blocks alike: the frame is a duplicate, or
        // the client still waits for this block.
        if (again && good != next) {
            if (now_ - acknowledged_at_ < acknowledge_after() / 4) return;
            if (good != 0) {
                acknowledged_at_ = now_;
                sequence_ = 0;
                block_sent_ = false;
                return send_block();
            }
        }
        last_acknowledgement_ = acknowledgement;
        acknowledged_at_ = now_;
        offset_ += std::min<std::uint32_t>(good * 7U, size_ - offset_);
        block_size_ = next;
        sequence_ = 0;
        block_sent_ = false;
        if (offset_ == size_) {
            state_ = State::block_upload_end;
            return end_block_upload();
        }
        return send_block();
    }
    case 1:
        if (state_ == State::idle && ended_ == State::block_upload_end) {
            return;  // duplicate
        }
        if (state_ != State::block_upload_end) break;
        if (stream_open_) {
            entry_->stream->close(*entry_, false, true);
        }
        stream_open_ = false;
        return finish();
    default: break;
    }
    abort(Abort::command);
}

void SdoServer::send_block() noexcept {
    while (!block_sent_ && out_.space() > out_.reserve()) {
        const auto from = offset_ + sequence_ * 7U;
        const auto count = std::min<std::uint32_t>(7, size_ - from);
        const bool last = from + count == size_;
        Frame f = make_frame(answer_cob_, 8);
        if (const auto why = read_object(from, {f.data.data() + 1, count}); why != Abort::none) {
            return abort(why);
        }
        if (crc_used_ && from == crc_until_) {
            crc_ = crc16({f.data.data() + 1, count}, crc_);
            crc_until_ += count;
        }
        if (last) {
            unused_ = static_cast<std::uint8_t>(7 - count);
        }
        f.data[0] = static_cast<std::uint8_t>(++sequence_ | (last ? 0x80 : 0));
        out_.push(f);
        block_sent_ = last || sequence_ == block_size_;
        block_end_ = out_.popped() + out_.size();
        heard_ = now_;
    }
}

void SdoServer::end_block_upload() noexcept {
    Bytes b{static_cast<std::uint8_t>(0xc1 | unused_ << 2)};
    store(b.data() + 1, crc_used_ ? crc_ : std::uint16_t{0});
    answer(b);
}

}  // namespace hal::canopen
