// SPDX-License-Identifier: MIT
// Executes a journal again: each cycle with its recorded inputs, in the order in which the cycles
// began; an edit of the session when the first cycle needs it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "execute/core.hpp"
#include "execute/cycle_schedule.hpp"
#include "journal/cycle_stack.hpp"
#include "journal/journal_file.hpp"
#include "journal/shortened_journal.hpp"
#include "netlist/netlist.hpp"
#include "text/diagnostic.hpp"

namespace hal {

class Session;
class Transaction;

/// A cycle of a thread of the journaled machine.
struct JournaledCycle {
    std::string thread;
    std::uint64_t number = 0;
    std::int64_t time_ns = 0;  ///< when it woke, since the first record of the journal
};

/// [setup] throughout. All cycles run on the calling thread, which holds the session's lock.
class ReExecution final : public CycleSchedule, private FunctionOrder {
public:
    /// Elaborates a command of the journal in a transaction.
    using Apply = std::function<void(Transaction&, const Command&, Diagnostics&)>;

    /// `file` outlives it.
    explicit ReExecution(JournalFile& file);
    ~ReExecution() override;

    /// The session has this as its schedule. `sampled` is called where values are recorded from.
    void attach(Session& session, Apply apply,
                std::function<void(const std::vector<std::string>&)> sampled);

    enum class State {
        goes_on,
        complete,  ///< all cycles of the journal have been executed
        ends,  ///< what follows is missing in the journal: reason()
        fails,  ///< an edit cannot be made again: reason()
        differs,  ///< the last cycle has other values than the journaled one
    };
    /// Executes the next cycle and the edits before it.
    State advance();
    /// Nothing more is executed, although the journal may have more. Runs the suspended cycles to
    /// their end, so that none holds a bus that the end of the machine waits for.
    void finish();
    State state() const { return state_; }
    /// Returns why the execution cannot go on, as sentences.
    const std::string& reason() const { return reason_; }
    const JournaledCycle& newest() const { return newest_; }
    std::uint64_t cycles() const { return cycles_; }
    std::uint64_t edits() const { return edits_; }
    /// Returns how many entries of the journal have been made, of JournalFile::entries().
    std::size_t entries() const { return entry_; }
    /// Returns true once an instance has opened something outside of the process, or has created a
    /// thread: from then on the process cannot be copied.
    bool has_outside() const { return outside_; }
    /// Returns whether the functions of a thread ran in its newest cycle.
    bool functions_run() const;
    /// Returns how much of the journal has been executed.
    JournalProgress progress() const;
    /// Returns true when a journal may begin here: between the cycles of all threads.
    bool at_rest() const;
    /// Returns the state of this moment for JournalBegin; "" after setting `problem`.
    std::string state(std::string& problem);
    /// Edits the machine at_rest(), without a cycle. Returns what `edit` does: why it cannot, or "".
    std::string edit_at_rest(const std::function<std::string()>& edit);
    /// From now on cycles may differ from the journaled ones, and only the first one is noted.
    void accept_differences() { accepts_differences_ = true; }
    /// Goes on behind the first cycle that differs, accepting differences.
    void pass_difference();
    /// The machine has been changed: what the journal has of its state is of another one.
    void ignore_state();
    /// Returns the first cycle that differed after accept_differences().
    const std::optional<JournaledCycle>& diverged() const { return diverged_; }
    /// This process is a copy of the one that has executed so far, and continues.
    void continue_in_copy();
    /// Returns what `differs` is about: other values, or another number of inputs.
    CycleInputs::Match match() const { return match_; }
    /// Returns true when the newest cycle is among the last that a journal without an end has: what
    /// it depends on may be missing.
    bool is_at_the_cut() const;
    /// Returns the link that has sent other frames; "": none.
    const std::string& differing_link() const { return differing_link_; }

    // CycleSchedule
    CycleInputs& inputs_of(std::uint32_t id) override;
    void begin(Core& core) override;
    void end(Core& core) override;
    bool step() override;
    std::int64_t now_ns() const override { return now_ns_; }
    std::optional<SetupResults> results_of(const std::string& call) override {
        return file_.setup().next_call(call);
    }
    const SetupFile* file_of(const std::string& path) override {
        return file_.setup().next_file(path);
    }
    void wait_for_setup_call(std::uint64_t ticket) override;

