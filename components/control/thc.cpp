// SPDX-License-Identifier: MIT
#include "torch_height.hpp"

namespace {

struct Thc : TorchHeight {
    using TorchHeight::TorchHeight;

    hal::In<double> encoder_vel{
        *this, "encoder-vel",
        "frequency of the voltage-to-frequency converter, as an encoder velocity"};
    hal::In<double> volts_requested{
        *this, "volts-requested", "requested arc voltage", {.unit = "V"}};
    hal::In<double> vel_tol{*this, "vel-tol", "no effect; set velocity-tol instead"};
    hal::Out<double> volts{*this, "volts", "arc voltage, not below 0", {.unit = "V"}};
    hal::Out<double> offset_value{*this, "offset-value", "current correction"};
    hal::Param<double> vel_scale{*this, "vel-scale", "volts per unit of encoder-vel"};
    hal::Param<double> scale_offset{*this, "scale-offset", "encoder-vel at 0 V"};
    hal::Param<double> voltage_tol{
        *this, "voltage-tol", "deadband around volts-requested", {.unit = "V"}};
    hal::Param<double> correction_vel{*this, "correction-vel",
                                      "change of the correction per cycle"};
    hal::Function run{*this, "", &Thc::update, "computes the arc voltage and corrects Z"};

    void update(hal::Cycle) noexcept {
        const double measured = (encoder_vel - scale_offset) * vel_scale;
        volts = measured < 0.0 ? 0.0 : measured;
        control([&] {  // a longer arc has a higher voltage
            const bool too_low = volts - voltage_tol < volts_requested;
            const bool too_high = volts + voltage_tol > volts_requested;
            return int{too_low} - int{too_high};  // both: within the tolerance
        }, correction_vel);
        offset_value = offset();
    }
};

}  // namespace

HAL_COMPONENT(Thc, "thc", "Torch height control from the arc voltage", R"(
    volts     = (encoder-vel - scale-offset) * vel-scale, at least 0
    z-pos-out = z-pos-in + correction,   z-fb-out = z-pos-in

While enabled, with the torch on, the arc stable and the machine moving at the requested velocity or
at most `velocity-tol` percent slower, each cycle changes the correction by `correction-vel`: up if
the voltage is too low by `voltage-tol` or more (the arc is too short), down if it is too high by
`voltage-tol` or more. With the torch off, upward motion of Z removes the correction, by at most the
distance Z moves up in the cycle. While disabled, Z passes through.

**Differences from LinuxCNC:** LinuxCNC's `thc` removes the whole correction in one cycle and delays
`offset-value` by one cycle, unlike its documentation. Halcyon implements the documented behaviour.
`vel-status` is FALSE while `enable` is FALSE (LinuxCNC: keeps its value), and disabling clears the
correction (LinuxCNC: it returns with `enable`, in one jump).

    loadrt thc
    addf thc servo
    setp thc.vel-scale 0.0015
    setp thc.scale-offset 3800
    setp thc.velocity-tol 10
    setp thc.voltage-tol 2
    setp thc.correction-vel 0.001
    net arc-frequency => thc.encoder-vel
    net z-cmd         => thc.z-pos-in
    net z-motor       <= thc.z-pos-out
)")
