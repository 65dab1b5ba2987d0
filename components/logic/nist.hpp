// SPDX-License-Identifier: MIT
// toggle2nist and momentary2nist: a button for a device that has an input to switch it on, one to switch it off, and says
// whether it is on.
#pragma once

#include "hal/component.hpp"

namespace nist {

/// `Edges`: both: every change of the input asks for the other state; otherwise only a rising edge does.
template <bool BothEdges>
struct Button : hal::Component {
    using Component::Component;
    hal::In<bool>          in{*this, "in", BothEdges ? "the button: every change counts" : "the button: a rising edge counts"};
    hal::In<bool>          is_on{*this, "is-on", "the device says that it is on"};
    hal::Out<bool>         on{*this, "on", "TRUE until is-on is, after a request to switch on"};
    hal::Out<bool>         off{*this, "off", "TRUE until is-on is FALSE, after a request to switch off"};
    hal::In<std::uint32_t> debounce{*this, "debounce", "cycles in must hold before its change counts; 0 and 1: at once", {.initial = 2}};
    hal::In<std::uint32_t> max_pulse{*this, "max-pulse-length", "cycles after which on or off is given up; 0: never", {.initial = 1000}};
    hal::Function          run{*this, "", hal::step<&Button::update>, "reads the button and the device"};

    void update(hal::Cycle) noexcept {
        if (on && (is_on || spent())) on = false;
        if (off && (!is_on || spent())) off = false;
        pulse_ += pulse_ < UINT32_MAX ? 1 : 0;
        if (!changed()) return;
        if (!BothEdges && !stable_) return;
        on = !is_on;
        off = is_on;
        pulse_ = 1;
    }

private:
    bool spent() const { return max_pulse != 0 && pulse_ >= max_pulse; }

    /// True in the cycle in which a new state of the button has held for long enough.
    bool changed() {
        held_ = in == stable_ ? 0 : held_ + 1;
        if (held_ == 0 || held_ < debounce) return false;
        stable_ = !stable_;
        held_ = 0;
        return true;
    }

    std::uint32_t held_ = 0;   // cycles in has not been stable_
    std::uint32_t pulse_ = 0;  // cycles on or off has been TRUE
    bool stable_ = false;
};

}  // namespace nist
