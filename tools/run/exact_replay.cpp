// SPDX-License-Identifier: MIT
#include "run/exact_replay.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fmt/core.h>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "cli/output.hpp"
#include "journal/component_heap.hpp"
#include "run/chosen_values.hpp"
#include "run/difference_inputs.hpp"
#include "run/journal_test.hpp"
#include "run/journaled_program.hpp"
#include "run/replay_note.hpp"
#include "run/replay_panel.hpp"
#include "run/replay_recording.hpp"
#include "run/replay_shell.hpp"
#include "run/replayed_machine.hpp"
#include "run/sim_summary.hpp"
#include "run/stop_rule.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {
namespace {

class ExactReplay {
public:
    /// All outlive it.
    ExactReplay(const ReplayOptions& options, JournalFile& file, const JournalPosition& until,
                const ValueCondition& condition, const WhatIf& change)
        : options_(options),
          file_(file),
          until_(until),
          condition_(condition),
          machine_(options, file, ReplayedMachine::Compare::values, change),
          execution_(machine_.execution()),
          recording_(options, file, machine_.session()) {}

    /// Executes the journal and prints the result. Returns the exit status.
    int run() {
        const auto lock = machine_.session().lock();
        const auto begun = std::chrono::steady_clock::now();
        const bool stopped = execute();
        const auto took = std::chrono::steady_clock::now() - begun;
        machine_.compare();
        int status = report(stopped, took);
        if (!recording_.finish()) {
            status = 1;
        }
        if (!show()) {
            status = 1;
        }
        if (!options_.as_test.empty() && status == 0) {
            status = write_journal_test(options_, file_, machine_);
        }
        if (!options_.cut.empty() && status == 0) {
            status = cut();
        }
        // last: the machine is behind the difference afterwards
        if (!print(machine_.later_difference())) {
            status = 1;
        }
        execution_.finish();
        return status;
    }
    /// Returns the first value that differs.
    std::optional<ValueDifference> difference() const {
        const ValueDifference* const at = machine_.value_difference();
        return at ? std::optional(*at) : std::nullopt;
    }

private:
    /// Returns true when a rule, the user or the recording has stopped it before the end.
    bool execute() {
        bool reached = false;
        while (machine_.advance()) {
            if (!recording_.note_cycle(execution_.edits())) return true;
            if (machine_.host().stop.requested()) return true;
            reached = reached || until_.reached(execution_.newest(), machine_.fastest()) ||
                      (!condition_.empty() && condition_.holds(machine_.session()));
            const bool may_stop = options_.cut.empty() || execution_.at_rest();
            if (reached && may_stop) return true;
        }
        return false;
    }

    /// Writes the rest of the journal.
    int cut() {
        std::string problem;
        std::string state = execution_.state(problem);
        if (state.empty()) {
            return fail(
                options_,
                fmt::format("--cut: the state of the machine cannot be written: {}", problem));
        }
        problem = write_remaining(file_, options_.cut, execution_.progress(), std::move(state));
        if (!problem.empty()) {
            return fail(options_, fmt::format("cannot write '{}': {}", options_.cut, problem));
        }
        print(
            fmt::format("{}: the journal from here on; to execute it, type: hal replay --exact "
                        "{}\n",
                        options_.cut, options_.cut));
        return 0;
    }

    /// How the execution ended: the lines that are printed, and whether that is a success.
    struct Ending {
        std::string text;
        bool good = true;
    };

    int report(bool stopped, std::chrono::steady_clock::duration took) {
        std::string text = summary(took);
        note_overlaps();
        const std::string difference = machine_.difference();
        const bool differs = !difference.empty() && !execution_.is_at_the_cut();
        const Ending ending = ending_of(stopped, difference);
        text += ending.text + machine_.consequences();
        const bool changed = differs || note_missing_change();
        const bool known = !condition_.is_unknown(machine_.session());
        if (!known) {
            note(options_, fmt::format("--break: the machine has no '{}'", condition_.name()));
        } else if (!stopped && !differs) {
            note_end();
        }
        return print(text) && ending.good && changed && known ? 0 : 1;
    }

    std::string summary(std::chrono::steady_clock::duration took) const {
        const double real = std::max(std::chrono::duration<double>(took).count(), 1e-9);
        return fmt::format("{} of {}, {} and {:.6g} s executed in {:.3g} s; {}\n",
                           counted(execution_.cycles(), "cycle"),
                           counted(file_.threads().size(), "thread"),
                           counted(execution_.edits(), "edit"),
                           seconds(execution_.newest().time_ns), real, newest_cycle());
    }

