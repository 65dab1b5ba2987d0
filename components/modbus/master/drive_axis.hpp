// SPDX-License-Identifier: MIT
// The spindle pins of a frequency converter: what the drive is commanded, and what its values mean.
#pragma once

#include <cmath>
#include <cstdint>

#include "modbus/master/image.hpp"

namespace hal::modbus {

/// All functions are [realtime].
class DriveAxis {
public:
    struct Inputs {
        bool run = false;
        double speed_rpm = 0.0;  ///< negative: reverse
        bool reset = false;
    };
    struct Feedback {
        bool is_online = false;
        bool has_speed = false;  ///< the actual speed has been read
        bool is_current = false;  ///< and that was not long ago
        double speed_rpm = 0.0;  ///< without sign
        bool has_running = false;  ///< `is_running` has been read
        bool is_running = false;
        bool reads_fault = false;  ///< `is_faulty` has been read
        bool is_faulty = false;
    };
    struct Outputs {
        std::uint32_t command = drive_stop;
        double speed_rpm = 0.0;  ///< without sign
        bool at_speed =
            false;  ///< it turns as the inputs command, which a stopped drive never does
        bool fault = false;
        bool stalled = false;
        bool running = false;
        double speed_feedback_rpm = 0.0;  ///< with sign
    };

    DriveAxis(double max_speed_rpm, double tolerance, std::int64_t stall_ns) noexcept
        : max_speed_(max_speed_rpm), tolerance_(tolerance), stall_ns_(stall_ns) {}

    /// The drive was stopped by something else: `run` starts it with its next rising edge only.
    void require_edge() noexcept {
        may_run_ = false;
        direction_ = drive_stop;
    }

    /// One cycle. A reversal stops the drive first.
    Outputs step(const Inputs& in, const Feedback& feedback, std::int64_t now_ns) noexcept {
        follow_run(in, feedback);
        if (std::isfinite(in.speed_rpm)) {
            speed_ = in.speed_rpm;
        }
        // an edge before the first reading of the speed waits for it
        const bool may_run = may_run_ && feedback.has_speed;
        choose_direction(in.run && may_run && speed_ != 0.0, feedback);

        Outputs out;
        out.command = direction_ | (in.reset ? std::uint32_t{drive_reset} : 0U);
        out.speed_rpm = direction_ == drive_stop ? 0.0 : std::fmin(std::fabs(speed_), max_speed_);
        out.fault = feedback.is_faulty;
        out.running = feedback.has_running ? feedback.is_running : feedback.speed_rpm > 0.0;
        out.speed_feedback_rpm = turns_back_ ? 0.0 - feedback.speed_rpm : feedback.speed_rpm;
        const bool turns_as_commanded = direction_ != drive_stop && direction_ == wanted_;
        const double error = std::fabs(feedback.speed_rpm - out.speed_rpm);
        out.at_speed =
            turns_as_commanded && feedback.is_current && error <= tolerance_ * out.speed_rpm;
        out.stalled = stalls(out.speed_rpm, feedback, now_ns);
        return out;
    }

private:
    /// After an interruption `run` needs another rising edge.
    void follow_run(const Inputs& in, const Feedback& feedback) noexcept {
        const bool lost_speed = had_speed_ && !feedback.has_speed;
        had_speed_ = feedback.has_speed;
        // a trip that is not read leaves the drive commanded: the reset must not start it
        const bool resets_unread = in.reset && !was_reset_ && !feedback.reads_fault;
        was_reset_ = in.reset;
        if (!feedback.is_online || feedback.is_faulty || lost_speed || resets_unread) {
            require_edge();
        } else if (in.run && !was_run_) {
            may_run_ = true;
        }
        was_run_ = in.run;
    }

    void choose_direction(bool runs, const Feedback& feedback) noexcept {
        wanted_ = drive_stop;
        if (runs) {
            wanted_ = speed_ < 0.0 ? drive_reverse : drive_forward;
        }
        const bool reverses =
            direction_ != drive_stop && wanted_ != drive_stop && direction_ != wanted_;
        const bool still_turns = feedback.speed_rpm > 0.01 * max_speed_;
        const bool turns_other_way =
            wanted_ != drive_stop && still_turns && turns_back_ != (wanted_ == drive_reverse);
        direction_ = reverses || turns_other_way ? std::uint32_t{drive_stop} : wanted_;
        if (direction_ != drive_stop) {
            turns_back_ = direction_ == drive_reverse;
        }
    }

    bool stalls(double commanded_rpm, const Feedback& feedback, std::int64_t now_ns) noexcept {
        const bool turns = feedback.speed_rpm >= 0.1 * commanded_rpm;
        if (commanded_rpm == 0.0 || !feedback.is_online || turns) {
            turned_at_ns_ = now_ns;
        }
        return now_ns - turned_at_ns_ >= stall_ns_;
    }

    const double max_speed_, tolerance_;
    const std::int64_t stall_ns_;
    bool may_run_ = false;
    bool had_speed_ = false;
    bool was_run_ = true;  // a machine that starts with `run` TRUE waits for an edge
    bool was_reset_ = true;
    bool turns_back_ = false;
    double speed_ = 0.0;
    std::uint32_t direction_ = drive_stop;
    std::uint32_t wanted_ = drive_stop;
    std::int64_t turned_at_ns_ = 0;
};

}  // namespace hal::modbus
