// SPDX-License-Identifier: MIT
// For components whose outputs are on the way somewhere: notices that they stood meanwhile.
#pragma once

#include <atomic>

#include "hal/component.hpp"

namespace hal {

/// Notes that the thread of the instance was stopped (`stop`, a fault, an exception, a hang) or
/// that the instance's last function was taken out of it (`delf`, `delthread`). What the outputs
/// command stands then, whatever speed the instance remembers, and time has passed since the inputs
/// were read: the next cycle starts from rest, and without differences to earlier inputs. Missed
/// cycles do not count.
///
///     hal::Interruption interruption_{*this};
///     …
///     if (interruption_.accept()) speed_ = 0.0;
///
/// A component that has a hal::Retained names it there: `reload` of a stopped machine keeps it.
class Interruption : Function {
public:
    explicit Interruption(Component&) {
        declare(this, "", entry(&Interruption::note), "notes that the outputs stand",
                HAL_FUNCTION_EMERGENCY);
    }

    /// Returns true once after an interruption. Of one function only: two have one each. [realtime]
    bool accept() noexcept {
        return noted_.load(std::memory_order_relaxed) &&
               noted_.exchange(false, std::memory_order_acquire);
    }

    static constexpr bool retainable = true;  ///< by hal::Retained

private:
    /// [any] also in a crash handler
    void note(Cycle) noexcept { noted_.store(true, std::memory_order_release); }

    std::atomic<bool> noted_{false};
};

}  // namespace hal
