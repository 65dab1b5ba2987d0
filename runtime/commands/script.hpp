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

#include "commands/shell_state.hpp"
#include "commands/table.hpp"

namespace hal {

class Script {
public:
    /// The locks as the commands carried out so far leave them: `lock` and `unlock` take effect
    /// with their transaction.
    unsigned locks() const { return locks_.value_or(session_.locked); }
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
    /// Adds a text to the session's sources for as long as this object lives, and longer when
    /// something made by it points into it.
    std::uint32_t add_text(std::string name, std::string text, std::uint32_t first_line = 1);

private:
    struct Parsed {
        std::vector<Command> commands;
        Diagnostics problems;  ///< of the text itself
    };
    /// The canonical path of a text that is a file, else "".
    std::string own_path(std::uint32_t source) const;
    Parsed parse_text(std::uint32_t source);
    void take_part(std::uint32_t source, Parsed& parsed);
    void run_commands(std::uint32_t source);
    void run_row(const std::vector<Command>& commands, std::size_t from, std::size_t to);
    void run_line(const Command& command);
    void edit(const Command& command, const CommandRow& row);
    /// The first pass of TWOPASS: true when the command was merged into the shell's module_loads.
    bool merge_load(const Command& command);
    void defer(const Command& command, const CommandRow& row);
    void act(const Command& command, const CommandRow& row);
    /// begin, commit, abort
    void group(const Command& command);
    /// After `begin`: true when the command was collected or rejected.
    bool collect(const Command& command, const CommandRow& row);
    void forget_collected(std::size_t from);
    Transaction& transaction();
    /// `hal check` starts no programs: which names are theirs.
    void note_program(const Command& command);
    void echo_line(std::string_view line, std::uint32_t number);
    void take_lock();
    /// Ends the transaction: commits, prints. Sets failed_ and, without -k, stopped_.
    void finish();
    void look_up_names(Diagnostics& found);
    /// True after Session::interrupt(); then the transaction is rolled back, and `command` and
    /// those after it are not executed.
    bool ended(const Command& command);
    /// Adds the error that the end of the machine has interrupted `command`.
    void report_end(const Command& command);
    void report(Diagnostics& found, std::size_t edits, bool took_effect);
    /// The diagnostic with the places in the INI file of the values that the words at its main
    /// place have.
    Diagnostic with_values(Diagnostic diagnostic) const;
    /// After a failure: "nothing was changed", or which lines took effect and which did not.
    std::string outcome(bool edited) const;
    /// -k: each line is a transaction. A check looks at the text as a whole in any case.
    bool separately() const { return shell_.options.keep_going && !shell_.options.check; }
    bool stop() const { return stopped_ || ended_; }

    Shell& shell_;
    Shell::State& state_;
    Session& session_;
    Output& output_;
    SessionLock lock_;
    std::optional<Transaction> transaction_;
    Diagnostics pending_;  ///< of the open transaction
    std::size_t edits_ = 0;  ///< in it
    /// Session::locked when it has taken effect, if it has `lock` or `unlock`
    std::optional<unsigned> locks_;
    /// that messages have offered: kept for those to come
    std::set<std::shared_ptr<const NameIndex>> names_;
    std::vector<Span> lines_;  ///< in it
    std::vector<Span> effective_;  ///< lines that took effect
    /// lines that had none: of transactions that failed, or were forgotten by `abort`
    std::vector<Span> idle_;
    struct Row {
        const std::vector<Command>* commands;
        std::size_t next, end;
    };
    std::vector<Row> rows_;  ///< being run, the outermost first
    bool half_done_ = false;  ///< a command that acts failed: what it did stays
    /// of the shell's collected commands, those that came before this text
    std::size_t collected_before_;
    bool checked_begin_ = false;  ///< `hal check` is between begin and commit
    std::size_t errors_ = 0;  ///< printed so far, for the summary with -k
    bool failed_ = false;
    bool stopped_ = false;
    bool ended_ = false;
    bool text_is_kept_ = false;
    struct Open {
        std::string path;  ///< canonical
        Span at;  ///< of the `source` command, in the file before
    };
    std::vector<std::uint32_t> texts_;  ///< of add_text()
    std::vector<Open> files_;  ///< being read, the outermost first
};

}  // namespace hal
