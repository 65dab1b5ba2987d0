// SPDX-License-Identifier: MIT
#include "run/sim_record.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <fnmatch.h>
#include <set>

#include "cli/output.hpp"
#include "paths.hpp"
#include "record/sink.hpp"
#include "recording/mcap/held_file.hpp"
#include "run/hosted_machine.hpp"
#include "run/sim_summary.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal::tools {
namespace {

/// All signals, pins and parameters that match, or all signals and what has none. Each value once.
/// The session's lock must be held.
std::vector<std::string> chosen(const Model& model, const std::vector<std::string>& patterns) {
    std::set<std::string> all;
    const auto wanted = [&](const std::string& name, bool otherwise) {
        if (patterns.empty()) return otherwise;
        return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& one) {
            return one == name || ::fnmatch(one.c_str(), name.c_str(), 0) == 0;
        });
    };
    for (const auto& signal : model.signals) {
        if (signal->type != HAL_TYPE_PORT && wanted(signal->name, true)) {
            all.insert(signal->name);
        }
    }
    for (const Pin* const pin : model.sorted_pins()) {
        if (pin->type != HAL_TYPE_PORT &&
            wanted(pin->name, !pin->signal && !pin->of_thread && !pin->function)) {
            all.insert(pin->name);
        }
    }
    return {all.begin(), all.end()};
}

/// States which of the names there is not; "" when all are known. The session's lock must be held.
std::string unknown_name(const Model& model, const std::vector<std::string>& patterns) {
    for (const std::string& one : patterns) {
        if (model.find_pin(one) || model.find_signal(one) || !chosen(model, {one}).empty()) {
            continue;
        }
        std::vector<std::string> names;
        for (const auto& [own, pin] : model.pin) {
            names.emplace_back(own);
        }
        for (const auto& [own, signal] : model.signal) {
            names.emplace_back(own);
        }
        std::sort(names.begin(), names.end());
        const std::string hint = did_you_mean(one, names);
        return fmt::format("no pin, parameter or signal matches '{}'{}", one,
                           hint.empty() ? "" : "; " + hint);
    }
    return "";
}

bool add_rows(Sink& sink, const ProbeRows& rows, ProbeLayout& layout, std::uint64_t& count) {
    if (rows.layout) {
        layout = *rows.layout;
        if (!sink.layout(layout.groups)) return false;
    }
    ProbeBatch batch;
    std::size_t offset = 0;
    for (const auto& part : rows.parts) {
        const std::size_t columns = layout.groups[part.group].columns.size();
        batch.parts.push_back({part.group, part.rows, columns, part.lost, offset});
        offset += part.rows * (columns + 2) * 8;
    }
    batch.bytes = rows.bytes;
    return add_batch(sink, batch, 0, INT64_MAX, count);
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
    const std::string problem = mcap::unwritable(options.record);
    return problem.empty()
               ? 0
               : fail(options, fmt::format("cannot write '{}': {}", options.record, problem));
}

int record_advance(const SimOptions& options, HostedMachine& machine) {
    Session& session = machine.session;
    std::shared_ptr<LiveProbe> probe;
    ProbeLayout layout;
    Journal::Position journal;
    std::string problem;
    {
        const auto lock = session.lock();
        const std::vector<std::string> patterns = names_in(options.values);
        if (const std::string unknown = unknown_name(session.model(), patterns); !unknown.empty()) {
            return fail(options, "--values: " + unknown);
        }
        probe = session.probes().attach({chosen(session.model(), patterns)}, problem);
        if (!probe) return fail(options, "--record: " + problem);
        layout = Probes::layout(*probe);
        journal = session.journal().begin();
    }
    const auto sink = make_sink(
        options.record, Probes::columns(*probe),
        {options.name.empty() ? "sim" : options.name, std::string(paths::version), "", "", 0, options.profile});
    if (!sink->kept().empty()) {
        write_all(2, kept_line(*sink, options.record));
    }
    bool good = sink->error() == 0 && sink->layout(layout.groups);
    std::uint64_t rows = 0;
    std::int64_t left_ns = options.for_ns;
    std::uint64_t left_cycles = options.cycles;
    constexpr std::int64_t step_ns = 100'000'000;
    constexpr std::uint64_t step_cycles = 100;
    while (good && !machine.stop.requested() && (left_ns > 0 || left_cycles > 0)) {
        if (left_cycles > 0) {
            machine.advance(-1, std::min(step_cycles, left_cycles));
        } else {
            machine.advance(std::min(step_ns, left_ns), 0);
        }
        left_cycles -= std::min(step_cycles, left_cycles);
        left_ns -= step_ns;
        const auto lock = session.lock();
        for (const JournalEntry& entry : session.journal().after(journal)) {
            good = good && sink->event({entry.time_ns, entry.kind, entry.text});
        }
        for (const ProbeRows& batch : session.probes().take(*probe, std::size_t{1} << 28)) {
            good = good && add_rows(*sink, batch, layout, rows);
        }
    }
    {
        const auto lock = session.lock();
        session.probes().detach(probe);
        session.journal().end();
    }
    if (!sink->close() || !good) return fail(options, cannot_write(*sink, options.record));
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
