// SPDX-License-Identifier: MIT
// Reports a component whose constructor, start, stop or destructor does not return.
#pragma once

#include <atomic>
#include <memory>

namespace hal {

/// Names a call that does not return within 2 s, or 2 s after the duration that the component has
/// announced. After end_soon() it ends the process when the call does not return 13 s later.
class SetupGuard {
public:
    struct Flags {
        std::atomic<bool> ending{false};
        std::atomic<bool> over{false};
    };

    SetupGuard();
    ~SetupGuard() { flags_->over = true; }
    SetupGuard(const SetupGuard&) = delete;
    /// Reports that the end was requested. [any]
    void end_soon() { flags_->ending = true; }

private:
    std::shared_ptr<Flags> flags_ = std::make_shared<Flags>();
};

}  // namespace hal
