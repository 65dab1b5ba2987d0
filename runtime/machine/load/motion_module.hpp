// SPDX-License-Identifier: MIT
// LinuxCNC's motion controller as its netlists see it.
#pragma once

#include <cstdint>

#include "hal/component.hpp"

namespace hal {

/// Declares what `motmod` of LinuxCNC 2.8 to 2.10 has, with the home pins that homemod adds to it.
/// A name that one of these versions has is declared for all of them.
class MotionModule : public Component {
public:
    explicit MotionModule(const hal_host* host);

private:
    void declare_joints();
    void declare_digital_pins();
    void declare_analog_pins();
    void declare_errors();
    void add_threads() const;
    // They never run. Two functions, because a thread should not run one twice.
    void handle_commands(Cycle) noexcept { handled_ = true; }
    void control(Cycle) noexcept { controlled_ = true; }

    Argument joints_;
    Argument extra_joints_;
    Argument spindles_;
    Argument unlock_mask_;
    Argument base_period_ns_;
    Argument servo_period_ns_;
    Function command_handler_;
    Function controller_;
    bool handled_ = false;
    bool controlled_ = false;
};

}  // namespace hal
