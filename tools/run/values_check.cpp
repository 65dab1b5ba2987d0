// SPDX-License-Identifier: MIT
#include "run/values_check.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <poll.h>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include "cli/no_output.hpp"
#include "cli/output.hpp"
#include "machine/load/source_tree.hpp"
#include "machine/session.hpp"
#include "run/chosen_values.hpp"
#include "run/hosted_machine.hpp"
#include "run/offline.hpp"

namespace hal::tools {

namespace {

std::string problem_in(Session& session, const std::vector<std::string>& values) {
    const Model& model = session.model();
    const std::vector<std::string> patterns = names_in(values);
    if (session.absences().has_programs()) return "";
    if (std::string unknown = unknown_value(model, patterns); !unknown.empty()) return unknown;
    std::vector<std::string> names = chosen_values(model, patterns);
    if (names.empty()) return "";  // the run reports that there are none
    std::string problem;
    session.probes().attach({.names = std::move(names), .advice = fewer_values}, problem);
    return problem;
}

std::string load_and_check(const NetlistOptions& options, const std::vector<std::string>& values) {
    export_variables(options, own_name(options));
    Session session(offline());
    ShellOptions how = shell_options(options);
    how.check = true;
    Shell shell(session, how);
    NoOutput output;  // the run that follows prints
    if (load_offline(shell, options, output) != 0) return "";
    const auto lock = session.lock();
    return problem_in(session, values);
}

/// Returns what the other process writes up to its end, and ends it after 10 s.
std::string answer_of(pid_t child, int end) {
    using Clock = std::chrono::steady_clock;
    const auto deadline = Clock::now() + std::chrono::seconds(10);
    std::string text;
    char part[512];
    while (true) {
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
        pollfd one{end, POLLIN, 0};
        const int ready = ::poll(&one, 1, static_cast<int>(std::max<long>(left.count(), 0)));
        if (ready < 0 && errno == EINTR) continue;
        const ssize_t size = ready > 0 ? ::read(end, part, sizeof part) : 0;
        if (size <= 0) break;
        text.append(part, static_cast<std::size_t>(size));
    }
    ::close(end);
    ::kill(child, SIGKILL);
    while (::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
    }
    return text;
}

/// A pipe can be read once only, and a script does more than to load.
bool can_be_read_twice(const std::string& path) {
    std::error_code error;
    return !path.ends_with(".tcl") && std::filesystem::is_regular_file(path, error);
}

bool can_be_loaded_twice(const NetlistOptions& options) {
    return options.part.empty() && (options.ini.empty() || can_be_read_twice(options.ini)) &&
           std::ranges::all_of(options.words, can_be_read_twice);
}

}  // namespace

std::string problem_of_values(const NetlistOptions& options,
                              const std::vector<std::string>& values) {
    if (!can_be_loaded_twice(options)) return "";
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return "";
    const pid_t child = ::fork();
    if (child == 0) {
        const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
        ::dup2(nothing, STDOUT_FILENO);
        ::dup2(nothing, STDERR_FILENO);
        forbid_builds();  // the run builds
        write_all(ends[1], load_and_check(options, values));
        ::_exit(0);
    }
    ::close(ends[1]);
    if (child < 0) {
        ::close(ends[0]);
        return "";
    }
    return answer_of(child, ends[0]);
}

}  // namespace hal::tools
