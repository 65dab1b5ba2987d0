// SPDX-License-Identifier: MIT
// The program `hal`; under the names of classic.cpp (halcmd, halrun, …) it behaves like LinuxCNC's
// programs.
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <sys/auxv.h>
#include <sys/prctl.h>
#include <system_error>
#include <unistd.h>

#include "classic.hpp"
#include "cli/other_program.hpp"
#include "cli/output.hpp"
#include "cli/standard_streams.hpp"
#include "command_line.hpp"
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

/// As run(); what no command expects, such as a limit of threads or descriptors, is an error too.
int run_and_report(const hal::tools::Classic* classic, int argc, char** argv) {
    std::string reason;
    try {
        return run(classic, argc, argv);
    } catch (const std::bad_alloc&) {
        reason = "there is no memory left";
    } catch (const std::system_error& error) {
        reason = error.what();
        if (error.code() == std::errc::resource_unavailable_try_again) {
            reason = "cannot create a thread: " + error.code().message() +
                     "; see the limit of processes: ulimit -u";
        } else if (error.code() == std::errc::too_many_files_open) {
            reason += "; see the limit of open files: ulimit -n";
        }
    } catch (const std::exception& error) {
        reason = error.what();
    }
    const std::string line = "hal: " + reason + "\n";
    hal::tools::write_all(STDERR_FILENO, line);
    return 1;
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
    const int status = run_and_report(classic, argc, argv);
    return status == 0 && (std::ferror(stdout) != 0 || hal::tools::print_failed()) ? 1 : status;
}
