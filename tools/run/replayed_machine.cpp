// SPDX-License-Identifier: MIT
#include "run/replayed_machine.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <unistd.h>
#include <utility>

#include "commands/table.hpp"
#include "run/replay_note.hpp"
#include "run/sim_summary.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {
namespace {

constexpr std::uint64_t compare_every = 256;  // cycles

std::string fastest_thread(JournalFile& file) {
    const auto& threads = file.threads();
    const auto fastest = std::ranges::min_element(
        threads, {}, [](const auto& entry) { return entry.second.period_ns; });
    return fastest == threads.end() ? "" : fastest->second.name;
}

/// The journal has the edits.
const ReplayOptions& without_netlists(const ReplayOptions& options, ReplayOptions& copy) {
    copy = options;
    copy.words.clear();
    return copy;
}

}  // namespace

ReplayedMachine::ReplayedMachine(const ReplayOptions& options, JournalFile& file, Compare compare,
                                 WhatIf change, bool is_copied)
    : options_(options),
      file_(file),
      with_values_(compare == Compare::values),
      fastest_(fastest_thread(file)),
      execution_(file),
      machine_(without_netlists(options, machine_options_), fmt::format("replay-{}", ::getpid()),
               true, {.schedule = &execution_, .is_copied = is_copied}),
      change_(std::move(change)) {
    execution_.attach(
        machine_.session,
        [](Transaction& transaction, const Command& command, Diagnostics& diagnostics) {
        apply_edit(transaction, command, diagnostics);
    }, [this](const std::vector<std::string>& names) { begin_values(names); });
}

void ReplayedMachine::begin_values(const std::vector<std::string>& names) {
    if (!with_values_) return;
    values_ = std::make_unique<ValueCheck>(options_.words[0], file_.unix_offset_ns());
    if (values_->problem().empty()) {
        values_->begin(machine_.session, names);
    }
    if (!values_->problem().empty()) {
        note(options_, "the recorded values are not compared: " + values_->problem());
    }
}

bool ReplayedMachine::advance() {
    if (change_.is_due(execution_.newest(), fastest_) && !make_change()) return false;
    if (execution_.advance() != ReExecution::State::goes_on) return false;
    if (!values_ || ++uncompared_ < compare_every) return true;
    uncompared_ = 0;
    return values_->compare() || change_.done();
}

/// Returns false when something differs before it, or when it is not possible.
bool ReplayedMachine::make_change() {
    if (!change_.netlist().empty() && !execution_.at_rest()) return true;  // a few cycles later
    if (!compare()) return false;
    change_problem_ = change_.apply(machine_.session, execution_, file_);
    if (!change_problem_.empty()) return false;
    execution_.accept_differences();
    execution_.ignore_state();
    return true;
}

std::string ReplayedMachine::consequences() const {
    if (!change_.done() || !change_problem_.empty()) return "";
    const JournaledCycle& since = change_.since();
    std::string text = fmt::format("edited after cycle {} of '{}' at {:.6f} s\n", since.number,
                                   since.thread, seconds(since.time_ns));
    for (const std::string& sentence : change_.netlist().not_applied()) {
        text += fmt::format("not changed: {}\n", sentence);
    }
    // with other functions, other ones are measured in a cycle: their times differ first
    const bool names_value = change_.netlist().empty() && values_ && values_->difference();
    if (names_value) {
        text += value_text(*values_->difference(), "first value that differs");
    }
    if (const auto& diverged = execution_.diverged()) {
        text += fmt::format("first cycle that differs: {} of '{}' at {:.6f} s\n", diverged->number,
                            diverged->thread, seconds(diverged->time_ns));
        const std::string inputs = outside_inputs(file_);
        text += inputs.empty()
                    ? "the journal has no input from outside of the machine but the time: what "
                      "follows is computed\n"
                    : fmt::format(
                          "from this cycle on, inputs no longer belong to the outputs: "
                          "{}\n",
                          inputs);
    } else {
        text += "no cycle differs from the journaled ones\n";
    }
    return text;
}

std::optional<std::uint64_t> ReplayedMachine::compared() const {
    if (!values_) return std::nullopt;
    return values_->values();
}

const ValueDifference* ReplayedMachine::value_difference() const {
    const bool has_one = values_ && values_->difference() && !change_.done();
    return has_one ? &*values_->difference() : nullptr;
}

std::string ReplayedMachine::difference() const {
    if (const ValueDifference* const at = value_difference())
        return value_text(*at, "first difference");
    if (execution_.state() != ReExecution::State::differs) return "";
    const JournaledCycle& at = execution_.newest();
    if (const std::string& link = execution_.differing_link(); !link.empty()) {
        return fmt::format(
            "first difference: cycle {} of thread '{}' at {:.6f} s sends other frames on {}\n",
            at.number, at.thread, seconds(at.time_ns), link);
    }
    const bool reads = execution_.match() == CycleInputs::Match::other_reads;
    return fmt::format(
        "first difference: cycle {} of thread '{}' at {:.6f} s {}\n{}", at.number, at.thread,
        seconds(at.time_ns),
        reads ? "reads another number of inputs" : "has values with another checksum",
        values_ ? "no recorded value of this cycle or before differs\n"
                : "to have the value named, write the journal with: --values '*'\n");
}

std::string ReplayedMachine::later_difference() {
    constexpr std::uint64_t max_cycles = 20'000;
    if (!values_ || execution_.state() != ReExecution::State::differs || value_difference()) {
        return "";
    }
    execution_.pass_difference();
    const std::uint64_t end = execution_.cycles() + max_cycles;
    while (execution_.cycles() < end && advance()) {
    }
    compare();
    const ValueDifference* const at = value_difference();
    return at ? value_text(*at, "first recorded value that differs") : "";
}

std::string ReplayedMachine::value_text(const ValueDifference& at, const char* title) const {
    const auto text = [&at](std::uint64_t word) {
        return format_exact(at.type, hal_value{.raw = word});
    };
    const std::string others = at.others == 0 ? ""
                                              : fmt::format(", and {} of the same cycle",
                                                            counted(at.others, "further value"));
    return fmt::format(
        "{}: '{}'{} in cycle {} of thread '{}': {} instead of "
        "{}{}\n",
        title, at.name, function_text(at.name), at.cycle, at.thread, text(at.executed),
        text(at.recorded), others);
}

const Pin* ReplayedMachine::writer(const std::string& name) const {
    const Model& model = machine_.session.model();
    const Pin* const pin = model.find_pin(name);
    const Signal* const signal = pin ? pin->signal : model.find_signal(name);
    const Pin* const from = signal && signal->writer ? signal->writer : pin;
    return from && from->instance ? from : nullptr;
}

const LoadedFunction* ReplayedMachine::function_of(const std::string& name) const {
    const Pin* const pin = writer(name);
    if (!pin) return nullptr;
    if (pin->function) return pin->function;
    const auto& functions = pin->instance->functions;
    return functions.empty() ? nullptr : functions.front();
}

/// Returns " ('x' of pid, function 'x.do-pid-calcs')" of what computes the value.
std::string ReplayedMachine::function_text(const std::string& name) const {
    const Pin* const pin = writer(name);
    if (!pin) return "";
    const Instance& instance = *pin->instance;
    std::string text = fmt::format(" ('{}' of {}", instance.name, instance.component->name);
    if (const LoadedFunction* const function = function_of(name)) {
        text += fmt::format(", function '{}'", function->name);
    }
    return text + ")";
}

}  // namespace hal::tools
