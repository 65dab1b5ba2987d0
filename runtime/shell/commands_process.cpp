// SPDX-License-Identifier: MIT
// loadusr, waitusr, unloadusr: programs outside the runtime.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <poll.h>
#include <unistd.h>

#include <fcntl.h>

#include "shell/commands.hpp"
#include "shell/processes.hpp"

namespace hal {
namespace {

using namespace std::chrono_literals;

struct Plan {
    bool wait_ready = false, wait_end = false, ignore_status = false;
    bool any_name = true;  ///< no -Wn: whatever the program calls its component
    RestartPolicy restart;
    std::string name;  ///< as component
    std::size_t program = 0;
};

constexpr const char* usage =
    "usage: loadusr [-W] [-Wn NAME] [-w] [-i] [--restart=no|on-failure|always] [--restart-delay=TIME] PROGRAM [ARGUMENT]...";

/// True for an option about restarts, which it has then taken or reported.
bool restart_option(Context& context, Plan& plan, std::size_t i, const std::string& option) {
    const auto equals = option.find('=');
    const std::string key = option.substr(0, equals), value = equals == option.npos ? "" : option.substr(equals + 1);
    if (key == "--restart") {
        static constexpr std::pair<const char*, Restart> words[] = {
            {"no", Restart::no}, {"on-failure", Restart::on_failure}, {"always", Restart::always}};
        const auto word = std::find_if(std::begin(words), std::end(words), [&](const auto& w) { return value == w.first; });
        if (word != std::end(words)) plan.restart.when = word->second;
        else context.diagnostics.error("unknown-option", context.span(i), "--restart is no, on-failure or always", "", usage);
        return true;
    }
    if (key != "--restart-delay") return false;
    if (const auto delay = parse_duration_ns(value, false); delay && *delay >= 10'000'000 && *delay <= 3'600'000'000'000)
        plan.restart.delay_ns = *delay;
    else context.diagnostics.error("unknown-option", context.span(i), "--restart-delay is a time from 10ms to 1h", "", usage);
    return true;
}

/// The options before the program. False after reporting.
bool read_options(Context& context, Plan& plan) {
    std::size_t i = 0;
    for (; i < context.count() && context.argument(i).starts_with('-'); ++i) {
        const std::string& option = context.argument(i);
        if (option == "-W") plan.wait_ready = true;
        else if (option == "-w") plan.wait_end = true;
        else if (option == "-i") plan.ignore_status = true;
        else if (option == "-iw" || option == "-wi") plan.wait_end = plan.ignore_status = true;
        else if (restart_option(context, plan, i, option)) {
            if (context.diagnostics.failed()) return false;
        } else if (option == "-Wn" && i + 1 < context.count()) {
            plan.wait_ready = true;
            plan.any_name = false;
            plan.name = context.argument(++i);
        } else {
            context.diagnostics.error("unknown-option", context.span(i),
                                      "loadusr has no option '" + option + "'" + (option == "-Wn" ? " without a name" : ""), "", usage);
            return false;
        }
    }
    plan.program = i;
    if (plan.wait_end && plan.restart.when != Restart::no) {
        context.diagnostics.error("unknown-option", context.span(0), "-w waits for a program's end, --restart does not let it end", "",
                                  usage);
        return false;
    }
    if (i == context.count()) {
        context.diagnostics.error("wrong-arguments", context.command.name.span, "'loadusr' needs a program to start",
                                  "something is missing", usage);
        return false;
    }
    if (plan.name.empty()) {
        const std::string& program = context.argument(i);
        plan.name = program.substr(program.rfind('/') + 1);
        if (plan.name.ends_with(".py")) plan.name.resize(plan.name.size() - 3);
    }
    return true;
}

/// Two pipes through which a child's stdout and stderr reach an Output that is not this process's own.
class Pipes {
public:
    Pipes() {
        for (auto& pipe : pipes_)
            if (pipe2(pipe.data(), O_CLOEXEC) == 0) fcntl(pipe[0], F_SETFL, O_NONBLOCK);
    }
    ~Pipes() {
        close_writers();
        for (auto& pipe : pipes_) close_one(pipe[0]);
    }
    Pipes(const Pipes&) = delete;
    int out() const { return pipes_[0][1]; }
    int err() const { return pipes_[1][1]; }
    void close_writers() {
        for (auto& pipe : pipes_) close_one(pipe[1]);
    }
    /// Hands on what has come, waiting at most so long for something. False when both ends are closed.
    bool pass_on(Output& output, int timeout_ms) {
        std::array<pollfd, 2> ready{pollfd{pipes_[0][0], POLLIN, 0}, pollfd{pipes_[1][0], POLLIN, 0}};
        poll(ready.data(), ready.size(), timeout_ms);
        for (std::size_t i = 0; i < 2; ++i) {
            if (pipes_[i][0] < 0) continue;
            std::array<char, 4096> text;
            ssize_t got;
            while ((got = read(pipes_[i][0], text.data(), text.size())) > 0) {
                const std::string_view part(text.data(), static_cast<std::size_t>(got));
                if (total_ > most) continue;  // read and thrown away, so that the program is not held up
                total_ += part.size();
                if (i == 0) output.out(part);
                else output.err(part);
                if (total_ > most) output.err("\n(output cut here: more than 1 MiB)\n");
            }
            if (got == 0) close_one(pipes_[i][0]);
        }
        return pipes_[0][0] >= 0 || pipes_[1][0] >= 0;
    }

private:
    static constexpr std::size_t most = std::size_t{1} << 20;
    static void close_one(int& file) {
        if (file >= 0) close(file);
        file = -1;
    }
    std::array<std::array<int, 2>, 2> pipes_{{{-1, -1}, {-1, -1}}};
    std::size_t total_ = 0;
};

void wait_until_ready(Context& context, const Plan& plan, pid_t pid) {
    while (true) {
        const auto* const entry = context.processes.find(plan.name);
        if (entry && entry->ready) return;
        const auto* const started = context.processes.find(pid);
        if (plan.any_name && started && started->ready) return;
        if (!started && !(entry && entry->dead() && (entry->restart_ns != 0 || !entry->ended))) {
            context.diagnostics.error("program-ended", context.span(plan.program),
                                      "'" + context.argument(plan.program) + "' ended before a component '" + plan.name + "' was ready", "",
                                      "a program says that it is ready over the control socket; without -W nobody waits for it");
            return;
        }
        if (context.interrupted()) return;
        context.processes.wait(context.lock, 100ms);
    }
}

void wait_until_ended(Context& context, const Plan& plan, pid_t pid, Pipes* pipes) {
    while (true) {
        const auto* const entry = context.processes.find(pid);
        if (entry->ended) break;
        if (context.interrupted()) {
            context.processes.terminate(*context.processes.find(pid));
            return context.processes.abandon(pid);
        }
        if (pipes) {
            context.lock.unlock();
            const bool open = pipes->pass_on(context.output, 20);
            context.lock.lock();
            if (open) continue;
        }
        context.processes.wait(context.lock, 100ms);
    }
    const int status = context.processes.find(pid)->status;
    context.processes.collect(pid);
    if (pipes) pipes->pass_on(context.output, 0);
    if (status == 0 || plan.ignore_status) return;
    const std::string how =
        status > 128 ? "was ended by signal " + std::to_string(status - 128) : "failed with exit status " + std::to_string(status);
    context.diagnostics.error("program-failed", context.span(plan.program), "'" + context.argument(plan.program) + "' " + how, "",
                              "-i before the program's name ignores the status");
}

}  // namespace

void command_loadusr(Context& context) {
    Plan plan;
    if (!read_options(context, plan)) return;

    ProcessStart start;
    start.directory = context.options().directory;
    for (std::size_t i = plan.program; i < context.count(); ++i) start.arguments.push_back(context.argument(i));
    if (start.arguments[0].starts_with('~')) start.arguments[0] = context.path(start.arguments[0]);
    std::optional<Pipes> pipes;
    if (plan.wait_end && context.output.is_process()) {
        start.keep_stdin = isatty(0);
    } else if (plan.wait_end) {
        pipes.emplace();
        start.out = pipes->out();
        start.err = pipes->err();
    }

    std::string problem;
    const pid_t pid = context.processes.start(start, plan.wait_end, problem);
    if (pid == 0) {
        context.diagnostics.error("no-program", context.span(plan.program), "'" + start.arguments[0] + "' cannot be started: " + problem);
        return;
    }
    if (pipes) pipes->close_writers();
    if (plan.wait_end) return wait_until_ended(context, plan, pid, pipes ? &*pipes : nullptr);
    // A program that will say its name itself is entered under its process's name until then.
    context.processes.add(pid, plan.name, context.command);
    context.processes.keep_alive(pid, start, plan.restart);
    if (plan.wait_ready) wait_until_ready(context, plan, pid);
}

void command_waitusr(Context& context) {
    const std::string& name = context.argument(0);
    if (!context.processes.find(name)) {
        const bool component = context.session.model().find_component(name) != nullptr;
        if (component)
            context.diagnostics.error("not-a-program", context.span(0), "'" + name + "' is a component in this process, not a program", "",
                                      "waitusr waits for programs started by loadusr");
        return;  // gone already: that is what was waited for
    }
    const auto lives = [&] {
        const auto* const entry = context.processes.find(name);
        return entry && (!entry->dead() || entry->restart_ns != 0 || (entry->child && !entry->ended));
    };
    while (lives() && !context.interrupted()) context.processes.wait(context.lock, 100ms);
}

namespace {

void no_program(Context& context, const std::string& name) {
    const auto names = context.processes.names();
    context.diagnostics.error("not-a-program", context.span(0), "there is no program '" + name + "'", did_you_mean(name, names),
                              names.empty() ? "no program runs" : "programs: " + listed(names));
}

}  // namespace

void command_unloadusr(Context& context) {
    const std::string& name = context.argument(0);
    if (name == "all") {
        for (const auto& each : context.processes.names()) context.processes.terminate(*context.processes.find(each));
    } else if (auto* const entry = context.processes.find(name)) {
        context.processes.terminate(*entry);
    } else {
        no_program(context, name);
    }
}

bool unload_processes(Context& context) {
    if (context.count() != 1) return false;
    if (context.argument(0) != "all" && !context.processes.find(context.argument(0))) return false;
    command_unloadusr(context);
    return context.argument(0) != "all";
}

}  // namespace hal