    Ending ending_of(bool stopped, const std::string& difference) const {
        const WhatIf& change = machine_.change();
        if (!difference.empty() && execution_.is_at_the_cut()) return {text_of_the_cut()};
        if (!difference.empty()) return {difference, false};
        if (!machine_.change_problem().empty()) {
            const std::string option = change.netlist().empty() ? "--edit" : "--netlist";
            return {option + ": " + machine_.change_problem() + "\n", false};
        }
        if (execution_.state() == ReExecution::State::fails) {
            return {execution_.reason() + "\n", false};
        }
        if (execution_.state() == ReExecution::State::ends) {
            const std::string text = "the journal ends: " + execution_.reason();
            const bool good = !file_.complete() && !has_gap();
            if (change.done()) return {text + "\n", good};
            return {text + "; " + verdict("no difference before") + "\n", good};
        }
        if (change.done()) return {};
        return {verdict(stopped ? "stopped; no difference so far" : "no difference") + "\n"};
    }

    std::string text_of_the_cut() const {
        return fmt::format(
            "the journal ends: it was cut off, and an edit or a value that cycle {} of thread '{}' "
            "depends on may be missing; no difference before\n",
            execution_.newest().number, execution_.newest().thread);
    }

    /// Returns false after a note when the execution ended before the change that was asked for.
    bool note_missing_change() const {
        if (machine_.change().empty() || machine_.change().done()) return true;
        note(options_, fmt::format("--at {}: the execution ended before it", options_.at));
        return false;
    }

    std::string newest_cycle() const {
        if (execution_.cycles() > 0) {
            const JournaledCycle& newest = execution_.newest();
            return fmt::format("newest: cycle {} of '{}' at {:.6f} s", newest.number, newest.thread,
                               seconds(newest.time_ns));
        }
        const bool has_cycles = has_gap() || std::ranges::any_of(file_.threads(), [](auto& entry) {
            return entry.second.record() != nullptr;
        });
        return has_cycles ? "no cycle was executed" : "the journal has no cycles";
    }

    void note_overlaps() const {
        const std::uint64_t overlaps = execution_.overlaps();
        if (overlaps == 0) return;
        const JournaledCycle& first = execution_.first_overlap();
        const std::string times = overlaps == 1 ? "once" : fmt::format("{} times", overlaps);
        note(options_,
             fmt::format("functions that share state in two threads ran at the same time {}, "
                         "first in cycle {} of '{}' at {:.6f} s; what one read of the other there "
                         "is unknown",
                         times, first.number, first.thread, seconds(first.time_ns)));
    }

    /// The journal has ended before what the user waits for.
    void note_end() const {
        if (!until_.empty()) {
            note(options_, fmt::format("--until {}: the journal ends before it", options_.until));
        }
        if (!condition_.empty()) {
            note(options_, fmt::format("--break '{}': it holds in no cycle of the journal",
                                       options_.break_condition));
        }
    }

    bool has_gap() const {
        return std::ranges::any_of(file_.threads(),
                                   [](const auto& entry) { return !entry.second.gap().empty(); });
    }

    /// The text and, where a recording was compared, how many values.
    std::string verdict(std::string text) const {
        const auto compared = machine_.compared();
        if (!compared) return text;
        return fmt::format("{}, {} compared", text, counted(*compared, "value"));
    }

    /// Prints the values of --show. Returns false after a note when the machine has no such name.
    bool show() {
        const Model& model = machine_.session().model();
        const std::vector<std::string> patterns = names_in(options_.show);
        if (const std::string problem = unknown_value(model, patterns); !problem.empty()) {
            note(options_, "--show: " + problem);
            return false;
        }
        const std::vector<std::string> names = named_values(model, patterns);
        const auto readings = machine_.session().values().read(names);
        std::string text;
        for (std::size_t i = 0; i < names.size(); ++i) {
            const std::string value =
                readings[i] ? format_value(readings[i]->type, readings[i]->value) : "(a port)";
            text += fmt::format("{} {}\n", names[i], value);
        }
        return print(text);
    }

