// SPDX-License-Identifier: MIT
// The part of the model that belongs to programs: a component for each, its pins and their links.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "machine/processes/program_entry.hpp"
#include "netlist/netlist.hpp"

namespace hal {

class RunningModel;
class Transaction;
struct Instance;
struct SessionState;

/// The first word of what a journal of the execution notes of the members below; the others are
/// their arguments. No command begins like these.
namespace program_words {
inline constexpr std::string_view add = ":program";
inline constexpr std::string_view remove = ":remove-program";
inline constexpr std::string_view add_pin = ":program-pin";
inline constexpr std::string_view remove_pins = ":remove-program-pins";
}  // namespace program_words

/// All members need the session's lock. [setup]
class ProgramModel {
public:
    ProgramModel(RunningModel& machine, SessionState& state) : machine_(machine), state_(state) {}

    /// Adds a component for the process `pid` to the model.
    void add_component(Transaction& transaction, const std::string& name, std::int64_t pid,
                       const Command& command);
    /// Removes the component of a program.
    void remove_component(Transaction& transaction, std::string_view name);
    /// Adds a pin to a program's component. It is linked like any other, and no thread runs it.
    /// Returns nullptr and sets `problem` to the reason.
    Pin* add_pin(Transaction& transaction, std::string_view component, const ProgramPin& pin,
                 std::string& problem);
    /// Unlinks and removes pins of a program's component.
    void remove_pins(Transaction& transaction, std::string_view component,
                     const std::vector<Pin*>& pins);

    // Each of these is a transaction of its own.
    void add(const std::string& name, pid_t pid, const Command& command);
    /// Another process answers for the component.
    void replace_process(std::string_view name, pid_t pid);
    void remove(std::string_view name);
    /// Removes all pins of the component but these.
    void keep_pins(std::string_view name, const std::vector<Pin*>& kept);

    /// Returns the instance that has the pins of a program's component, or nullptr before its first
    /// pin.
    Instance* instance_of(std::string_view name) const;

private:
    RunningModel& machine_;
    SessionState& state_;
};

}  // namespace hal
