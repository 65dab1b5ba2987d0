// SPDX-License-Identifier: MIT
// The program `hal`; under the names halcmd, halrun, halsampler and halstreamer it behaves as LinuxCNC hands expect.
#include <csignal>
#include <string_view>

#include "classic.hpp"
#include "commands.hpp"

int main(int argc, char** argv) {
    std::signal(SIGPIPE, SIG_IGN);  // a reader that leaves is an error of that write, not the end of a machine
    std::string_view program = argc > 0 ? argv[0] : "hal";
    program.remove_prefix(program.find_last_of('/') + 1);
    if (const hal::tools::Classic* classic = hal::tools::find_classic(program)) return classic->run(argc, argv);
    return hal::tools::run_command_line(argc, argv);
}
