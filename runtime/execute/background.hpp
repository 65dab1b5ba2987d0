// SPDX-License-Identifier: MIT
// Extension "hal.background/1": components' work that is not real time, between two instants of the virtual clock (decision 17).
#pragma once

#include <cstdint>
#include <vector>

#include "hal/background.h"

namespace hal {

class Background {
public:
    explicit Background(bool virtual_clock);
    Background(const Background&) = delete;

    /// Calls what is attached, in the order of attaching. Outside of all cycles. [setup]
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
