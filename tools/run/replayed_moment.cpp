// SPDX-License-Identifier: MIT
#include "run/replayed_moment.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fmt/core.h>
#include <limits>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

#include "cli/output.hpp"
#include "commands/json_text.hpp"
#include "commands/table.hpp"
#include "control/connection.hpp"
#include "machine/report/crash.hpp"
#include "run/moment_samples.hpp"
#include "run/replay_note.hpp"
#include "run/replayed_traces.hpp"
#include "text/numbers.hpp"

namespace hal::tools {
namespace {

/// Returns the commands of an edit on one line.
std::string entry_text(const ExecutionEntry& entry) {
    constexpr std::size_t max_length = 200;
    std::string text;
    for (const std::vector<std::string>& command : entry.commands) {
        text += text.empty() ? "" : "; ";
        for (std::size_t i = 0; i < command.size(); ++i) {
            text += (i == 0 ? "" : " ") + command[i];
        }
        if (text.size() > max_length) return text.substr(0, max_length) + " …";
    }
    return text;
}

constexpr auto min_spacing = std::chrono::milliseconds(20);
constexpr int max_share = 8;  // the copies take an eighth of the time at most
constexpr std::uint64_t look_every = 64;  // cycles: at the clock and at the front

}  // namespace

ReplayedMoment::ReplayedMoment(const ReplayOptions& options, JournalFile& file, Keyframes& frames,
                               const WhatIf& change, int socket)
    : options_(options),
      file_(file),
      frames_(frames),
      socket_(socket),
      machine_(options, file, ReplayedMachine::Compare::values, change, true),
      spacing_(min_spacing) {
    if (file.begin()) {  // what is before it was made in another machine
        entries_ = file.begin()->entries;
        has_run_ = true;
    }
}

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

void ReplayedMoment::send(Packet kind, std::string_view text) {
    std::string packet;
    do {
        const std::string_view part = text.substr(0, max_packet);
        packet.assign(1, static_cast<char>(kind)).append(part);
        while (::send(socket_, packet.data(), packet.size(), MSG_NOSIGNAL) < 0 && errno == EINTR) {
        }
        text.remove_prefix(part.size());
    } while (!text.empty());
}

void ReplayedMoment::answer(int status, std::string_view data) {
    if (!data.empty()) {
        send(Packet::data, data);
    }
    send(Packet::end, std::to_string(status));
}

void ReplayedMoment::carry_out(const Errand& errand) {
    interrupted_ = false;
    status_ = errand.status;
    marks_ = errand.marks;
    frontier_ = errand.frontier;
    sent_ = std::chrono::steady_clock::now();
    switch (errand.kind) {
    case Errand::Kind::command: return answer(execute(errand.text));
    case Errand::Kind::complete: return complete(errand);
    case Errand::Kind::request: return request(errand);
    default: return move(errand);
    }
}

void ReplayedMoment::move(Errand errand) {
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
    case Errand::Kind::run_to_fault: run_to_fault(); break;
    case Errand::Kind::samples: samples(errand); break;
    case Errand::Kind::sample: sample(errand); break;
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
    note_marks(goes_on);
    if (!goes_on) return false;
    if (cycles() % look_every != 0) return true;
    if (!frames_.front_lives()) end_process(0);
    send_progress();
    if (std::chrono::steady_clock::now() - kept_ >= spacing_) {
        keep();
    }
    return !resumed_;
}

void ReplayedMoment::resume(const Errand& errand, std::uint64_t max_cycles) {
    Errand& next = frames_.errand<Errand>();
    next = errand;
    next.marks = marks_;
    next.frontier = frontier_;
    if (machine_.execution().has_outside()) {
        machine_.execution().finish();
        machine_.session().shut_down();  // what it has opened is opened again
    }
    frames_.resume([max_cycles](const KeyframeMark& mark) { return mark.cycles <= max_cycles; });
    say("cannot go back: no copy of this process could be made (too many processes, or not "
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
        say(fmt::format("break: the machine has no '{}'\n", condition.name()));
    }
    tell();
}

void ReplayedMoment::step(std::uint64_t count, const std::string& thread) {
    constexpr std::uint64_t max = std::numeric_limits<std::uint64_t>::max();
    const std::uint64_t target = cycles() + std::min(count, max - cycles());
    const auto goes_on = [&] { return thread.empty() ? cycles() < target : count > 0; };
    while (goes_on() && next()) {
        if (machine_.execution().newest().thread == thread) {
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
    std::uint64_t before = cycles();
    while (cycles() < target) {
        before = cycles();
        if (!next()) break;
    }
    if (resumed_) return;
    if (cycles() > target) return seek(before, condition);  // an edit executes several cycles
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
        const bool is_earlier = cycles() < errand.limit;  // an edit executes several cycles
        if (suits && is_earlier) {
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
            say(fmt::format("break: the machine has no '{}'\n", condition.name()));
        }
        say(condition.empty() ? "no earlier cycle of this thread\n"
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
        say(fmt::format("break: the machine has no '{}' in this cycle\n", condition.name()));
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
        say(fmt::format("scope: {}\n", problem));
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
    say(traces.drawn(problem));
    if (!problem.empty()) {
        say(fmt::format("scope: {}\n", problem));
        status_ = 1;
    }
    seek(errand.limit);
}

void ReplayedMoment::run_to_fault() {
    const std::uint64_t before = newest_fault_;
    while (next()) {
        if (newest_fault_ == before) continue;
        say(fault_text_ + "\n");
        return tell();
    }
    if (!resumed_) {
        tell();
    }
}

/// The front has checked that the request only reads.
void ReplayedMoment::request(const Errand& errand) {
    std::string line;
    std::string part(max_packet, '\0');
    while (line.size() < errand.count) {
        const ssize_t bytes = ::recv(socket_, part.data(), part.size(), 0);
        if (bytes < 0 && errno == EINTR) continue;
        if (bytes <= 0) return;
        line.append(part, 0, static_cast<std::size_t>(bytes));
    }
    Connection connection(machine_.host().shell, ::getpid());
    std::string reply;
    if (errand.json) {
        connection.handle(R"({"options":{"json":true}})", reply);
        reply.clear();
    }
    connection.handle(line, reply, true);
    answer(0, reply);
}

void ReplayedMoment::samples(Errand errand) {
    const MomentSamples rows(machine_.session(), errand.text, machine_.fastest());
    if (!rows.problem().empty()) return answer(1, rows.problem());
    errand.kind = Errand::Kind::sample;
    errand.limit = cycles();
    errand.time_ns = max_time_ns_;
    const std::int64_t begin_ns = max_time_ns_ - errand.before_ns;
    const auto before = [begin_ns](const KeyframeMark& mark) {
        return mark.cycles == 0 || mark.time_ns < begin_ns;
    };
    if (before(mark())) return sample(errand);
    resume(errand, frames_.newest(before).value_or(0));
}

/// Executes the cycles around the moment, answers their rows, and goes back to it.
void ReplayedMoment::sample(const Errand& errand) {
    const std::int64_t begin_ns = errand.time_ns - errand.before_ns;
    const std::int64_t end_ns = errand.time_ns + errand.after_ns;
    bool goes_on = true;
    // nothing is loaded before the first cycle
    while ((max_time_ns_ < begin_ns || cycles() == 0) && goes_on) {
        goes_on = next();
    }
    if (resumed_) return;
    MomentSamples rows(machine_.session(), errand.text, machine_.fastest());
    rows.add(machine_.execution().newest());
    while (goes_on && max_time_ns_ < end_ns) {
        goes_on = next();
        if (goes_on) {
            rows.add(machine_.execution().newest());
        }
    }
    if (resumed_) return;
    send(Packet::data, rows.answer(max_time_ns_));
    seek(errand.limit);
}

// --- the time line ---

void ReplayedMoment::note_marks(bool goes_on) {
    if (!marks_) return;
    const bool is_sent = cycles() > frontier_ || !goes_on;
    note_entries(is_sent);
    note_switch(is_sent);
    note_faults(is_sent);
    frontier_ = std::max(frontier_, cycles());
}

/// Edits before the functions were started are not marked: they load the machine.
void ReplayedMoment::note_entries(bool is_sent) {
    const std::size_t before = std::exchange(entries_, machine_.execution().entries());
    for (std::size_t i = before; i < entries_; ++i) {
        const ExecutionEntry& entry = file_.entries()[i];
        const bool is_edit = entry.kind == ExecutionEntry::Kind::edit;
        if (is_sent && is_edit && has_run_) {
            send_mark("edit", entry_text(entry));
        }
    }
}

void ReplayedMoment::note_switch(bool is_sent) {
    const bool runs = machine_.execution().functions_run();
    has_run_ = has_run_ || runs;
    const bool is_other = std::exchange(runs_, runs) != runs;
    const bool is_begin = cycles() <= 1 && file_.begin();  // the state has it
    if (is_sent && is_other && !is_begin) {
        send_mark(runs ? "start" : "stop", runs ? "functions started" : "functions stopped");
    }
}

void ReplayedMoment::note_faults(bool is_sent) {
    const Reports& reports = machine_.session().reports();
    const std::uint64_t count = reports.fault_count();
    if (std::exchange(fault_count_, count) == count) return;
    for (const FaultRecord& record : reports.faults()) {
        if (record.number <= newest_fault_) continue;
        newest_fault_ = record.number;
        fault_text_ = record.sentence;
        if (is_sent) {
            send_mark("fault", record.sentence);
        }
    }
}

void ReplayedMoment::send_mark(const char* kind, const std::string& text) {
    send(Packet::mark, json_text({{"kind", kind},
                                  {"cycles", cycles()},
                                  {"time_ns", machine_.execution().newest().time_ns},
                                  {"text", text}}));
}

/// `text`: why the execution cannot go on, or "".
void ReplayedMoment::send_position(const std::string& text, bool is_moving) {
    const JournaledCycle& newest = machine_.execution().newest();
    send(Packet::now,
         json_text({{"cycles", cycles()},
                    {"cycle", newest.number},
                    {"thread", newest.thread},
                    {"fastest_cycle", fastest_number_},
                    {"time_ns", newest.time_ns},
                    {"frontier", frontier_},
                    {"edits", edits()},
                    {"moving", is_moving},
                    {"ended", machine_.execution().state() != ReExecution::State::goes_on},
                    {"running", runs_},
                    {"copied", !machine_.execution().has_outside()},
                    {"text", position_text()},
                    {"state", text}}));
}

/// From time to time while an errand takes long.
void ReplayedMoment::send_progress() {
    constexpr auto interval = std::chrono::milliseconds(100);
    const auto now = std::chrono::steady_clock::now();
    if (!marks_ || now - sent_ < interval) return;
    sent_ = now;
    send_position("", true);
}

/// Returns how many changes made the machine what it is: of the journal, and by --edit or --netlist.
std::uint64_t ReplayedMoment::edits() const {
    return machine_.execution().edits() + (machine_.change().done() ? 1 : 0);
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

std::string ReplayedMoment::position_text() const {
    if (cycles() == 0) return "before the first cycle";
    const JournaledCycle& newest = machine_.execution().newest();
    return fmt::format("cycle {} of '{}' at {:.6f} s", newest.number, newest.thread,
                       seconds(newest.time_ns));
}

/// Prints where the machine is, and answers. `found`: the name whose condition holds.
void ReplayedMoment::tell(const std::string& found) {
    std::string text = position_text();
    if (!found.empty()) {
        if (const auto reading = machine_.session().values().read({found}).front()) {
            text += fmt::format(": {} {}", found, format_value(reading->type, reading->value));
        }
    }
    const std::string state = state_text();
    say(text + "\n" + state);
    if (marks_) {
        send_position(state, false);
    }
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
    if (!row->only_reads()) {
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
