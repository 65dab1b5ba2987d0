// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Toggle : hal::Component {
    using Component::Component;
    hal::In<bool>             in{*this, "in", "the push button"};
    hal::Io<bool>             out{*this, "out", "changes with every press"};
    hal::Param<std::uint32_t> debounce{*this, "debounce", "cycles the button must hold before it counts as pressed or released", {.initial = 2}};
    hal::Function             run{*this, "", &Toggle::update, "watches the button"};

    void update(hal::Cycle) noexcept {
        if (in == pressed_) {
            differing_ = 0;
            return;
        }
        if (++differing_ < debounce) return;
        differing_ = 0;
        pressed_ = !pressed_;
        if (pressed_) out = !out;
    }

private:
    std::uint32_t differing_ = 0;  // cycles in a row in which the button was not as it counts
    bool pressed_ = false;
};

}  // namespace

HAL_COMPONENT(Toggle, "toggle", "Push-on, push-off from a push button", R"(
Each press turns `out` over. The button counts as pressed, or as released, once it has been so for `debounce` cycles in a
row. `out` is an input/output pin: another writer on its signal, or another `toggle`, may turn it over too.

    loadrt toggle names=lamp
    addf lamp servo
    net lamp-button => lamp.in
    net lamp        <=> lamp.out
)")
