// SPDX-License-Identifier: MIT
// The state of the instances of one function that shares it with a function of another thread, as
// a journal copies it when both ran at the same time (docs/internals/journal.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "hal/abi.h"

namespace hal::plan {

/// Memory of the instances in words of 64 bits, and their outputs. What the constructor of a
/// component has allocated by the sdk belongs to it; other heap memory does not.
class SharedState {
public:
    static constexpr std::size_t max_words = 1024;

    /// Adds memory and an output. [setup]
    void add(std::uint64_t* word) { words_.push_back(word); }
    void add(hal_pin* output) { outputs_.push_back(output); }
    /// Call after the last add(). A larger state is not copied: see covered(). [setup]
    void complete() {
        covered_ = words_.size() + outputs_.size() <= max_words;
        if (!covered_) {
            words_.clear();
            outputs_.clear();
        }
        known_.resize(words_.size());
        changes_.resize(words_.size());
    }
    bool covered() const noexcept { return covered_; }

    /// Before the first pass: what changes from now on counts as state. [realtime]
    void begin() noexcept {
        if (begun_) return;
        begun_ = true;
        for (std::size_t i = 0; i < words_.size(); ++i) {
            known_[i] = load(words_[i]);
        }
    }
    /// Finds the words that change. Those that never do, such as pointers to pins, are different
    /// in each process and are not copied. [realtime]
    void look() noexcept {
        for (std::size_t i = 0; i < words_.size(); ++i) {
            const std::uint64_t now = load(words_[i]);
            if (now == known_[i]) continue;
            known_[i] = now;
            changes_[i] = !is_address(now);
        }
    }
    /// Calls `note` with the words of the state as they are: the number of pairs, pairs of an index
    /// and a value, the outputs. [realtime]
    template <class Note>
    void write(Note note) noexcept {
        std::uint64_t count = 0;
        for (const std::uint8_t one : changes_) {
            count += one;
        }
        note(count);
        for (std::size_t i = 0; i < words_.size(); ++i) {
            if (changes_[i] == 0) continue;
            note(i);
            note(load(words_[i]));
        }
        for (const hal_pin* const output : outputs_) {
            note(load(&output->slot->raw));
        }
    }
    /// Sets the state to the words that `note` returns, or only reads them unless `sets`. In a
    /// re-execution, between two functions
    template <class Note>
    void read(Note note, bool sets = true) noexcept {
        const std::uint64_t count = note();
        for (std::uint64_t pair = 0; pair < count && pair < max_words; ++pair) {
            const std::uint64_t index = note();
            const std::uint64_t value = note();
            if (sets && index < words_.size() && !is_address(load(words_[index]))) {
                *words_[index] = value;
            }
        }
        for (const hal_pin* const output : outputs_) {
            const std::uint64_t value = note();
            if (sets) {
                output->slot->raw = value;
            }
        }
    }

private:
    // Another thread may write it meanwhile: any of both values is right.
    [[gnu::no_sanitize("thread")]] static std::uint64_t load(const std::uint64_t* word) noexcept {
        return __atomic_load_n(word, __ATOMIC_RELAXED);
    }
    /// Whether it may be an address of this process: no number of a component is that large, but a
    /// time in ns 26 or 38 hours after the start of the computer.
    static bool is_address(std::uint64_t word) noexcept {
        const std::uint64_t top = word >> 40;
        return (top >= 0x55 && top < 0x58) || top == 0x7e || top == 0x7f;
    }

    std::vector<std::uint64_t*> words_;
    std::vector<hal_pin*> outputs_;
    std::vector<std::uint64_t> known_;  // of the thread, since the last pass
    std::vector<std::uint8_t> changes_;  // 1: the word has changed
    bool begun_ = false;
    bool covered_ = true;
};

}  // namespace hal::plan
