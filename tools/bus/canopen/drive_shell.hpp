// SPDX-License-Identifier: MIT
// The lines of a session of `hal can drive`: its own commands (`A go 1000`), and those of the robot
// shell, which end with the letter of the axis (`ONA:`).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bus/canopen/drive_robot_shell.hpp"
#include "bus/canopen/drive_session.hpp"
#include "bus/canopen/drive_values.hpp"
#include "cli/prompt_loop.hpp"

namespace hal::tools {

/// For the thread of the session, which must outlive it.
class DriveShell final : public LineExecutor {
public:
    explicit DriveShell(DriveSession& session) : session_(session) {}

    int execute(std::string_view line) override;
    Completion complete(std::string_view line, std::size_t cursor) override;
    bool collecting() const override { return false; }
    bool over() const override { return over_ || session_.stop_requested(); }
    std::function<void()> meanwhile() override;
    /// Returns true after `quit`: the axes stay as they are.
    bool left() const { return left_; }

private:
    using Words = std::vector<std::string>;
    struct Motion;

    bool run(Words);
    std::optional<unsigned> parse_axis(Words&) const;
    std::optional<std::int64_t> parse_within(Words& arguments) const;
    bool quit(const std::string& verb);
    bool command(SdoAxis&, const std::string& verb, Words arguments);
    bool simple(SdoAxis&, const std::string& verb);
    bool set_mode(SdoAxis&, const std::string& wanted);
    bool home(SdoAxis&, const Words& arguments, const std::string& usage);
    bool motion(SdoAxis&, const std::string& verb, Words arguments, const std::string& usage);
    bool move(SdoAxis&, const std::string& verb, const Motion&);
    static std::string help_text();

    DriveSession& session_;
    DriveValues values_{session_};
    RobotShell robot_{session_, values_};
    bool over_ = false;
    bool left_ = false;
};

}  // namespace hal::tools
