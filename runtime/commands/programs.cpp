// SPDX-License-Identifier: MIT
// loadusr, waitusr, unloadusr: programs outside the runtime.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <poll.h>
#include <unistd.h>

#include <fcntl.h>

#include "base/poll_all.hpp"
#include "commands/table.hpp"
#include "machine/processes/programs.hpp"
#include "text/find_row.hpp"

namespace hal {
namespace {

using namespace std::chrono_literals;

struct Plan {
    bool wait_ready = false;
    bool wait_end = false;
    bool ignore_status = false;
    bool any_name = true;  ///< no -Wn: whatever the program calls its component
    RestartPolicy restart;
    std::string name;  ///< as component
    std::size_t name_at = 0;
    std::size_t program = 0;
    std::int64_t timeout_ns = 0;  ///< of waiting; 0: none
};

/// Returns the duration if it is in the range; else nothing.
std::optional<std::int64_t> duration_in(std::string_view text, std::int64_t min_ns,
                                        std::int64_t max_ns) {
    const auto time = parse_duration_ns(text);
    return time && *time >= min_ns && *time <= max_ns ? time : std::nullopt;
}

/// The time behind `-t` at argument i, or 0 after reporting.
std::int64_t timeout_option(Context& context, std::size_t i) {
    const std::string text = i < context.count() ? context.argument(i) : "";
    const auto time = duration_in(text, 1'000'000, 86'400'000'000'000);
    if (!time) {
        context.diagnostics.error("unknown-option", context.span(i),
                                  "-t requires a duration of 1ms..24h, such as -t 10s");
    }
    return time.value_or(0);
}

/// Reports an invalid option of loadusr; false.
bool reject(Context& context, std::size_t at, std::string message) {
    context.diagnostics.error("unknown-option", context.span(at), std::move(message), "",
                              context.usage());
    return false;
}

/// Reads `--restart=` and `--restart-delay=`. False after reporting.
bool read_restart(Context& context, Plan& plan, std::size_t i) {
    static constexpr std::pair<std::string_view, Restart> policies[] = {
        {"no", Restart::no}, {"on-failure", Restart::on_failure}, {"always", Restart::always}};
    const std::string& option = context.argument(i);
    const std::string key = option.substr(0, option.find('='));
    const std::string value = option.substr(std::min(key.size() + 1, option.size()));
    if (key == "--restart-delay") {
        const auto delay = duration_in(value, 10'000'000, 3'600'000'000'000);
        plan.restart.delay_ns = delay.value_or(0);
        return delay || reject(context, i, "--restart-delay must be a duration of 10ms..1h");
    }
    for (const auto& [name, policy] : policies) {
        if (value != name) continue;
        plan.restart.when = policy;
        return true;
    }
    return reject(context, i, "--restart must be no, on-failure or always");
}

/// An option without an argument, and what it sets.
struct Flag {
    std::string_view option;
    bool wait_ready, wait_end, ignore_status;
};
constexpr Flag flags[] = {{"-W", true, false, false},
                          {"-w", false, true, false},
                          {"-i", false, false, true},
                          {"-iw", false, true, true},
                          {"-wi", false, true, true}};

/// Reads the option at argument i; moves i to its last word. False after reporting.
bool read_option(Context& context, Plan& plan, std::size_t& i) {
    const std::string& option = context.argument(i);
    if (const Flag* const flag = find_row(flags, option, &Flag::option)) {
        plan.wait_ready |= flag->wait_ready;
        plan.wait_end |= flag->wait_end;
        plan.ignore_status |= flag->ignore_status;
        return true;
    }
    const std::string key = option.substr(0, option.find('='));
    if (key == "--restart" || key == "--restart-delay") return read_restart(context, plan, i);
    if (option == "-t") {
        plan.timeout_ns = timeout_option(context, ++i);
        return plan.timeout_ns != 0;
    }
    if (option != "-Wn") return reject(context, i, "loadusr has no option '" + option + "'");
    if (i + 1 == context.count()) {
        return reject(context, i, "loadusr has no option '-Wn' without a name");
    }
    plan.wait_ready = true;
    plan.any_name = false;
    plan.name = context.argument(++i);
    plan.name_at = i;
    return true;
}

/// Reads the options before the program, and its name. False after reporting.
bool read_options(Context& context, Plan& plan) {
    std::size_t i = 0;
    for (; i < context.count() && context.argument(i).starts_with('-'); ++i) {
        if (!read_option(context, plan, i)) return false;
    }
    plan.program = i;
    if (plan.timeout_ns != 0 && !plan.wait_ready && !plan.wait_end) {
        return reject(context, 0, "-t requires -W, -Wn or -w, whose wait it limits");
    }
    if (plan.wait_end && plan.restart.when != Restart::no) {
        return reject(context, 0,
                      "-w and --restart exclude each other: -w waits for the program to end, "
                      "--restart starts it again");
    }
    if (i == context.count()) {
        context.diagnostics.error("wrong-arguments", context.command.name.span,
                                  "'loadusr' requires the name of a program", "missing program",
                                  context.usage());
        return false;
    }
    if (plan.name.empty()) {
        const std::string& program = context.argument(i);
        plan.name = program.substr(program.rfind('/') + 1);
        plan.name_at = i;
        if (plan.name.ends_with(".py")) {
            plan.name.resize(plan.name.size() - 3);
        }
    }
    return true;
}

/// Two pipes through which a child's stdout and stderr reach an Output that is not this process's
/// own.
class Pipes {
public:
    Pipes() {
        for (auto& pipe : pipes_) {
            if (pipe2(pipe.data(), O_CLOEXEC) == 0) {
                fcntl(pipe[0], F_SETFL, O_NONBLOCK);
            }
        }
    }
    ~Pipes() {
        close_writers();
        for (auto& pipe : pipes_) {
            close_one(pipe[0]);
        }
    }
    Pipes(const Pipes&) = delete;
    int out() const { return pipes_[0][1]; }
    int err() const { return pipes_[1][1]; }
    void close_writers() {
        for (auto& pipe : pipes_) {
            close_one(pipe[1]);
        }
    }
    /// Passes on what has arrived; waits at most `timeout_ms` for it. False when both ends are
    /// closed.
    bool pass_on(Output& output, int timeout_ms) {
        std::array<pollfd, 2> ready{pollfd{pipes_[0][0], POLLIN, 0},
                                    pollfd{pipes_[1][0], POLLIN, 0}};
        const timespec timeout{timeout_ms / 1000, timeout_ms % 1000 * 1'000'000L};
        poll_all(ready, &timeout);
        for (auto& pipe : pipes_) {
            if (pipe[0] < 0) continue;
            std::array<char, 4096> text;
            ssize_t got;
            while ((got = read(pipe[0], text.data(), text.size())) > 0) {
                write(output, &pipe == &pipes_[0], {text.data(), static_cast<std::size_t>(got)});
            }
            if (got == 0) {
                close_one(pipe[0]);
            }
        }
        return pipes_[0][0] >= 0 || pipes_[1][0] >= 0;
    }

private:
    static constexpr std::size_t max_bytes = std::size_t{1} << 20;

