// SPDX-License-Identifier: MIT
// The session of `hal can drive`: its own commands, and those of the robot shell, which end with
// the letter of the axis (`ONA:`).
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/can/drive_axis.hpp"
#include "bus/can/supervision.hpp"
#include "cli/prompt_loop.hpp"

namespace hal::tools {

class DriveShell final : public LineExecutor {
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
    DriveShell(const Options&, NodeClient&, Supervision&, const Settings&);

    int execute(std::string_view line) override;
    Completion complete(std::string_view line, std::size_t cursor) override;
    bool collecting() const override { return false; }
    bool over() const override { return over_ || station_.bus.stop.requested(); }
    std::function<void()> meanwhile() override;
    void press() { pressed_.store(true); }  ///< Notes a signal. [any]
    /// Returns true after `quit`: the axes stay as they are.
    bool left() const { return left_; }
    /// Ends the session. Unless `leave`, first stops and disables every axis that was enabled or
    /// moved; an `expected` end is not a failure. Returns the exit status.
    int end(bool leave, const char* why, bool expected = true);

private:
    using Words = std::vector<std::string>;
    struct RobotCommand;

    bool run(Words);
    /// Runs `ONA:`, `GB: 1000`: a command of the robot shell. Returns nullopt for other commands.
    std::optional<bool> robot_line(std::string_view line);
    bool robot_command(SdoAxis&, const RobotCommand&, const std::vector<std::int64_t>&, bool query);
    bool print_line(const std::string& text) const;
    bool wrong(const std::string& sentence) const;
    /// Reports a factor that no command uses. Returns false.
    bool without_effect(const std::string& command) const;
    bool command(SdoAxis&, const std::string& verb, Words arguments);
    std::optional<std::int64_t> take_within(Words& arguments) const;
    bool set_mode(SdoAxis& a, const std::string& wanted);
    bool simple(SdoAxis& a, const std::string& verb);
    bool motion(SdoAxis&, const std::string& verb, Words arguments, const std::string& usage);
    bool query(SdoAxis&, const std::string& name);
    bool set(SdoAxis&, const std::string& name, const std::string& value);
    bool status(SdoAxis&);
    /// Accesses a parameter of the drive by name, in user units. Returns false after printing the
    /// reason.
    bool fetch(SdoAxis&, const std::string& name, double& value);
    bool store(SdoAxis&, const std::string& name, double value, double& back);
    SdoAxis& axis(unsigned number);
    /// Checks that the axis exists and is supervised as far as possible; call it before a motion.
    bool watched(SdoAxis&);
    SdoAxis::Interruption interruption() const;
    static std::string help_text();

    const Options& options_;
    NodeClient& station_;
    Supervision& supervision_;
    const Settings settings_;
    std::array<std::unique_ptr<SdoAxis>, canopen::cia402::most_axes> axes_;
    std::atomic<bool> pressed_{false};
    bool over_ = false;
    bool left_ = false;
};

// Shared by the sources of the session.
bool parse_real(const std::string& text, double& value);
/// Parses `4096/360`, `4096,360`, `4096`.
bool parse_factor(const std::string& text, canopen::cia402::Factor&);
/// Returns the names of parameters and factors in the order of the help; with `reading` also the
/// read-only ones.
std::vector<std::string> value_names(bool reading);
std::string value_help();

}  // namespace hal::tools
