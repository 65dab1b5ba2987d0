// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Radiobutton : hal::Component {
    using Component::Component;
    hal::Argument count{*this, "personality", 4, "number of buttons", {.min = 1, .max = 32}};
    hal::Ins<bool> in{*this, "in-##", count, "button #"};
    hal::Outs<bool> out{*this, "out-##", count,
                        "TRUE after a press of button # until another button is pressed"};
    hal::Function run{*this, "", hal::step<&Radiobutton::update>, "reads the buttons"};

    void update(hal::Cycle) noexcept {
        std::size_t pressed = in.size();
        for (std::size_t i = in.size(); i-- > 0;) {
            const std::uint32_t bit = std::uint32_t{1} << i;
            if (in[i] && (was_ & bit) == 0) {
                pressed = i;
            }
            was_ = in[i] ? was_ | bit : was_ & ~bit;
        }
        if (pressed == in.size()) return;
        for (std::size_t i = 0; i < out.size(); ++i) {
            out[i] = i == pressed;
        }
    }

private:
    std::uint32_t was_ = 0;
    hal::Retained retained_{*this, {{"was", was_}}};
};

}  // namespace

HAL_COMPONENT(Radiobutton, "radiobutton", "Radio buttons: the last button pressed stays on", R"(
A rising edge of a button sets its output and clears all others. At the start no output is TRUE. If
several buttons are pressed in the same cycle, the lowest number takes precedence. `personality` is
the number of buttons.

    loadrt radiobutton names=axis-choice personality=3
    addf axis-choice servo
    net button-x => axis-choice.in-00
    net button-y => axis-choice.in-01
    net button-z => axis-choice.in-02
    net jog-x    <= axis-choice.out-00
    net jog-y    <= axis-choice.out-01
    net jog-z    <= axis-choice.out-02
)")
