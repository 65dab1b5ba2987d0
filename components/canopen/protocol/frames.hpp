// SPDX-License-Identifier: MIT
// The transmit queue: services push frames, the owner of the bus pops them, in the same thread.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <memory>

#include "link/can.hpp"
#include "numbers.hpp"

namespace hal::canopen {

using can::Frame;

/// A bounded queue for one thread. A service keeps a frame that did not fit and retries at its next
/// poll.
class FrameQueue {
public:
    /// Allocates space for `capacity` frames, rounded up to a power of two in 8..65536. [setup]
    explicit FrameQueue(std::size_t capacity)
        : mask_(std::bit_ceil(std::clamp<std::size_t>(capacity, 8, 65536)) - 1),
          frames_(std::make_unique<Frame[]>(mask_ + 1)) {}

    /// Appends a frame; returns false if the queue is full. [realtime]
    bool push(const Frame& frame) noexcept {
        if (space() == 0) {
            ++rejected_;
            return false;
        }
        frames_[head_++ & mask_] = frame;
        return true;
    }
    /// Moves the oldest frame to `frame`; returns false if the queue is empty. [realtime]
    bool pop(Frame& frame) noexcept {
        if (head_ == tail_) return false;
        frame = frames_[tail_++ & mask_];
        return true;
    }
    /// Returns the oldest frame or nullptr. It stays queued until drop(), so a full link loses
    /// nothing. [realtime]
    const Frame* front() const noexcept {
        return head_ == tail_ ? nullptr : &frames_[tail_ & mask_];
    }
    /// Removes the oldest frame. [realtime]
    void drop() noexcept {
        if (head_ != tail_) {
            ++tail_;
        }
    }
    /// Removes all frames. [realtime]
    void clear() noexcept { tail_ = head_; }
    /// Returns the number of queued frames. [any]
    std::size_t size() const noexcept { return head_ - tail_; }
    /// Returns the number of frames that still fit. [any]
    std::size_t space() const noexcept { return mask_ + 1 - size(); }
    /// Returns the number of frames that fit in total. [any]
    std::size_t capacity() const noexcept { return mask_ + 1; }
    /// Returns the space, in frames, that bulk transfers leave to services with single frames.
    /// [any]
    std::size_t reserve() const noexcept { return std::min<std::size_t>(capacity() / 4, 64); }
    /// Returns the number of frames removed so far; shows a service that waits for space whether
    /// the bus accepts frames at all. [any]
    std::size_t popped() const noexcept { return tail_; }
    /// Returns how often push() found the queue full. [any]
    std::uint64_t rejected() const noexcept { return rejected_; }

private:
    const std::size_t mask_;
    std::unique_ptr<Frame[]> frames_;
    std::size_t head_ = 0;
    std::size_t tail_ = 0;
    std::uint64_t rejected_ = 0;
};

/// Returns true if the frame has the identifier in `cob` (a COB-ID object). [realtime]
inline bool has_id(const Frame& frame, std::uint32_t cob) noexcept {
    return frame.id == cob_id(cob) && frame.extended == ((cob & cob_extended) != 0);
}
/// Returns a data frame with the identifier in `cob` (a COB-ID object), `length` bytes (0..8) and
/// zero data. [realtime]
inline Frame make_frame(std::uint32_t cob, std::uint8_t length) noexcept {
    Frame frame;
    frame.id = cob_id(cob);
    frame.extended = (cob & cob_extended) != 0;
    frame.length = length;
    return frame;
}

}  // namespace hal::canopen
