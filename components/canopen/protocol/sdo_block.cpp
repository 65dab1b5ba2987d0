// SPDX-License-Identifier: MIT
#include "sdo_block.hpp"

namespace hal::canopen {

void BlockReceiver::hold(const Frame& f) noexcept {
    std::copy_n(f.data.begin() + 1, held_.size(), held_.begin());
    holds_ = true;
    last_command_ = f.data[0];
    sequence_ = f.data[0] & 0x7f;
    last_seen_ = (f.data[0] & 0x80) != 0;
}

BlockReceiver::Arrived BlockReceiver::misplaced(const Frame& f, unsigned number) noexcept {
    if (number <= sequence_ && !ends_with(f)) return Arrived::duplicate;
    if (number > sequence_) {
        gap_ = true;
    }
    return Arrived::out_of_order;
}

std::uint8_t BlockReceiver::acknowledge(BlockChange change, std::uint8_t max) noexcept {
    size_ = next_block_size(size_, change, sequence_, acknowledged_, max);
    acknowledged_ = sequence_;
    sequence_ = 0;
    any_ = false;
    gap_ = false;
    return acknowledged_;
}

Acknowledgement BlockSender::evaluate(std::uint8_t good, std::uint8_t next, const FrameQueue& out,
                                      Time now, Time interval) const noexcept {
    const bool again = (good << 8 | next) == last_acknowledgement_;
    // A repeated acknowledgement cannot refer to segments that are still in the transmit queue.
    const bool waits = !complete_ || out.popped() < end_in_queue_;
    if (again && (good > sequence_ || waits)) return Acknowledgement::duplicate;
    if (good > sequence_) return Acknowledgement::beyond;
    // A receiver that varies the block size after a loss never acknowledges two blocks alike: the
    // frame is a duplicate, or the receiver still waits for this block. An acknowledgement in the
    // middle of a block means that the receiver timed out.
    if (again && good != next) {
        if (now - acknowledged_at_ < interval) return Acknowledgement::duplicate;
        if (good != 0) return Acknowledgement::stalled;
    }
    return Acknowledgement::of_this_block;
}

void BlockSender::advance(std::uint8_t good, std::uint8_t next, std::uint32_t size,
                          Time now) noexcept {
    acknowledged(good, next, now);
    offset_ += std::min<std::uint32_t>(good * 7U, size - offset_);
    block_size_ = next;
    restart_block();
}

}  // namespace hal::canopen
