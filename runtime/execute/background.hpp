// SPDX-License-Identifier: MIT
// Extension "hal.background/1": runs non-real-time work of components between two instants of the
// virtual clock (decision 17).
#pragma once

#include <cstdint>
#include <vector>

#include "hal/background.h"

namespace hal {

class Background {
public:
    explicit Background(bool virtual_clock);
    Background(const Background&) = delete;

    /// Calls the attached functions in the order in which they were attached, outside of all
    /// cycles. [setup]
    void run(std::int64_t now_ns);
    const hal_background& shared() const { return shared_.host; }  ///< given out to components

private:
    struct Work {
        void (*work)(void*, std::int64_t);
        void* self;
    };
    struct Shared {
        hal_background host{};  // first: the extension's functions get its address
        std::vector<Work> works;
    };
    static Shared& of(const hal_background* host);
    Shared shared_;
};

}  // namespace hal
