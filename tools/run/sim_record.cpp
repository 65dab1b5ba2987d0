// SPDX-License-Identifier: MIT
#include "run/sim_record.hpp"

#include <algorithm>
#include <cstdlib>
#include <fmt/core.h>
#include <utility>

#include "cli/output.hpp"
#include "machine/report/outside_readings.hpp"
#include "paths.hpp"
#include "record/sink.hpp"
#include "recording/mcap/held_file.hpp"
#include "run/chosen_values.hpp"
#include "run/determinism_check.hpp"
#include "run/hosted_machine.hpp"
#include "run/sim_summary.hpp"
#include "run/values_check.hpp"
#include "text/quoting.hpp"

namespace hal::tools {
namespace {

/// How far the simulation goes until its rows are written: 100 cycles of the fastest thread, and not
/// further than 100 ms. A step of few rows needs little memory for thousands of values.
struct Step {
    std::uint64_t cycles = 100;
    std::int64_t ns = 100'000'000;
    std::int64_t buffered_ns = 200'000'000;  ///< the rows that a probe keeps: of two steps
};

/// `period_ns`: the shortest one; 0: the netlist has no thread.
Step step_of(std::int64_t period_ns, const SimOptions& options) {
    Step step;
    if (period_ns == 0) return step;
    const std::int64_t cycles_ns = static_cast<std::int64_t>(step.cycles) * period_ns;
    step.ns = std::min(step.ns, cycles_ns);
    step.buffered_ns = 2 * (options.cycles > 0 ? cycles_ns : step.ns);
    return step;
}

std::int64_t shortest_period_ns(Session& session) {
    const auto threads = session.reports().threads();
    return threads.empty() ? 0 : std::ranges::min(threads, {}, &ThreadReport::period_ns).period_ns;
}

int check_recording(const SimOptions& options) {
    if (!options.record.ends_with(".mcap") && !options.record.ends_with(".csv")) {
        return fail(options, fmt::format("unknown format of '{}'; name the file .mcap or .csv",
                                         options.record));
    }
    if (const std::string unsupported = unsupported_profile(options.profile, options.record);
        !unsupported.empty()) {
        return fail(options, unsupported);
    }
    if (const std::string problem = mcap::unwritable(options.record); !problem.empty()) {
        return fail(options, fmt::format("cannot write '{}': {}", options.record, problem));
    }
    const std::string problem = problem_of_values(options, options.values);
    return problem.empty() ? 0 : fail(options, "--values: " + problem);
}

std::uint64_t lost_rows(const ProbeRows& batch) {
    std::uint64_t lost = 0;
    for (const ProbeRows::Part& part : batch.parts) {
        lost += part.lost;
    }
    return lost;
}

/// For `hal check --deterministic`: two simulations with different seeds must be equal.
class DeterminismCheck {
public:
    DeterminismCheck() {
        const char* const seed = std::getenv(determinism_seed);
        is_on_ = seed != nullptr;
        if (!is_on_) return;
        const auto number = static_cast<unsigned>(std::atoi(seed));
        std::srand(number);
        ::srand48(static_cast<long>(number));
        has_edited_ = number % 2 == 0;
        report_outside_readings();
    }
    /// Makes a step short enough for two.
    void limit(Step& step, std::int64_t for_ns) const {
        if (is_on_) {
            step.ns = std::min(step.ns, for_ns / 2 + 1);
        }
    }
    /// Gives the threads new plans once, in one of the two simulations: a function that has kept an
    /// address in the old ones reads something else from then on. Returns why they have not got
    /// them; "" when they have. [setup]
    std::string advanced(HostedMachine& machine) {
        if (!is_on_ || std::exchange(has_edited_, true)) return "";
        std::vector<std::string> threads;
        {
            const auto lock = machine.session.lock();
            for (const ThreadReport& thread : machine.session.reports().threads()) {
                threads.push_back(thread.name);
            }
        }
        for (const std::string& thread : threads) {
            const std::string name = "determinism-check-" + thread;
            for (const std::string& command :
                 {"loadrt and2 names=" + name, "addf " + name + " " + thread,
                  "delf " + name + " " + thread}) {
                TextOutput output;
                if (machine.shell.execute(command, output) != 0) {
                    return output.err_text.substr(0, output.err_text.find_last_not_of('\n') + 1);
                }
            }
        }
        return "";
    }

private:
    bool is_on_ = false;
    bool has_edited_ = false;
};

int record_advance(const SimOptions& options, HostedMachine& machine) {
    Session& session = machine.session;
    std::shared_ptr<LiveProbe> probe;
    ProbeLayout layout;
    EventLog::Position journal;
    Step step;
    std::string problem;
    {
        const auto lock = session.lock();
        const std::vector<std::string> patterns = names_in(options.values);
        if (const std::string unknown = unknown_value(session.model(), patterns);
            !unknown.empty()) {
            return fail(options, "--values: " + unknown);
        }
        step = step_of(shortest_period_ns(session), options);
        std::vector<std::string> names = chosen_values(session.model(), patterns);
        if (names.empty()) return fail(options, "--record: the machine has no values to record");
        probe = session.probes().attach(
            {.names = std::move(names), .buffer_ns = step.buffered_ns, .advice = fewer_values},
            problem);
        if (!probe) return fail(options, "--values: " + problem);
        layout = Probes::layout(*probe);
        journal = session.event_log().begin();
    }
    const auto sink = make_sink(options.record, Probes::columns(*probe),
                                {options.name.empty() ? "sim" : options.name,
                                 std::string(paths::version), "", "", 0, options.profile});
    if (!sink->kept().empty()) {
        write_all(2, kept_line(*sink, options.record));
    }
    bool good = sink->error() == 0 && sink->layout(layout.groups);
    std::uint64_t rows = 0;
    std::uint64_t lost = 0;
    std::int64_t left_ns = options.for_ns;
    std::uint64_t left_cycles = options.cycles;
    DeterminismCheck check;
    check.limit(step, options.for_ns);
    while (good && problem.empty() && !machine.stop.requested() &&
           (left_ns > 0 || left_cycles > 0)) {
        if (left_cycles > 0) {
            machine.advance(-1, std::min(step.cycles, left_cycles));
        } else {
            machine.advance(std::min(step.ns, left_ns), 0);
        }
        left_cycles -= std::min(step.cycles, left_cycles);
        left_ns -= step.ns;
        problem = check.advanced(machine);
        const auto lock = session.lock();
        for (const LoggedEvent& entry : session.event_log().after(journal)) {
            good = good && sink->event({entry.time_ns, entry.kind, entry.text});
        }
        for (const ProbeRows& batch :
             session.probes().take(*probe, max_taken, Probes::Rest::taken)) {
            good = good && add_rows(*sink, batch, layout, rows);
            lost += lost_rows(batch);
        }
    }
    {
        const auto lock = session.lock();
        session.probes().detach(probe);
        session.event_log().end();
    }
    if (!problem.empty()) {
        return fail(options, "the plans could not be exchanged: " + problem);
    }
    if (!sink->close() || !good) return fail(options, cannot_write(*sink, options.record));
    if (lost > 0) {
        return fail(options, fmt::format("'{}' is incomplete: {} did not fit the buffer",
                                         options.record, counted(lost, "row")));
    }
    if (!options.quiet) {
        write_all(2, fmt::format("{}: {} of {}\n", options.record, counted(rows, "row"),
                                 counted(Probes::columns(*probe).size(), "value")));
    }
    return 0;
}

}  // namespace

int run_recorded_sim(const SimOptions& options) {
    constexpr SimRecorder recorder{check_recording, record_advance};
    return simulate(options, &recorder);
}

}  // namespace hal::tools
