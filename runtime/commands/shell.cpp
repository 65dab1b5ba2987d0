// SPDX-License-Identifier: MIT
#include "commands/shell.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "commands/files.hpp"
#include "commands/foreign_file.hpp"
#include "commands/ini_netlists.hpp"
#include "commands/script.hpp"
#include "commands/shell_state.hpp"
#include "commands/table.hpp"
#include "hal/privilege.hpp"
#include "machine/session.hpp"

namespace hal {
namespace {

bool write_all(FILE* file, FILE* other, std::string_view text) {
    std::fflush(other);
    return std::fwrite(text.data(), 1, text.size(), file) == text.size() && std::fflush(file) == 0;
}

}  // namespace

void ProcessOutput::out(std::string_view text) {
    const bool lost_before = std::ferror(stdout) != 0;
    if (write_all(stdout, stderr, text)) return;
    if (errno == EPIPE) {
        std::clearerr(stdout);  // its reader has left, as `head` does
    } else if (!lost_before) {
        err(std::string("hal: cannot write to standard output: ") + std::strerror(errno) + "\n");
    }
}
void ProcessOutput::err(std::string_view text) { write_all(stderr, stdout, text); }

Shell::Shell(Session& session, ShellOptions o)
    : options(std::move(o)), state_(new State{.session = session}) {}

Shell::Shell(Shell& sibling, ShellOptions o)
    : options(std::move(o)),
      state_(new State{.session = sibling.session(),
                       .latencies = sibling.state_->latencies,
                       .journal = sibling.state_->journal}) {}

Shell::~Shell() {
    if (state_->collected.empty()) return;
    const auto lock = state_->session.lock();
    for (const Command& one : state_->collected) {
        state_->session.sources.release(one.span.source);
    }
}

Session& Shell::session() const { return state_->session; }
bool Shell::collecting() const { return state_->collecting; }
void Shell::collect(const std::vector<Command>& commands) {
    state_->collected.insert(state_->collected.end(), commands.begin(), commands.end());
}
bool Shell::quit() const { return state_->quit; }
void Shell::cancel(bool on) { state_->cancelled.store(on, std::memory_order_relaxed); }

void Shell::look_up(std::function<std::optional<std::string>(const std::string&)> variable) {
    state_->variable = std::move(variable);
}

std::string Shell::note_journal(const JournalLine& journal, const std::string& origin) {
    State::NotedJournal& noted = *state_->journal;
    if (noted.origin.empty()) {
        noted = {journal, origin};
    }
    const bool is_same = absolute_path(noted.journal.file) == absolute_path(journal.file) &&
                         noted.journal.keep_ns == journal.keep_ns;
    return is_same ? "" : noted.origin;
}

void Shell::note_journal_option(const std::string& file, std::int64_t keep_ns) {
    if (!file.empty()) {
        note_journal({file, keep_ns}, "--journal " + file);
    }
}

void Shell::add_latencies(std::vector<std::string> lines) {
    const auto lock = state_->session.lock();
    *state_->latencies = std::move(lines);
}

std::vector<std::string> Shell::latencies() const {
    std::vector<std::string> lines = state_->session.reports().latencies();
    lines.insert(lines.end(), state_->latencies->begin(), state_->latencies->end());
    std::sort(lines.begin(), lines.end());
    return lines;
}

void Shell::look_in(std::optional<Ini> ini) { state_->ini = std::move(ini); }

int Shell::execute(const std::vector<std::string>& words, Output& output, std::string_view name) {
    return words.empty() ? 0 : execute(std::vector<std::vector<std::string>>{words}, output, name);
}

int Shell::execute(const std::vector<std::vector<std::string>>& all, Output& output,
                   std::string_view name) {
    Script script(*this, *state_, output);
    std::vector<Command> commands;
    std::string text;
    for (const auto& words : all) {
        commands.push_back(command_of(words, 0, text));
    }
    const std::uint32_t source = script.add_text(std::string(name), std::move(text));
    for (Command& command : commands) {
        command.span.source = command.name.span.source = source;
        for (Token& word : command.args) {
            word.span.source = source;
        }
    }
    const int status = script.run(commands);
    if (script.quit_seen()) {
        state_->quit = true;
    }
    return status;
}

int Shell::execute(std::string_view line, Output& output, std::string_view name,
                   std::uint32_t number) {
    Script script(*this, *state_, output);
    const std::uint32_t source = script.add_text(std::string(name), std::string(line), number);
    const int status = script.run(source);
    if (script.quit_seen()) {
        state_->quit = true;
    }
    return status;
}

int Shell::run_text(std::string name, std::string text, Output& output) {
    Script script(*this, *state_, output);
    return script.run(script.add_text(std::move(name), std::move(text)));
}

int Shell::run_file(const std::string& path, Output& output) {
    if (path.ends_with(".ini")) {
        if (read_ini(path, output) != 0) return 1;
        return IniNetlists(*this, *state_, path, output).run();
    }
    if (path.ends_with(".tcl")) {
        return report_unreadable(
            *this, output, path, "it is a Tcl script", "unsupported-file",
            "`hal run` executes it, and `haltcl` on a running machine; here only .hal and .ini "
            "files are supported, with loops as ranges: pid.[0..5].command");
    }
    std::string text, problem;
    const bool is_read = read_text_file(resolve_path(path, options.directory), text, problem, true);
    if (const auto foreign = is_read ? foreign_file(path, text) : std::nullopt) {
        return report(*this, output, "unsupported-file", foreign->sentence, foreign->help);
    }
    if (!is_read) {
        if (options.check) {
            state_->session.absences().note_missing_text(path);
        }
        return report_unreadable(*this, output, path, problem, "unreadable-file", "");
    }
    note_ini_beside(path);
    return run_text(path, std::move(text), output);
}

void Shell::note_ini_beside(const std::string& netlist) {
    const std::string ini = std::filesystem::path(netlist).replace_extension(".ini").string();
    std::error_code ignored;
    if (std::filesystem::is_regular_file(resolve_path(ini, options.directory), ignored)) {
        const auto lock = state_->session.lock();
        state_->session.ini.set_candidate(privilege::shell_word(ini));
    }
}

int Shell::read_ini(const std::string& path, Output& output) {
    Diagnostics diagnostics;
    const auto lock = state_->session.lock();
    Ini ini =
        Ini::read(state_->session.sources, resolve_path(path, options.directory), diagnostics);
    print_diagnostics(diagnostics, *this, output);
    if (diagnostics.failed()) return 1;
    state_->session.ini = std::move(ini);
    return 0;
}

int Shell::run_halfiles(const std::string& path, Output& output) {
    return IniNetlists(*this, *state_, path, output).run_halfiles();
}

void Shell::run_scripts_with(ScriptRunner runner) { state_->run_script = std::move(runner); }

namespace {

bool has_functions(const Model& model) {
    return std::any_of(model.components.begin(), model.components.end(),
                       [](const auto& component) { return !component->functions.empty(); });
}

bool runs_functions(const Model& model) {
    return std::any_of(model.threads.begin(), model.threads.end(),
                       [](const auto& thread) { return !thread->functions.empty(); });
}

/// Why no function has run although time has passed; nothing when one has, or when there is none.
void check_that_something_ran(const Session& session, Diagnostics& diagnostics) {
    const Model& model = session.model();
    const Span at = session.threads().first_advance();
    if (!has_functions(model) || session.threads().functions_ran() ||
        session.threads().now_ns() == 0) {
        return;
    }
    if (model.threads.empty()) {
        diagnostics.warning(
            "nothing-ran", at, "no thread exists, so no function ran", "",
            "create one with `newthread servo-thread 1000000`, then `addf FUNCTION servo-thread`");
    } else if (!runs_functions(model)) {
        diagnostics.warning("nothing-ran", at, "no function is in a thread, so none ran", "",
                            "addf FUNCTION " + model.threads.front()->name +
                                "; to see the functions: show function");
    } else if (!session.threads().was_started()) {
        diagnostics.warning("nothing-ran", at, "the threads were never started, so no function ran",
                            "", "write `start` before this line");
    }
}

}  // namespace

void Shell::warn_when_nothing_ran(Output& output) {
    Diagnostics diagnostics;
    const auto lock = state_->session.lock();
    check_that_something_ran(state_->session, diagnostics);
    print_diagnostics(diagnostics, *this, output);
}

Completion Shell::complete(std::string_view line, std::size_t cursor) const {
    return complete_line(state_->session, options, line, cursor);
}

bool Shell::may_wait(std::string_view text) {
    static const auto waiting = [] {
        std::vector<std::string_view> names;
        for (const auto& row : command_table()) {
            if (row.behaviour.waiting == Waiting::possible) {
                names.push_back(row.name);
            }
        }
        return names;
    }();
    // A match anywhere is enough, and the values of $NAME and [SECTION]KEY are unknown here:
    // running a harmless text in a thread of its own costs little.
    if (text.find_first_of("$[") != text.npos) return true;
    return std::any_of(waiting.begin(), waiting.end(),
                       [&](std::string_view name) { return text.find(name) != text.npos; });
}

}  // namespace hal
