// SPDX-License-Identifier: MIT
// `hal sim`: netlists on a virtual clock. Standard output has what the commands print, then --show, and nothing that differs from run to run.
#include "run/sim.hpp"

#include <algorithm>
#include <chrono>
#include <fmt/core.h>
#include <fnmatch.h>
#include <unistd.h>

#include "base/types.hpp"
#include "cli/output.hpp"
#include "run/cell_netlists.hpp"
#include "run/hosted_machine.hpp"
#include "run/report.hpp"
#include "run/sim_summary.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {

namespace {

struct Shown {
    std::string name, value;
};

/// Adds the pins, parameters and signals of that name or pattern. Returns false for none.
bool add_named(Session& session, const std::string& name, std::vector<Shown>& all) {
    const Model& model = session.model();
    const auto add_pin = [&](std::string_view own, const Pin* pin) {
        all.push_back(
            {std::string(own), format_value(pin->type, session.values().read_pins({pin})[0])});
    };
    const auto add_signal = [&](std::string_view own, const Signal* signal) {
        all.push_back({std::string(own),
                       format_value(signal->type, session.values().read_signals({signal})[0])});
    };
    const std::size_t before = all.size();
    if (const Pin* const pin = model.find_pin(name)) {
        add_pin(name, pin);
    } else if (const Signal* const signal = model.find_signal(name)) {
        add_signal(name, signal);
    }
    if (all.size() != before) return true;
    for (const auto& [own, pin] : model.pin) {
        if (::fnmatch(name.c_str(), std::string(own).c_str(), 0) == 0) {
            add_pin(own, pin);
        }
    }
    for (const auto& [own, signal] : model.signal) {
        if (::fnmatch(name.c_str(), std::string(own).c_str(), 0) == 0) {
            add_signal(own, signal);
        }
    }
    std::sort(all.begin() + static_cast<std::ptrdiff_t>(before), all.end(),
              [](const Shown& a, const Shown& b) { return a.name < b.name; });
    return all.size() != before;
}

}  // namespace

std::vector<std::string> names_in(const std::vector<std::string>& lists) {
    std::vector<std::string> names;
    for (const std::string& list : lists) {
        for (std::size_t at = 0; at <= list.size();) {
            const std::size_t end = std::min(list.find(',', at), list.size());
            if (end > at) {
                names.push_back(list.substr(at, end - at));
            }
            at = end + 1;
        }
    }
    return names;
}

int show_values(const SimOptions& options, Session& session) {
    const auto lock = session.lock();
    std::vector<Shown> all;
    for (const std::string& name : names_in(options.show)) {
        if (add_named(session, name, all)) continue;
        std::vector<std::string> names;
        for (const auto& [own, pin] : session.model().pin) {
            names.emplace_back(own);
        }
        for (const auto& [own, signal] : session.model().signal) {
            names.emplace_back(own);
        }
        const std::string hint = did_you_mean(name, names);
        return fail(options, fmt::format("--show: unknown pin, parameter or signal '{}'{}", name,
                                         hint.empty() ? "" : "; " + hint));
    }
    std::size_t width = 0;
    for (const Shown& one : all) {
        width = std::max(width, one.name.size());
    }
    std::string text;
    for (const Shown& one : all) {
        text += fmt::format("{:{}}  {}\n", one.name, width, one.value);
    }
    return exit_code(print(text));
}

std::string simulated_for(std::int64_t virtual_ns, std::chrono::steady_clock::duration wall) {
    if (virtual_ns <= 0) return "no time simulated: add --for 10s, or advance in the netlist";
    const double wall_ns =
        std::max(1.0, static_cast<double>(std::chrono::nanoseconds(wall).count()));
    const double ratio = static_cast<double>(virtual_ns) / wall_ns;
    return fmt::format("simulated {} in {}, {:.{}f} times as fast as real time",
                       format_duration(static_cast<double>(virtual_ns)), format_duration(wall_ns),
                       ratio, ratio < 10 ? 2 : 0);
}

bool summary_wanted(const SimOptions& options, bool printed) {
    return !options.quiet && (!printed || ::isatty(STDERR_FILENO) != 0);
}