    const ReplayOptions& options_;
    JournalFile& file_;
    const JournalPosition& until_;
    const ValueCondition& condition_;
    ReplayedMachine machine_;
    ReExecution& execution_;
    ReplayRecording recording_;
};

/// Several ones are parts of a ring.
bool has_only_journals(const std::vector<std::string>& words) {
    if (words.size() < 2) return words.size() == 1;
    return std::ranges::all_of(words, [](const std::string& path) {
        return path.ends_with(".mcap") || path.ends_with(".mcap.part");
    });
}

/// Returns why a file must not be written; "" when it may.
std::string target_problem(const ReplayOptions& options, const std::string& path) {
    const bool is_source = std::ranges::any_of(options.words, [&path](const std::string& journal) {
        std::error_code error;
        return std::filesystem::equivalent(path, journal, error);
    });
    return is_source ? fmt::format("'{}' is the journal itself; name another file", path) : "";
}

std::string record_problem(const ReplayOptions& options) {
    std::string problem = ReplayRecording::problem(options);
    if (!problem.empty()) return problem;
    problem = target_problem(options, options.record);
    return problem.empty() ? "" : "--record: " + problem;
}

/// Returns why the options of the panel are invalid; "" when they are valid.
std::string panel_problem(const ReplayOptions& options) {
    if (!options.panel) return options.name.empty() ? "" : "--name is for --panel";
    const bool has_output = !options.show.empty() || !options.record.empty() ||
                            !options.as_test.empty() || !options.cut.empty();
    if (options.shell || has_output) {
        return "--panel excludes --shell, --show, --record, --as-test and --cut; leave them out";
    }
    return "";
}

std::string cut_problem(const ReplayOptions& options) {
    if (!options.edits.empty() || !options.netlist.empty() || options.shell) {
        return "it is for the journal as it is: without --edit, --netlist and --shell";
    }
    if (options.until.empty() && options.break_condition.empty()) {
        return "name the moment with --until or --break";
    }
    if (!options.cut.ends_with(".mcap")) {
        return fmt::format("unknown format of '{}'; name the file .mcap", options.cut);
    }
    if (options.cut == options.record) {
        return fmt::format("'{}' is the file of --record; name another one", options.cut);
    }
    if (std::string problem = target_problem(options, options.cut); !problem.empty()) {
        return problem;
    }
    const std::string problem = component_heap::track();
    return problem.empty() ? "" : "the state of the machine cannot be written: " + problem;
}

/// Returns what to name in place of a missing file whose unfinished part is beside it; "": nothing.
std::string unfinished_part(const std::string& path) {
    std::error_code ignored;
    const std::string part = path + ".part";
    const bool is_beside =
        !std::filesystem::exists(path, ignored) && std::filesystem::exists(part, ignored);
    if (!is_beside) return "";
    return fmt::format(
        "; '{}' is there, of a machine that runs or did not end in good order: name "
        "that one",
        part);
}

/// What the options ask for.
struct ReplayPlan {
    JournalPosition until;
    ValueCondition condition;
    WhatIf change;

    /// Parses the options. Returns why they are invalid, or "".
    std::string parse(const ReplayOptions& options) {
        if (!has_only_journals(options.words)) {
            return "--exact takes one journal and no netlist: the journal has the edits";
        }
        if (!options.until.empty() && !until.parse(options.until)) {
            return fmt::format("--until: invalid cycle or time '{}'; write 12000, 3.5s or 250ms",
                               options.until);
        }
        if (!options.break_condition.empty() && !condition.parse(options.break_condition)) {
            return fmt::format("--break: invalid condition '{}'; {}", options.break_condition,
                               ValueCondition::form);
        }
        if (std::string problem = panel_problem(options); !problem.empty()) return problem;
        if (std::string problem = record_problem(options); !problem.empty()) return problem;
        if (std::string problem = change.parse(options); !problem.empty()) return problem;
        return output_problem(options);
    }

private:
    /// Returns why the journal cannot be written as a test or be cut, or "".
    std::string output_problem(const ReplayOptions& options) const {
        const bool is_as_test = !options.as_test.empty();
        if (is_as_test && (!change.empty() || options.shell)) {
            return "--as-test is for the journal as it is: without --edit, --netlist and --shell";
        }
        if (!options.cut.empty()) {
            const std::string problem = cut_problem(options);
            if (!problem.empty()) return "--cut: " + problem;
        }
        if (is_as_test && is_occupied(options.as_test)) {
            return fmt::format(
                "--as-test: '{}' exists already; name another folder, or "
                "remove it",
                options.as_test);
        }
        return "";
    }
};

/// Opens the journal, or the parts of a ring, and prints the notes about it. Returns false after
/// printing the reason.
bool open_journal(const ReplayOptions& options, JournalFile& file) {
    const bool is_one_file = options.words.size() == 1;
    const bool is_open = is_one_file ? file.open(options.words[0]) : file.open(options.words);
    if (!is_open) {
        fail(options, fmt::format("cannot execute '{}': {}{}", options.words[0], file.problem(),
                                  unfinished_part(options.words[0])));
        return false;
    }
    for (const std::string& text : file.notes()) {
        note(options, text);
    }
    return true;
}

/// Executes the journal to its end and prints the result. Returns the exit status.
int execute_journal(const ReplayOptions& options, JournalFile& file, const ReplayPlan& plan) {
    std::optional<ValueDifference> difference;
    int status = 0;
    {
        ExactReplay replay(options, file, plan.until, plan.condition, plan.change);
        status = replay.run();
        difference = replay.difference();
    }  // the machine is gone: inputs_of() executes the journal on another one
    if (difference && !print(inputs_of(options, *difference))) return 1;
    return status;
}

}  // namespace

int run_exact_replay(const ReplayOptions& options) {
    ReplayPlan plan;
    if (const std::string problem = plan.parse(options); !problem.empty()) {
        return fail(options, problem);
    }
    JournalFile file;
    if (!open_journal(options, file)) return 1;
    const JournaledProgram program(options, file);
    if (const int status = program.check(); status != 0) return status;
    program.name_readers();
    if (options.panel) {
        program.name_uncopied();
        return run_replay_panel(options, file, plan.change);
    }
    if (options.shell) {
        program.name_uncopied();
        return run_replay_shell(options, file, plan.change);
    }
    return execute_journal(options, file, plan);
}

}  // namespace hal::tools
