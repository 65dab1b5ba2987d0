// SPDX-License-Identifier: MIT
// Which program of the tool box has a command. The tables of commands are compiled once for each
// program.
#pragma once

namespace hal::tools {

/// The programs that share the tables. `hal` is what runs and commands machines, and is built
/// first; it replaces itself with the others.
enum class Part { core, tools, bus, panel };

/// The packages of the tree that have commands, by their names in cmake/packages.
namespace package {
inline constexpr char core[] = "";
inline constexpr char canopen[] = "canopen";
inline constexpr char ethercat[] = "ethercat";
inline constexpr char scocan[] = "scocan";
inline constexpr char tdma[] = "tdma";
inline constexpr char modbus[] = "modbus";
inline constexpr char mesa[] = "mesa";
inline constexpr char linuxcnc[] = "linuxcnc";
inline constexpr char panel[] = "panel";
}  // namespace package

/// Where a command is: in which program, in which package of the tree, and its function, where this
/// source is compiled for that program and the package is built; nullptr elsewhere.
template <Part part_, auto run_, const char* package_ = package::core>
struct In {
    static constexpr Part part = part_;
    static constexpr auto run = run_;
    static constexpr const char* package = package_;
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

// Commands of packages.
#if defined(HALCYON_BUS_PROGRAM) && HALCYON_PACKAGE_CANOPEN
#define OF_CANOPEN(run) In<Part::bus, run, package::canopen>
#else
#define OF_CANOPEN(run) In<Part::bus, nullptr, package::canopen>
#endif
#if defined(HALCYON_BUS_PROGRAM) && HALCYON_PACKAGE_ETHERCAT
#define OF_ETHERCAT(run) In<Part::bus, run, package::ethercat>
#else
#define OF_ETHERCAT(run) In<Part::bus, nullptr, package::ethercat>
#endif
#if defined(HALCYON_BUS_PROGRAM) && HALCYON_PACKAGE_SCOCAN
#define OF_SCOCAN(run) In<Part::bus, run, package::scocan>
#else
#define OF_SCOCAN(run) In<Part::bus, nullptr, package::scocan>
#endif
#if defined(HALCYON_BUS_PROGRAM) && HALCYON_PACKAGE_TDMA
#define OF_TDMA(run) In<Part::bus, run, package::tdma>
#else
#define OF_TDMA(run) In<Part::bus, nullptr, package::tdma>
#endif
#if defined(HALCYON_BUS_PROGRAM) && HALCYON_PACKAGE_MODBUS
#define OF_MODBUS(run) In<Part::bus, run, package::modbus>
#else
#define OF_MODBUS(run) In<Part::bus, nullptr, package::modbus>
#endif
#if defined(HALCYON_BUS_PROGRAM) && HALCYON_PACKAGE_MESA
#define OF_MESA(run) In<Part::bus, run, package::mesa>
#else
#define OF_MESA(run) In<Part::bus, nullptr, package::mesa>
#endif
#if defined(HALCYON_TOOLS_PROGRAM) && HALCYON_PACKAGE_LINUXCNC
#define OF_LINUXCNC(run) In<Part::tools, run, package::linuxcnc>
#else
#define OF_LINUXCNC(run) In<Part::tools, nullptr, package::linuxcnc>
#endif
#ifdef HALCYON_PANEL_PROGRAM
#define OF_PANEL(run) In<Part::panel, run, package::panel>
#else
#define OF_PANEL(run) In<Part::panel, nullptr, package::panel>
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
