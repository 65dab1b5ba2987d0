// SPDX-License-Identifier: MIT
// What an INI file and the installation of LinuxCNC determine of a machine: its programs, modules,
// netlists and folders.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "linuxcnc/installation.hpp"
#include "linuxcnc/linuxcnc.hpp"
#include "netlist/netlist.hpp"

namespace hal::tools {

using Words = std::vector<std::string>;

struct Configuration {
    std::string file;    ///< the INI file, absolute, with its includes expanded
    std::string folder;  ///< its folder, where everything runs
    bool expanded = false;  ///< `file` was written for this run
    Ini ini;

    Installation linuxcnc;
    std::string nml;     ///< NML configuration
    /// programs with their arguments; io, halui and bridge may be empty
    Words task, io, halui, bridge, display;
    Words planner, homing;           ///< modules with their parameters
    std::vector<Words> applications;
    std::int64_t applications_delay_ns = 0;
    std::string shutdown;            ///< [HAL]SHUTDOWN; may be empty
    /// [HALCYON]TASK_TIMEOUT: longest time between two cycles of task; 0: not watched
    std::int64_t task_timeout_ns = 0;
    /// [HALCYON]MAX_CPU_GAP, of SessionOptions
    std::int64_t max_gap_ns = 0;
    std::int64_t max_gap_realtime_ns = 0;

    /// A name, as the messages have it: "machine.ini".
    std::string given;
};

/// Reads the INI file and checks what must be there before anything starts. Prints the errors and
/// returns nothing.
std::optional<Configuration> read_configuration(const LinuxcncOptions&);

/// Sets the variables that LinuxCNC's programs read, before anything else runs.
void export_configuration(const Configuration&, const LinuxcncOptions&);

/// Removes what read_configuration() wrote.
void remove_expanded(const Configuration&);

/// Returns where the program is: a path, or the first file in PATH; empty when it is missing.
std::string find_program(const Configuration&, const std::string& program);

}  // namespace hal::tools
