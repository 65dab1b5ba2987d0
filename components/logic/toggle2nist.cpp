// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Toggle2nist : hal::Component {
    using Component::Component;
    hal::In<bool>          in{*this, "in", "the button: every change counts"};
    hal::In<bool>          is_on{*this, "is-on", "the device says that it is on"};
    hal::Out<bool>         on{*this, "on", "TRUE until is-on is, after a request to switch on"};
    hal::Out<bool>         off{*this, "off", "TRUE until is-on is FALSE, after a request to switch off"};
    hal::In<std::uint32_t> debounce{*this, "debounce", "cycles in must hold before its change counts; 0 and 1: at once", {.initial = 2}};
    hal::In<std::uint32_t> patience{*this, "max-pulse-length", "cycles after which on or off is given up; 0: never", {.initial = 1000}};
    hal::Function          run{*this, "", hal::step<&Toggle2nist::update>, "reads the button and the device"};

    void update(hal::Cycle) noexcept {
        if (changed()) {
            asking_ = true;
            wanted_ = !is_on;
            asked_ = 0;
        } else if (asking_) {
            const bool answered = is_on == wanted_, tired = patience != 0 && asked_ >= patience;
            asking_ = !answered && !tired;
        }
        if (asking_) ++asked_;
        on = asking_ && wanted_;
        off = asking_ && !wanted_;
    }

private:
    // True in the cycle in which the button has held another state long enough.
    bool changed() noexcept {
        if (in == state_) {
            held_ = 0;
            return false;
        }
        if (++held_ < debounce) return false;
        held_ = 0;
        state_ = !state_;
        return true;
    }

    bool state_ = false;                    // the button without its bouncing
    bool asking_ = false, wanted_ = false;  // a request is out, and for what
    std::uint32_t held_ = 0;                // cycles the button has been other than state_
    std::uint64_t asked_ = 0;               // cycles the request has been out
};

}  // namespace

HAL_COMPONENT(Toggle2nist, "toggle2nist", "A toggle button for a device with on, off and is-on", R"(
Each change of `in`, in either direction, asks the device for its other state: `on` is TRUE until `is-on` is, or `off` is
TRUE until `is-on` is FALSE. A device that does not answer within `max-pulse-length` cycles has the request taken back. A
change while a request is out asks anew: for the other state of what `is-on` says then, and for the full time.

LinuxCNC's manual page of version 2.9 says that rising edges count; what the component does there is this. For a button that
is TRUE while it is pressed use `momentary2nist`.

    loadrt toggle2nist names=power
    addf power servo
    net power-switch     => power.in
    net machine-is-on    => power.is-on
    net machine-turn-on  <= power.on
    net machine-turn-off <= power.off
)")
