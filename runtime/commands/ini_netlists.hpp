// SPDX-License-Identifier: MIT
// Runs the netlists that [HAL] of an INI file names. Internal to the shell.
#pragma once

#include <string>
#include <vector>

#include "commands/shell_state.hpp"
#include "text/diagnostic.hpp"

namespace hal {

/// Prints diagnostics as the options of the shell ask for. The session's lock must be held.
void print_diagnostics(const Diagnostics& diagnostics, const Shell& shell, Output& output);
/// Prints an error without a place. Takes the session's lock. Returns 1, the exit status.
int report(const Shell& shell, Output& output, Code code, std::string sentence, std::string help);
/// Prints that a file cannot be read. Takes the session's lock. Returns 1, the exit status.
int report_unreadable(const Shell& shell, Output& output, const std::string& path,
                      const std::string& problem, Code code, std::string help);

/// One run of an INI file, which the session has read. Takes the session's lock itself.
class IniNetlists {
public:
    IniNetlists(Shell& shell, Shell::State& state, const std::string& path, Output& output);

    /// Runs HALFILE, with TWOPASS, then HALCMD. Under `hal check` also what the display would load.
    /// Returns the exit status.
    int run();
    /// Runs HALFILE, with TWOPASS. Returns the exit status.
    int run_halfiles();

private:
    /// One netlist that HALFILE or POSTGUI_HALFILE names.
    struct File {
        std::string name;  ///< as messages call it; of a script, its path
        std::string text;
        bool is_script = false;
        std::vector<std::string> arguments = {};  ///< of a script
    };

    int read(const char* key, std::vector<File>& files);
    int report_missing(const char* key, const std::string& file, const std::string& problem);
    int run(std::vector<File>& files);
    int run_one_by_one(std::vector<File>& files);
    int run_pass(std::vector<File>& files, Pass pass);
    int run_in_two_passes(std::vector<File>& files);
    bool is_over(int status) const;
    int check_version();
    int reject_without_netlist();

    Shell& shell_;
    Shell::State& state_;
    std::string path_;
    Output& output_;
    bool quit_ = false;  // a `quit` has ended the loading
};

}  // namespace hal
