// SPDX-License-Identifier: MIT
// The parameters of a drive by name: `set NAME VALUE` and `NAME?`.
#pragma once

#include <string>
#include <vector>

#include "bus/canopen/drive_session.hpp"

namespace hal::tools {

/// Reads and writes parameters and factors by name, in user units. Every function prints the
/// reason when it returns false. For the thread of the session.
class DriveValues {
public:
    explicit DriveValues(DriveSession& session) : session_(session) {}

    /// Prints a parameter, a factor or a value of the state.
    bool query(SdoAxis&, const std::string& name);
    bool set(SdoAxis&, const std::string& name, const std::string& value);
    bool status(SdoAxis&);
    bool fetch(SdoAxis&, const std::string& name, double& value);
    /// Sets `back` to the value that the drive keeps.
    bool store(SdoAxis&, const std::string& name, double value, double& back);

private:
    bool unknown(const std::string& name, bool reading) const;

    DriveSession& session_;
};

/// Parses a finite number, with or without a sign.
bool parse_real(const std::string& text, double& value);
/// Returns the names of parameters and factors in the order of the help; with `reading` also the
/// read-only ones.
std::vector<std::string> value_names(bool reading);
std::string value_help();

}  // namespace hal::tools
