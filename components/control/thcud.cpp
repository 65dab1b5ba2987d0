// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "torch_height.hpp"

namespace {

struct Thcud : hal::Component {
    using Component::Component;
    static constexpr hal::Traits traits{.singleton = true};

    hal::In<bool>      torch_up{*this, "torch-up", "the voltage control wants the torch higher"};
    hal::In<bool>      torch_down{*this, "torch-down", "the voltage control wants the torch lower"};
    hal::In<double>    current_vel{*this, "current-vel", "velocity now (motion.current-vel)"};
    hal::In<double>    requested_vel{*this, "requested-vel", "velocity wanted (motion.requested-vel)"};
    hal::In<bool>      torch_on{*this, "torch-on", "TRUE: the torch is switched on"};
    hal::In<bool>      arc_ok{*this, "arc-ok", "TRUE: the arc burns"};
    hal::In<bool>      enable{*this, "enable", "FALSE: Z passes unchanged and the correction is forgotten"};
    hal::In<double>    z_pos_in{*this, "z-pos-in", "wanted position of Z"};
    hal::Out<double>   z_pos_out{*this, "z-pos-out", "wanted position of Z, corrected"};
    hal::Out<double>   z_fb_out{*this, "z-fb-out", "position of Z for the motion: without the correction"};
    hal::Out<double>   cur_offset{*this, "cur-offset", "the correction"};
    hal::Out<bool>     vel_status{*this, "vel-status", "TRUE: enabled and at the wanted velocity"};
    hal::Out<bool>     removing_offset{*this, "removing-offset", "TRUE: the torch is off and the correction goes away"};
    hal::Param<double> velocity_tol{*this, "velocity-tol", "largest deviation from the wanted velocity", {.unit = "%"}};
    hal::Param<double> correction_vel{*this, "correction-vel", "change of the correction per cycle"};
    hal::Function      run{*this, "", &Thcud::update, "corrects Z"};

    void update(hal::Cycle) noexcept {
        const double z = z_pos_in;
        const bool steady = enable && torch::at_velocity(current_vel, requested_vel, velocity_tol);
        bool removing = false;
        if (!enable) offset_.clear();
        else if (!torch_on) removing = offset_.remove(z - last_z_);
        else if (arc_ok && steady && torch_up != torch_down) offset_.correct(torch_up ? correction_vel : -correction_vel);
        last_z_ = z;
        vel_status = steady;
        removing_offset = removing;
        cur_offset = offset_.value();
        z_pos_out = z + offset_.value();
        z_fb_out = z;
    }

private:
    torch::Offset offset_;
    double last_z_ = 0.0;
};

}  // namespace

HAL_COMPONENT(Thcud, "thcud", "Torch height control from up and down signals", R"(
    z-pos-out = z-pos-in + correction,   z-fb-out = z-pos-in

While enabled, with the torch on, the arc burning and the velocity within `velocity-tol` percent of the wanted one, the correction changes
by `correction-vel` in each cycle, up or down as the inputs say; with both inputs on it stays. With the torch off it is taken
away while Z moves up by itself, no faster than Z moves, so that the torch never goes down because the arc ended. Not enabled, Z passes.

There, where LinuxCNC's own takes the whole correction away in one cycle and `cur-offset` stays 0, this does what its page says.

    loadrt thcud
    addf thcud servo
    setp thcud.velocity-tol 10
    setp thcud.correction-vel 0.001
    net torch-up   => thcud.torch-up
    net torch-down => thcud.torch-down
    net z-cmd      => thcud.z-pos-in
    net z-motor    <= thcud.z-pos-out
)")
