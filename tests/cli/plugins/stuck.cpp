// SPDX-License-Identifier: MIT
#include <unistd.h>

#include "hal/component.hpp"
#include "hal/setup_time.hpp"

namespace {

/// Its stop() does not return, or with takes=MS late; with start=1 its start() does not, either.
struct Stuck : hal::Component {
    using Component::Component;

    hal::Argument hangs_at_start{
        *this, "start", 0, "1: start() does not return", {.min = 0, .max = 1}};

    hal::Argument takes_ms{
        *this,
        "takes",
        0,
        "stop() announces 5 s, and returns after this time in ms; 0: it does not return",
        {.min = 0}};

    hal::Out<bool> out{*this, "out", "TRUE", {.safe = false}};
    hal::Function run{*this, "", &Stuck::step, "sets the output"};

    void start() {
        setup_time_.start();
        while (hangs_at_start == 1) {
            ::pause();
        }
    }
    void stop() noexcept {
        if (takes_ms > 0) {
            setup_time_.expect(5'000'000'000, "a slow bus still sends what is queued");
            ::usleep(static_cast<useconds_t>(takes_ms) * 1000);
            return;
        }
        while (true) {
            ::pause();
        }
    }
    void step(hal::Cycle) noexcept { out = true; }

private:
    hal::SetupTime setup_time_;
};

}  // namespace

HAL_COMPONENT(Stuck, "stuck", "Hangs when it is stopped or started")
