// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Toggle2nist : hal::Component {
    using Component::Component;
    hal::In<bool>          in{*this, "in", "button; every change is a request"};
    hal::In<bool>          is_on{*this, "is-on", "feedback of the device: TRUE while it is on"};
    hal::Out<bool>         on{*this, "on", "request to switch on, until is-on is TRUE"};
    hal::Out<bool>         off{*this, "off", "request to switch off, until is-on is FALSE"};
    hal::In<std::uint32_t> debounce{*this, "debounce", "cycles for which a change of in must be stable; 0 and 1: immediate", {.initial = 2}};
    hal::In<std::uint32_t> timeout{*this, "max-pulse-length", "timeout of a request in cycles; 0: no timeout", {.initial = 1000}};
    hal::Function          run{*this, "", hal::step<&Toggle2nist::update>, "reads the button and the device"};

    void update(hal::Cycle) noexcept {
        if (changed()) {
            requesting_ = true;
            wanted_ = !is_on;
            age_ = 0;
        } else if (requesting_) {
            const bool followed = is_on == wanted_, expired = timeout != 0 && age_ >= timeout;
            requesting_ = !followed && !expired;
        }
        if (requesting_) ++age_;
        on = requesting_ && wanted_;
        off = requesting_ && !wanted_;
    }

private:
    // True in the cycle in which a new state of the button has been stable for the debounce time.
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

    bool state_ = false;                        // debounced state of the button
    bool requesting_ = false, wanted_ = false;  // a request is pending; the requested state
    std::uint32_t held_ = 0;                    // cycles for which the button has differed from state_
    std::uint64_t age_ = 0;                     // cycles for which the request has been pending
};

}  // namespace

HAL_COMPONENT(Toggle2nist, "toggle2nist", "Toggle button for a device with inputs to switch on and off", R"(
Each change of `in`, in either direction, requests the other state of the device: `on` is TRUE until `is-on` is TRUE, or `off` is
TRUE until `is-on` is FALSE. If the device does not follow within `max-pulse-length` cycles, the request ends. A
change during a request starts a new one: for the inverse of `is-on`, and with the full timeout.

LinuxCNC's manual page (2.9) describes rising edges only; its component behaves as described here. For a button that
is TRUE while pressed use `momentary2nist`.

    loadrt toggle2nist names=power
    addf power servo
    net power-switch     => power.in
    net machine-is-on    => power.is-on
    net machine-turn-on  <= power.on
    net machine-turn-off <= power.off
)")
