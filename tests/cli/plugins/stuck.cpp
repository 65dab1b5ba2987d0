// SPDX-License-Identifier: MIT
#include <unistd.h>

#include "hal/component.hpp"

namespace {

/// Its stop() does not return; with start=1 its start() does not, either.
struct Stuck : hal::Component {
    using Component::Component;

    hal::Argument hangs_at_start{*this, "start", 0, "1: start() does not return", {.min = 0, .max = 1}};

    hal::Out<bool> out{*this, "out", "TRUE", {.safe = false}};
    hal::Function run{*this, "", &Stuck::step, "sets the output"};

    void start() {
        while (hangs_at_start == 1) ::pause();
    }
    void stop() noexcept {
        while (true) ::pause();
    }
    void step(hal::Cycle) noexcept { out = true; }
};

}  // namespace

HAL_COMPONENT(Stuck, "stuck", "Hangs when it is stopped or started")