int run_sim(const SimOptions& options) { return simulate(options, nullptr); }

namespace {

bool is_advanced(const SimOptions& options) { return options.for_ns >= 0 || options.cycles != 0; }

/// What is wrong with the combination of options; empty: nothing.
std::string problem_of(const SimOptions& options) {
    const bool records = !options.record.empty();
    if (records && !is_advanced(options)) return "--record needs --for TIME or --cycles N";
    if (!options.values.empty() && !records) return "--values needs --record FILE";
    if (!options.profile.empty() && !records) return "--profile needs --record FILE.mcap";
    if (options.for_ns >= 0 && options.cycles != 0) {
        return "--for and --cycles exclude each other; leave one out";
    }
    return "";
}

int advance(const SimOptions& options, const SimRecorder* recorder, HostedMachine& machine) {
    machine.start_threads();
    if (recorder && !options.record.empty()) return recorder->advance(options, machine);
    machine.advance(options.for_ns, options.cycles);
    return 0;
}

/// Executes the command lines, then shows values; returns the status of the first that fails.
int execute_and_show(const SimOptions& options, HostedMachine& machine, TrackedOutput& output) {
    int status = 0;
    for (const std::string& command : options.execute) {
        if (status == 0 && !machine.stop.requested()) {
            status = machine.shell.execute(command, output, "<commandline>");
        }
    }
    if (status == 0 && !options.show.empty()) {
        status = show_values(options, machine.session);
    }
    return status;
}

/// Prints the report of the run that ends, or its summary.
void report_run(const SimOptions& options, HostedMachine& machine, bool has_output,
                std::chrono::steady_clock::duration wall) {
    if (options.report) {
        write_all(STDERR_FILENO, timing_report(machine.session));
        return;
    }
    if (!summary_wanted(options, has_output || !options.show.empty())) return;
    const auto simulated = simulated_for(machine.session.threads().now_ns(), wall);
    write_all(STDERR_FILENO, simulated_summary(machine.session, simulated));
}

/// Loads, advances, executes and shows. With --keep-going what could be loaded runs, and the status
/// has the rest.
int run_machine(const SimOptions& options, const SimRecorder* recorder, HostedMachine& machine) {
    TrackedOutput output;
    const auto begun = std::chrono::steady_clock::now();
    int status = machine.load(&output);
    const bool keeps_going = options.keep_going && (status == 0 || !machine.stop.requested());
    const bool loaded = status == 0 || keeps_going;
    const auto goes_on = [&] { return status == 0 || keeps_going; };
    if (goes_on() && is_advanced(options)) {
        status = std::max(status, advance(options, recorder, machine));
    }
    const auto wall = std::chrono::steady_clock::now() - begun;
    if (goes_on()) {
        status = std::max(status, execute_and_show(options, machine, output));
    }
    if (goes_on()) {
        machine.shell.warn_when_nothing_ran(output);
    }
    if (loaded || options.report) {
        report_run(options, machine, output.printed, wall);
    }
    return machine.faulted() || machine.stop.requested() ? 1 : status;
}

}  // namespace

/// Loads the netlists on the virtual clock, advances them, executes --execute and prints --show.
/// Returns the status of the command. `recorder` may be nullptr: then nothing is recorded.
int simulate(const SimOptions& options, const SimRecorder* recorder) {
    const bool records = !options.record.empty();
    if (const std::string problem = problem_of(options); !problem.empty()) {
        return fail(options, problem);
    }
    auto nodes = requested_nodes(options);
    if (!nodes) return 1;
    if (!nodes->empty() && records) {
        return fail(options, "--record records one machine; add --node NAME");
    }
    if (recorder && records && recorder->check(options) != 0) return 1;
    if (!nodes->empty()) return sim_cell(options, std::move(*nodes));

    const std::string name =
        options.name.empty() ? fmt::format("sim-{}", ::getpid()) : options.name;
    HostedMachine machine(options, name, true);
    if (!machine.serve(!options.name.empty())) return 1;
    return run_machine(options, recorder, machine);
}

}  // namespace hal::tools
