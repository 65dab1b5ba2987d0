// SPDX-License-Identifier: MIT
// The command table: a row per command. Arity, help, completion, the manual and the rules of
// transactions come from it. Internal to the shell.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "commands/shell.hpp"
#include "machine/session.hpp"
#include "netlist/netlist.hpp"
#include "netlist/usage.hpp"
#include "text/diagnostic.hpp"

namespace hal {

class Programs;
class Script;
struct CommandRow;

/// One command that is being executed by its function. The lock of the session is held; a command
/// that waits releases it meanwhile.
struct Context {
    Script& script;
    Shell& shell;
    Session& session;
    Programs& programs;
    Output& output;
    const CommandRow& row;
    const Command& command;
    Diagnostics& diagnostics;            ///< an error in here is the command's failure
    SessionLock& lock;
    /// of a deferred command: the transaction that queues its action
    Transaction* transaction = nullptr;
    /// of a deferred command: Session::locked after the commit
    unsigned* locks = nullptr;

    const ShellOptions& options() const { return shell.options; }
    std::size_t count() const { return command.args.size(); }
    const std::string& argument(std::size_t i) const { return command.args[i].text; }
    std::string_view argument_or(std::size_t i, std::string_view fallback) const {
        return i < count() ? argument(i) : fallback;
    }
    Span span(std::size_t i) const { return i < count() ? command.args[i].span : command.span; }
    std::string usage() const;
    /// `hal check`: the function reports what is wrong with its arguments, and does nothing.
    bool checking() const { return options().check; }
    /// `hal check`: true when `name` is missing because something else is, which was reported.
    bool is_absent(std::string_view name, Absences::Kind kind) const;
    /// A path of the command line, relative to the shell's directory, `~` expanded.
    std::string path(const std::string& text) const;
    /// True when the command should stop waiting; reports `interrupted`.
    bool interrupted();
};

/// What a command does: an edit changes the model, all others act on the machine or read it.
struct CommandFunction {
    using Act = void (*)(Context&);
    using Edit = void (*)(Elaboration&, std::span<const Token>);
    constexpr CommandFunction(Act function) : act(function) {}
    constexpr CommandFunction(Edit function) : edit(function) {}
    Act act = nullptr;
    Edit edit = nullptr;
};

/// What a command touches.
enum class Effect {
    nothing,        ///< does not access the machine: does not end a transaction
    output,         ///< the same, and only prints: not called under `hal check`
    reading,        ///< only reads the machine, including the edits made so far: does not end a
                    ///< transaction
    machine,        ///< acts on the machine: pending edits take effect first
    addition,       ///< an edit after which the model refers to its text
    change,         ///< an edit that leaves nothing in the model that refers to its text
    end_of_program  ///< the same, and ends programs
};

/// When a command acts.
enum class Timing {
    at_once,
    at_commit,   ///< with the transaction that it is part of, and not at all after a rollback
    at_request,  ///< start, stop: at once, but after `begin` with the transaction
    group        ///< begin, commit, abort: it bounds a transaction
};

/// Whether a command may wait for something outside.
enum class Waiting { none, possible };

/// How its arguments are read.
enum class Operands {
    plain,
    arrows,  ///< arrows may stand among them
    ranges,  ///< one name; a range of names is a command for each
    paths    ///< they may be paths: quotes around them are removed
};

struct Behaviour {
    Effect effect = Effect::machine;
    Timing timing = Timing::at_once;
    Waiting waiting = Waiting::none;
    Operands operands = Operands::plain;
};

struct CommandRow {
    const char* name;
    const char* also;       ///< a second name, or ""
    std::string_view arguments;  ///< see Usage; the number of arguments follows from it
    const char* summary;    ///< one line
    const char* help;       ///< more about it, or ""
    CommandFunction function;
    unsigned lock;          ///< bits of Lock that forbid it
    Behaviour behaviour;

    /// Accepted for netlists of tests, and not listed.
    bool is_for_tests() const { return std::string_view(name).ends_with("_for_test_suite_only"); }
    bool edits() const { return function.edit != nullptr; }
    bool is_query() const { return behaviour.effect == Effect::reading; }
    /// Does not access the machine.
    bool is_apart() const {
        return behaviour.effect == Effect::nothing || behaviour.effect == Effect::output;
    }
    /// Neither acts on the machine nor executes other commands, as `source` does.
    bool only_reads() const;
    /// Called under `hal check`, too: see Context::checking().
    bool is_checked() const {
        return behaviour.effect != Effect::output && behaviour.timing != Timing::at_request;
    }
    bool can_be_collected() const {
        return behaviour.timing == Timing::at_commit || behaviour.timing == Timing::at_request;
    }
    Usage usage() const { return {name, arguments}; }
    EditForm form() const {
        return {usage(), function.edit, behaviour.operands == Operands::arrows};
    }
};

/// All rows, in the order `help` lists them.
std::span<const CommandRow> command_table();
/// Finds a command by either name; nullptr when it is unknown.
const CommandRow* find_command(std::string_view name);
/// What the row of `NAME = VALUE` is: setp.
const CommandRow* row_of(const Command& command);
std::vector<std::string> command_names();

/// Applies an edit by its row. Reports unknown-command when no row exists.
void apply_edit(Transaction& transaction, const Command& command, Diagnostics& diagnostics);

/// Checks the locks. False after reporting the lock and how to release it. Values of pins and
/// signals are never locked, as in LinuxCNC.
bool check_lock(const CommandRow& row, const Command& command, unsigned lock, const Model& model,
                Diagnostics& diagnostics);

/// Makes a command that sets `NAME VALUE` a sets when NAME is a signal, else a setp.
void resolve_set(const Model& model, Command& command);

// --- functions, by file --------------------------------------------------------------------------
// show.cpp
void command_show(Context&);
void command_list(Context&);
// report.cpp
void command_status(Context&);
void command_fault(Context&);
void command_journal(Context&);
void show_timing(Context&);
void show_latency(Context&);
void show_faults(Context&);
// save.cpp
void command_save(Context&);
// value.cpp
void command_getp(Context&);
void command_gets(Context&);
void command_ptype(Context&);
void command_stype(Context&);
// run.cpp
void command_start(Context&);
void command_stop(Context&);
void command_advance(Context&);
void command_lock(Context&);
void command_unlock(Context&);
// programs.cpp
void command_loadusr(Context&);
void command_waitusr(Context&);
void command_unloadusr(Context&);
/// The part of `unload NAME|all` that ends programs, a deferred command. True: nothing remains to
/// be done.
bool unload_processes(Context&);
// help.cpp
void command_source(Context&);
void command_print(Context&);
void command_echo(Context&);
void command_unecho(Context&);
void command_debug(Context&);
void command_help(Context&);
void command_explain(Context&);
void command_quit(Context&);
void command_nothing(Context&);
void command_node(Context&);

}  // namespace hal
