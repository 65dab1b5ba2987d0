// SPDX-License-Identifier: MIT
// Which lines of a Script took effect, and what is printed about it. Internal to the shell.
#pragma once

#include <cstddef>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "commands/shell_state.hpp"
#include "machine/session.hpp"
#include "text/diagnostic.hpp"

namespace hal {

/// What a transaction of a text, or a command that acts, has come to.
struct ScriptOutcome {
    std::size_t edits = 0;
    bool took_effect = false;  ///< as a transaction
    bool failed = false;
    /// -k: each line is a transaction
    bool separately = false;
    /// of a failure: lines that were collected before, and lines behind it
    std::vector<Span> collected = {};
    std::vector<Span> not_reached = {};
};

/// All members need the session's lock. [setup]
class ScriptEffects {
public:
    ScriptEffects(Shell& shell, Shell::State& state, Output& output, SessionLock& lock)
        : shell_(shell), state_(state), output_(output), lock_(lock) {}

    /// A line of the open transaction.
    void add_line(Span line) { lines_.push_back(line); }
    /// A command took effect outside of a transaction.
    void add_effective(Span line) { effective_.push_back(line); }
    /// A line without effect: forgotten by `abort`.
    void add_idle(Span line) { idle_.push_back(line); }
    /// A command that acts failed: what it did stays.
    void note_half_done() { half_done_ = true; }
    /// Errors printed so far.
    std::size_t errors() const { return errors_; }

    /// Prints the diagnostics of a transaction and what became of it. Releases the lock while it
    /// looks up similar names.
    void report(Diagnostics& found, const ScriptOutcome& outcome);

private:
    std::string render_shown(const Diagnostics& shown, const ScriptOutcome& outcome) const;
    void look_up_names(Diagnostics& found);
    Diagnostic with_values(Diagnostic diagnostic) const;
    std::string failure_text(const ScriptOutcome& outcome) const;

    Shell& shell_;
    Shell::State& state_;
    Output& output_;
    SessionLock& lock_;
    std::vector<Span> lines_;  // of the open transaction
    std::vector<Span> effective_;  // took effect
    std::vector<Span> idle_;  // of transactions that failed, or were forgotten by `abort`
    bool half_done_ = false;
    std::size_t errors_ = 0;
    // that messages have offered: kept for those to come
    std::set<std::shared_ptr<const NameIndex>> names_;
};

}  // namespace hal
