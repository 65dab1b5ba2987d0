// SPDX-License-Identifier: MIT
#include "run/replay_recording.hpp"

#include <fmt/core.h>

#include "cli/output.hpp"
#include "paths.hpp"
#include "recording/mcap/held_file.hpp"
#include "run/chosen_values.hpp"
#include "run/replay_note.hpp"
#include "run/sim_summary.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal::tools {
namespace {

constexpr std::uint64_t take_every = 64;  // cycles, of all threads

}  // namespace

ReplayRecording::ReplayRecording(const ReplayOptions& options, JournalFile& file, Session& session)
    : options_(options), file_(file), session_(session), patterns_(names_in({options.names})) {}

ReplayRecording::~ReplayRecording() {
    if (!probe_) return;
    session_.probes().detach(probe_);
    session_.event_log().end();
}

std::string ReplayRecording::problem(const ReplayOptions& options) {
    if (options.record.empty()) return "";
    if (options.shell) return "--record and --shell exclude each other; leave one out";
    if (!options.record.ends_with(".mcap") && !options.record.ends_with(".csv")) {
        return fmt::format("--record: unknown format of '{}'; name the file .mcap or .csv",
                           options.record);
    }
    const std::string reason = mcap::unwritable(options.record);
    return reason.empty() ? ""
                          : fmt::format("--record: cannot write '{}': {}", options.record, reason);
}

bool ReplayRecording::attach() {
    problem_ = unknown_value(session_.model(), patterns_);
    if (!problem_.empty()) return true;  // a later cycle may have them
    names_ = chosen_values(session_.model(), patterns_);
    probe_ = session_.probes().attach(
        {.names = names_, .buffer_rows = 2 * take_every, .advice = "choose fewer with --names"},
        problem_);
    if (!probe_) return false;
    layout_ = Probes::layout(*probe_);
    journal_ = session_.event_log().begin();
    sink_ = make_sink(options_.record, Probes::columns(*probe_),
                      {.instance = "replay",
                       .version = std::string(paths::version),
                       .netlist = "",
                       .cause = "",
                       .unix_offset_ns = file_.unix_offset_ns()});
    if (!sink_->kept().empty()) {
        write_all(2, kept_line(*sink_, options_.record));
    }
    is_written_ = sink_->error() == 0 && sink_->layout(layout_.groups);
    return true;
}

bool ReplayRecording::note_cycle(std::uint64_t edits) {
    if (options_.record.empty()) return true;
    const bool is_edited = edits != edits_;
    edits_ = edits;
    if (!probe_) return attach();
    if (is_edited) {
        note_later_values();
    }
    if (++untaken_ >= take_every) {
        take();
    }
    return true;
}

void ReplayRecording::note_later_values() {
    for (std::string& name : chosen_values(session_.model(), patterns_)) {
        if (!std::binary_search(names_.begin(), names_.end(), name)) {
            later_.insert(std::move(name));
        }
    }
}

void ReplayRecording::take() {
    untaken_ = 0;
    for (const LoggedEvent& entry : session_.event_log().after(journal_)) {
        is_written_ = is_written_ && sink_->event({entry.time_ns, entry.kind, entry.text});
    }
    for (const ProbeRows& rows : session_.probes().take(*probe_, max_taken, Probes::Rest::taken)) {
        is_written_ = is_written_ && add_rows(*sink_, rows, layout_, rows_);
        for (const ProbeRows::Part& part : rows.parts) {
            lost_ += part.lost;
        }
    }
}

bool ReplayRecording::finish() {
    if (options_.record.empty()) return true;
    if (!probe_) {
        note(options_,
             "--record: " + (problem_.empty() ? "no cycle was executed" : "--names: " + problem_));
        return false;
    }
    take();
    if (!sink_->close() || !is_written_) {
        fail(options_, cannot_write(*sink_, options_.record));
        return false;
    }
    if (lost_ > 0) {
        note(options_, fmt::format("'{}' is incomplete: {} did not fit the buffer", options_.record,
                                   counted(lost_, "row")));
        return false;
    }
    if (!later_.empty()) {
        const std::vector<std::string> names(later_.begin(), later_.end());
        note(options_,
             fmt::format("'{}' does not have {} loaded after its first row: {}; to record more, "
                         "list each name in --names: the recording then begins when the machine "
                         "has all of them",
                         options_.record, counted(names.size(), "value"), listed(names)));
    }
    return print(fmt::format("{}: {} of {}\n", options_.record, counted(rows_, "row"),
                             counted(Probes::columns(*probe_).size(), "value")));
}

}  // namespace hal::tools
