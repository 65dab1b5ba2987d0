// SPDX-License-Identifier: MIT
#include "ethercat/recorded/frame_directions.hpp"

#include <algorithm>
#include <utility>

#include "ethercat/wire/frames.hpp"

namespace hal::ethercat {
namespace {

/// Returns what a frame has in common with its answer: command, index and length of each datagram.
std::vector<std::uint8_t> shape_of(std::span<const std::uint8_t> frame) {
    std::vector<std::uint8_t> bytes(frame.begin(), frame.end());
    std::vector<std::uint8_t> shape;
    FrameReader reader(bytes);
    while (const auto d = reader.next()) {
        shape.push_back(static_cast<std::uint8_t>(d->command));
        shape.push_back(d->index);
        shape.push_back(static_cast<std::uint8_t>(d->length));
        shape.push_back(static_cast<std::uint8_t>(d->length >> 8));
    }
    return shape;
}

/// Returns true when a slave has processed a datagram.
bool was_processed(std::span<const std::uint8_t> frame) {
    std::vector<std::uint8_t> bytes(frame.begin(), frame.end());
    FrameReader reader(bytes);
    while (const auto d = reader.next()) {
        if (d->wkc() != 0) return true;
    }
    return false;
}

}  // namespace

FrameDirections::Direction FrameDirections::take(std::span<const std::uint8_t> frame) {
    const std::size_t number = frames_++;
    std::vector<std::uint8_t> shape = shape_of(frame);
    const auto same = std::find_if(waiting_.begin(), waiting_.end(),
                                   [&](const Waiting& waiting) { return waiting.shape == shape; });
    if (!is_marked(frame)) {
        unmarked_seen_ = true;
    } else if (same != waiting_.end()) {
        const Direction direction{true, same->number};
        waiting_.erase(same);
        return direction;
    } else if (unmarked_seen_ || was_processed(frame)) {
        return {true, Direction::npos};  // the capture does not have what was sent
    }
    if (same != waiting_.end()) {
        waiting_.erase(same);  // it was lost: its index is used again
    }
    waiting_.push_back({number, std::move(shape)});
    if (waiting_.size() > max_waiting) {
        waiting_.pop_front();
    }
    return {};
}

}  // namespace hal::ethercat
