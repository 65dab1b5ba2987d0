// SPDX-License-Identifier: MIT
#include "journal/re_execution.hpp"

#include <algorithm>
#include <charconv>
#include <fmt/core.h>
#include <string_view>
#include <utility>

#include "journal/component_heap.hpp"
#include "journal/machine_state.hpp"
#include "machine/processes/programs.hpp"
#include "machine/report/crash.hpp"
#include "machine/session.hpp"
#include "recording/mcap/bytes.hpp"

namespace hal {
namespace {

template <class Number>
Number number_of(const std::string& text) {
    Number value{};
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
}

Command command_of(const std::vector<std::string>& words) {
    Command command;
    command.name.text = words.front();
    for (std::size_t i = 1; i < words.size(); ++i) {
        command.args.emplace_back().text = words[i];
    }
    return command;
}

std::string text_of(const std::vector<std::vector<std::string>>& commands) {
    if (commands.empty()) return "an edit";
    std::string text;
    for (const std::string& word : commands.front()) {
        text += (text.empty() ? "" : " ") + word;
    }
    constexpr std::size_t max_length = 80;
    if (text.size() > max_length) {
        text = text.substr(0, max_length) + "...";
    }
    text = "'" + text + "'";
    if (commands.size() > 1) {
        text += fmt::format(" and {} more", commands.size() - 1);
    }
    return text;
}

}  // namespace

ReExecution::ReExecution(JournalFile& file) : file_(file) {
    for (auto& [number, thread] : file.threads()) {
        Cursor& cursor = cursors_[number];
        cursor.inputs = std::make_unique<CycleInputs>(static_cast<FunctionOrder*>(this));
        cursor.thread = &thread;
        load(cursor);
        if (const CycleRecord* const first = thread.record()) {
            begin_ns_ = std::min(begin_ns_.value_or(first->woke_ns), first->woke_ns);
        }
    }
    now_ns_ = begin_ns_.value_or(0);
    for (std::size_t i = 0; i < file.entries().size(); ++i) {
        for (const std::uint64_t call : file.entries()[i].calls) {
            session_calls_[call] = i;
        }
    }
    if (!file.begin()) return;
    if (const std::string problem = component_heap::track(); !problem.empty()) {
        fail(State::fails, "the state that the journal begins with cannot be restored: " + problem);
    }
}

ReExecution::~ReExecution() = default;

void ReExecution::attach(Session& session, Apply apply,
                         std::function<void(const std::vector<std::string>&)> sampled) {
    session_ = &session;
    apply_ = std::move(apply);
    sampled_ = std::move(sampled);
}

bool ReExecution::fail(State state, std::string reason) {
    if (state_ == State::goes_on) {
        state_ = state;
        reason_ = std::move(reason);
    }
    return false;
}

// --- the schedule ---

CycleInputs& ReExecution::inputs_of(std::uint32_t id) {
    std::unique_ptr<CycleInputs>& inputs = cursors_[id].inputs;
    if (!inputs) {
        inputs = std::make_unique<CycleInputs>(
            static_cast<FunctionOrder*>(this));  // of a thread without a cycle
    }
    return *inputs;
}

void ReExecution::begin(Core& core) { cursors_[core.id()].core = &core; }

void ReExecution::end(Core& core) {
    Cursor& cursor = cursors_[core.id()];
    const auto remain = [&cursor] {
        return cursor.thread && (cursor.suspended || cursor.thread->record());
    };
    while (remain() && step()) {
    }
    cursor.core = nullptr;
    cursor.ended = true;
}

/// Executed inside an edit that waits for its threads.
bool ReExecution::step() {
    if (catches_up_) return catch_up();
    if (state_ != State::goes_on || finished_) return false;
    bool needs_edit = false;
    Cursor* const cursor = next(needs_edit, true);
    if (!cursor) return false;
    execute(*cursor);
    return state_ == State::goes_on;
}

/// Returns the thread whose cycle began first, of those that can execute theirs; nullptr: none can,
/// or the first one needs an edit.
ReExecution::Cursor* ReExecution::next(bool& needs_edit, bool in_edit) {
    std::vector<Cursor*> waiting;
    bool waits_in_call = false;
    for (auto& [number, cursor] : cursors_) {
        if (cursor.suspended) {
            if (cursor.ticket == (cursor.in_call ? next_call_ : next_ticket_)) return &cursor;
            waits_in_call = waits_in_call || cursor.in_call;
        } else if (cursor.thread && cursor.thread->record() && !cursor.ended) {
            waiting.push_back(&cursor);
        }
    }
    std::ranges::sort(waiting, {},
                      [](const Cursor* cursor) { return cursor->thread->record()->woke_ns; });
    for (Cursor* const cursor : waiting) {
        const Core::Missing missing = cursor->core ? cursor->core->missing() : Core::Missing::edit;
        if (missing == Core::Missing::nothing) return cursor;
        if (missing != Core::Missing::edit) continue;
        needs_edit = true;
        if (!in_edit) return nullptr;
    }
    // the call before it may be one of the session, in start() or stop() of the next edit
    if (waits_in_call && waits_for_session()) {
        needs_edit = true;
        if (!in_edit) return nullptr;
    }
    return accepts_differences_ ? stalled_call() : nullptr;
}

/// Returns whether the next call on a bus is one of an edit that is still to be made.
bool ReExecution::waits_for_session() const {
    if (entry_ >= file_.entries().size()) return false;
    const auto found = session_calls_.find(next_call_);
    if (found != session_calls_.end()) return found->second >= entry_;
    return !accepts_differences_;  // a journal of an earlier version does not have them
}

/// A changed machine may make fewer calls than the journaled one. Returns the thread whose call is
/// the next one that is made, before that of the session; nullptr: none waits.
ReExecution::Cursor* ReExecution::stalled_call() {
    Cursor* first = nullptr;
    for (auto& [number, cursor] : cursors_) {
        const bool waits = cursor.suspended && cursor.in_call && cursor.ticket < setup_call_;
        if (waits && (!first || cursor.ticket < first->ticket)) {
            first = &cursor;
        }
    }
    if (first) {
        next_call_ = first->ticket;
    }
    return first;
}

void ReExecution::load(Cursor& cursor) {
    if (const CycleRecord* const record = cursor.thread->record()) {
        cursor.inputs->load(*record, cursor.thread->notes());
    } else if (!cursor.thread->gap().empty()) {
        fail(State::ends, cursor.thread->gap());
    }
}

JournaledCycle ReExecution::cycle_of(const Cursor& cursor) const {
    const CycleRecord& record = cursor.inputs->record();
    return {cursor.thread->name, record.number, record.woke_ns - begin_ns_.value_or(0)};
}

/// Begins a cycle, or continues one that waits in a gate. Returns true when it has ended.
bool ReExecution::execute(Cursor& cursor) {
    Cursor* const outer = std::exchange(running_, &cursor);
    bool ended = false;
    if (cursor.suspended) {
        Core::set_current(cursor.core);
        ended = cursor.stack->resume();
    } else {
        if (!cursor.stack) {
            cursor.stack = std::make_unique<CycleStack>();
        }
        cursor.entered.reset();
        now_ns_ = cursor.inputs->record().woke_ns;
        ended = cursor.stack->run([&cursor] { cursor.core->replay(); });
    }
    Core::set_current(nullptr);
    running_ = outer;
    cursor.suspended = !ended;
    if (ended) {
        finish_cycle(cursor);
    }
    return ended;
}

void ReExecution::finish_cycle(Cursor& cursor) {
    newest_ = cycle_of(cursor);
    ++cycles_;
    ++cursor.executed;
    match_ = cursor.inputs->match();
    if (const char* const link = cursor.inputs->differing_link()) {
        differing_link_ = link;
    }
    if (match_ != CycleInputs::Match::same && !accepts_differences_) {
        fail(State::differs, "");
    } else if (match_ != CycleInputs::Match::same && !diverged_) {
        diverged_ = newest_;
        ignore_state();
    }
    cursor.thread->next();
    load(cursor);
}

void ReExecution::finish() {
    finished_ = true;
    for (auto& [number, cursor] : cursors_) {
        if (!cursor.suspended) continue;
        Core::set_current(cursor.core);
        cursor.stack->resume();
        Core::set_current(nullptr);
        cursor.suspended = false;
    }
}

/// Called by a cycle before and after a function that shares state.
void ReExecution::wait_for(std::uint64_t ticket, bool covered) {
    if (!running_) return;
    Cursor& cursor = *running_;
    while (ticket > next_ticket_ && !finished_) {
        cursor.ticket = ticket;
        cursor.stack->leave();
    }
    next_ticket_ = ticket + 1;
    note_overlap(cursor, ticket, covered);
}

/// Called by a cycle in an ordered call.
void ReExecution::wait_for_call(std::uint64_t ticket) {
    if (!running_) return;
    Cursor& cursor = *running_;
    while (ticket > next_call_ && !finished_) {
        cursor.ticket = ticket;
        cursor.in_call = true;
        cursor.stack->leave();
    }
    cursor.in_call = false;
    pass_call(ticket);
}

void ReExecution::pass_call(std::uint64_t ticket) {
    next_call_ = std::max(next_call_, ticket + 1);
    pass_skipped_calls();
}

void ReExecution::pass_skipped_calls() {
    while (skipped_calls_.contains(next_call_)) {
        ++next_call_;
    }
}

/// Called by a setup call, on the session's stack.
void ReExecution::wait_for_setup_call(std::uint64_t ticket) {
    setup_call_ = ticket;
    while (ticket > next_call_ && step()) {
    }
    setup_call_ = UINT64_MAX;
    pass_call(ticket);
}

void ReExecution::note_overlap(Cursor& cursor, std::uint64_t ticket, bool covered) {
    if (!cursor.entered) {
        cursor.entered = ticket;
        return;
    }
    const bool overlapped = ticket != *cursor.entered + 1;
    cursor.entered.reset();
    if (overlapped && !covered && overlaps_++ == 0) {
        first_overlap_ = cycle_of(cursor);
    }
}

// --- a journal that begins with a state ---

bool ReExecution::at_rest() const {
    return std::ranges::all_of(cursors_, [](const auto& one) {
        return !one.second.suspended && (!one.second.core || one.second.core->at_rest());
    });
}

/// In the order of their numbers.
std::vector<Core*> ReExecution::cores() const {
    std::vector<Core*> cores;
    for (const auto& [number, cursor] : cursors_) {
        if (cursor.core) {
            cores.push_back(cursor.core);
        }
    }
    return cores;
}

std::string ReExecution::state(std::string& problem) {
    if (has_withdrawn_) {  // its memory was allocated, too
        problem = "an edit before it was rolled back after threads had taken it";
        return "";
    }
    MachineState machine(*session_, cores());
    const std::string memory = machine.capture();
    if (memory.empty()) {
        problem = machine.problem();
        return "";
    }
    std::string state;
    mcap::put(state, next_ticket_);
    mcap::put(state, next_call_);
    return state + memory;
}

/// Returns false when no thread had to do anything.
bool ReExecution::catch_up() {
    bool any = false;
    for (Core* const core : cores()) {
        any = core->catch_up() || any;
    }
    return any;
}

namespace {

/// What the threads have published stays when an edit that the journal does not have gives
/// them other plans: the records count on.
class KeptChannels {
public:
    explicit KeptChannels(Core& core) : core_(core), remains_(core.remains()) {
        if (!core.plan()) return;
        for (const plan::Import& import : core.plan()->imports) {
            channels_.push_back(import.channel);
        }
    }
    void restore() const {
        Core::Remains remains = core_.remains();
        remains.writes = remains_.writes;
        remains.sampled = remains_.sampled;
        core_.set_remains(remains);
        const std::size_t imports = core_.plan() ? core_.plan()->imports.size() : 0;
        for (std::size_t i = 0; i < std::min(imports, channels_.size()); ++i) {
            plan::Channel& now = *core_.plan()->imports[i].channel;
            plan::Channel& before = *channels_[i];
            if (&now == &before) continue;
            now.published = before.published;
            if (now.size == before.size) {
                now.history = std::move(before.history);
            }
        }
    }

private:
    Core& core_;
    const Core::Remains remains_;
    std::vector<std::shared_ptr<plan::Channel>> channels_;
};

}  // namespace

std::string ReExecution::edit_at_rest(const std::function<std::string()>& edit) {
    std::vector<KeptChannels> kept;
    for (Core* const core : cores()) {
        kept.emplace_back(*core);
    }
    catches_up_ = true;
    // epochs that no edit of the journal has, nor an earlier one at rest: a thread that had taken
    // one of this number would count as one that has taken the new plan
    session_->threads().continue_after(epoch_at_rest_);
    epoch_at_rest_ += std::uint64_t{1} << 32;
    std::string problem = edit();
    while (catch_up()) {
    }
    catches_up_ = false;
    for (const KeptChannels& one : kept) {
        one.restore();
    }
    for (auto& [number, cursor] : cursors_) {
        if (cursor.thread) {
            load(cursor);
        }
    }
    return problem;
}

/// Makes the machine that it was, and gives it the state.
bool ReExecution::begin_at_state() {
    const JournalBegin& begin = *file_.begin();
    catches_up_ = true;
    const std::vector<ExecutionEntry>& entries = file_.entries();
    while (entry_ < std::min<std::size_t>(begin.entries, entries.size())) {
        if (!make(entries[entry_++])) return false;
    }
    while (catch_up()) {
    }
    catches_up_ = false;
    for (auto& [number, cursor] : cursors_) {
        if (cursor.thread) {
            load(cursor);
        }
    }
    mcap::Fields fields(begin.state);
    next_ticket_ = fields.get<std::uint64_t>();
    next_call_ = fields.get<std::uint64_t>();
    pass_skipped_calls();
    MachineState machine(*session_, cores());
    if (!machine.restore(fields.rest())) {
        return fail(State::fails, "the state that the journal begins with cannot be restored: " +
                                      machine.problem());
    }
    edits_ = 0;
    return true;
}

ReExecution::State ReExecution::advance() {
    if (state_ == State::goes_on && file_.begin() && !std::exchange(begun_, true) &&
        !begin_at_state())
        return state_;
    while (state_ == State::goes_on) {
        bool needs_edit = false;
        if (Cursor* const cursor = next(needs_edit, false)) {
            if (execute(*cursor)) return state_;
            continue;
        }
        if (!needs_edit) return state_ = end_of_journal();
        if (!make_next_edit()) break;
    }
    return state_;
}

bool ReExecution::functions_run() const {
    return std::ranges::any_of(
        cursors_, [](const auto& one) { return one.second.core && !one.second.core->is_safe(); });
}

JournalProgress ReExecution::progress() const {
    JournalProgress progress{.entries = entry_, .records = {}};
    for (const auto& [number, cursor] : cursors_) {
        progress.records[number] = cursor.executed;
    }
    return progress;
}

void ReExecution::ignore_state() {
    for (auto& [number, cursor] : cursors_) {
        cursor.inputs->ignore_state();
    }
}

void ReExecution::pass_difference() {
    if (state_ != State::differs) return;
    state_ = State::goes_on;
    diverged_ = newest_;
    accept_differences();
    ignore_state();
}

void ReExecution::continue_in_copy() {
    hal::continue_in_copy();
    for (auto& [number, cursor] : cursors_) {
        if (cursor.core) {
            cursor.core->continue_in_copy();
        }
    }
}

bool ReExecution::is_at_the_cut() const {
    if (file_.complete()) return false;
    return std::ranges::any_of(cursors_, [this](const auto& one) {
        const JournaledThread* const thread = one.second.thread;
        return thread && thread->name == newest_.thread && thread->in_last_batch();
    });
}

bool ReExecution::breaks_off() const {
    if (file_.complete()) return false;
    return std::ranges::any_of(cursors_, [](const auto& one) {
        return one.second.core && one.second.thread && !one.second.thread->record();
    });
}

ReExecution::State ReExecution::end_of_journal() {
    for (const auto& [number, cursor] : cursors_) {
        if (!cursor.thread || !cursor.thread->record() || cursor.ended) continue;
        std::string_view why = "reads a cycle of another thread that is not in the journal";
        if (cursor.suspended) {
            why = cursor.in_call ? "waits in a call on a bus for a call that is not in the journal"
                                 : "waits for a function of another thread that is not in the "
                                   "journal";
        }
        reason_ += fmt::format("{}thread '{}': its cycle {} {}", reason_.empty() ? "" : "; ",
                               cursor.thread->name, cursor.thread->record()->number, why);
    }
    return reason_.empty() ? State::complete : State::ends;
}

// --- the edits ---

bool ReExecution::make_next_edit() {
    if (entry_ == file_.entries().size()) {
        return fail(State::ends, "the next cycle needs an edit that is not in the journal");
    }
    const std::vector<ExecutionEntry>& entries = file_.entries();
    if (!make(entries[entry_++])) return false;
    const auto waits_for_nothing = [](const ExecutionEntry& entry) {
        return entry.kind != ExecutionEntry::Kind::edit &&
               entry.kind != ExecutionEntry::Kind::written &&
               entry.kind != ExecutionEntry::Kind::withdrawn &&
               entry.kind != ExecutionEntry::Kind::rejected;
    };
    while (entry_ < entries.size() && waits_for_nothing(entries[entry_])) {
        make(entries[entry_++]);
    }
    make_writes_before_samples();
    return true;
}

/// No cycle may need the values that programs wrote, to pins without a link, but those of the
/// cycles behind them are recorded.
void ReExecution::make_writes_before_samples() {
    const std::vector<ExecutionEntry>& entries = file_.entries();
    std::size_t end = entry_;
    while (end < entries.size() && entries[end].kind == ExecutionEntry::Kind::written) {
        ++end;
    }
    const bool begins_samples =
        end < entries.size() && entries[end].kind == ExecutionEntry::Kind::sampled;
    while (begins_samples && entry_ <= end) {
        make(entries[entry_++]);
    }
}

bool ReExecution::make(const ExecutionEntry& entry) {
    switch (entry.kind) {
    case ExecutionEntry::Kind::edit: return make_edit(entry);
    case ExecutionEntry::Kind::written: return write(entry);
    case ExecutionEntry::Kind::withdrawn: return make_withdrawn(entry);
    case ExecutionEntry::Kind::rejected: return make_rejected(entry);
    case ExecutionEntry::Kind::sampled:
        if (!entry.names.empty()) {
            sampled_(entry.names);
        }
        return true;
    case ExecutionEntry::Kind::opened:
        outside_ = outside_ || !entry.resources.empty() || entry.threads > 0;
        return true;
    case ExecutionEntry::Kind::start:
    case ExecutionEntry::Kind::stop:
    case ExecutionEntry::Kind::end: return true;  // the cycles have it
    }
    return true;
}

/// Returns whether the transaction took effect; nothing when the entry is invalid, which is a
/// failure.
std::optional<bool> ReExecution::commit(const ExecutionEntry& entry, Diagnostics& diagnostics) {
    session_->threads().continue_after(entry.epoch);
    Transaction transaction = session_->begin();
    if (!make_commands(transaction, entry, diagnostics)) return std::nullopt;
    return transaction.commit(diagnostics);
}

bool ReExecution::make_commands(Transaction& transaction, const ExecutionEntry& entry,
                                Diagnostics& diagnostics) {
    for (const auto& words : entry.commands) {
        if (words.empty() || !make_command(transaction, words, diagnostics)) {
            return fail(State::fails, "invalid entry of the journal: " + text_of(entry.commands));
        }
    }
    return true;
}

/// Its instances were on a bus in memory until it was rejected. What rejected it may be outside of
/// the process, so it is rejected here in any case.
bool ReExecution::make_rejected(const ExecutionEntry& entry) {
    session_->threads().continue_after(entry.epoch);
    Diagnostics ignored;
    Transaction transaction = session_->begin();
    if (!make_commands(transaction, entry, ignored)) return false;
    if (entry.starts) {
        transaction.start_and_reject(ignored);
    } else {
        transaction.roll_back();
    }
    skipped_calls_.insert(entry.calls.begin(), entry.calls.end());  // those that it did not make
    pass_skipped_calls();
    return state_ == State::goes_on;
}

/// A thread that did not take the plan live has no cycle with it, so that the edit is rolled back
/// again, and the threads that took it take the plan before it again in the same cycles.
bool ReExecution::make_withdrawn(const ExecutionEntry& entry) {
    has_withdrawn_ = true;
    constexpr const char* reason =
        "an edit was rolled back after threads had taken it: its cycles cannot be executed again";
    if (entry.commands.empty() || catches_up_) return fail(State::ends, reason);
    Diagnostics diagnostics;
    const std::optional<bool> done = commit(entry, diagnostics);
    if (!done || state_ != State::goes_on) return false;
    return !*done || fail(State::ends, reason);
}

bool ReExecution::make_edit(const ExecutionEntry& entry) {
    ++edits_;
    Diagnostics diagnostics;
    const std::optional<bool> committed = commit(entry, diagnostics);
    if (!committed) return false;
    const bool done = *committed;
    if (done || state_ != State::goes_on) return done;
    if (breaks_off()) {
        return fail(State::ends,
                    "it breaks off before all threads take the edit " + text_of(entry.commands));
    }
    std::string why = "it is rejected";
    for (const Diagnostic& one : diagnostics.all()) {
        if (one.severity == Severity::error) {
            why = one.message;
            break;
        }
    }
    return fail(State::fails,
                fmt::format("{} cannot be executed again: {}", text_of(entry.commands), why));
}

bool ReExecution::make_command(Transaction& transaction, const std::vector<std::string>& words,
                               Diagnostics& diagnostics) {
    if (words.front().starts_with(':')) return make_of_program(transaction, words);
    apply_(transaction, command_of(words), diagnostics);
    return true;
}

/// The pins of programs, which are not started again.
bool ReExecution::make_of_program(Transaction& transaction, const std::vector<std::string>& words) {
    ProgramModel& model = session_->programs().model();
    if (words[0] == program_words::add && words.size() == 3) {
        model.add_component(transaction, words[1], 1, command_of({"loadusr", words[2]}));
        return true;
    }
    if (words[0] == program_words::remove && words.size() == 2) {
        model.remove_component(transaction, words[1]);
        return true;
    }
    if (words[0] == program_words::add_pin && words.size() == 6) {
        ProgramPin pin;
        pin.name = words[2];
        pin.type = static_cast<hal_type>(number_of<int>(words[3]));
        pin.dir = static_cast<hal_dir>(number_of<int>(words[4]));
        pin.initial.raw = number_of<std::uint64_t>(words[5]);
        std::string problem;
        return model.add_pin(transaction, words[1], pin, problem) != nullptr;
    }
    if (words[0] != program_words::remove_pins || words.size() < 2) return false;
    std::vector<Pin*> pins;
    for (std::size_t i = 2; i < words.size(); ++i) {
        if (Pin* const pin = session_->model().find_pin(words[i])) {
            pins.push_back(pin);
        }
    }
    model.remove_pins(transaction, words[1], pins);
    return true;
}

bool ReExecution::write(const ExecutionEntry& entry) {
    std::vector<std::pair<Pin*, hal_value>> values;
    for (const auto& [name, raw] : entry.values) {
        if (Pin* const pin = session_->model().find_pin(name)) {
            values.emplace_back(pin, hal_value{.raw = raw});
        }
    }
    session_->values().write(values);
    return true;
}

}  // namespace hal
