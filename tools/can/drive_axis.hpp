// SPDX-License-Identifier: MIT
// One axis of a drive by hand: the walks and handshakes of `components/canopen/402`, with SDOs in place of process data.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "can/station.hpp"
#include "canopen/402/axis.hpp"

namespace hal::tools {

/// Every function that talks to the drive says why on stderr when it returns false.
class HandAxis {
public:
    HandAxis(const Options&, Station&, std::uint8_t node, unsigned axis);

    char letter() const { return static_cast<char>('A' + axis_); }

    // Commands. They are done when they return, unless `wait` is false.
    bool on();
    bool off();
    bool go(double position, bool relative, bool wait);
    bool speed(double velocity, bool wait);
    bool torque(double permille, bool wait);
    bool stop();
    bool quick_stop();
    bool home(std::optional<int> method);
    bool reset();
    bool set_mode(canopen::cia402::Mode);
    bool wait();

    // Looking, without a word to the state machine.
    bool look();
    const canopen::cia402::AxisFeedback& seen() const { return feedback_; }
    double position() const { return rules.position.to_user(feedback_.position); }
    double velocity() const { return rules.velocity.to_user(feedback_.velocity); }

    /// An object of the axis, as of the first one. False after saying why; or, with `missing`, when the drive has no such object.
    bool read(std::uint16_t index, std::uint8_t sub, std::int64_t& value, bool is_signed, bool* missing = nullptr);
    bool write(std::uint16_t index, std::uint8_t sub, std::int64_t value, unsigned bytes);
    bool choose_homing(int method);
    /// "A: " and the sentence, on stderr; false.
    bool refuse(const std::string& sentence) const;

    canopen::cia402::AxisRules rules;
    /// Ctrl-C during a motion stops the axis. Asked between two cycles.
    std::function<bool()> interrupted;

private:
    using Ready = std::function<bool()>;
    bool adopt();
    bool cycle();
    bool tell(const canopen::cia402::AxisOrders&);
    bool until(const Ready&, bool (HandAxis::*still)() = nullptr);
    bool report();
    bool begin_motion(canopen::cia402::Mode);
    bool standing();
    bool arrived();

    const Options& options_;
    Station& station_;
    const std::uint8_t node_;
    const unsigned axis_;
    canopen::cia402::Axis machine_;
    canopen::cia402::AxisCommand command_;
    canopen::cia402::AxisFeedback feedback_;
    bool adopted_ = false, has_torque_ = true;
    struct Told {
        std::optional<std::uint16_t> controlword;
        std::optional<std::int8_t> mode;
        std::optional<std::int32_t> position, velocity;
        std::optional<std::int16_t> torque, vl;
    } told_;
    std::uint64_t emergencies_ = 0;
    std::int32_t rest_position_ = 0;
    std::int64_t rest_since_ = 0, moved_at_ = 0;
};

}  // namespace hal::tools
