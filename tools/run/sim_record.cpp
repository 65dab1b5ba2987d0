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

/// Returns the option whose values cannot be recorded.
std::string option_of_values(const SimOptions& options) {
    return options.values.empty() ? "--record: " : "--values: ";
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
    return problem.empty() ? 0 : fail(options, option_of_values(options) + problem);
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

/// Simulates and writes the rows of one machine.
class SimRecording {
public:
    /// Both outlive it.
    SimRecording(const SimOptions& options, HostedMachine& machine)
        : options_(options), machine_(machine), session_(machine.session) {}

    /// Returns the exit status.
    int run() {
        if (!attach()) return 1;
        open();
        advance_all();
        detach();
        return finish();
    }

private:
    /// Returns false after a message.
    bool attach() {
        const auto lock = session_.lock();
        const std::vector<std::string> patterns = names_in(options_.values);
        std::string problem = unknown_value(session_.model(), patterns);
        if (!problem.empty()) {
            fail(options_, "--values: " + problem);
            return false;
        }
        std::vector<std::string> names = chosen_values(session_.model(), patterns);
        if (names.empty()) {
            fail(options_, "--record: the machine has no values to record");
            return false;
        }
        step_ = step_of(shortest_period_ns(session_), options_);
        probe_ = session_.probes().attach(
            {.names = std::move(names), .buffer_ns = step_.buffered_ns, .advice = fewer_values},
            problem);
        if (!probe_) {
            fail(options_, option_of_values(options_) + problem);
            return false;
        }
        layout_ = Probes::layout(*probe_);
        journal_ = session_.event_log().begin();
        check_.limit(step_, options_.for_ns);
        return true;
    }

    void open() {
        sink_ = make_sink(options_.record, Probes::columns(*probe_),
                          {options_.name.empty() ? "sim" : options_.name,
                           std::string(paths::version), "", "", 0, options_.profile});
        if (!sink_->kept().empty()) {
            write_all(2, kept_line(*sink_, options_.record));
        }
        good_ = sink_->error() == 0 && sink_->layout(layout_.groups);
    }

    /// Ends early when the file cannot be written, the plans cannot be exchanged, or on a signal.
    void advance_all() {
        std::int64_t left_ns = options_.for_ns;
        std::uint64_t left_cycles = options_.cycles;
        while ((left_ns > 0 || left_cycles > 0) && may_go_on()) {
            const std::uint64_t cycles = std::min(step_.cycles, left_cycles);
            if (cycles > 0) {
                machine_.advance(-1, cycles);
            } else {
                machine_.advance(std::min(step_.ns, left_ns), 0);
            }
            left_cycles -= cycles;
            left_ns -= step_.ns;
            problem_ = check_.advanced(machine_);
            write_step();
        }
    }

    bool may_go_on() const { return good_ && problem_.empty() && !machine_.stop.requested(); }

    void write_step() {
        const auto lock = session_.lock();
        for (const LoggedEvent& entry : session_.event_log().after(journal_)) {
            good_ = good_ && sink_->event({entry.time_ns, entry.kind, entry.text});
        }
        for (const ProbeRows& batch :
             session_.probes().take(*probe_, max_taken, Probes::Rest::taken)) {
            good_ = good_ && add_rows(*sink_, batch, layout_, rows_);
            lost_ += lost_rows(batch);
        }
    }

    void detach() {
        const auto lock = session_.lock();
        session_.probes().detach(probe_);
        session_.event_log().end();
    }

    /// Closes the file. Returns the exit status.
    int finish() {
        if (!problem_.empty()) {
            return fail(options_, "the plans could not be exchanged: " + problem_);
        }
        if (!sink_->close() || !good_) return fail(options_, cannot_write(*sink_, options_.record));
        if (lost_ > 0) {
            return fail(options_, fmt::format("'{}' is incomplete: {} did not fit the buffer",
                                              options_.record, counted(lost_, "row")));
        }
        if (!options_.quiet) {
            write_all(2, fmt::format("{}: {} of {}\n", options_.record, counted(rows_, "row"),
                                     counted(Probes::columns(*probe_).size(), "value")));
        }
        return 0;
    }

    const SimOptions& options_;
    HostedMachine& machine_;
    Session& session_;
    Step step_;
    std::shared_ptr<LiveProbe> probe_;
    ProbeLayout layout_;
    EventLog::Position journal_;
    std::unique_ptr<Sink> sink_;
    DeterminismCheck check_;
    bool good_ = true;
    std::string problem_;
    std::uint64_t rows_ = 0;
    std::uint64_t lost_ = 0;
};

int record_advance(const SimOptions& options, HostedMachine& machine) {
    return SimRecording(options, machine).run();
}

}  // namespace

int run_recorded_sim(const SimOptions& options) {
    constexpr SimRecorder recorder{check_recording, record_advance};
    return simulate(options, &recorder);
}

}  // namespace hal::tools
