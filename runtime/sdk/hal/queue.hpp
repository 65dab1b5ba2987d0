// SPDX-License-Identifier: MIT
// How a cycle and an ordinary thread meet: a bounded queue and a latest-value mailbox. One writer
// thread, one reader thread each; neither ever waits. The memory is taken in the constructor.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <memory>
#include <type_traits>

namespace hal {

/// A first-in first-out queue. `T` must be trivially copyable.
///
/// `head_` counts the items written, `tail_` those read, without wrapping; index = count & mask.
///   1. writer stores the item at head      2. writer publishes head + 1 (release)
///   3. reader sees head (acquire), copies   4. reader publishes tail + 1 (release)
/// The writer reuses an entry only after 4, the reader accesses it only after 2.
template <class T>
class Queue {
    static_assert(std::is_trivially_copyable_v<T>);

public:
    /// Allocates space for at least `capacity` items. [setup]
    explicit Queue(std::size_t capacity)
        : mask_(std::bit_ceil(capacity < 2 ? std::size_t{2} : capacity) - 1),
          items_(std::make_unique<T[]>(mask_ + 1)) {}

    /// Adds an item. Returns false when full. [realtime] writer
    bool push(const T& item) noexcept {
        const auto head = head_.load(std::memory_order_relaxed);
        if (head - tail_.load(std::memory_order_acquire) > mask_) return false;
        items_[head & mask_] = item;
        head_.store(head + 1, std::memory_order_release);
        return true;
    }
    /// Appends all items or, when there is not enough space, none: the reader never sees a part.
    /// [realtime] writer
    bool push(const T* items, std::size_t count) noexcept {
        const auto head = head_.load(std::memory_order_relaxed);
        if (head + count - tail_.load(std::memory_order_acquire) > mask_ + 1) return false;
        for (std::size_t i = 0; i < count; ++i) {
            items_[(head + i) & mask_] = items[i];
        }
        head_.store(head + count, std::memory_order_release);
        return true;
    }
    /// Removes the oldest item. Returns false when empty. [realtime] reader
    bool pop(T& item) noexcept {
        const auto tail = tail_.load(std::memory_order_relaxed);
        if (tail == head_.load(std::memory_order_acquire)) return false;
        item = items_[tail & mask_];
        tail_.store(tail + 1, std::memory_order_release);
        return true;
    }
    /// Returns the entry of the next item, to be filled and then added by commit(), or nullptr when
    /// full: saves copying a large, mostly empty item. [realtime] writer
    T* place() noexcept {
        const auto head = head_.load(std::memory_order_relaxed);
        return head - tail_.load(std::memory_order_acquire) > mask_ ? nullptr
                                                                    : &items_[head & mask_];
    }
    /// Adds the item filled in place(). [realtime] writer
    void commit() noexcept {
        head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    }
    /// Returns the oldest item, valid until it is dropped, or nullptr. [realtime] reader
    T* front() noexcept { return at(0); }
    /// Returns the item `n` after the oldest, or nullptr. [realtime] reader
    T* at(std::size_t n) noexcept {
        const auto tail = tail_.load(std::memory_order_relaxed);
        return head_.load(std::memory_order_acquire) - tail > n ? &items_[(tail + n) & mask_]
                                                                : nullptr;
    }
    /// Removes the oldest `count` items, which must exist. [realtime] reader
    void drop(std::size_t count = 1) noexcept {
        tail_.store(tail_.load(std::memory_order_relaxed) + count, std::memory_order_release);
    }
    /// Returns the number of waiting items, as seen by either side. [any]
    std::size_t size() const noexcept {
        // read first, or the reader could overtake the head that was read
        const auto tail = tail_.load(std::memory_order_acquire);
        return head_.load(std::memory_order_acquire) - tail;
    }
    std::size_t capacity() const noexcept { return mask_ + 1; }

private:
    const std::size_t mask_;
    std::unique_ptr<T[]> items_;
    alignas(64) std::atomic<std::size_t> head_{0};  // written by the writer
    alignas(64) std::atomic<std::size_t> tail_{0};  // written by the reader
};

/// The newest value only: a triple buffer. Not for events: what is overwritten before it is read is
/// gone.
///   1. writer fills `back`   2. swaps back <-> middle, marking it fresh   3. reader swaps front <-> middle if fresh
/// At every moment the three indices are different, so writer and reader never touch the same
/// buffer.
template <class T>
class Mailbox {
public:
    explicit Mailbox(const T& initial = T{}) : buffers_{initial, initial, initial} {}

    /// [realtime] writer
    void put(const T& value) noexcept(std::is_nothrow_copy_assignable_v<T>) {
        buffers_[back_] = value;
        back_ = middle_.exchange(back_ | fresh, std::memory_order_acq_rel) & index;
    }
    /// The newest value; `true` in `changed` when it is newer than the last one got. [realtime]
    /// reader
    const T& get(bool* changed = nullptr) noexcept {
        const bool newer = middle_.load(std::memory_order_acquire) & fresh;
        if (newer) {
            front_ = middle_.exchange(front_, std::memory_order_acq_rel) & index;
        }
        if (changed) {
            *changed = newer;
        }
        return buffers_[front_];
    }

private:
    static constexpr unsigned fresh = 4;

private:
    static constexpr unsigned index = 3;
    T buffers_[3];
    unsigned back_ = 0;  // writer only
    unsigned front_ = 1;  // reader only
    std::atomic<unsigned> middle_{2};
};

}  // namespace hal
