// SPDX-License-Identifier: MIT
#include <unistd.h>

#include "hal/component.hpp"

namespace {

/// Its stop() does not return.
struct Stuck : hal::Component {
    using Component::Component;

    hal::Out<bool> out{*this, "out", "TRUE", {.safe = false}};
    hal::Function run{*this, "", &Stuck::step, "sets the output"};

    void stop() noexcept {
        while (true) ::pause();
    }
    void step(hal::Cycle) noexcept { out = true; }
};

}  // namespace

HAL_COMPONENT(Stuck, "stuck", "Hangs when it is stopped")