    /// Passes on a part of the output. The rest of a long one is read and discarded, so that the
    /// program does not block.
    void write(Output& output, bool to_stdout, std::string_view part) {
        if (total_ > max_bytes) return;
        total_ += part.size();
        if (to_stdout) {
            output.out(part);
        } else {
            output.err(part);
        }
        if (total_ > max_bytes) {
            output.err("\n(output truncated after 1 MiB)\n");
        }
    }
    static void close_one(int& file) {
        if (file >= 0) {
            close(file);
        }
        file = -1;
    }
    std::array<std::array<int, 2>, 2> pipes_{{{-1, -1}, {-1, -1}}};
    std::size_t total_ = 0;
};

/// How long a command has waited: when to report it, and when to give up.
class Timeout {
public:
    explicit Timeout(std::int64_t limit_ns) : limit_(limit_ns) {}
    std::int64_t limit_ns() const { return limit_.count(); }
    bool over() const { return limit_.count() != 0 && waited() >= limit_; }
    /// True after 1 s, 10 s, and then every minute.
    bool report_due() {
        if (waited() < report_) return false;
        if (report_ < 10s) {
            report_ = 10s;
        } else if (report_ < 60s) {
            report_ = 60s;
        } else {
            report_ = report_ + 60s;
        }
        return true;
    }
    std::string text() const {
        return std::to_string(std::chrono::duration_cast<std::chrono::seconds>(waited()).count()) +
               " s";
    }

private:
    std::chrono::nanoseconds waited() const { return std::chrono::steady_clock::now() - begin_; }
    std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
    std::chrono::nanoseconds limit_, report_ = 1s;
};

/// Returns how long a command waits for a program: as its `-t` states, else the limit of the
/// virtual clock.
std::int64_t limit_of(const Context& context, std::int64_t timeout_ns) {
    return timeout_ns != 0 ? timeout_ns : context.session.options().wait_limit_ns;
}

void report_wait(Context& context, Timeout& timeout, const auto& what) {
    if (!timeout.report_due() || context.options().level == Level::nothing) return;
    const std::string text =
        context.command.name.text + ": " + what() + " (" + timeout.text() + ")\n";
    context.lock.unlock();
    context.output.notice(text);
    context.lock.lock();
}

void timed_out(Context& context, std::int64_t limit_ns, const std::string& what, std::string help) {
    context.diagnostics.error("program-timeout", context.command.span,
                              what + " within " + format_duration(static_cast<double>(limit_ns)),
                              "", std::move(help));
}

void name_in_use(Context& context, const Plan& plan, const Programs::Entry* entry) {
    const std::string who = entry ? "process " + std::to_string(entry->pid) + ", " + entry->state()
                                  : "a component in the machine";
    context.diagnostics.error(
        "name-taken", context.span(plan.name_at),
        "the name '" + plan.name + "' is in use (" + who + ")", "in use",
        entry ? "end the program first: unload " + plan.name : "give the program another name");
}

bool is_name_of_component(Context& context, const std::string& name) {
    const Model& model = context.session.model();
    return model.find_component(name) || model.find_instance(name);
}

/// Waits until the name that the program is to have is free or a dead program's. False after
/// reporting.
bool wait_for_name(Context& context, const Plan& plan, Timeout& timeout) {
    while (true) {
        const auto* const entry = context.programs.find(plan.name);
        if (!entry && !is_name_of_component(context, plan.name)) return true;
        const bool leaves_name = entry && entry->dead() && !entry->comes_back();
        if (leaves_name && !entry->running()) return true;
        if (!leaves_name && !(entry && entry->stopping)) {
            name_in_use(context, plan, entry);
            return false;
        }
        if (timeout.over()) {
            timed_out(
                context, timeout.limit_ns(),
                "the previous '" + plan.name + "' (process " + std::to_string(entry->pid) +
                    ") did not end",
                "nothing was started; kill -9 " + std::to_string(entry->pid) + " ends it by force");
            return false;
        }
        report_wait(context, timeout, [&] {
            return "waiting for the previous '" + plan.name + "' to end: process " +
                   std::to_string(entry->pid) +
                   (entry->stopping ? " received SIGTERM but is still running"
                                    : " lost its connection but is still running");
        });
        if (context.interrupted()) return false;
        context.programs.wait(context.lock, 100ms);
    }
}

constexpr const char* initializing = "has registered it and is initializing";

constexpr char nothing_registered[] = "has not registered a component";

/// Why the awaited component is not ready yet: what the program has done so far.
std::string progress(Context& context, const Plan& plan, pid_t pid) {
    const auto* const entry = context.programs.find(plan.name);
    if (entry && entry->owner != 0 && !entry->dead()) return initializing;
    if (const std::string why = context.programs.refusal_of(pid); !why.empty()) {
        return "could not register: " + why;
    }
    const auto names = context.programs.registered_by(pid);
    if (names.empty()) return nothing_registered;
    return "has registered " + (names.size() == 1 ? "'" + names[0] + "'" : listed(names)) +
           " instead";
}

/// "was terminated by signal 9" or "VERB exit status 1".
std::string end_text(int status, const std::string& verb) {
    return status > 128 ? "was terminated by signal " + std::to_string(status - 128)
                        : verb + " exit status " + std::to_string(status);
}

/// What to do about a program that has ended and had not tried to register. `status`: none when it
/// is unknown.
std::string advice_for_silent(std::optional<int> status) {
    if (status == 0) return "a program registers over the control socket; omit -W if it does not";
    return (status ? "it " + end_text(*status, "ended with") + "; see" : "see") +
           " its messages, which are in the output of the machine";
}

/// Reports that the program has ended before its component was ready. `last`: what it had done.
void report_ended_early(Context& context, const Plan& plan, pid_t pid, bool registered,
                        const std::string& last) {
    std::string why = "it " + last;
    if (registered) {
        why = "it registered the component and ended while it was initializing";
    } else if (last == nothing_registered) {
        why = advice_for_silent(context.programs.ended_with(pid));
    }
    context.diagnostics.error("program-ended", context.span(plan.program),
                              "'" + context.argument(plan.program) +
                                  "' ended before a component '" + plan.name + "' was ready",
                              "", why);
}

/// Returns true for a component that returns: its program is restarted, or has not ended yet.
bool may_return(const Programs::Entry& entry) {
    return entry.dead() && (entry.restarts.due_ns != 0 || !entry.ended());
}

/// `fresh`: no dead program had the name before.
void wait_until_ready(Context& context, const Plan& plan, pid_t pid, std::uint64_t number,
                      bool fresh, Timeout& timeout) {
    const std::string& program = context.argument(plan.program);
    std::string last = nothing_registered;
    while (true) {
        const auto* const child = context.programs.find(pid);
        if (child || !context.programs.refusal_of(pid).empty()) {
            last = progress(context, plan, pid);
        }
        auto* const entry = context.programs.find_number(number);
        if (entry && entry->ready()) return;
        const auto* const named = plan.any_name ? nullptr : context.programs.find(plan.name);
        if (named && named->ready()) return;
        if (!child && !(entry && may_return(*entry))) {
            const bool is_lost = fresh && entry && entry->dead();
            report_ended_early(context, plan, pid, last == initializing || is_lost, last);
            if (is_lost) {
                context.programs.give_up(*entry);
            }
            return;
        }
        if (timeout.over()) {
            if (entry) {
                context.programs.give_up(*entry);
            }
            return timed_out(context, timeout.limit_ns(),
                             "component '" + plan.name + "' was not ready",
                             "'" + program + "' " + last + "; it was terminated");
        }
        report_wait(context, timeout, [&] {
            return "waiting for component '" + plan.name + "': '" + program + "' (process " +
                   std::to_string(pid) + ") " + last;
        });
        if (context.interrupted()) return;
        context.programs.wait(context.lock, 100ms);
    }
}

/// Reports, under the virtual clock, that a command waits for a program, and for what time stands.
void report_virtual_wait(Context& context, Timeout& timeout, const std::string& program,
                         pid_t pid) {
    if (!context.session.options().virtual_clock) return;
    report_wait(context, timeout, [&] {
        return "waiting for '" + program + "' (process " + std::to_string(pid) +
               ") to end; time passes only while it reads a sampler or feeds a streamer";
    });
}

void wait_until_ended(Context& context, const Plan& plan, pid_t pid, Pipes* pipes,
                      Timeout& timeout) {
    const Programs::Awaited awaited(context.programs, pid);
    while (true) {
        const auto* const entry = context.programs.find(pid);
        if (entry->ended()) break;
        report_virtual_wait(context, timeout, context.argument(plan.program), pid);
        if (timeout.over()) {
            timed_out(context, timeout.limit_ns(),
                      "'" + context.argument(plan.program) + "' did not end",
                      "the program was terminated");
            context.programs.give_up(*context.programs.find(pid));
            return context.programs.abandon(pid);
        }
        if (context.interrupted()) {
            context.programs.terminate(*context.programs.find(pid));
            return context.programs.abandon(pid);
        }
        if (pipes) {
            context.lock.unlock();
            const bool open = pipes->pass_on(context.output, 20);
            context.lock.lock();
            if (open) continue;
        }
        context.programs.wait(context.lock, 100ms);
    }
    const int status = context.programs.find(pid)->status;
    context.programs.collect(pid);
    if (pipes) {
        pipes->pass_on(context.output, 0);
    }
    if (status == 0 || plan.ignore_status) return;
    const std::string how = end_text(status, "failed with");
    context.diagnostics.error("program-failed", context.span(plan.program),
                              "'" + context.argument(plan.program) + "' " + how, "",
                              "-i before the name of the program ignores the status");
}

}  // namespace

void command_loadusr(Context& context) {
    Plan plan;
    if (!read_options(context, plan)) return;
    if (context.checking()) {
        if (!plan.any_name && !plan.wait_end && is_name_of_component(context, plan.name)) {
            name_in_use(context, plan, nullptr);
        }
        return;
    }

    ProcessStart start;
    start.directory = context.options().directory;
    for (std::size_t i = plan.program; i < context.count(); ++i) {
        start.arguments.push_back(context.argument(i));
    }
    if (start.arguments[0].starts_with('~')) {
        start.arguments[0] = context.path(start.arguments[0]);
    }
    std::optional<Pipes> pipes;
    if (plan.wait_end && context.output.is_process()) {
        start.keep_stdin = isatty(0);
    } else if (plan.wait_end) {
        pipes.emplace();
        start.out = pipes->out();
        start.err = pipes->err();
    }

    Timeout timeout(limit_of(context, plan.timeout_ns));
    if (!plan.any_name && !plan.wait_end && !wait_for_name(context, plan, timeout)) return;
    const bool fresh = !plan.any_name && !context.programs.find(plan.name);
    std::string problem;
    const pid_t pid = context.programs.start(start, plan.wait_end, problem);
    if (pid == 0) {
        context.diagnostics.error("no-program", context.span(plan.program),
                                  "'" + start.arguments[0] + "' cannot be started: " + problem);
        return;
    }
    if (pipes) {
        pipes->close_writers();
    }
    if (plan.wait_end) {
        return wait_until_ended(context, plan, pid, pipes ? &*pipes : nullptr, timeout);
    }
    // A program that registers its own name later is listed under the name of its process until
    // then.
    const std::uint64_t number =
        context.programs.add(pid, plan.name, context.command, !plan.any_name);
    context.programs.keep_alive(pid, start, plan.restart);
    if (plan.wait_ready) {
        wait_until_ready(context, plan, pid, number, fresh, timeout);
    }
}

namespace {

/// Reports a name of which no program runs, unless one has ended.
void nothing_to_wait_for(Context& context, std::size_t at) {
    const std::string& name = context.argument(at);
    if (context.session.model().find_component(name) != nullptr) {
        context.diagnostics.error("not-a-program", context.span(at),
                                  "'" + name + "' is a component in this process, not a program",
                                  "", "waitusr waits for programs started by loadusr");
    } else if (!context.checking() && !context.programs.was_known(name)) {
        const auto names = context.programs.names();
        context.diagnostics.warning(
            "not-a-program", context.span(at),
            "no program '" + name + "' was started or has registered: waitusr does not wait",
            did_you_mean(name, names),
            names.empty() ? "no program is running" : "programs: " + listed(names));
    }
}

}  // namespace

void command_waitusr(Context& context) {
    const bool limited = context.argument(0) == "-t";
    const std::int64_t limit_ns = limited ? timeout_option(context, 1) : 0;
    if (limited && limit_ns == 0) return;
    if (context.count() != (limited ? 3U : 1U)) {
        context.diagnostics.error("wrong-arguments", context.command.span,
                                  "'waitusr' requires one program", "", context.usage());
        return;
    }
    const std::size_t at = limited ? 2 : 0;
    const std::string& name = context.argument(at);
    const auto* const named = context.programs.find(name);
    // its component may have another name than the program
    const auto* const awaited_entry = named ? named : context.programs.find_started_as(name);
    if (!awaited_entry) return nothing_to_wait_for(context, at);
    Timeout timeout(limit_of(context, limit_ns));
    const Programs::Awaited awaited(context.programs, awaited_entry->pid);
    // the one that has the name now; another that takes the name over meanwhile is not waited for
    const std::uint64_t number = awaited_entry->number;
    const auto living = [&]() -> const Programs::Entry* {
        const auto* const entry = context.programs.find_number(number);
        if (!entry) return nullptr;
        return entry->gone() && entry->restarts.due_ns == 0 ? nullptr : entry;
    };
    while (const auto* const entry = living()) {
        if (timeout.over()) {
            return timed_out(context, timeout.limit_ns(),
                             "'" + name + "' (process " + std::to_string(entry->pid) + ", " +
                                 entry->state() + ") did not end",
                             "");
        }
        report_virtual_wait(context, timeout, name, entry->pid);
        if (context.interrupted()) return;
        context.programs.wait(context.lock, 100ms);
    }
}

namespace {

void no_program(Context& context, const std::string& name) {
    const auto names = context.programs.names();
    context.diagnostics.error(
        "not-a-program", context.span(0), "unknown program '" + name + "'",
        did_you_mean(name, names),
        names.empty() ? "no program is running" : "programs: " + listed(names));
}

}  // namespace

void command_unloadusr(Context& context) {
    const std::string& name = context.argument(0);
    // programs are not started there
    if (context.checking() && (name == "all" || context.session.absences().has_programs())) return;
    const auto unload = [&](Programs::Entry& entry) {
        const std::string why = context.programs.unload(*context.transaction, entry);
        if (!why.empty()) {
            context.diagnostics.error("not-permitted", context.span(0), why, "",
                                      "end it as that user, or as root");
        }
    };
    if (name == "all") {
        for (const auto& each : context.programs.names()) {
            unload(*context.programs.find(each));
        }
    } else if (auto* const entry = context.programs.find(name)) {
        unload(*entry);
    } else {
        no_program(context, name);
    }
}

bool unload_processes(Context& context) {
    if (context.count() != 1) return false;
    const std::string& name = context.argument(0);
    if (name != "all" &&
        !(context.programs.find(name) && context.session.model().find_component(name))) {
        return false;
    }
    command_unloadusr(context);
    return name != "all";
}

}  // namespace hal
