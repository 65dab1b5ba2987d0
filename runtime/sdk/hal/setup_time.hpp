// SPDX-License-Identifier: MIT
// For components whose stop() may take longer than 2 s because a slow bus still sends what is
// queued.
#pragma once

#include <algorithm>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/setup_time.h"

namespace hal {

class SetupTime {
public:
    /// In the component's start(). [setup]
    void start() { host_ = extension<hal_setup_time>(HAL_SETUP_TIME); }
    /// In stop(), before the call that takes the time; `why` is a literal. Without effect on a host
    /// that does not know it. [setup]
    void expect(std::int64_t ns, const char* why) const noexcept {
        if (host_ != nullptr && ns > 0) {
            host_->expect(host_, ns, why);
        }
    }

private:
    const hal_setup_time* host_ = nullptr;
};

}  // namespace hal
