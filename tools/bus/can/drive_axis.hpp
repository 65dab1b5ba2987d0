// SPDX-License-Identifier: MIT
// One axis of a drive controlled by SDO: the state machine and handshakes of `components/cia402`,
// with SDOs in place of process data.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "bus/can/node_client.hpp"
#include "cia402/axis.hpp"

namespace hal::tools {

/// Every function that accesses the drive prints the reason on stderr when it returns false.
class SdoAxis {
public:
    SdoAxis(const Options&, NodeClient&, std::uint8_t node, unsigned axis);

    unsigned number() const { return axis_; }
    char letter() const { return static_cast<char>('A' + axis_); }

    /// Sets the timeout of the next command, ns. A motion that takes longer is stopped, and the
    /// command fails.
    void allow(std::int64_t ns);

    // Commands. They return when done, unless `wait` is false.
    bool on();
    bool off();
    /// Without `wait`: `queued` set-points are queued in the drive, others replace the current one.
    bool go(double position, bool relative, bool wait, bool queued = true);
    bool speed(double velocity, bool wait);
    bool torque(double permille, bool wait);
    bool stop();
    bool quick_stop();
    bool home(std::optional<int> method);
    bool reset();
    bool set_mode(canopen::cia402::Mode);
    bool wait();
    /// Returns true when a command of this session enabled or moved the axis.
    bool touched() const { return touched_; }
    /// Stops the axis with quick stop and disables it, in any state. Sets `what` to the result.
    /// Returns false after printing the reason.
    bool secure(std::string& what);
    /// Returns true when the axis is enabled and commanded to move.
    bool moves();

    // Reading, without a command.
    bool look();
    const canopen::cia402::AxisFeedback& seen() const { return feedback_; }
    double position() const { return rules.position.to_user(feedback_.position); }
    double velocity() const { return rules.velocity.to_user(feedback_.velocity); }

    /// Accesses an object of the axis, by its index on the first one. Returns false after printing
    /// the reason; or sets `missing` instead when the drive has no such object.
    bool read(std::uint16_t index, std::uint8_t sub, std::int64_t& value, bool is_signed,
              bool* missing = nullptr);
    bool write(std::uint16_t index, std::uint8_t sub, std::int64_t value, unsigned bytes);
    bool choose_homing(int method);
    /// Prints "A: " and the sentence on stderr. Returns false.
    bool refuse(const std::string& sentence) const;

    canopen::cia402::AxisRules rules;
    /// `stop` (Ctrl-C at a prompt) stops the axis; `end` ends the command at once, secure() must follow. Polled between two cycles.
    enum class Interruption : std::uint8_t { none, stop, end };
    std::function<Interruption()> interrupted;

private:
    using Ready = std::function<bool()>;
    // between two cycles, to leave the bus to others
    static constexpr std::int64_t pause_ns = 10'000'000;
    bool overdue();
    bool is_interrupted() const { return interrupted && interrupted() != Interruption::none; }
    bool adopt();
    bool cycle();
    bool tell(const canopen::cia402::AxisOrders&);
    bool until(const Ready&, bool (SdoAxis::*still)() = nullptr);
    bool report();
    bool begin_motion(canopen::cia402::Mode);
    bool standing();
    bool arrived();

    const Options& options_;
    NodeClient& station_;
    const std::uint8_t node_;
    const unsigned axis_;
    canopen::cia402::Axis machine_;
    canopen::cia402::AxisCommand command_;
    canopen::cia402::AxisFeedback feedback_;
    bool adopted_ = false;
    bool has_torque_ = true;
    bool touched_ = false;
    bool in_motion_ = false;
    struct Told {
        std::optional<std::uint16_t> controlword;
        std::optional<std::int8_t> mode;
        std::optional<std::int32_t> position, velocity;
        std::optional<std::int16_t> torque, vl;
    } reported_;
    std::uint64_t emergencies_ = 0;
    std::int32_t rest_position_ = 0;
    std::int64_t rest_since_ = 0;
    std::int64_t moved_at_ = 0;
    std::int64_t allowed_ = 0;
    std::int64_t deadline_ = INT64_MAX;
};

}  // namespace hal::tools
