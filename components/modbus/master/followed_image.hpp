// SPDX-License-Identifier: MIT
// What a cycle sees of the image of an engine, in the journal of its machine.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "hal/journal.hpp"
#include "modbus/master/image.hpp"

namespace hal::modbus {

/// Without a journal the cycle sees the image itself. With one it sees a copy: take() copies the
/// words that have changed and records them, and in a re-execution, which has no engine, they come
/// from the journal. What the cycle writes goes to the image.
class FollowedImage {
public:
    /// In start(). [setup]
    void attach(const Image& engine, const Bus& bus, const Plan& plan) {
        engine_ = engine;
        seen_ = engine;
        words_ = 0;
        if (!hal_journal_mode || hal_journal_mode() == 0) return;
        const std::size_t size = Image::size_of(bus, plan);
        memory_.assign(size + alignment, std::byte{0});
        void* at = memory_.data();
        std::size_t space = memory_.size();
        seen_ = Image(std::align(alignment, size, at, space), bus, plan, true);
        words_ = size / sizeof(Word);
    }
    /// Begins a function of the cycle. [realtime]
    void take() noexcept {
        if (!is_journaled()) return;
        if (is_executed_again()) {
            give_back();
        } else {
            record();
        }
    }
    /// Returns whether there is a journal. [realtime]
    bool is_journaled() const noexcept { return words_ != 0; }
    /// What the cycle sees.
    const Image& seen() const noexcept { return seen_; }
    /// Takes the oldest event. [realtime]
    bool pop(EventRecord& event) noexcept {
        const bool has_one = seen_.pop(event);
        if (has_one && is_journaled()) {
            engine_.header().event_tail.store(seen_.header().event_tail.load(),
                                              std::memory_order_release);
        }
        return has_one;
    }

private:
    using Word = std::atomic<std::uint64_t>;
    static constexpr std::size_t alignment = 64;
    static constexpr std::size_t first_word = sizeof(bus::CycleCounter) / sizeof(Word);
    static constexpr std::uint32_t end = UINT32_MAX;

    static Word* words_of(const Image& image) noexcept {
        return reinterpret_cast<Word*>(&image.header());
    }
    /// The marks come first: what a mark is about is at least as new.
    void record() noexcept {
        for (std::size_t n = 0; n < ImageHeader::slave_words; ++n) {
            const std::uint64_t marks = engine_.take_changed(n);
            if (marks == 0) continue;
            Word& seen = seen_.header().changed[n];
            seen.fetch_or(marks, std::memory_order_relaxed);
            note(static_cast<std::uint32_t>(&seen - words_of(seen_)), seen);
        }
        const auto marks_begin =
            static_cast<std::size_t>(seen_.header().changed.data() - words_of(seen_));
        for (std::size_t n = first_word; n < words_; ++n) {
            if (n - marks_begin < ImageHeader::slave_words) continue;
            const std::uint64_t now = words_of(engine_)[n].load(std::memory_order_acquire);
            Word& seen = words_of(seen_)[n];
            if (now == seen.load(std::memory_order_relaxed)) continue;
            seen.store(now, std::memory_order_relaxed);
            note(static_cast<std::uint32_t>(n), now);
        }
        std::uint32_t last = end;
        journaled(last);
    }
    static void note(std::uint32_t index, std::uint64_t value) noexcept {
        journaled(index);
        journaled(value);
    }
    void give_back() noexcept {
        for (std::size_t count = 0; count <= words_ + ImageHeader::slave_words; ++count) {
            std::uint32_t index = end;
            std::uint64_t value = 0;
            journaled(index);
            if (index >= words_) return;
            journaled(value);
            words_of(seen_)[index].store(value, std::memory_order_relaxed);
        }
    }

    Image engine_;
    Image seen_;
    std::vector<std::byte> memory_;  // of the copy
    std::size_t words_ = 0;  // 0: there is no copy
};

}  // namespace hal::modbus
