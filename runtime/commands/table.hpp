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

enum CommandFlags : unsigned {
    command_plain = 0,        ///< acts on the machine: pending edits take effect first
    command_apart = 1,        ///< does not access the machine: does not end a transaction
    command_waits = 2,        ///< may wait for something outside
    command_transaction = 4,  ///< begin, commit, abort
    command_checked = 8,      ///< called under `hal check`, too: see Context::checking()
    /// only reads the machine, including the edits made so far: does not end a transaction
    command_query = 16,
    /// part of a transaction: executed after its commit, and not at all after a rollback
    command_deferred = 32,
    command_collected = 64,   ///< start, stop: acts at once, but after `begin` it is deferred
    command_arrows = 128,     ///< an edit with arrows among its arguments
    /// an edit that leaves nothing in the model that points into its text
    command_traceless = 256,
    command_each = 512,       ///< takes one name; a range of them is a command for each
    command_path = 1024,      ///< its arguments may be paths: quotes around them are removed
    command_programs = 2048,  ///< an edit that also ends programs
};

struct CommandRow {
    const char* name;
    const char* also;       ///< a second name, or ""
    std::string_view arguments;  ///< see Usage; the number of arguments follows from it
    const char* summary;    ///< one line
    const char* help;       ///< more about it, or ""
    CommandFunction function;
    unsigned lock;          ///< bits of Lock that forbid it
    unsigned flags;

    bool edits() const { return function.edit != nullptr; }
    bool is_query() const { return (flags & command_query) != 0; }
    bool takes_paths() const { return (flags & command_path) != 0; }
    Usage usage() const { return {name, arguments}; }
    EditForm form() const { return {usage(), function.edit, (flags & command_arrows) != 0}; }
};

/// All rows, in the order `help` lists them.
std::span<const CommandRow> command_table();
/// By either name; nullptr when there is none.
const CommandRow* find_command(std::string_view name);
/// What the row of `NAME = VALUE` is: setp.
const CommandRow* row_of(const Command& command);
std::vector<std::string> command_names();

/// Applies an edit by its row. Reports unknown-command when there is none.
void apply_edit(Transaction& transaction, const Command& command, Diagnostics& diagnostics);

/// Checks the locks. False after reporting the lock and how to release it. Values of pins and
/// signals are never locked, as in LinuxCNC.
bool check_lock(const CommandRow& row, const Command& command, unsigned lock, const Model& model,
                Diagnostics& diagnostics);

/// Makes a command that sets `NAME VALUE` a sets when NAME is a signal, else a setp.
void resolve_set(const Model& model, Command& command);

// --- functions, by file ---------------------------------------------------------------------------------------------------
// show.cpp
void command_show(Context&);
void command_list(Context&);
// report.cpp
void command_status(Context&);
void command_fault(Context&);
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
