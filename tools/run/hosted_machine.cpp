// SPDX-License-Identifier: MIT
#include "run/hosted_machine.hpp"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fmt/core.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "commands/files.hpp"
#include "execute/process_setup.hpp"
#include "machine/load/source_tree.hpp"
#include "machine/processes/address.hpp"
#include "machine/processes/programs.hpp"
#include "tcl/tcl.hpp"

namespace hal::tools {

namespace {

SessionOptions session_options(const NetlistOptions& of, const std::string& name,
                               bool virtual_clock, ExitObserver* observer, Execution execution) {
    SessionOptions options;
    options.sink = execution.sink;
    options.schedule = execution.schedule;
    options.observer = observer;
    options.name = name;
    options.files = of.words;
    options.virtual_clock = virtual_clock;
    options.wait_limit_ns = virtual_clock ? of.cycle_limit_ns : 0;
    options.max_gap_ns = of.max_gap_ns;
    options.max_gap_realtime_ns = of.max_gap_realtime_ns;
    return options;
}

}  // namespace

ShellOptions shell_options(const NetlistOptions& options) {
    ShellOptions how;
    how.keep_going = options.keep_going;
    how.echo = options.echo;
    how.script = options.script;
    how.color = colours(STDERR_FILENO);
    how.node = options.part;
    if (options.loudness == Loudness::nothing) {
        how.level = Level::nothing;
    } else if (options.loudness == Loudness::results) {
        how.level = Level::results;
    } else {
        how.level = Level::errors;
    }
    return how;
}

/// What stands behind `--`: $1, $2 … of the netlists, and NAME=VALUE as $NAME. For the programs
/// they start: which instance halcmd is to talk to, and first in PATH the folder of this very
/// program.
void export_variables(const Options& options, const std::string& instance) {
    ::setenv("HALCYON_INSTANCE", instance.c_str(), 1);
    std::error_code unknown;
    const std::string folder =
        std::filesystem::read_symlink("/proc/self/exe", unknown).parent_path().string();
    const char* path = std::getenv("PATH");
    if (!unknown) {
        ::setenv("PATH",
                 (folder + ":" + (path && *path ? path : "/usr/local/bin:/usr/bin:/bin")).c_str(),
                 1);
    }
    for (std::size_t i = 0; i < options.arguments.size(); ++i) {
        const std::string& argument = options.arguments[i];
        ::setenv(std::to_string(i + 1).c_str(), argument.c_str(), 1);
        if (const auto equals = argument.find('='); equals != std::string::npos && equals != 0) {
            ::setenv(argument.substr(0, equals).c_str(), argument.substr(equals + 1).c_str(), 1);
        }
    }
}

namespace {

class OwnShell final : public LineExecutor {
public:
    OwnShell(Shell& shell, StopRequest& stop, Output& output)
        : shell_(shell), stop_(stop), output_(output) {}
    int execute(std::string_view line) override {
        shell_.cancel(false);
        stop_.spare(true);  // Ctrl-C is for the command now
        const int status = shell_.execute(line, output_);
        stop_.spare(false);
        return status;
    }
    Completion complete(std::string_view line, std::size_t cursor) override {
        return shell_.complete(line, cursor);
    }
    bool collecting() const override { return shell_.collecting(); }
    bool over() const override { return shell_.quit() || stop_.requested(); }

private:
    Shell& shell_;
    StopRequest& stop_;
    Output& output_;
};

/// Starts the process that reports how this one ended, and prepares this one before its first
/// thread.
std::unique_ptr<ExitObserver> start_observer(const std::string& name, bool virtual_clock) {
    if (virtual_clock) return nullptr;
    auto observer = std::make_unique<ExitObserver>(name);
    prepare_process();
    return observer;
}

}  // namespace

std::string own_name(const NetlistOptions& options) {
    if (!options.name.empty()) return options.name;
    if (!options.part.empty()) return options.part;
    const char* variable = std::getenv("HALCYON_INSTANCE");
    return variable && *variable ? variable : "default";
}

HostedMachine::HostedMachine(const NetlistOptions& options, const std::string& name,
                             bool virtual_clock, Execution execution)
    : observer_(start_observer(name, virtual_clock)),
      stop(execution.is_copied ? StopRequest::Handles::nothing : StopRequest::Handles::signals),
      session(session_options(options, name, virtual_clock, observer_.get(), execution)),
      shell(session, shell_options(options)),
      options_(options) {
    export_variables(options, name);
    // a machine that is stopped from the terminal would leave its outputs as they are
    if (!virtual_clock) {
        for (const int number : {SIGTSTP, SIGTTIN, SIGTTOU}) {
            std::signal(number, SIG_IGN);
        }
    }
    shell.run_scripts_with([this](const std::string& path,
                                  const std::vector<std::string>& arguments, Pass pass,
                                  Output&) { return run_script(path, arguments, pass); });
    if (!execution.is_copied) {
        begin_watching(virtual_clock);
    }
}

void HostedMachine::begin_watching(bool virtual_clock) {
    setup_guard_.emplace();
    descriptor_watch_.emplace([this] { halt_ticket_ = session.threads().halt(); }, [this] {
        return session.threads().halted(halt_ticket_) != ThreadControl::Halt::pending;
    });
    if (virtual_clock) {
        cycle_guard_.begin(options_.cycle_limit_ns);
    }
    stop.when_signalled([this, virtual_clock] {
        shell.cancel();
        if (virtual_clock) {
            cycle_guard_.end_soon();
        }
        if (!stop.requested()) return;
        end_now();
        setup_guard_->end_soon();
    });
}

HostedMachine::~HostedMachine() {
    shut_down();
    // outputs are safe: a second Ctrl-C ends the process at once from here on
    ExitObserver::silence();
    stop.release();  // it calls the shell, which goes now
    if (server_ && programs_have_ended()) {
        server_->close_at_exit();
    }
    server_.reset();
}

void HostedMachine::end_now() {
    if (!stops_at_once_) return;
    session.interrupt();
    session.threads().halt();
}

bool HostedMachine::serve(bool needed) {
    const std::string& name = session.options().name;
    if (!good_instance_name(name)) {
        fail(options_,
             fmt::format(
                 "invalid instance name '{}'; use up to 64 letters, digits, '-', '_' and '.'",
                 name));
        return false;
    }
    ServerOptions how;
    how.group = options_.group;
    how.stop = [this] {
        stop.request();
        shell.cancel();
        end_now();
    };
    server_ = std::make_unique<Server>(shell, std::move(how));
    Diagnostics diagnostics;
    if (server_->start(diagnostics)) return true;
    server_.reset();
    if (needed) {
        write_all(STDERR_FILENO, render(diagnostics, session.sources, colours(STDERR_FILENO)));
    }
    return !needed;
}

int HostedMachine::load(Output* output) {
    Output& to = output != nullptr ? *output : output_;
    if (!options_.ini.empty() && shell.read_ini(options_.ini, to) != 0) return 1;
    if (!options_.ini.empty()) {
        ini_path = absolute_path(options_.ini);
    }
    int status = 0;
    for (const std::string& path : options_.words) {
        if (stop.requested()) return 1;
        if (path.ends_with(".ini")) {
            ini_path = absolute_path(path);
        }
        status = std::max(status, path.ends_with(".tcl")
                                      ? run_script(path, options_.arguments, Pass::both)
                                      : shell.run_file(path, to));
        if (status != 0 && !options_.keep_going) return status;
    }
    return status;
}

int HostedMachine::run_script(const std::string& path, const std::vector<std::string>& arguments,
                              Pass pass) {
    const std::string name =
        path.empty() ? "<haltcl>" : "<" + std::filesystem::path(path).filename().string() + ">";
    TclScript script;
    script.path = path;
    script.directory = shell.options.directory;
    script.arguments = arguments;
    script.ini_path = ini_path;
    script.ini = &session.ini;
    script.pass = pass;
    const TclCommand execute = [this, &name](const std::vector<std::string>& words) {
        TextOutput text;
        const int status = shell.execute(words, text, name);
        return TclAnswer{status, std::move(text.out_text), std::move(text.err_text)};
    };
    std::string problem;
    const int status = run_tcl(script, execute, stop.fd(), problem);
    if (status < 0) {
        return fail(options_,
                    fmt::format("'{}' cannot be run: {}", path.empty() ? "Tcl" : path, problem));
    }
    if (status != 0 && !stop.requested() && !path.empty()) {
        fail(options_, fmt::format("'{}' {}", path, end_description(status)));
    }
    return exit_code(status == 0);
}

void HostedMachine::start_threads() {
    forbid_builds();
    const auto lock = session.lock();
    if (!session.threads().running() && !session.model().threads.empty()) {
        session.threads().start();
    }
}

int HostedMachine::converse(const Prompt& prompt) {
    OwnShell executor(shell, stop, output_);
    return run_prompt_loop(executor, prompt, stop.fd());
}

void HostedMachine::advance(std::int64_t ns, std::uint64_t cycles) {
    constexpr std::int64_t slice_ns = 100'000'000;
    constexpr std::uint64_t slice_cycles = 1000;
    while (!stop.requested() && (ns > 0 || cycles > 0)) {
        const auto lock = session.lock();
        if (ns > 0) {
            const std::int64_t slice = std::min(ns, slice_ns);
            session.threads().advance_ns(slice);
            ns -= slice;
        } else {
            const std::uint64_t slice = std::min(cycles, slice_cycles);
            session.threads().advance_cycles(slice);
            cycles -= slice;
        }
    }
}

void HostedMachine::shut_down() {
    constexpr std::int64_t max_end_ns = 15'000'000'000;
    const bool is_limited = setup_guard_ && !session.options().virtual_clock;
    if (is_limited) {
        setup_guard_->end_within(max_end_ns);
    }
    {
        const auto lock = session.lock();
        session.shut_down();
    }
    if (is_limited) {
        setup_guard_->end_within(SetupGuard::no_limit);  // what follows may wait for a reader
    }
}

std::string HostedMachine::end_report() {
    shut_down();
    const auto lock = session.lock();
    std::string report;
    for (const std::string& name : session.failed_stops()) {
        report += fmt::format(
            "'{}' raised a fault while it stopped: what it drives may run on; see its messages\n",
            name);
    }
    return report;
}

bool HostedMachine::programs_have_ended() {
    const auto lock = session.lock();
    return session.ending() && session.programs().idle();
}

bool HostedMachine::faulted() {
    const auto lock = session.lock();
    const auto reports = session.reports().threads();
    return std::any_of(reports.begin(), reports.end(),
                       [](const ThreadReport& r) { return r.faulted || r.hangs != 0; });
}

}  // namespace hal::tools
