// SPDX-License-Identifier: MIT
#include "run/sim_record.hpp"

#include <algorithm>
#include <fmt/core.h>

#include "cli/output.hpp"
#include "paths.hpp"
#include "record/sink.hpp"
#include "recording/mcap/held_file.hpp"
#include "run/chosen_values.hpp"
#include "run/hosted_machine.hpp"
#include "run/sim_summary.hpp"
#include "text/quoting.hpp"

namespace hal::tools {
namespace {

int check_recording(const SimOptions& options) {
    if (!options.record.ends_with(".mcap") && !options.record.ends_with(".csv")) {
        return fail(options, fmt::format("unknown format of '{}'; name the file .mcap or .csv",
                                         options.record));
    }
    if (const std::string unsupported = unsupported_profile(options.profile, options.record);
        !unsupported.empty()) {
        return fail(options, unsupported);
    }
    const std::string problem = mcap::unwritable(options.record);
    return problem.empty()
               ? 0
               : fail(options, fmt::format("cannot write '{}': {}", options.record, problem));
}

// the rows of a step are written before the next one
constexpr std::int64_t step_ns = 100'000'000;
constexpr std::uint64_t step_cycles = 100;

/// Returns the time whose rows a probe keeps: that of two steps.
std::int64_t buffered_ns(Session& session, const SimOptions& options) {
    if (options.cycles == 0) return 2 * step_ns;
    std::int64_t fastest_ns = step_ns / static_cast<std::int64_t>(step_cycles);
    const auto threads = session.reports().threads();
    if (!threads.empty()) {
        fastest_ns = std::ranges::min(threads, {}, &ThreadReport::period_ns).period_ns;
    }
    return 2 * static_cast<std::int64_t>(step_cycles) * fastest_ns;
}

std::uint64_t lost_rows(const ProbeRows& batch) {
    std::uint64_t lost = 0;
    for (const ProbeRows::Part& part : batch.parts) {
        lost += part.lost;
    }
    return lost;
}

int record_advance(const SimOptions& options, HostedMachine& machine) {
    Session& session = machine.session;
    std::shared_ptr<LiveProbe> probe;
    ProbeLayout layout;
    EventLog::Position journal;
    std::string problem;
    {
        const auto lock = session.lock();
        const std::vector<std::string> patterns = names_in(options.values);
        if (const std::string unknown = unknown_value(session.model(), patterns);
            !unknown.empty()) {
            return fail(options, "--values: " + unknown);
        }
        probe = session.probes().attach({.names = chosen_values(session.model(), patterns),
                                         .buffer_ns = buffered_ns(session, options)},
                                        problem);
        if (!probe) return fail(options, "--record: " + problem);
        layout = Probes::layout(*probe);
        journal = session.event_log().begin();
    }
    const auto sink = make_sink(
        options.record, Probes::columns(*probe),
        {options.name.empty() ? "sim" : options.name, std::string(paths::version), "", "", 0, options.profile});
    if (!sink->kept().empty()) {
        write_all(2, kept_line(*sink, options.record));
    }
    bool good = sink->error() == 0 && sink->layout(layout.groups);
    std::uint64_t rows = 0;
    std::uint64_t lost = 0;
    std::int64_t left_ns = options.for_ns;
    std::uint64_t left_cycles = options.cycles;
    while (good && !machine.stop.requested() && (left_ns > 0 || left_cycles > 0)) {
        if (left_cycles > 0) {
            machine.advance(-1, std::min(step_cycles, left_cycles));
        } else {
            machine.advance(std::min(step_ns, left_ns), 0);
        }
        left_cycles -= std::min(step_cycles, left_cycles);
        left_ns -= step_ns;
        const auto lock = session.lock();
        for (const LoggedEvent& entry : session.event_log().after(journal)) {
            good = good && sink->event({entry.time_ns, entry.kind, entry.text});
        }
        for (const ProbeRows& batch : session.probes().take(*probe, max_taken, Probes::Rest::taken)) {
            good = good && add_rows(*sink, batch, layout, rows);
            lost += lost_rows(batch);
        }
    }
    {
        const auto lock = session.lock();
        session.probes().detach(probe);
        session.event_log().end();
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
