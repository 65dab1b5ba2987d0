// SPDX-License-Identifier: MIT
// Brings the model up to date with the plans that the threads have begun to run.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "model/compile.hpp"
#include "model/edit.hpp"

namespace hal {

/// Used once, after a swap: all threads that answered run the new plans; the old images are still
/// there, and nobody writes them any more. A thread that did not answer still runs its old plan, so
/// what is known of its slots stays. Allocates nothing when all threads have answered. [setup]
class PlanAdoption {
public:
    /// `hangs` returns true for a thread that did not answer; `all_answered`: it never does.
    PlanAdoption(Edit& edit, Compiled& compiled, std::function<bool(const Thread*)> hangs,
                 bool all_answered)
        : edit_(edit), compiled_(compiled), hangs_(std::move(hangs)), all_answered_(all_answered) {}

    /// Adopts values, slots and homes, and clears the values of the edit, which the threads have
    /// taken: a second swap of the same edit must not give them again.
    void adopt();

private:
    bool unknown(const Compiled::Place& place) const {
        return hangs_(place.signal->home) || hangs_(place.home);
    }
    void adopt_value(const Compiled::Place& place);
    const hal_value* value_without_thread(const Signal& signal) const;
    void adopt_copies(Compiled::Place& place);
    void bind_session_pins();
    void adopt_homes();
    void write_loose_pins();
    void retire();

    Edit& edit_;
    Compiled& compiled_;
    std::function<bool(const Thread*)> hangs_;
    bool all_answered_;
};

}  // namespace hal
