// SPDX-License-Identifier: MIT
// Which program of the tool box has a command. The tables of commands are compiled once for each
// program.
#pragma once

namespace hal::tools {

/// The programs that share the tables. `hal` is what runs and commands machines, and is built
/// first; it replaces itself with the others.
enum class Part { core, tools, bus, panel };

/// Where a command is: in which program, and its function, where this source is compiled for that
/// program; nullptr elsewhere.
template <Part part_, auto run_>
struct In {
    static constexpr Part part = part_;
    static constexpr auto run = run_;
};

#define IN_CORE(run) In<Part::core, run>
#ifdef HALCYON_TOOLS_PROGRAM
#define IN_TOOLS(run) In<Part::tools, run>
#else
#define IN_TOOLS(run) In<Part::tools, nullptr>
#endif
#ifdef HALCYON_BUS_PROGRAM
#define ON_BUS(run) In<Part::bus, run>
#else
#define ON_BUS(run) In<Part::bus, nullptr>
#endif
#ifdef HALCYON_PANEL_PROGRAM
#define ON_PANEL(run) In<Part::panel, run>
#else
#define ON_PANEL(run) In<Part::panel, nullptr>
#endif

constexpr const char* program_of(Part part) {
    switch (part) {
    case Part::core: return "hal";
    case Part::tools: return "hal-tools";
    case Part::bus: return "hal-bus";
    case Part::panel: return "hal-panel";
    }
    return "";
}

}  // namespace hal::tools
