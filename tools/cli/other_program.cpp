// SPDX-License-Identifier: MIT
#include "cli/other_program.hpp"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/core.h>
#include <spawn.h>
#include <string_view>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

#include "cli/capabilities.hpp"
#include "cli/output.hpp"
#include "machine/load/source_tree.hpp"

namespace hal::tools {
namespace {

std::string path_of(std::string_view name) {
    return std::filesystem::read_symlink("/proc/self/exe").replace_filename(name).string();
}

/// The name that ./hal build knows: "tools" for hal-tools.
std::string build_name(std::string_view name) {
    return std::string(name.substr(name.find('-') + 1));
}

int report_missing(std::string_view name, int error) {
    const std::string problem =
        fmt::format("cannot start {}: {}; ", path_of(name), std::strerror(error));
    if (name == "hal-panel") {
        return fail(
            Options{},
            problem +
                "with Halcyon's Debian packages, type: sudo apt install halcyon-panel; in the "
                "source "
                "tree: sudo apt install libwebsockets-dev libpugixml-dev && ./hal build panel");
    }
    return fail(Options{},
                problem + fmt::format("it must be in the folder of hal: type ./hal build {} in the "
                                      "source tree, or reinstall Halcyon",
                                      build_name(name)));
}

/// Ignores SIGINT while it exists: Ctrl-C is for the other program.
class IgnoredInterrupt {
public:
    IgnoredInterrupt() {
        struct sigaction ignore{};
        ignore.sa_handler = SIG_IGN;
        ::sigaction(SIGINT, &ignore, &before_);
    }
    ~IgnoredInterrupt() { ::sigaction(SIGINT, &before_, nullptr); }
    IgnoredInterrupt(const IgnoredInterrupt&) = delete;
    IgnoredInterrupt& operator=(const IgnoredInterrupt&) = delete;

private:
    struct sigaction before_{};
};

/// Starts a program with no signal blocked and SIGINT as usual. Returns 0 or an errno.
int spawn_with_default_signals(pid_t& child, const std::string& program, char** argv) {
    posix_spawnattr_t attributes;
    if (const int error = ::posix_spawnattr_init(&attributes); error != 0) return error;
    sigset_t blocked;
    sigset_t defaults;
    ::sigemptyset(&blocked);
    ::sigemptyset(&defaults);
    ::sigaddset(&defaults, SIGINT);
    ::posix_spawnattr_setsigmask(&attributes, &blocked);
    ::posix_spawnattr_setsigdefault(&attributes, &defaults);
    ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    const int error = ::posix_spawn(&child, program.c_str(), nullptr, &attributes, argv, environ);
    ::posix_spawnattr_destroy(&attributes);
    return error;
}

/// What the copy of this process does to become a companion. `failure`: the end of a pipe that gets
/// errno when it cannot, and is closed otherwise. Other threads may have held locks when this process
/// was copied, so nothing here allocates or prints.
[[noreturn]] void become_companion(const char* program, char** argv, pid_t parent, int failure) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(1);  // it has ended before that
    sigset_t blocked;
    ::sigemptyset(&blocked);
    ::sigprocmask(SIG_SETMASK, &blocked, nullptr);
    std::signal(SIGINT, SIG_DFL);
    ::execv(program, argv);
    const int error = errno;
    const ssize_t written = ::write(failure, &error, sizeof error);
    ::_exit(written < 0 ? 2 : 1);
}

/// Starts a program as spawn_with_default_signals() does; it gets SIGTERM when this one has ended, also
/// when it was killed. Returns 0, or errno.
int spawn_companion(pid_t& child, const std::string& program, char** argv) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return errno;
    const pid_t parent = ::getpid();
    child = ::fork();
    const int fork_error = errno;
    if (child == 0) become_companion(program.c_str(), argv, parent, ends[1]);
    ::close(ends[1]);
    int error = child < 0 ? fork_error : 0;
    if (child > 0 && ::read(ends[0], &error, sizeof error) == sizeof error) {
        ::waitpid(child, nullptr, 0);
    }
    ::close(ends[0]);
    return error;
}

}  // namespace

int become_program(const char* name, char** argv) {
    if (std::string_view(name) != "hal-panel") {
        pass_on_capabilities();
    }
    const std::string program = path_of(name);
    ::execv(program.c_str(), argv);
    if (errno == ENOENT && build_on_demand(build_name(name))) {
        ::execv(program.c_str(), argv);
    }
    return report_missing(name, errno);
}

pid_t start_program(const char* name, std::vector<std::string> arguments, Lifetime lifetime) {
    const std::string program = path_of(name);
    if (::access(program.c_str(), X_OK) != 0) {
        build_on_demand(build_name(name));
    }
    arguments.insert(arguments.begin(), "hal");
    std::vector<char*> argv;
    for (std::string& argument : arguments) {
        argv.push_back(argument.data());
    }
    argv.push_back(nullptr);
    pid_t child = 0;
    const int error = lifetime == Lifetime::of_this
                          ? spawn_companion(child, program, argv.data())
                          : spawn_with_default_signals(child, program, argv.data());
    if (error == 0) return child;
    report_missing(name, error);
    return -1;
}

int run_tool(std::vector<std::string> arguments) {
    constexpr const char* name = "hal-tools";
    const IgnoredInterrupt meanwhile;
    const pid_t child = start_program(name, std::move(arguments), Lifetime::own);
    if (child < 0) return 1;
    int status = 0;
    while (::waitpid(child, &status, 0) < 0) {
        if (errno != EINTR) return report_missing(name, errno);
    }
    if (WIFSIGNALED(status)) return 128 + WTERMSIG(status);
    return WEXITSTATUS(status);
}

}  // namespace hal::tools
