// SPDX-License-Identifier: MIT
// What arm_kinematics, mill_kinematics and drive_kinematics have in common: pins and the check of
// their inputs.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <optional>

#include "estimation/matrix.hpp"
#include "hal/component.hpp"

namespace hal::estimation {

/// Documentation of the pins whose meaning depends on the machine.
struct KinematicsDocs {
    const char *joint, *target, *pose, *command, *follow;
    std::optional<double> safe = {};  ///< of the commands: 0 for speeds, none for positions
};

/// Base of the kinematics components. A derived class declares the function `update` and calls
/// `read_inputs` first.
class Kinematics : public Component {
protected:
    static constexpr double pi = std::numbers::pi;

    Kinematics(const hal_host* host, std::int64_t joints, const KinematicsDocs& docs)
        : Component(host),
          joint(*this, "joint-#", joints, docs.joint),
          target(*this, "target-#", 6, docs.target),
          pose(*this, "pose-#", 6, docs.pose, {.finite = true}),
          command(*this, "command-#", joints, docs.command, {.safe = docs.safe, .finite = true}),
          follow(*this, "follow", docs.follow) {
        measured_ = Vector::Zero(static_cast<Eigen::Index>(joints));
    }

    /// Copies the joints to `measured_`. False, with `solved` FALSE, when an input or one of the
    /// machine's `dimensions` is not finite or exceeds 1e9. [realtime]
    bool read_inputs(std::initializer_list<double> dimensions = {}) noexcept {
        const bool valid = std::ranges::all_of(target, is_valid) &&
                           std::ranges::all_of(dimensions, is_valid) && read_joints();
        if (!valid) {
            reject_inputs();
        }
        return valid;
    }
    /// Copies the joints to `measured_`. False when one is not valid. [realtime]
    bool read_joints() noexcept {
        if (!std::ranges::all_of(joint, is_valid)) return false;
        for (std::size_t i = 0; i < joint.size(); ++i) {
            measured_(static_cast<Eigen::Index>(i)) = joint[i];
        }
        return true;
    }
    /// Counts a cycle with an invalid input. [realtime]
    void reject_inputs() noexcept {
        bad_inputs = bad_inputs + 1;
        solved = false;
    }
    static bool is_valid(double value) noexcept { return std::fabs(value) < 1e9; }  // not for NaN

    Vector measured_;

public:
    Ins<double> joint, target;
    Outs<double> pose, command;
    In<bool> follow;
    Out<bool> solved{*this, "solved", "TRUE while the commands reach the target"};
    Out<std::uint32_t> bad_inputs{
        *this, "bad-inputs",
        "cycles with an input or a dimension that is NaN, infinite or above 1e9; positions keep "
        "their values, speeds of wheels become 0"};
};

}  // namespace hal::estimation
