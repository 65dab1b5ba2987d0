// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct CorexyByHal : hal::Component {
    using Component::Component;
    hal::In<double> alpha_fb{*this, "alpha-fb", "position of motor alpha"};
    hal::In<double> beta_fb{*this, "beta-fb", "position of motor beta"};
    hal::In<double> j0_cmd{*this, "j0-motor-pos-cmd", "commanded position of joint 0 (x)"};
    hal::In<double> j1_cmd{*this, "j1-motor-pos-cmd", "commanded position of joint 1 (y)"};
    hal::Out<double> j0_fb{*this, "j0-motor-pos-fb", "position of joint 0 (x)"};
    hal::Out<double> j1_fb{*this, "j1-motor-pos-fb", "position of joint 1 (y)"};
    hal::Out<double> alpha_cmd{*this, "alpha-cmd", "commanded position of motor alpha"};
    hal::Out<double> beta_cmd{*this, "beta-cmd", "commanded position of motor beta"};
    hal::Function run{*this, "", &CorexyByHal::update, "computes commands and feedback"};

    void update(hal::Cycle) noexcept {
        alpha_cmd = 0.5 * (j0_cmd + j1_cmd);
        beta_cmd = 0.5 * (j0_cmd - j1_cmd);
        j0_fb = alpha_fb + beta_fb;
        j1_fb = alpha_fb - beta_fb;
    }
};

}  // namespace

HAL_COMPONENT(CorexyByHal, "corexy_by_hal", "Kinematics of a CoreXY belt drive", R"(
    alpha-cmd = (j0-motor-pos-cmd + j1-motor-pos-cmd) / 2      j0-motor-pos-fb = alpha-fb + beta-fb
    beta-cmd  = (j0-motor-pos-cmd - j1-motor-pos-cmd) / 2      j1-motor-pos-fb = alpha-fb - beta-fb

Joint 0 is x, joint 1 is y; one unit of a motor moves x and y by one unit each. With the transform
in HAL the joints are Cartesian, so x and y are homed separately.

    loadrt corexy_by_hal names=belts
    addf belts servo
    net x-cmd => belts.j0-motor-pos-cmd
    net y-cmd => belts.j1-motor-pos-cmd
    net alpha <= belts.alpha-cmd
    net beta  <= belts.beta-cmd
)")
