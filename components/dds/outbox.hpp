// SPDX-License-Identifier: MIT
// A bounded queue of samples from a cycle to the DDS thread. Its slots already contain the bytes of
// a sample that never change, so that the cycle stores values only. One writer thread, one reader
// thread, as in hal/queue.hpp.
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

namespace hal::dds {

class Outbox {
public:
    /// Allocates at least `depth` copies of `sample`. [setup]
    Outbox(std::span<const std::uint8_t> sample, std::size_t depth)
        : size_(sample.size()),
          stride_((sample.size() + stamp + 63) / 64 * 64),
          mask_(std::bit_ceil(depth < 2 ? 2 : depth) - 1),
          memory_(stride_ * (mask_ + 1)) {
        for (std::size_t i = 0; i <= mask_; ++i) {
            std::memcpy(memory_.data() + i * stride_ + stamp, sample.data(), size_);
        }
    }
    /// Returns the slot of the next sample, or nullptr when the queue is full. [realtime] writer
    std::uint8_t* begin() noexcept {
        const auto head = head_.load(std::memory_order_relaxed);
        return head - tail_.load(std::memory_order_acquire) > mask_
                   ? nullptr
                   : memory_.data() + (head & mask_) * stride_ + stamp;
    }
    /// Queues the slot that begin() returned, with its time. [realtime] writer
    void commit(std::int64_t time_ns) noexcept {
        const auto head = head_.load(std::memory_order_relaxed);
        std::memcpy(memory_.data() + (head & mask_) * stride_, &time_ns, sizeof time_ns);
        head_.store(head + 1, std::memory_order_release);
    }
    /// Returns the oldest sample, which may be modified, or an empty span. It stays valid until
    /// take(). reader
    std::span<std::uint8_t> front(std::int64_t& time_ns) noexcept {
        const auto tail = tail_.load(std::memory_order_relaxed);
        if (tail == head_.load(std::memory_order_acquire)) {
            return {};
        }
        std::uint8_t* slot = memory_.data() + (tail & mask_) * stride_;
        std::memcpy(&time_ns, slot, sizeof time_ns);
        return {slot + stamp, size_};
    }
    /// Removes the oldest sample. reader
    void take() noexcept {
        tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    }

private:
    // before each sample: its time; aligns the doubles after its header
    static constexpr std::size_t stamp = 16;
    const std::size_t size_, stride_, mask_;
    std::vector<std::uint8_t> memory_;
    alignas(64) std::atomic<std::size_t> head_{0};  // written by the writer
    alignas(64) std::atomic<std::size_t> tail_{0};  // written by the reader
};

}  // namespace hal::dds
