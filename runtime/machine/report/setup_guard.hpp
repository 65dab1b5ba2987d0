// SPDX-License-Identifier: MIT
// Reports a component whose constructor, start, stop or destructor does not return.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

namespace hal {

/// Names a call that does not return within 2 s, or 2 s after the duration that the component has
/// announced. After end_soon() it ends the process when the call does not return 13 s later. After
/// end_within() it also ends the process when anything else takes too long.
class SetupGuard {
public:
    static constexpr std::int64_t no_limit = 0;
    struct Flags {
        std::atomic<bool> ending{false};
        std::atomic<bool> over{false};
        std::atomic<std::int64_t> limit_ns{no_limit};  ///< of the end
    };

    SetupGuard();
    ~SetupGuard() { flags_->over = true; }
    SetupGuard(const SetupGuard&) = delete;
    /// Reports that the end was requested. [any]
    void end_soon() { flags_->ending = true; }
    /// Reports that the machine ends now, until no_limit. When that takes longer than `ns`, the calls
    /// of components not counted, outputs get their safe values and the process ends with status 1.
    /// [any]
    void end_within(std::int64_t ns) { flags_->limit_ns = ns; }

private:
    std::shared_ptr<Flags> flags_ = std::make_shared<Flags>();
};

}  // namespace hal
