// SPDX-License-Identifier: MIT
// The objects of one axis of a drive, read and written by SDO.
#pragma once

#include <cstdint>
#include <string>

#include "bus/canopen/node_client.hpp"
#include "cia402/axis.hpp"

namespace hal::tools {

/// Reads and writes the objects of one axis, and can stop it in any state. It gives no other
/// command. Every function that accesses the drive prints the reason on stderr when it returns
/// false. For the thread that owns the NodeClient.
class AxisAccess {
public:
    AxisAccess(const Options&, NodeClient&, std::uint8_t node, unsigned axis);

    unsigned number() const { return axis_; }
    char letter() const { return static_cast<char>('A' + axis_); }

    /// Reads the state of the axis from the drive.
    bool look();
    const cia402::AxisFeedback& seen() const { return feedback_; }
    double position() const { return rules.position.to_user(feedback_.position); }
    double velocity() const { return rules.velocity.to_user(feedback_.velocity); }

    /// Accesses an object of the axis, by its index on the first one. Returns false after printing
    /// the reason; or sets `missing` instead when the drive has no such object.
    bool read(std::uint16_t index, std::uint8_t sub, std::int64_t& value, bool is_signed,
              bool* missing = nullptr);
    bool write(std::uint16_t index, std::uint8_t sub, std::int64_t value, unsigned bytes);
    bool choose_homing(int method);
    /// Stops the axis with quick stop and disables it, in any state. Sets `what` to the result.
    bool stop_and_disable(std::string& what);
    /// Prints "A: ", the sentence and a new EMCY on stderr. Returns false.
    bool refuse(const std::string& sentence) const;

    cia402::AxisRules rules;

protected:
    // between two cycles, to leave the bus to others
    static constexpr std::int64_t pause_ns = 10'000'000;

    cia402::State state() const { return cia402::state_of(feedback_.statusword); }
    /// An EMCY that arrived before this call is not reported with a failure.
    void forget_emergencies() { emergencies_ = station_.network.add(node_).emergencies(); }
    /// Starts to measure how long the position does not change.
    void restart_standstill() { rest_since_ = monotonic_ns(); }
    std::int64_t rest_since() const { return rest_since_; }
    bool standing() const;

    const Options& options_;
    NodeClient& station_;
    const std::uint8_t node_;
    cia402::AxisFeedback feedback_;

private:
    bool read_optional(bool& available, std::uint16_t index, std::int64_t& value);
    bool in_fault() const;
    bool has_torque() const;
    bool brake();
    /// Sends the commands without waiting for responses.
    void send_stop();
    std::string homing_methods(bool& missing);

    const unsigned axis_;
    bool has_torque_object_ = true;
    std::uint64_t emergencies_ = 0;
    std::int32_t rest_position_ = 0;
    std::int64_t rest_since_ = 0;  // 0: no position yet
};

}  // namespace hal::tools
