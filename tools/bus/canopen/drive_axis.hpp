// SPDX-License-Identifier: MIT
// One axis of a drive controlled by SDO: the state machine and handshakes of `components/cia402`,
// with SDOs in place of process data.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "bus/canopen/drive_access.hpp"

namespace hal::tools {

/// Commands one axis through the state machine of CiA 402. Every function that accesses the drive
/// prints the reason on stderr when it returns false. For the thread that owns the NodeClient.
class SdoAxis final : public AxisAccess {
public:
    using AxisAccess::AxisAccess;

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
    bool set_mode(cia402::Mode);
    bool wait();
    /// Returns true when a command of this session enabled or moved the axis.
    bool touched() const { return touched_; }
    /// Stops the axis with quick stop and disables it, in any state. Sets `what` to the result.
    /// Returns false after printing the reason.
    bool secure(std::string& what);
    /// Returns true when the axis is enabled and commanded to move.
    bool moves();

    /// `stop` (Ctrl-C at a prompt) stops the axis; `end` ends the command at once, and secure()
    /// must follow. Polled between two cycles.
    enum class Interruption : std::uint8_t { none, stop, end };
    std::function<Interruption()> interrupted;

private:
    using Ready = std::function<bool()>;
    /// The values that the drive has received.
    struct Written {
        std::optional<std::uint16_t> controlword;
        std::optional<std::int8_t> mode;
        std::optional<std::int32_t> position, velocity;
        std::optional<std::int16_t> torque, vl;
    };

    Interruption interruption() const { return interrupted ? interrupted() : Interruption::none; }
    bool adopt();
    bool cycle();
    bool cycles(unsigned count);
    bool write_orders(const cia402::AxisOrders&);
    bool write_target(const cia402::AxisOrders&);
    template <typename Value>
    bool write_changed(std::optional<Value>& written, Value value, std::uint16_t index);
    bool until(const Ready&, bool (SdoAxis::*still)() = nullptr);
    bool until_target_reached();
    bool interrupt(Interruption why);
    bool timed_out();
    bool report();
    bool clear_failure();
    bool begin_motion(cia402::Mode);
    bool arrived();
    bool withdraw_set_points();
    bool target_reached() const;

    cia402::Axis machine_;
    cia402::AxisCommand command_;
    Written written_;
    bool adopted_ = false;
    bool touched_ = false;
    bool in_motion_ = false;
    std::int64_t began_ns_ = 0;
    std::int64_t timeout_ns_ = 0;
    std::int64_t deadline_ns_ = INT64_MAX;
};

}  // namespace hal::tools
