// SPDX-License-Identifier: MIT
#include "torch_height.hpp"

namespace {

struct Thcud : TorchHeight {
    using TorchHeight::TorchHeight;

    hal::In<bool> torch_up{*this, "torch-up", "request to raise the torch"};
    hal::In<bool> torch_down{*this, "torch-down", "request to lower the torch"};
    hal::Out<double> cur_offset{*this, "cur-offset", "current correction"};
    hal::Out<bool> removing_offset{
        *this, "removing-offset",
        "TRUE while the torch is off and the correction is being removed"};
    hal::In<double> correction_vel{*this, "correction-vel", "change of the correction per cycle"};
    hal::Function run{*this, "", &Thcud::update, "corrects Z"};

    void update(hal::Cycle) noexcept {
        removing_offset =
            control([&] { return int{torch_up.get()} - int{torch_down.get()}; }, correction_vel);
        cur_offset = offset();
    }
};

}  // namespace

HAL_COMPONENT(Thcud, "thcud", "Torch height control from up and down signals", R"(
    z-pos-out = z-pos-in + correction,   z-fb-out = z-pos-in

While enabled, with the torch on, the arc stable and the machine moving at the requested velocity or
at most `velocity-tol` percent slower, each cycle changes the correction by `correction-vel`, up or
down according to the inputs; with both inputs TRUE it does not change. With the torch off, upward
motion of Z removes the correction, by at most the distance Z moves up in the cycle, so the torch
never drops when the arc ends. While disabled, Z passes through.

**Differences from LinuxCNC:** LinuxCNC's `thcud` removes the whole correction in one cycle, and its
`cur-offset` remains 0, unlike its documentation. Halcyon implements the documented behaviour.
`correction-vel` is an input as in 2.9.10 and 2.10 (in 2.9.0 it is a parameter). `vel-status` is
FALSE while `enable` is FALSE (LinuxCNC: keeps its value).

    loadrt thcud
    addf thcud servo
    setp thcud.velocity-tol 10
    setp thcud.correction-vel 0.001
    net torch-up   => thcud.torch-up
    net torch-down => thcud.torch-down
    net z-cmd      => thcud.z-pos-in
    net z-motor    <= thcud.z-pos-out
)")
