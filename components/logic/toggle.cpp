// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Toggle : hal::Component {
    using Component::Component;
    hal::In<bool>             in{*this, "in", "the button"};
    hal::Io<bool>             out{*this, "out", "turns over with each press; others may write it, too"};
    hal::Param<std::uint32_t> debounce{*this, "debounce", "cycles the button must hold its new state; 0 and 1: it counts at once",
                                       {.initial = 2}};
    hal::Function             run{*this, "", &Toggle::read, "reads the button"};

    void read(hal::Cycle) noexcept {
        const std::uint32_t enough = std::max<std::uint32_t>(debounce, 1);
        if (in) count_ += count_ < enough ? 1 : 0;
        else count_ -= count_ > 0 ? 1 : 0;
        if (count_ >= enough && !pressed_) {
            pressed_ = true;
            out = !out;
        } else if (count_ == 0) pressed_ = false;
    }

private:
    std::uint32_t count_ = 0;  // up to debounce while the button is down, down to 0 while it is up
    bool pressed_ = false;
};

}  // namespace

HAL_COMPONENT(Toggle, "toggle", "Push on, push off", R"(
A press that outlasts its bouncing by `debounce` cycles turns `out` over; so must the release before the next press counts. `out` is an
io pin: what others write into the signal is where the next press starts.

    loadrt toggle names=lamp-button
    addf lamp-button servo
    net button => lamp-button.in
    net lamp   <=> lamp-button.out
)")
