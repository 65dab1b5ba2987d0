// SPDX-License-Identifier: MIT
// The command table: a row per command. Arity, help, completion, the manual and the rules of transactions come from it.
// Internal to the shell.
#pragma once

#include <cstddef>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/diagnostic.hpp"
#include "netlist/netlist.hpp"
#include "session/session.hpp"
#include "shell/shell.hpp"

namespace hal {

struct Processes;
class Script;

/// One command that is being executed by its handler. The session's mutex is held; who waits gives it back meanwhile.
struct Context {
    Script& script;
    Shell& shell;
    Session& session;
    Processes& processes;
    Output& output;
    const Command& command;
    Diagnostics& diagnostics;            ///< an error in here is the command's failure
    std::unique_lock<std::mutex>& lock;

    const ShellOptions& options() const { return shell.options; }
    std::size_t count() const { return command.args.size(); }
    const std::string& argument(std::size_t i) const { return command.args[i].text; }
    std::string_view argument_or(std::size_t i, std::string_view fallback) const { return i < count() ? argument(i) : fallback; }
    Span span(std::size_t i) const { return i < count() ? command.args[i].span : command.span; }
    /// A path of the command line, relative to the shell's directory, `~` expanded.
    std::string path(const std::string& text) const;
    /// True when the command should stop waiting; reports `interrupted`.
    bool interrupted();
};

using Handler = void (*)(Context&);

enum CommandFlags : unsigned {
    command_plain = 0,     ///< acts on the machine: what was edited before takes effect first
    command_apart = 1,     ///< does not look at the machine: does not end a transaction
    command_waits = 2,     ///< may wait for something outside
    command_transaction = 4,  ///< begin, commit, abort
    command_checked = 8,      ///< works the same way under `hal check`
};

struct CommandRow {
    const char* name;
    const char* also;       ///< a second name, or ""
    const char* arguments;  ///< usage. CAPITALS are objects (completion knows them), [x] is optional, x|y a choice, … repeats
    const char* summary;    ///< one line
    const char* help;       ///< more about it, or ""
    Handler handler;        ///< nullptr: an edit of the model, done by Session::apply
    unsigned lock;          ///< bits of Lock that forbid it
    unsigned flags;
};

/// All rows, in the order `help` lists them.
std::span<const CommandRow> command_table();
/// By either name; nullptr when there is none.
const CommandRow* find_command(std::string_view name);
/// What the row of `NAME = VALUE` is: setp.
const CommandRow* row_of(const Command& command);
std::vector<std::string> command_names();

/// The usage text cut into its words: "FUNCTION THREAD [POSITION]" has three.
struct ArgumentWord {
    std::string_view text;  ///< without brackets and dots: "POSITION", "lock|mem|all"
    bool optional = false;
    bool repeats = false;
    bool of_option = false; ///< stands behind an option in one bracket: TYPE in "[-t TYPE]"
};
std::vector<ArgumentWord> argument_words(const CommandRow& row);

/// Checks the number of arguments; Session::apply does it for edits. False after reporting wrong-arguments.
bool check_arity(const CommandRow& row, const Command& command, Diagnostics& diagnostics);
/// Checks the locks. False after reporting which one and how to take it off.
bool check_lock(const CommandRow& row, const Command& command, unsigned lock, Diagnostics& diagnostics);

// --- handlers, by file ---------------------------------------------------------------------------------------------------
// commands_show.cpp
void command_show(Context&);
void command_list(Context&);
// commands_report.cpp
void command_status(Context&);
void command_fault(Context&);
void show_timing(Context&);
void show_latency(Context&);
void show_faults(Context&);
// commands_save.cpp
void command_save(Context&);
// commands_value.cpp
void command_getp(Context&);
void command_gets(Context&);
void command_ptype(Context&);
void command_stype(Context&);
// commands_machine.cpp
void command_start(Context&);
void command_stop(Context&);
void command_advance(Context&);
void command_lock(Context&);
void command_unlock(Context&);
// commands_process.cpp
void command_loadusr(Context&);
void command_waitusr(Context&);
void command_unloadusr(Context&);
/// The part of `unload NAME|all` that is about processes. True: nothing is left to do.
bool unload_processes(Context&);
// commands_help.cpp
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
