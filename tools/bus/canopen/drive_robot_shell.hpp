// SPDX-License-Identifier: MIT
// The commands of the robot shell: NAME, the letter of the axis, `:` for a command or `?` for a
// query, integers. `ONA:`, `GB: -1000`, `PFA:4096,360`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bus/canopen/drive_session.hpp"
#include "bus/canopen/drive_values.hpp"

namespace hal::tools {

/// For the thread of the session.
class RobotShell {
public:
    RobotShell(DriveSession& session, DriveValues& values) : session_(session), values_(values) {}

    /// Runs a command of the robot shell. Returns whether it succeeded, after printing the reason
    /// if not; nullopt for any other line.
    std::optional<bool> execute(std::string_view line);

private:
    struct Command;
    struct Line;
    using Integers = std::vector<std::int64_t>;
    static const Command commands[];

    static const Command* find_command(std::string_view name);
    static std::optional<Line> parse(std::string_view text);
    static std::string usage(const Command&);
    bool help() const;
    std::optional<bool> unknown(const Line&) const;
    bool parse_values(const Line&, const Command&, Integers&) const;
    bool run(SdoAxis&, const Command&, const Integers&, bool query);
    bool factor(SdoAxis&, const Command&, const Integers&, bool query);
    bool parameter(SdoAxis&, const Command&, const Integers&, bool query);
    bool answer(const SdoAxis&, const Command&, const std::string& value) const;

    DriveSession& session_;
    DriveValues& values_;
};

}  // namespace hal::tools
