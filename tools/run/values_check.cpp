// SPDX-License-Identifier: MIT
#include "run/values_check.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "machine/session.hpp"
#include "run/chosen_values.hpp"
#include "run/hosted_machine.hpp"
#include "run/offline.hpp"

namespace hal::tools {

namespace {

/// Prints nothing: the run that follows does.
class Silent final : public Output {
public:
    void out(std::string_view) override {}
    void err(std::string_view) override {}
};

std::string problem_in(Session& session, const std::vector<std::string>& values,
                       const BufferOf& buffer_ns) {
    const Model& model = session.model();
    const std::vector<std::string> patterns = names_in(values);
    if (session.absences().has_programs()) return "";
    if (std::string unknown = unknown_value(model, patterns); !unknown.empty()) return unknown;
    std::int64_t shortest_ns = 0;
    for (const auto& thread : model.threads) {
        const std::int64_t period_ns = thread->options.period_ns;
        shortest_ns = shortest_ns == 0 ? period_ns : std::min(shortest_ns, period_ns);
    }
    std::string problem;
    session.probes().attach(
        {.names = chosen_values(model, patterns), .buffer_ns = buffer_ns(shortest_ns)}, problem);
    return problem;
}

std::string load_and_check(const NetlistOptions& options, const std::vector<std::string>& values,
                           const BufferOf& buffer_ns) {
    export_variables(options, own_name(options));
    Session session(offline());
    ShellOptions how = shell_options(options);
    how.check = true;
    Shell shell(session, how);
    Silent output;
    if (load_offline(shell, options, output) != 0) return "";
    const auto lock = session.lock();
    return problem_in(session, values, buffer_ns);
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

bool is_script(const std::string& path) { return path.ends_with(".tcl"); }

}  // namespace

std::string problem_of_values(const NetlistOptions& options, const std::vector<std::string>& values,
                              const BufferOf& buffer_ns) {
    if (std::ranges::any_of(options.words, is_script) || !options.part.empty()) return "";
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return "";
    const pid_t child = ::fork();
    if (child == 0) {
        const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
        ::dup2(nothing, STDOUT_FILENO);
        ::dup2(nothing, STDERR_FILENO);
        write_all(ends[1], load_and_check(options, values, buffer_ns));
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
