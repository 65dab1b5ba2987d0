// SPDX-License-Identifier: MIT
#include "ethercat/recorded/recorded_port.hpp"

#include <algorithm>
#include <ctime>

#include "link/system.hpp"

namespace hal::ethercat {

using hal::ethernet::Arrival;
using hal::ethernet::Sent;

namespace {

void add(std::atomic<std::uint64_t>& counter, std::uint64_t count = 1) noexcept {
    counter.fetch_add(count, std::memory_order_relaxed);
}

}  // namespace

RecordedPort::RecordedPort(const std::string& address,
                           const std::vector<hal::ethernet::Captured>& frames)
    : answers_(frames), description_(hal::ethernet::describe(address)) {}

Sent RecordedPort::send(std::span<const std::uint8_t> frame, const hal::ethernet::Launch& launch,
                        std::int64_t now_ns) noexcept {
    const bool fits = launch.fits(frame.size()) && frame.size() <= max_frame_bytes;
    if (!fits || waiting_ == capacity) {
        add(dropped_);
        return fits ? Sent::full : Sent::rejected;
    }
    Frame& to = frames_[(first_ + waiting_) % capacity];
    std::copy(frame.begin(), frame.end(), to.bytes.begin());
    to.size = frame.size();
    if (!FrameReader({to.bytes.data(), to.size}).valid()) {
        add(dropped_);
        return Sent::rejected;
    }
    to.time_ns = now_ns != hal::ethernet::unclocked ? now_ns : hal::link::monotonic_ns();
    add(unknown_, answers_.answer({to.bytes.data(), to.size}));
    ++waiting_;
    add(sent_);
    return Sent::queued;
}

std::optional<Arrival> RecordedPort::receive(std::int64_t) noexcept {
    if (waiting_ == 0) return std::nullopt;
    const Frame& frame = frames_[first_];
    first_ = (first_ + 1) % capacity;
    --waiting_;
    add(received_);
    return Arrival{{frame.bytes.data(), frame.size}, frame.time_ns};
}

bool RecordedPort::wait(std::int64_t until_ns) noexcept {
    if (waiting_ != 0) return true;
    const timespec end = hal::link::to_timespec(until_ns);
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &end, nullptr);
    return false;
}

hal::ethernet::Statistics RecordedPort::statistics() const noexcept {
    hal::ethernet::Statistics s;
    s.sent = sent_.load(std::memory_order_relaxed);
    s.received = received_.load(std::memory_order_relaxed);
    s.dropped = dropped_.load(std::memory_order_relaxed);
    s.errors = unknown_.load(std::memory_order_relaxed);
    return s;
}

}  // namespace hal::ethercat
