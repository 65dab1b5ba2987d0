// SPDX-License-Identifier: MIT
// The axes of a session of `hal can drive`: made when a command names them, interrupted by a
// signal, stopped at the end.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <string>

#include "bus/canopen/drive_axis.hpp"
#include "bus/canopen/supervision.hpp"

namespace hal::tools {

/// What the commands of a session share. For the thread that owns the NodeClient, except press().
class DriveSession {
public:
    struct Settings {
        std::uint8_t node = 0;
        unsigned axis = 0;          ///< axis of commands without a letter
        bool ends_at_failure = false;
        bool prompt = false;        ///< interactive: `ok` confirms commands without output
        bool one_shot = false;      ///< a single command of the command line
        bool axis_given = false;    ///< by --axis
        std::int64_t within_ns = 0; ///< timeout of a command; 0: its default
    };
    DriveSession(const Options&, NodeClient&, Supervision&, const Settings&);

    const Settings& settings() const { return settings_; }
    const Options& options() const { return options_; }

    /// Notes a signal: it interrupts the command that is running. [any]
    void press() { pressed_.store(true); }
    void clear_press() { pressed_.store(false); }
    /// Serves the bus while no command is running.
    void idle();
    bool stop_requested() const { return station_.bus.stop.requested(); }

    SdoAxis& axis(unsigned number);
    /// Checks that the axis exists and is supervised as far as possible; call it before a motion.
    bool watched(SdoAxis&);
    /// Returns true when another device sends our heartbeat, and prints what that means.
    bool collided() const;
    /// Ends the session. Unless `leave`, first stops and disables every axis that was enabled or
    /// moved; an `expected` end is not a failure. Returns the exit status.
    int end(bool leave, const char* why, bool expected);

    bool print_line(const std::string& text) const;
    /// Prints the sentence on stderr. Returns false.
    bool wrong(const std::string& sentence) const;
    /// Reports a factor that no command uses. Returns false.
    bool without_effect(const std::string& command) const;

private:
    SdoAxis::Interruption interruption() const;
    bool stop_axis(SdoAxis&, const char* why, bool expected);
    void report_moving(SdoAxis&) const;

    const Options& options_;
    NodeClient& station_;
    Supervision& supervision_;
    const Settings settings_;
    std::array<std::unique_ptr<SdoAxis>, cia402::max_axes> axes_;
    std::atomic<bool> pressed_{false};  // written by the thread of signals
};

}  // namespace hal::tools
