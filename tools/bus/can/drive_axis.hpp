// SPDX-License-Identifier: MIT
// One axis of a drive by hand: the walks and handshakes of `components/canopen/402`, with SDOs in place of process data.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "bus/can/station.hpp"
#include "cia402/axis.hpp"

namespace hal::tools {

/// Every function that talks to the drive says why on stderr when it returns false.
class HandAxis {
public:
    HandAxis(const Options&, Station&, std::uint8_t node, unsigned axis);

    unsigned number() const { return axis_; }
    char letter() const { return static_cast<char>('A' + axis_); }

    /// Time for the next command. A motion that takes longer is stopped, and the command fails.
    void allow(std::int64_t ns);

    // Commands. They are done when they return, unless `wait` is false.
    bool on();
    bool off();
    /// Without `wait`: `queued` set-points wait their turn in the drive, others replace what the drive is at.
    bool go(double position, bool relative, bool wait, bool queued = true);
    bool speed(double velocity, bool wait);
    bool torque(double permille, bool wait);
    bool stop();
    bool quick_stop();
    bool home(std::optional<int> method);
    bool reset();
    bool set_mode(canopen::cia402::Mode);
    bool wait();
    /// A command of this session switched it on or moved it.
    bool touched() const { return touched_; }
    /// Quick stop, then off, from whatever state it is in. False after saying why not; `what` is what became of it.
    bool secure(std::string& what);
    /// On, and commanded to move.
    bool moves();

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
    /// `stop` (Ctrl-C at a prompt) stops the axis; `end` ends the command at once, for secure() to follow. Asked between two cycles.
    enum class Interruption : std::uint8_t { none, stop, end };
    std::function<Interruption()> interrupted;

private:
    using Ready = std::function<bool()>;
    static constexpr std::int64_t pause_ns = 10'000'000;  // between two looks: the bus is there for others, too
    bool overdue();
    bool is_interrupted() const { return interrupted && interrupted() != Interruption::none; }
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
    bool adopted_ = false, has_torque_ = true, touched_ = false, in_motion_ = false;
    struct Told {
        std::optional<std::uint16_t> controlword;
        std::optional<std::int8_t> mode;
        std::optional<std::int32_t> position, velocity;
        std::optional<std::int16_t> torque, vl;
    } told_;
    std::uint64_t emergencies_ = 0;
    std::int32_t rest_position_ = 0;
    std::int64_t rest_since_ = 0, moved_at_ = 0, allowed_ = 0, deadline_ = INT64_MAX;
};

}  // namespace hal::tools
