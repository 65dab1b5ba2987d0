// SPDX-License-Identifier: MIT
// SDO block transfer of the client (CiA 301): block download sends segments, block upload receives
// them.
#include <algorithm>

#include "sdo_client.hpp"

namespace hal::canopen {

void SdoClient::send_block() noexcept {
    while (!block_sent_ && out_.space() > out_.reserve()) {
        const auto from = offset_ + sequence_ * 7U;
        const auto count = std::min<std::uint32_t>(7, size_ - from);
        const bool last = from + count == size_;
        Bytes b{static_cast<std::uint8_t>(++sequence_ | (last ? 0x80 : 0))};
        std::memcpy(b.data() + 1, first_->data.data() + from, count);
        if (from == crc_until_) {
            crc_ = crc16({b.data() + 1, count}, crc_);
            crc_until_ += count;
        }
        send(b);
        block_sent_ = last || sequence_ == block_size_;
        block_end_ = out_.popped() + out_.size();
        heard_ = now_;
    }
}

void SdoClient::on_block_acknowledge(const Frame& f) noexcept {
    if ((f.data[0] & 0xe3) != 0xa2) return unexpected(Abort::command);
    const auto good = f.data[1];
    const auto next = f.data[2];
    const auto acknowledgement = static_cast<std::uint16_t>(good << 8 | next);
    const bool again = acknowledgement == last_acknowledgement_;
    // A repeated acknowledgement cannot refer to segments that are still in the transmit queue.
    if (again && (good > sequence_ || !block_sent_ || out_.popped() < block_end_)) {
        return unexpected(Abort::sequence);
    }
    if (good > sequence_) return restart_or_fail(Abort::sequence, false);
    // A server that varies the block size after a loss never acknowledges two blocks alike: the
    // frame is a duplicate, or the server still waits for this block. An acknowledgement in the
    // middle of a block means that the server timed out: continue after its last good segment.
    if (again && good != next) {
        if (now_ - acknowledged_at_ < settings_.timeout / 10) return unexpected(Abort::sequence);
        if (good != 0) {
            if (++stalls_ > 4 + settings_.resends) return restart_or_fail(Abort::sequence, false);
            acknowledged_at_ = now_;
            sequence_ = 0;
            block_sent_ = false;
            return send_block();
        }
    }
    last_acknowledgement_ = acknowledgement;
    acknowledged_at_ = now_;
    if (next < 1 || next > 127) return abort(Abort::block_size);
    if (good == 0 && ++stalls_ > 4 + settings_.resends) {
        return restart_or_fail(Abort::sequence, false);
    }
    if (good != 0) {
        stalls_ = 0;
    }
    if (good < sequence_) {
        ++retries_;
        ++first_->retries;
    }
    progress();
    offset_ += std::min<std::uint32_t>(good * 7U, size_ - offset_);
    block_size_ = next;
    sequence_ = 0;
    block_sent_ = false;
    if (offset_ != size_) return send_block();
    state_ = State::block_download_end;
    send_block_end();
}

void SdoClient::send_block_end() noexcept {
    Bytes b{static_cast<std::uint8_t>(0xc1 | (7 - (size_ - 1) % 7 - 1) << 2)};
    store(b.data() + 1, crc_used_ ? crc_ : std::uint16_t{0});
    send(b);
}

void SdoClient::on_block_segment(const Frame& f) noexcept {
    const std::uint8_t number = f.data[0] & 0x7f;
    const bool last = (f.data[0] & 0x80) != 0;
    if (acknowledged_early_ && number != 1) return;
    if (!block_any_ && number != 1 && number == acknowledged_ &&
        std::equal(held_.begin(), held_.end(), f.data.begin() + 1)) {
        // duplicate last segment of the previous block, or the server missed the acknowledgement,
        // which the timeout repeats
        ++unexpected_;
        return;
    }
    acknowledged_early_ = false;
    block_any_ = true;
    if (number == sequence_ + 1 && number <= block_size_) {
        if (held_count_ != 0) {
            if (crc_used_) {
                crc_ = crc16(held_, crc_);
            }
            if (!store_received(held_)) return;
        }
        std::copy_n(f.data.begin() + 1, 7, held_.begin());
        held_count_ = 7;
        sequence_ = number;
        last_seen_ = last;
        last_command_ = f.data[0];
        segment_received_ = true;
        progress();
    } else {
        ++unexpected_;
        if (number <= sequence_ && !last && number != block_size_) return;
        if (number > sequence_) {
            gap_ = true;
        }
    }
    if (number == block_size_ || last) {
        acknowledge_block(gap_ ? BlockChange::smaller : BlockChange::larger);
    }
}

void SdoClient::acknowledge_block(BlockChange change) noexcept {
    block_size_ =
        next_block_size(block_size_, change, sequence_, acknowledged_, settings_.block_size);
    acknowledged_ = sequence_;
    if (sequence_ != 0) {
        stalls_ = 0;
    } else if (++stalls_ > 4 + settings_.resends) {
        return restart_or_fail(Abort::sequence, false);
    }
    send({0xa2, sequence_, block_size_});
    sequence_ = 0;
    block_any_ = gap_ = false;
    if (last_seen_) {
        state_ = State::block_upload_end;
    }
}

void SdoClient::on_block_end(const Frame& f) noexcept {
    const auto command = f.data[0];
    if ((command & 0xe3) != 0xc1) return unexpected(Abort::command);
    const std::uint32_t count = 7U - (command >> 2 & 7);
    const bool good = crc16({held_.data(), count}, crc_) == load<std::uint16_t>(f.data.data() + 1);
    const bool again =
        command == last_command_ && std::equal(held_.begin(), held_.end(), f.data.begin() + 1);
    // a repeated last segment, which can look like an end frame
    if (again && !(crc_used_ && good)) return unexpected(Abort::command);
    if (crc_used_ && !good) return restart_or_fail(Abort::crc, false);
    if (!store_received({held_.data(), count})) return;
    if (size_known_ && offset_ != size_) return restart_or_fail(Abort::too_short, false);
    send({0xa1});
    const bool lost = pending_;
    finish(Abort::none);
    if (lost) {
        send_again();
    }
}

}  // namespace hal::canopen
