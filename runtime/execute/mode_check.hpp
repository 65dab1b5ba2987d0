// SPDX-License-Identifier: MIT
// Finds the function that changes the floating-point modes of its thread.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>

#include "execute/float_modes.hpp"

namespace hal {

/// A thread compares the modes once per cycle, behind its last function. When they differ, it
/// compares them behind each function from the next cycle on, so that the cause has a name and no
/// other function runs with them. In the first cycles of a plan it does so too, because most
/// functions that change modes do it there, once. Used by the thread, except where noted.
class ModeCheck {
public:
    /// The thread runs another plan: all functions are unsuspected.
    void begin_plan() noexcept {
        checked_cycles_ = first_cycles;
        named_count_ = 0;
        pending_ = 0;
    }
    /// Returns true if this cycle compares behind each function.
    bool each() const noexcept { return checked_cycles_ > 0; }

    /// Returns what has changed, as FloatModes::Difference, and resets the modes; 0: nothing.
    unsigned take() noexcept {
        const FloatModes now = FloatModes::now();
        if (now == FloatModes::defaults() && !trapped_.load(std::memory_order_relaxed)) [[likely]] {
            return 0;
        }
        FloatModes::defaults().set();
        changed_ = true;
        const unsigned trap =
            trapped_.exchange(false, std::memory_order_relaxed) ? unsigned{FloatModes::traps} : 0U;
        return now.differences(FloatModes::defaults()) | trap;
    }
    /// An exception trapped in a function and was masked. In a signal handler of the thread
    void note_trap() noexcept { trapped_.store(true, std::memory_order_relaxed); }

    /// The function is the cause. Returns true if that is news since the last cycle without a
    /// change; only the first eight functions are.
    bool name(std::uint32_t function) noexcept {
        checked_cycles_ = for_ever;
        pending_ = 0;
        const auto end = named_.begin() + static_cast<std::ptrdiff_t>(named_count_);
        if (std::find(named_.begin(), end, function) != end) return false;
        if (named_count_ == named_.size()) return false;  // as many are news at a time
        named_[named_count_++] = function;
        return true;
    }
    /// Some function of this cycle is the cause: the next one looks for it.
    void suspect(unsigned differences) noexcept {
        checked_cycles_ = for_ever;
        pending_ = differences;
        pending_is_new_ = true;
    }

    /// What a cycle leaves behind.
    struct Result {
        unsigned unnamed;  ///< a change whose cause did not repeat it; 0: none
        bool begins, ends;  ///< cycles with changes
    };
    Result end_cycle() noexcept {
        if (checked_cycles_ > 0 && checked_cycles_ != for_ever) {
            --checked_cycles_;
        }
        if (!changed_ && !lasts_ && pending_ == 0) [[likely]] {
            return {0, false, false};
        }
        Result result{0, changed_ && !lasts_, !changed_ && lasts_};
        if (pending_ != 0 && !pending_is_new_) {
            result.unnamed = pending_;
            pending_ = 0;
        }
        pending_is_new_ = false;
        lasts_ = changed_;
        if (!changed_) {
            named_count_ = 0;
        }
        changed_ = false;
        return result;
    }

private:
    static constexpr std::uint32_t first_cycles = 100;
    static constexpr std::uint32_t for_ever = UINT32_MAX;

    std::uint32_t checked_cycles_ = first_cycles;
    unsigned pending_ = 0;
    bool pending_is_new_ = false;
    bool changed_ = false;  // in this cycle
    bool lasts_ = false;    // in the cycle before
    // the signal handler of the same thread writes it
    std::atomic<bool> trapped_{false};
    std::array<std::uint32_t, 8> named_{};
    std::size_t named_count_ = 0;
};

}  // namespace hal
