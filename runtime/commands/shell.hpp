// SPDX-License-Identifier: MIT
// The command language on a session: a line, a file, completion. The command table is in
// commands.hpp. One Shell per user of the session (the program itself, each connection of the
// server); they share the machine and the processes started by loadusr, but neither options nor an
// open `begin`. All members take the session's lock themselves, and only while they work: a command
// that waits (loadusr -w, waitusr, advance on a real clock) lets others go on. [setup], one thread
// at a time per Shell, but for cancel().
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "commands/completion.hpp"

namespace hal {

class Diagnostics;
class Ini;
class Session;
class Sources;
struct Command;
struct JournalLine;

/// Where the text of commands goes.
class Output {
public:
    virtual ~Output() = default;
    virtual void out(std::string_view text) = 0;
    virtual void err(std::string_view text) = 0;
    /// What a command that waits reports meanwhile; on stderr unless there is a faster way to the
    /// user.
    virtual void notice(std::string_view text) { err(text); }
    /// True: this is the process's own stdout and stderr, and programs run by `loadusr -w` may
    /// write there directly.
    virtual bool is_process() const { return false; }
};

/// Keeps the text.
class TextOutput final : public Output {
public:
    void out(std::string_view text) override { out_text += text; }
    void err(std::string_view text) override { err_text += text; }
    std::string out_text, err_text;
};

/// Writes to stdout and stderr of the process, unbuffered between the two.
class ProcessOutput final : public Output {
public:
    void out(std::string_view text) override;
    void err(std::string_view text) override;
    bool is_process() const override { return true; }
};

/// Receives what a shell reads and reports as data: for editors. Called with the session's lock
/// held. [setup]
class ShellObserver {
public:
    virtual ~ShellObserver() = default;
    /// A text was parsed; of a netlist for several machines, these are the commands of one.
    virtual void parsed(const Sources& sources, std::uint32_t source,
                        const std::vector<Command>& commands) = 0;
    /// These diagnostics are printed, the similar names in them included.
    virtual void reported(const Diagnostics& diagnostics, const Sources& sources) = 0;
};

/// Verbosity: `-Q`, `-q` (the default), `-v`, `-V`.
enum class Level { nothing, errors, results, debug };

struct ShellOptions {
    /// -k: each line is a transaction of its own, an error does not stop the file
    bool keep_going = false;
    bool echo = false;  ///< -e: each line to stderr as `(LINE)<echo>: TEXT`
    bool script = false;  ///< -s: no titles, owner names, one line per thread and signal
    bool json = false;  ///< show, list, getp, gets, ptype, stype and status answer in JSON
    bool color = false;  ///< of diagnostics
    bool notes = false;  ///< print notes (stale reads …) as well as errors and warnings
    /// `hal check`: a file is one transaction, commands that act are only looked at
    bool check = false;
    bool linuxcnc = false;  ///< with check: reports also what LinuxCNC would not load
    Level level = Level::errors;
    /// of a netlist with `node` lines: whose part is loaded; `$NODE` in it
    std::string node = {};
    /// of a netlist with `node` lines that runs on one virtual clock with the others: rejects
    /// `advance`
    bool shared_time = false;
    /// what relative paths of source, save, loadusr are relative to; empty: the process's own
    std::string directory = {};
    ShellObserver* observer = nullptr;  ///< outlives the shell; nullptr: none
};

/// Which commands of a netlist run: LinuxCNC's TWOPASS does the loads of all files before anything
/// else.
enum class Pass { both, loads, rest };

/// Runs a netlist that is a script of another language: the file, its arguments, which of its
/// commands. Returns the exit status.
using ScriptRunner = std::function<int(const std::string& path,
                                       const std::vector<std::string>& arguments, Pass, Output&)>;

class Shell {
public:
    /// The session must outlive it.
    explicit Shell(Session& session, ShellOptions options = {});
    /// Another shell on the same machine, with options of its own.
    Shell(Shell& sibling, ShellOptions options);
    ~Shell();
    Shell(const Shell&) = delete;

    ShellOptions options;
    Session& session() const;

    /// Runs one line. Returns LinuxCNC's exit status: 0 all good, 1 something failed. `name` is
    /// what messages call the source: "<shell>" or "<commandline>"; `number` is the line's in it.
    int execute(std::string_view line, Output& output, std::string_view name = "<shell>",
                std::uint32_t number = 1);
    /// Runs one command whose words are given as they are: no quotes, no comments, nothing to
    /// substitute.
    int execute(const std::vector<std::string>& words, Output& output,
                std::string_view name = "<commandline>");
    /// Runs several commands of words like a text: consecutive edits are one transaction.
    int execute(const std::vector<std::vector<std::string>>& commands, Output& output,
                std::string_view name);
    /// Runs a text as a file: consecutive edits are one transaction, ended by commands that act and
    /// by the end.
    int run_text(std::string name, std::string text, Output& output);
    /// Runs a .hal file, or an .ini file with its [HAL] section: HALFILE=, HALCMD=, TWOPASS=. An
    /// .ini file also becomes what [SECTION]KEY is looked up in.
    int run_file(const std::string& path, Output& output);
    /// After a simulation: prints a warning when time has passed and no function has run.
    void warn_when_nothing_ran(Output& output);
    /// Reads an .ini file for [SECTION]KEY only (`-i`).
    int read_ini(const std::string& path, Output& output);
    /// Runs the files of [HAL]HALFILE, with TWOPASS, of the INI file at `path`, which was read.
    int run_halfiles(const std::string& path, Output& output);
    /// Sets what runs the Tcl files among them; without it they are errors.
    void run_scripts_with(ScriptRunner runner);

    /// True between `begin` and `commit` or `abort`; the edits are kept in this shell and invisible
    /// to others.
    bool collecting() const;
    /// Adds commands that set NAME VALUE to those collected since `begin`.
    void collect(const std::vector<Command>& commands);
    /// True after `quit` or `exit` was executed; the caller then stops reading lines.
    bool quit() const;
    /// Interrupts a command that waits, and all later ones until cancel(false). [any]
    void cancel(bool on = true);
    /// True when executing the line may wait for something outside (loadusr -w …), so that a server
    /// needs a thread for it.
    static bool may_wait(std::string_view text);

    /// As complete_line().
    Completion complete(std::string_view line, std::size_t cursor) const;

    /// What $NAME means in commands; empty: the environment of this process. A client of the socket
    /// brings its own.
    void look_up(std::function<std::optional<std::string>(const std::string&)> variable);
    /// What [SECTION]KEY means in commands; without a value, the INI file of the session. A client
    /// of the socket brings its own.
    void look_in(std::optional<Ini> ini);

    /// Notes the journal that the machine writes. `origin`: where it is named. Returns the origin of
    /// another one that was noted before, or "".
    std::string note_journal(const JournalLine& journal, const std::string& origin);
    /// Notes the journal that `hal run --journal` names: a line `journal` that names another one is
    /// ignored. Does nothing with an empty name.
    void note_journal_option(const std::string& file, std::int64_t keep_ns);
    /// Sets the lines that latencies() of this shell and its siblings adds: about signals between
    /// the machines of a cell.
    void add_latencies(std::vector<std::string> lines);
    /// Returns what `show latency` prints: one line per signal, sorted. The session's lock must be
    /// held.
    std::vector<std::string> latencies() const;
    struct State;

private:
    /// Keeps the name of the INI file that stands beside the netlist, for errors of keys without one.
    void note_ini_beside(const std::string& netlist);

    std::unique_ptr<State> state_;
};

}  // namespace hal
