// SPDX-License-Identifier: MIT
// Frames on their way out. The services put them in, whoever owns the bus takes them out; both in one thread.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <memory>

#include "link/can.hpp"
#include "numbers.hpp"

namespace hal::canopen {

using can::Frame;

/// A bounded queue for one thread. What does not fit is not taken: the service keeps it and tries again at its next poll.
class FrameQueue {
public:
    explicit FrameQueue(std::size_t capacity)  // [setup]
        : mask_(std::bit_ceil(std::clamp<std::size_t>(capacity, 8, 65536)) - 1), frames_(std::make_unique<Frame[]>(mask_ + 1)) {}

    /// False, and nothing done, when full. [realtime]
    bool push(const Frame& frame) noexcept {
        if (room() == 0) {
            ++refused_;
            return false;
        }
        frames_[head_++ & mask_] = frame;
        return true;
    }
    /// [realtime]
    bool pop(Frame& frame) noexcept {
        if (head_ == tail_) return false;
        frame = frames_[tail_++ & mask_];
        return true;
    }
    /// The oldest, or nullptr; it stays until drop(), so a link that is full loses nothing. [realtime]
    const Frame* front() const noexcept { return head_ == tail_ ? nullptr : &frames_[tail_ & mask_]; }
    void drop() noexcept {
        if (head_ != tail_) ++tail_;
    }
    void clear() noexcept { tail_ = head_; }
    std::size_t size() const noexcept { return head_ - tail_; }
    std::size_t room() const noexcept { return mask_ + 1 - size(); }
    std::size_t capacity() const noexcept { return mask_ + 1; }
    /// Room that bulk transfers leave to those who have one frame to send.
    std::size_t reserve() const noexcept { return std::min<std::size_t>(capacity() / 4, 64); }
    /// Counts the frames that left it; who waits for room sees whether it moves at all.
    std::size_t taken() const noexcept { return tail_; }
    /// How often push() found it full.
    std::uint64_t refused() const noexcept { return refused_; }

private:
    const std::size_t mask_;
    std::unique_ptr<Frame[]> frames_;
    std::size_t head_ = 0, tail_ = 0;
    std::uint64_t refused_ = 0;
};

/// A frame of the length given, its data zero. [realtime]
inline Frame make_frame(std::uint32_t cob, std::uint8_t length) noexcept {
    Frame frame;
    frame.id = cob_id(cob);
    frame.extended = (cob & cob_extended) != 0;
    frame.length = length;
    return frame;
}

}  // namespace hal::canopen
