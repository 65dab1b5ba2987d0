// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "torch_height.hpp"

namespace {

struct Thc : hal::Component {
    using Component::Component;
    static constexpr hal::Traits traits{.singleton = true};

    hal::In<double>    encoder_vel{*this, "encoder-vel", "frequency of the voltage converter, as velocity of an encoder"};
    hal::In<double>    current_vel{*this, "current-vel", "velocity now (motion.current-vel)"};
    hal::In<double>    requested_vel{*this, "requested-vel", "velocity wanted (motion.requested-vel)"};
    hal::In<double>    volts_requested{*this, "volts-requested", "wanted arc voltage", {.unit = "V"}};
    hal::In<double>    vel_tol{*this, "vel-tol", "no effect; velocity-tol is what counts"};
    hal::In<bool>      torch_on{*this, "torch-on", "TRUE: the torch is switched on"};
    hal::In<bool>      arc_ok{*this, "arc-ok", "TRUE: the arc burns"};
    hal::In<bool>      enable{*this, "enable", "FALSE: Z passes unchanged and the correction is forgotten"};
    hal::In<double>    z_pos_in{*this, "z-pos-in", "wanted position of Z"};
    hal::Out<double>   z_pos_out{*this, "z-pos-out", "wanted position of Z, corrected"};
    hal::Out<double>   z_fb_out{*this, "z-fb-out", "position of Z for the motion: without the correction"};
    hal::Out<double>   volts{*this, "volts", "arc voltage", {.unit = "V"}};
    hal::Out<bool>     vel_status{*this, "vel-status", "TRUE: enabled and at the wanted velocity"};
    hal::Out<double>   offset_value{*this, "offset-value", "the correction"};
    hal::Param<double> vel_scale{*this, "vel-scale", "volts per unit of encoder-vel"};
    hal::Param<double> scale_offset{*this, "scale-offset", "encoder-vel at 0 V"};
    hal::Param<double> velocity_tol{*this, "velocity-tol", "largest deviation from the wanted velocity", {.unit = "%"}};
    hal::Param<double> voltage_tol{*this, "voltage-tol", "deviation of the voltage that is not corrected", {.unit = "V"}};
    hal::Param<double> correction_vel{*this, "correction-vel", "change of the correction per cycle"};
    hal::Function      run{*this, "", &Thc::update, "corrects Z"};

    void update(hal::Cycle) noexcept {
        const double z = z_pos_in;
        volts = (encoder_vel - scale_offset) * vel_scale;
        const bool steady = enable && torch::at_velocity(current_vel, requested_vel, velocity_tol);
        if (!enable) offset_.clear();
        else if (!torch_on) offset_.remove(z - last_z_);
        else if (arc_ok && steady) {  // a longer arc has a higher voltage
            if (volts < volts_requested - voltage_tol) offset_.correct(correction_vel);
            else if (volts > volts_requested + voltage_tol) offset_.correct(-correction_vel);
        }
        last_z_ = z;
        vel_status = steady;
        offset_value = offset_.value();
        z_pos_out = z + offset_.value();
        z_fb_out = z;
    }

private:
    torch::Offset offset_;
    double last_z_ = 0.0;
};

}  // namespace

HAL_COMPONENT(Thc, "thc", "Torch height control from the arc voltage", R"(
    volts     = (encoder-vel - scale-offset) * vel-scale
    z-pos-out = z-pos-in + correction,   z-fb-out = z-pos-in

While enabled, with the torch on, the arc burning and the velocity within `velocity-tol` percent of the wanted one, the correction changes
by `correction-vel` in each cycle: up while the voltage is more than `voltage-tol` too low (the arc is too short), down while it is as much
too high. With the torch off it is taken away while Z moves up by itself, no faster than Z moves. Not enabled, Z passes.

There, where LinuxCNC's own takes the whole correction away in one cycle, and gives `offset-value` a cycle late, this does what its
page says.

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
