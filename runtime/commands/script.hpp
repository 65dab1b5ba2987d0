// SPDX-License-Identifier: MIT
// Runs one text: which of its commands form a transaction, when it takes effect, what is printed
// about it. Internal to the shell; used for one execute(), run_text() or run_file(), and not after
// that.
//
// Consecutive edits are one transaction. It ends before a command that acts on the machine and at
// the end of the text; with -k after every line. Commands that only look do not end it: they see
// the machine with the edits made so far (docs/decisions/0019). All its problems are printed
// together, and the last line states which lines took effect. A `source`d file belongs to the text
// at its place. From the first edit to the end of its transaction the session's lock is held.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "commands/script_effects.hpp"
#include "commands/script_texts.hpp"
#include "commands/shell_state.hpp"
#include "commands/table.hpp"
#include "machine/report/logged_edits.hpp"

namespace hal {

class Script {
public:
    /// The locks as the commands carried out so far leave them: `lock` and `unlock` take effect
    /// with their transaction.
    unsigned locks() const { return locks_.value_or(session_.locked); }
    /// True when the open transaction acknowledges the faults that are over.
    bool clears_faults() const { return clears_faults_; }
    void note_fault_clear() { clears_faults_ = true; }
    Script(Shell& shell, Shell::State& state, Output& output);
    ~Script();
    Script(const Script&) = delete;

    /// Runs a text that is in the session's sources, then ends the last transaction. Returns 0, or
    /// 1 when anything failed.
    int run(std::uint32_t source);
    /// Runs commands whose text is in the session's sources, then ends the last transaction.
    /// Returns like run(source).
    int run(const std::vector<Command>& commands);
    /// Several texts with the loads of all of them merged and done first (`[HAL]TWOPASS`).
    int run_two_pass(const std::vector<std::uint32_t>& texts, Pass pass = Pass::both);

    /// The `source` and `quit` commands.
    void source(Context& context);
    void quit() { ended_ = true; }
    /// True when Shell::cancel was called; reports it once.
    bool interrupted(Context& context);
    bool quit_seen() const { return ended_; }
    /// As ScriptTexts::add().
    std::uint32_t add_text(std::string name, std::string text, std::uint32_t first_line = 1) {
        return texts_.add(std::move(name), std::move(text), first_line);
    }

private:
    void end_text(std::uint32_t source, bool collecting_before, std::size_t collected_before);
    std::string kept_going_text(std::uint32_t source) const;
    void run_commands(std::uint32_t source);
    void run_row(const std::vector<Command>& commands, std::size_t from, std::size_t to);
    void run_line(const Command& command);
    void report_unknown(const Command& command);
    void edit(const Command& command, const CommandRow& row);
    bool merge_module_load(const Command& command);
    void defer(const Command& command, const CommandRow& row);
    void act(const Command& command, const CommandRow& row);
    void log_failure(const Command& command, std::size_t errors_before);
    bool begin_check(const Command& command, const CommandRow& row);
    void keep_remembered(const Command& command, const CommandRow& row);
    void note_effect(const Command& command, const CommandRow& row, bool apart, bool failed);
    void act_on_each(const Command& command, const CommandRow& row);
    void act_on(const Command& command, const CommandRow& row);
    void finish_before_acting();
    /// begin, commit, abort
    void group(const Command& command);
    void begin_collecting(const Command& command);
    void commit_collected();
    /// After `begin`: true when the command was collected or rejected.
    bool collect(const Command& command, const CommandRow& row);
    void report_conflict(const Command& command, const Command& other);
    bool reject_in_transaction(const Command& command, const CommandRow& row);
    const Command* find_conflict(const Command& command) const;
    void forget_collected(std::size_t from);
    Transaction& transaction();
    bool read_source(Context& context, std::string& path, std::string& text);
    bool reports_recursion(Context& context, const std::string& canonical);
    void echo_line(std::string_view line, std::uint32_t number);
    /// Ends the transaction: commits, prints. Sets failed_ and, without -k, stopped_.
    void finish();
    /// True after Session::interrupt(); then the transaction is rolled back, and `command` and
    /// those after it are not executed.
    bool ended(const Command& command);
    /// Adds the error that the end of the machine has interrupted `command`.
    void report_end(const Command& command);
    ScriptOutcome outcome_of(std::size_t edits, bool took_effect, bool failed) const;
    /// -k: each line is a transaction. A check looks at the text as a whole in any case.
    bool separately() const { return shell_.options.keep_going && !shell_.options.check; }
    bool stop() const { return stopped_ || ended_; }

    Shell& shell_;
    Shell::State& state_;
    Session& session_;
    Output& output_;
    SessionLock lock_;
    ScriptTexts texts_;
    ScriptEffects effects_;
    LoggedEdits logged_edits_;
    std::optional<Transaction> transaction_;
    Diagnostics pending_;  ///< of the open transaction
    std::size_t edits_ = 0;  ///< in it
    /// Session::locked when it has taken effect, if it has `lock` or `unlock`
    std::optional<unsigned> locks_;
    bool clears_faults_ = false;  ///< it has `fault clear`
    struct Row {
        const std::vector<Command>* commands;
        std::size_t next, end;
    };
    std::vector<Row> rows_;  ///< being run, the outermost first
    /// of the shell's collected commands, those that came before this text
    std::size_t collected_before_;
    bool checked_begin_ = false;  ///< `hal check` is between begin and commit
    bool failed_ = false;
    bool stopped_ = false;
    bool ended_ = false;
    std::set<std::uint32_t> ignored_;  ///< texts of which nothing was carried out
};

}  // namespace hal
