// SPDX-License-Identifier: MIT
// `hal check --linuxcnc`: what runs here and is an error for halcmd of LinuxCNC 2.9.
#pragma once

#include <set>
#include <string>

#include "commands/linuxcnc_arguments.hpp"
#include "model/model.hpp"
#include "netlist/netlist.hpp"
#include "text/diagnostic.hpp"

namespace hal {

class LinuxcncCheck {
public:
    /// Reports what halcmd rejects of a command, before the command is executed.
    void command(const Command& command, const Model& model, Diagnostics& diagnostics);
    /// Reports what LinuxCNC could not create of the model, each thing once.
    void model(const Model& model, Diagnostics& diagnostics);

private:
    bool loads_again(const Command& command, const Model& model, Diagnostics& diagnostics) const;
    void name(const std::string& name, const char* kind, Span at, Diagnostics& diagnostics);

    std::set<std::string, std::less<>> reported_;
    LinuxcncFloatingPoint floating_point_;
};

}  // namespace hal
