// SPDX-License-Identifier: MIT
// What `hal doctor --fix` does about its findings.
#pragma once

#include <string>
#include <vector>

#include "inspect/doctor.hpp"
#include "inspect/finding.hpp"

namespace hal::tools {

struct Remedy {
    std::string command;  ///< for a shell; what needs root begins with `sudo`
    std::string then;     ///< what remains to be done, or ""
    bool operator==(const Remedy&) const = default;
};

/// Returns the commands of findings, each once. [setup]
std::vector<Remedy> remedies_of(const std::vector<Finding>&);

/// Shows each command, asks, and runs it; root needs no sudo. Returns the exit code: 0 when nothing
/// that was agreed to has failed. [setup]
int carry_out(const DoctorOptions&, const std::vector<Remedy>&);

}  // namespace hal::tools
