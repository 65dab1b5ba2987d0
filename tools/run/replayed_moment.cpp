// SPDX-License-Identifier: MIT
#include "run/replayed_moment.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fmt/core.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

#include "cli/output.hpp"
#include "commands/table.hpp"
#include "machine/report/crash.hpp"
#include "run/replay_note.hpp"
#include "run/replayed_traces.hpp"
#include "text/numbers.hpp"

namespace hal::tools {
namespace {

constexpr auto min_spacing = std::chrono::milliseconds(20);
constexpr int max_share = 8;  // the copies take an eighth of the time at most
constexpr std::uint64_t look_every = 64;  // cycles: at the clock and at the front

}  // namespace

ReplayedMoment::ReplayedMoment(const ReplayOptions& options, JournalFile& file, Keyframes& frames,
                               const WhatIf& change, int socket)
    : options_(options),
      frames_(frames),
      socket_(socket),
      machine_(options, file, ReplayedMachine::Compare::values, change, true),
      spacing_(min_spacing) {}

void ReplayedMoment::serve() {
    keep();  // where all cycles can be reached from
    for (Errand errand;;) {
        if (std::exchange(resumed_, false)) {
            errand = frames_.errand<Errand>();
        } else if (!receive(errand)) {
            break;
        }
        carry_out(errand);
    }
    const auto lock = machine_.session().lock();
    machine_.execution().finish();
    machine_.session().shut_down();
    end_process(0);
}

/// Returns false when the front has ended.
bool ReplayedMoment::receive(Errand& errand) {
    pollfd events[] = {{socket_, POLLIN, 0}, {frames_.life(), POLLIN, 0}};
    for (;;) {
        if (::poll(events, 2, -1) < 0) continue;
        if (events[1].revents != 0) return false;
        if (events[0].revents == 0) continue;
        return ::recv(socket_, static_cast<void*>(&errand), sizeof errand, 0) ==
               static_cast<ssize_t>(sizeof errand);
    }
}

void ReplayedMoment::answer(int status, const std::string& text) {
    const std::string message = fmt::format("{}\n{}", status, text);
    while (::send(socket_, message.data(), message.size(), MSG_NOSIGNAL) < 0 && errno == EINTR) {
    }
}

void ReplayedMoment::carry_out(Errand errand) {
    interrupted_ = false;
    status_ = errand.status;
    if (errand.kind == Errand::Kind::command) {
        answer(execute(errand.text));
        return;
    }
    if (errand.kind == Errand::Kind::complete) {
        complete(errand);
        return;
    }
    const auto lock = machine_.session().lock();
    ValueCondition condition;
    condition.parse(errand.condition);
    switch (errand.kind) {
    case Errand::Kind::run: run(condition); break;
    case Errand::Kind::step: step(errand.count, errand.thread); break;
    case Errand::Kind::seek: seek(errand.count, errand.condition); break;
    case Errand::Kind::back:
        if (condition.empty() && errand.thread[0] == '\0') {
            seek(cycles() - std::min(errand.count, cycles()));
            break;
        }
        errand.kind = Errand::Kind::search;
        errand.limit = cycles();
        search(errand);
        break;
    case Errand::Kind::search: search(errand); break;
    case Errand::Kind::position: go_to(errand); break;
    case Errand::Kind::check: check(condition); break;
    case Errand::Kind::scope: scope(errand); break;
    case Errand::Kind::draw: draw(errand); break;
    default: tell();
    }
}

KeyframeMark ReplayedMoment::mark() const { return {cycles(), fastest_number_, max_time_ns_}; }

void ReplayedMoment::keep() {
    if (machine_.execution().has_outside()) return;
    const auto begun = std::chrono::steady_clock::now();
    resumed_ = frames_.keep(mark());
    kept_ = std::chrono::steady_clock::now();
    if (resumed_) {
        machine_.execution().continue_in_copy();
    } else {
        spacing_ = std::max<std::chrono::nanoseconds>(min_spacing, max_share * (kept_ - begun));
    }
}

/// Executes a cycle. Returns false when the errand has to end, or this process has another one.
bool ReplayedMoment::next() {
    if (frames_.interrupted()) {
        interrupted_ = true;
        return false;
    }
    const std::uint64_t before = cycles();
    const bool goes_on = machine_.advance();
    const JournaledCycle& newest = machine_.execution().newest();
    if (cycles() != before) {
        max_time_ns_ = std::max(max_time_ns_, newest.time_ns);
        if (newest.thread == machine_.fastest()) {
            fastest_number_ = newest.number;
        }
    }
    if (!goes_on) return false;
    if (cycles() % look_every != 0) return true;
    if (!frames_.front_lives()) end_process(0);
    if (std::chrono::steady_clock::now() - kept_ >= spacing_) {
        keep();
    }
    return !resumed_;
}

void ReplayedMoment::resume(const Errand& errand, std::uint64_t max_cycles) {
    frames_.errand<Errand>() = errand;
    if (machine_.execution().has_outside()) {
        machine_.execution().finish();
        machine_.session().shut_down();  // what it has opened is opened again
    }
    frames_.resume([max_cycles](const KeyframeMark& mark) { return mark.cycles <= max_cycles; });
    print(
        "cannot go back: no copy of this process could be made (too many processes, or not "
        "enough memory)\n");
    answer(1);
}

void ReplayedMoment::run(const ValueCondition& condition) {
    bool held = !condition.empty() && condition.holds(machine_.session());
    while (next()) {
        if (condition.empty()) continue;
        const bool holds = condition.holds(machine_.session());
        if (holds && !held) return tell(condition.name());
        held = holds;
    }
    if (resumed_) return;
    if (condition.is_unknown(machine_.session())) {
        print(fmt::format("break: the machine has no '{}'\n", condition.name()));
    }
    tell();
}

void ReplayedMoment::step(std::uint64_t count, const std::string& thread) {
    while (count > 0 && next()) {
        if (thread.empty() || machine_.execution().newest().thread == thread) {
            --count;
        }
    }
    if (!resumed_) {
        tell();
    }
}

void ReplayedMoment::seek(std::uint64_t target, const std::string& condition) {
    const auto nearer =
        frames_.newest([target](const KeyframeMark& mark) { return mark.cycles <= target; });
    if (target < cycles() || (nearer && *nearer > cycles())) {
        Errand errand;
        errand.kind = Errand::Kind::seek;
        errand.count = target;
        errand.status = status_;
        condition.copy(errand.condition, sizeof errand.condition - 1);
        return resume(errand, target);
    }
    while (cycles() < target && next()) {
    }
    if (resumed_) return;
    ValueCondition searched;
    searched.parse(condition);
    tell(searched.name());
}

/// Executes from a keyframe up to the limit, and notes each cycle that is searched for. When there
/// are too few, continues with the keyframe before.
void ReplayedMoment::search(const Errand& errand) {
    if (errand.limit == 0 || cycles() >= errand.limit) {
        if (errand.limit == 0 || cycles() == 0) return tell();
        return resume(errand, errand.limit - 1);
    }
    ValueCondition condition;
    condition.parse(errand.condition);
    const std::uint64_t begin = cycles();
    std::vector<std::uint64_t> found;
    bool held = !condition.empty() && condition.holds(machine_.session());
    while (cycles() + 1 < errand.limit && next()) {
        const bool holds = !condition.empty() && condition.holds(machine_.session());
        const bool suits = condition.empty() ? machine_.execution().newest().thread == errand.thread
                                             : holds && !held;
        if (suits) {
            found.push_back(cycles());
        }
        held = holds;
    }
    if (resumed_) return;
    if (interrupted_) return tell();
    if (found.size() >= errand.count) {
        return seek(found[found.size() - errand.count], errand.condition);
    }
    if (begin == 0) {
        if (condition.is_unknown(machine_.session())) {
            print(fmt::format("break: the machine has no '{}'\n", condition.name()));
        }
        print(condition.empty() ? "no earlier cycle of this thread\n"
                                : "the condition begins to hold in no earlier cycle\n");
        return seek(0);
    }
    Errand rest = errand;
    rest.count -= found.size();
    rest.limit = begin + 1;
    resume(rest, begin - 1);
}

void ReplayedMoment::go_to(const Errand& errand) {
    JournalPosition position;
    position.parse(errand.text);
    const auto before = [&position](const KeyframeMark& mark) {
        return mark.cycles == 0 || !position.reached(mark.fastest, mark.time_ns);
    };
    const auto nearest = frames_.newest(before);
    const bool is_behind = !before(mark());
    if (nearest && (is_behind || *nearest > cycles())) return resume(errand, *nearest);
    while (next()) {
        if (position.reached(machine_.execution().newest(), machine_.fastest())) return tell();
    }
    if (!resumed_) {
        tell();
    }
}

/// A name that is unknown now may be that of an instance that is loaded later; before the first
/// cycle nothing is loaded.
void ReplayedMoment::check(const ValueCondition& condition) {
    if (cycles() != 0 && condition.is_unknown(machine_.session())) {
        print(fmt::format("break: the machine has no '{}' in this cycle\n", condition.name()));
    }
    answer(0);
}

void ReplayedMoment::scope(Errand errand) {
    ScopeCommand command;
    std::string problem = command.parse(errand.text);
    if (problem.empty()) {
        const ReplayedTraces traces(machine_.session(), command, max_time_ns_);
        problem = traces.problem();
        // at the begin of the picture a pattern may match less
        const std::string text = command.text_for(traces.names());
        if (text.size() < sizeof errand.text) {
            std::memcpy(errand.text, text.c_str(), text.size() + 1);
        } else if (problem.empty()) {
            problem = "the names are too long";
        }
    }
    if (!problem.empty()) {
        print(fmt::format("scope: {}\n", problem));
        return answer(1);
    }
    errand.kind = Errand::Kind::draw;
    errand.limit = cycles();
    errand.time_ns = max_time_ns_;
    const std::int64_t begin_ns = max_time_ns_ - command.pre_ns;
    const auto before = [begin_ns](const KeyframeMark& mark) {
        return mark.cycles == 0 || mark.time_ns < begin_ns;
    };
    if (before(mark())) return draw(errand);
    resume(errand, frames_.newest(before).value_or(0));
}

/// Executes the cycles around the moment, and goes back to it.
void ReplayedMoment::draw(const Errand& errand) {
    ScopeCommand command;
    command.parse(errand.text);
    const std::int64_t begin_ns = errand.time_ns - command.pre_ns;
    bool goes_on = true;
    while (max_time_ns_ < begin_ns && goes_on) {
        goes_on = next();
    }
    if (resumed_) return;
    // nothing is loaded before the first cycle
    if (cycles() == 0) {
        goes_on = next();
    }
    if (resumed_) return;
    ReplayedTraces traces(machine_.session(), command, errand.time_ns);
    traces.sample(max_time_ns_);
    while (goes_on && max_time_ns_ < traces.end_ns()) {
        goes_on = next();
        traces.sample(max_time_ns_);
    }
    if (resumed_) return;
    std::string problem;
    print(traces.drawn(problem));
    if (!problem.empty()) {
        print(fmt::format("scope: {}\n", problem));
        status_ = 1;
    }
    seek(errand.limit);
}

// --- what is printed ---

std::string ReplayedMoment::state_text() {
    if (interrupted_) return "interrupted\n";
    machine_.compare();
    if (std::string text = machine_.difference(); !text.empty()) return text;
    if (!machine_.change_problem().empty()) return "--edit: " + machine_.change_problem() + "\n";
    const ReExecution& execution = machine_.execution();
    switch (execution.state()) {
    case ReExecution::State::complete:
        return "the journal has no further cycle\n" + machine_.consequences();
    case ReExecution::State::ends: return "the journal ends: " + execution.reason() + "\n";
    case ReExecution::State::fails: return execution.reason() + "\n";
    default: return "";
    }
}

/// Prints where the machine is, and answers. `found`: the name whose condition holds.
void ReplayedMoment::tell(const std::string& found) {
    const JournaledCycle& newest = machine_.execution().newest();
    std::string text = "before the first cycle";
    if (cycles() > 0) {
        text = fmt::format("cycle {} of '{}' at {:.6f} s", newest.number, newest.thread,
                           seconds(newest.time_ns));
    }
    if (!found.empty()) {
        if (const auto reading = machine_.session().values().read({found}).front()) {
            text += fmt::format(": {} {}", found, format_value(reading->type, reading->value));
        }
    }
    const std::string state = state_text();
    print(text + "\n" + state);
    const bool good =
        machine_.difference().empty() && machine_.execution().state() != ReExecution::State::fails;
    answer(std::max(exit_code(good), status_));
}

int ReplayedMoment::execute(const std::string& line) {
    const std::string name = line.substr(0, line.find_first_of(" \t"));
    const CommandRow* const row = find_command(name);
    if (!row) {
        print(fmt::format("unknown command '{}'; type help\n", name));
        return 1;
    }
    if (!row->is_query() && !row->is_apart()) {
        const bool can_be_tried = name == "setp" || name == "sets";
        print(fmt::format(
            "'{}' is not possible: this is a moment of the past. To execute the "
            "journal with another value, type: hal replay --exact FILE --edit '{}' --at "
            "CYCLE\n",
            name, can_be_tried ? line : "setp NAME VALUE"));
        return 1;
    }
    ProcessOutput output;
    return machine_.host().shell.execute(line, output);
}

void ReplayedMoment::complete(const Errand& errand) {
    const Completion completion = machine_.host().shell.complete(errand.text, errand.count);
    std::string text = fmt::format("{}\n", completion.begin);
    for (const Candidate& candidate : completion.candidates) {
        const std::string line = candidate.text + "\t" + candidate.hint + "\n";
        if (text.size() + line.size() > (std::size_t{1} << 16)) break;
        text += line;
    }
    answer(0, text);
}

}  // namespace hal::tools
