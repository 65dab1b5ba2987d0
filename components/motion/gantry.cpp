// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Gantry : hal::Component {
    using Component::Component;
    hal::Argument personality{
        *this, "personality", 2, "number of joints", {.per_instance = true, .min = 1, .max = 64}};

    hal::Function read{
        *this, "read", &Gantry::read_joints,
        "computes feedback and combined switches; add it before the motion controller"};
    hal::Function write{*this, "write", &Gantry::write_joints,
                        "computes the joint commands; add it after the motion controller"};
    hal::Outs<double> pos_cmd{*this, "joint.##.pos-cmd", personality,
                              "commanded position of joint ##"};
    hal::Ins<double> pos_fb{*this, "joint.##.pos-fb", personality, "position of joint ##"};
    hal::Ins<bool> joint_home{*this, "joint.##.home", personality, "home switch of joint ##"};
    hal::Outs<double> offset{*this, "joint.##.offset", personality,
                             "position-cmd - pos-cmd of joint ##, found while homing"};
    hal::In<double> position_cmd{*this, "position-cmd", "commanded position"};
    hal::Out<double> position_fb{*this, "position-fb", "position, from a joint that moves"};
    hal::Out<bool> home{*this, "home",
                        "TRUE after all home switches were on, until all are off again"};
    hal::Out<bool> limit{*this, "limit", "TRUE while any home switch is on"};
    hal::In<double> search_vel{*this, "search-vel",
                               "search velocity; its sign is the direction of the home switches"};

    void read_joints(hal::Cycle) noexcept {
        watch_switches();
        if (!home && joint_home[feedback_joint_]) {
            feedback_joint_ = moving_joint();
        }
        position_fb = pos_fb[feedback_joint_] + offset[feedback_joint_];
    }

    void write_joints(hal::Cycle) noexcept {
        watch_switches();
        const bool valid = std::fabs(position_cmd) <= 1e300;
        const double command = valid ? position_cmd.get() : last_command_;
        const double moved = started_ ? command - last_command_ : 0.0;
        const bool homing = !home && limit && moved * search_vel > 0.0;
        for (std::size_t joint = 0; joint < pos_cmd.size(); ++joint) {
            if (homing && joint_home[joint]) {
                offset[joint] = offset[joint] + moved;
            }
            pos_cmd[joint] = command - offset[joint];
        }
        last_command_ = command;
        started_ = started_ || valid;
    }

private:
    void watch_switches() noexcept {
        bool all = true;
        bool any = false;
        for (const auto& on : joint_home) {
            all = all && on;
            any = any || on;
        }
        home = all || (any && home);
        limit = any;
    }

    /// Returns the first joint that is not stopped by its home switch, or the one in use.
    std::size_t moving_joint() const noexcept {
        for (std::size_t joint = 0; joint < joint_home.size(); ++joint) {
            if (!joint_home[joint]) return joint;
        }
        return feedback_joint_;
    }

    double last_command_ = 0.0;
    bool started_ = false;
    std::size_t feedback_joint_ = 0;
    hal::Retained retained_{*this,
                            {{"last-command", last_command_},
                             {"started", started_},
                             {"feedback-joint", feedback_joint_}}};
};

}  // namespace

HAL_COMPONENT(Gantry, "gantry", "Drives several joints from one axis and squares them while homing",
              R"(
All joints follow `position-cmd`, each with its own offset: pos-cmd = position-cmd - offset. While
`position-cmd` moves in the direction of `search-vel` and some but not all home switches are on, the
joints whose switch is on do not move, and their offset absorbs the motion. Once the last switch is
on, the offsets are known and all joints move together, until all switches have been off. Joints
stop without a ramp, so home slowly, and use the same sign for HOME_SEARCH_VEL and HOME_LATCH_VEL.

`personality` is the number of joints, 2 by default. `position-fb` is the feedback of a joint plus
its offset: of joint 0, and, from when its home switch stops it, of the first joint that still
moves, so that it does not jump. While an input is NaN, the last command is held.

**Differences from LinuxCNC:** `home` waits for all joints (LinuxCNC, with more than two: not for
the last ones). The first command is not a motion (LinuxCNC: from 0). Offsets have double precision
(LinuxCNC: single). Without `personality` there are two joints (LinuxCNC 2.10: an error; 2.9
crashes).

    loadrt gantry names=y personality=2
    addf y.read servo
    addf y.write servo
    setp y.search-vel -5
    net y-cmd   => y.position-cmd
    net y-fb    <= y.position-fb
    net y-home  <= y.home
    net y-left  <= y.joint.00.pos-cmd
    net y-right <= y.joint.01.pos-cmd
)")
