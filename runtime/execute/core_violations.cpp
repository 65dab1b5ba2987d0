// SPDX-License-Identifier: MIT
// What a function changes around it - the floating-point modes of its thread, the process - and what
// the cycle does about it.
#include <sys/syscall.h>
#include <unistd.h>

#include "execute/core.hpp"
#include "execute/violation.hpp"

namespace hal {

// One by one: no other function runs with the modes that one has changed.
void Core::run_checked() noexcept {
    const auto& functions = plan_->functions;
    const plan::Step* const steps = plan_->steps.data();
    const bool time_all = profile_every.load(std::memory_order_relaxed) || tracing_ != nullptr;
    const std::size_t sampled = sampled_;
    sampled_ = sampled_ + 1 == functions.size() ? 0 : sampled_ + 1;
    for (std::size_t i = 0; i < functions.size(); ++i) {
        if (stopped_.load(std::memory_order_relaxed)) return;
        const plan::Function& function = functions[i];
        if (measure_ && (time_all || i == sampled)) {
            run_timed(function, steps);
        } else {
            run_steps(steps + function.begin, steps + function.end);
        }
        check_modes(function.id);
    }
}

void Core::check_modes(std::uint32_t function) noexcept {
    const unsigned differences = modes_.take();
    if (differences == 0 || !modes_.name(function)) [[likely]]
        return;
    raise({HAL_FAULT_VIOLATION, function, info_.number, info_.start_ns,
           static_cast<double>(differences), violation::float_modes, nullptr});
}

void Core::suspect_modes() noexcept {
    if (const unsigned differences = modes_.take(); differences != 0) [[unlikely]] {
        modes_.suspect(differences);
    }
}

void Core::settle_modes() noexcept {
    const ModeCheck::Result result = modes_.end_cycle();
    if (result.begins) {
        board_.begin(this, &modes_);
    }
    if (result.unnamed != 0) {
        raise({HAL_FAULT_VIOLATION, 0, info_.number, info_.start_ns,
               static_cast<double>(result.unnamed), violation::float_modes, nullptr});
    }
    if (result.ends) {
        board_.end(this, &modes_);
    }
}

void Core::note_fork() noexcept {
    raise({HAL_FAULT_VIOLATION, current_function(), info_.number, info_.start_ns, 0.0,
           violation::forked, nullptr});
}

void Core::end_copy() noexcept {
    for (;;) {
        syscall(SYS_exit_group, 1);
    }
}

}  // namespace hal