    /// Returns how often functions that share state ran at the same time and the journal has not
    /// their state, so that what one read of the other is unknown, and the first such cycle.
    std::uint64_t overlaps() const { return overlaps_; }
    const JournaledCycle& first_overlap() const { return first_overlap_; }

private:
    struct Cursor {
        JournaledThread* thread = nullptr;
        std::unique_ptr<CycleInputs> inputs;
        Core* core = nullptr;  // nullptr: the thread does not exist yet, or no more
        bool ended = false;
        std::uint64_t executed = 0;  // records
        std::unique_ptr<CycleStack> stack = {};  // of its cycle
        bool suspended = false;  // within a cycle, in a gate
        bool in_call = false;  // suspended in an ordered call
        std::uint64_t ticket = 0;  // that it waits for
        std::optional<std::uint64_t> entered = {};  // ticket with which its function began
    };
    /// A thread that exists has no further record in a journal without an end.
    bool breaks_off() const;
    Cursor* next(bool& needs_edit, bool in_edit);
    bool waits_for_session() const;
    Cursor* stalled_call();
    bool execute(Cursor& cursor);
    void finish_cycle(Cursor& cursor);
    void wait_for(std::uint64_t ticket, bool covered) override;
    void note_overlap(Cursor& cursor, std::uint64_t ticket, bool covered);
    void wait_for_call(std::uint64_t ticket) override;
    void pass_call(std::uint64_t ticket);
    void pass_skipped_calls();
    JournaledCycle cycle_of(const Cursor& cursor) const;
    void load(Cursor& cursor);
    State end_of_journal();
    bool begin_at_state();
    bool catch_up();
    std::vector<Core*> cores() const;
    bool make_next_edit();
    void make_writes_before_samples();
    bool make(const ExecutionEntry& entry);
    bool make_edit(const ExecutionEntry& entry);
    bool make_withdrawn(const ExecutionEntry& entry);
    bool make_rejected(const ExecutionEntry& entry);
    bool make_commands(Transaction& transaction, const ExecutionEntry& entry,
                       Diagnostics& diagnostics);
    std::optional<bool> commit(const ExecutionEntry& entry, Diagnostics& diagnostics);
    bool make_command(Transaction& transaction, const std::vector<std::string>& words,
                      Diagnostics& diagnostics);
    bool make_of_program(Transaction& transaction, const std::vector<std::string>& words);
    bool write(const ExecutionEntry& entry);
    bool fail(State state, std::string reason);

    JournalFile& file_;
    Session* session_ = nullptr;
    Apply apply_;
    std::function<void(const std::vector<std::string>&)> sampled_;
    std::map<std::uint32_t, Cursor> cursors_;
    Cursor* running_ = nullptr;
    std::uint64_t next_ticket_ = 0;
    std::uint64_t next_call_ = 0;  // ticket
    std::uint64_t setup_call_ = UINT64_MAX;  // ticket for which a call of the session waits
    std::map<std::uint64_t, std::size_t> session_calls_;  // ticket, entry that makes the call
    std::set<std::uint64_t> skipped_calls_;  // tickets of rejected edits that are not still to come
    std::uint64_t overlaps_ = 0;
    JournaledCycle first_overlap_;
    std::size_t entry_ = 0;  // the next one
    State state_ = State::goes_on;
    bool finished_ = false;
    bool begun_ = false;
    bool catches_up_ = false;  // executes the edits before the state, without cycles
    std::uint64_t epoch_at_rest_ = std::uint64_t{1} << 62;  // of the plans of the next edit at rest
    bool outside_ = false;
    bool has_withdrawn_ = false;  // an edit of the journal was rolled back
    bool accepts_differences_ = false;
    std::optional<JournaledCycle> diverged_;
    std::string reason_;
    JournaledCycle newest_;
    CycleInputs::Match match_ = CycleInputs::Match::same;
    std::string differing_link_;
    std::uint64_t cycles_ = 0;
    std::uint64_t edits_ = 0;
    std::optional<std::int64_t> begin_ns_;
    std::int64_t now_ns_ = 0;
};

}  // namespace hal
