// SPDX-License-Identifier: MIT
// The program `hal`; under the names of classic.cpp (halcmd, halrun, …) it behaves like LinuxCNC's
// programs.
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <sys/auxv.h>
#include <sys/prctl.h>
#include <unistd.h>

#include "classic.hpp"
#include "cli/other_program.hpp"
#include "cli/standard_streams.hpp"
#include "commands.hpp"
#include "execute/process_setup.hpp"

namespace {

/// Ends this program with the machine when loadusr has started it. The spawner requests this from
/// the kernel, which drops the request when it starts a program with file capabilities.
void end_with_machine() {
    const char* const machine = std::getenv("HALCYON_PARENT");
    const long pid = machine ? std::strtol(machine, nullptr, 10) : 0;
    if (pid <= 0 || ::getppid() != pid) return;
    ::prctl(PR_SET_PDEATHSIG, static_cast<unsigned long>(SIGTERM));
    if (::getppid() != pid) {
        std::raise(SIGTERM);  // it ended meanwhile
    }
}

int run(const hal::tools::Classic* classic, int argc, char** argv) {
    if (!classic) return hal::tools::run_command_line(argc, argv);
    if (!classic->run) {
        return hal::tools::become_program(hal::tools::program_of(classic->part), argv);
    }
    return classic->run(argc, argv);
}

}  // namespace

int main(int argc, char** argv) {
    hal::tools::open_standard_streams();
    // a reader that leaves is an error of that write, not the end of a machine
    std::signal(SIGPIPE, SIG_IGN);
    // With file capabilities the kernel leaves no core dump and gives /proc/PID to root. Every user
    // who can start this program can load code into it, so it holds no secrets; still, only a
    // process with the same capabilities can trace it.
    if (::getauxval(AT_SECURE) != 0) {
        ::prctl(PR_SET_DUMPABLE, 1UL);
    }
    hal::limit_helper_stacks();
    end_with_machine();
    std::string_view program = argc > 0 ? argv[0] : "hal";
    program.remove_prefix(program.find_last_of('/') + 1);
    const hal::tools::Classic* const classic = hal::tools::find_classic(program);
    const int status = run(classic, argc, argv);
    return status == 0 && (std::ferror(stdout) != 0 || hal::tools::print_failed()) ? 1 : status;
}
