// SPDX-License-Identifier: MIT
#include "commands/shell.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "machine/session.hpp"
#include "commands/table.hpp"
#include "commands/files.hpp"
#include "commands/script.hpp"
#include "commands/shell_state.hpp"

namespace hal {
namespace {

bool write_all(FILE* file, FILE* other, std::string_view text) {
    std::fflush(other);
    return std::fwrite(text.data(), 1, text.size(), file) == text.size() && std::fflush(file) == 0;
}

/// A session's own option while a file is run.
template <class T>
class Borrowed {
public:
    Borrowed(T& where, T value) : where_(where), before_(std::exchange(where, std::move(value))) {}
    ~Borrowed() { where_ = std::move(before_); }
    Borrowed(const Borrowed&) = delete;

private:
    T& where_;
    T before_;
};

}  // namespace

void ProcessOutput::out(std::string_view text) {
    const bool lost_before = std::ferror(stdout) != 0;
    if (write_all(stdout, stderr, text)) return;
    if (errno == EPIPE) std::clearerr(stdout);  // its reader has left, as `head` does
    else if (!lost_before) err(std::string("hal: cannot write to standard output: ") + std::strerror(errno) + "\n");
}
void ProcessOutput::err(std::string_view text) { write_all(stderr, stdout, text); }

Shell::Shell(Session& session, ShellOptions o)
    : options(std::move(o)), state_(new State{.session = session}) {}

Shell::Shell(Shell& sibling, ShellOptions o)
    : options(std::move(o)), state_(new State{.session = sibling.session(), .latencies = sibling.state_->latencies}) {}

Shell::~Shell() = default;

Session& Shell::session() const { return state_->session; }
bool Shell::collecting() const { return state_->collecting; }
void Shell::collect(const std::vector<Command>& commands) {
    state_->collected.insert(state_->collected.end(), commands.begin(), commands.end());
}
bool Shell::quit() const { return state_->quit; }
void Shell::cancel(bool on) { state_->cancelled.store(on, std::memory_order_relaxed); }

void Shell::look_up(std::function<std::optional<std::string>(const std::string&)> variable) { state_->variable = std::move(variable); }

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

int Shell::execute(const std::vector<std::vector<std::string>>& all, Output& output, std::string_view name) {
    Script script(*this, *state_, output);
    Sources& sources = state_->session.sources;
    std::vector<Command> commands;
    std::string text;
    for (const auto& words : all) commands.push_back(command_of(words, 0, text));
    const std::uint32_t source = sources.add(std::string(name), std::move(text));
    for (Command& command : commands) {
        command.span.source = command.name.span.source = source;
        for (Token& word : command.args) word.span.source = source;
    }
    const int status = script.run(commands);
    if (script.quit_seen()) state_->quit = true;
    if (script.text_can_go()) sources.drop(source);
    return status;
}

int Shell::execute(std::string_view line, Output& output, std::string_view name, std::uint32_t number) {
    Script script(*this, *state_, output);
    Session& session = state_->session;
    const std::uint32_t source = session.sources.add(std::string(name), std::string(line), number);
    const int status = script.run(source);
    if (script.quit_seen()) state_->quit = true;
    if (script.text_can_go()) session.sources.drop(source);
    return status;
}

int Shell::run_text(std::string name, std::string text, Output& output) {
    Script script(*this, *state_, output);
    Session& session = state_->session;
    const std::uint32_t source = session.sources.add(std::move(name), std::move(text));
    const int status = script.run(source);
    if (script.text_can_go()) session.sources.drop(source);
    return status;
}

namespace {

int cannot_read(Shell& shell, Output& output, const std::string& path, const std::string& problem, Code code, std::string help) {
    Diagnostics diagnostics;
    diagnostics.error(code, {}, "'" + path + "' cannot be read: " + problem, "", std::move(help));
    const auto lock = shell.session().lock();
    if (shell.options.level != Level::nothing) output.err(render(diagnostics, shell.session().sources, shell.options.color));
    return 1;
}

}  // namespace

namespace {

/// The programs that LinuxCNC starts by itself, before the files of [HAL] and between HALFILE and POSTGUI_HALFILE.
void note_programs(Session& session, const Ini& ini) {
    const auto started = [&](const char* section, const char* key, const char* otherwise, std::vector<std::string> names) {
        const std::string program = ini.get(section, key).value_or(otherwise);
        if (!program.empty()) session.absences().note_program(program.substr(0, program.find(' ')), names);
    };
    started("EMCIO", "EMCIO", "", {"iocontrol"});
    started("HAL", "HALUI", "", {"halui"});
    const std::string display = ini.get("DISPLAY", "DISPLAY").value_or("");
    started("DISPLAY", "DISPLAY", "", {"axisui", "pyvcp", "gladevcp", "qtvcp", "gmoccapy", display.substr(0, display.find(' '))});
}

}  // namespace

int Shell::run_file(const std::string& path, Output& output) {
    if (path.ends_with(".ini")) return run_ini(path, output);
    if (path.ends_with(".tcl"))
        return cannot_read(*this, output, path, "it is a Tcl script", "unsupported-file",
                           "only .hal and .ini files are supported; write loops and name lists with [0..5] and {x,y,z}");
    std::string text, problem;
    if (!read_text_file(resolve_path(path, options.directory), text, problem, true)) {
        if (options.check) state_->session.absences().note_missing_text(path);
        return cannot_read(*this, output, path, problem, "unreadable-file", "");
    }
    return run_text(path, std::move(text), output);
}

int Shell::read_ini(const std::string& path, Output& output) {
    Diagnostics diagnostics;
    const auto lock = state_->session.lock();
    Ini ini = Ini::read(state_->session.sources, resolve_path(path, options.directory), diagnostics);
    if (!diagnostics.all().empty() && options.level != Level::nothing)
        output.err(render(diagnostics, state_->session.sources, options.color));
    if (diagnostics.failed()) return 1;
    state_->session.ini = std::move(ini);
    return 0;
}

int Shell::run_ini(const std::string& path, Output& output) {
    if (read_ini(path, output) != 0) return 1;
    const Ini& ini = state_->session.ini;
    const std::string full = resolve_path(path, options.directory);
    // As LinuxCNC does, everything named in the file is relative to its folder.
    const Borrowed in_folder(options.directory, folder_of(canonical_path(full)));

    int status = 0;
    std::vector<std::pair<std::string, std::string>> texts;  // name, text
    std::string at;                                          // of a file named by a relative path
    const auto take_files = [&](const char* key) {
        for (const std::string& entry : ini.all("HAL", key)) {
            const std::string file = entry.substr(0, entry.find(' '));
            std::string text, problem = "it is a Tcl script";
            const bool script = file.ends_with(".tcl");
            if (!script && read_netlist(file, options.directory, at, text, problem)) {
                // Messages name it as the INI file was named.
                const std::string beside = resolve_path(file, options.directory);
                texts.emplace_back(at == beside ? resolve_path(file, folder_of(path)) : at, std::move(text));
                continue;
            }
            if (options.check) state_->session.absences().note_missing_text(file);
            status = script ? cannot_read(*this, output, file, problem, "unsupported-file",
                                          "rewrite it as a .hal file; loops become ranges: pid.[0..5].command")
                            : cannot_read(*this, output, file, problem, "unreadable-file",
                                          "named by [HAL]" + std::string(key) + " in " + path +
                                              "; HALLIB_PATH and HALLIB_DIR are further search paths");
        }
    };
    if (options.check) note_programs(state_->session, ini);
    take_files("HALFILE");
    const std::size_t before_display = texts.size();
    if (options.check) take_files("POSTGUI_HALFILE");  // for `hal check` only: no user interface runs here
    if (status != 0 && !options.keep_going) return status;
    std::string commands;
    for (const std::string& command : ini.all("HAL", "HALCMD")) commands += command + "\n";

    const bool two_pass = !ini.get("HAL", "TWOPASS").value_or("").empty();
    if (two_pass) {
        Script script(*this, *state_, output);
        std::vector<std::uint32_t> sources;
        for (auto& [name, text] : std::span(texts).first(before_display)) sources.push_back(state_->session.sources.add(name, std::move(text)));
        status |= script.run_two_pass(sources);
        if (script.quit_seen()) return status;
    } else {
        for (auto& [name, text] : std::span(texts).first(before_display)) {
            status |= run_text(name, std::move(text), output);
            if (status != 0 && !options.keep_going && !options.check) return status;
        }
    }
    if (status != 0 && !options.keep_going && !options.check) return status;
    if (!commands.empty()) status |= run_text(path + " [HAL]HALCMD", std::move(commands), output);
    for (auto& [name, text] : std::span(texts).subspan(before_display)) status |= run_text(name, std::move(text), output);
    return status;
}

bool Shell::may_wait(std::string_view text) {
    static const auto waiting = [] {
        std::vector<std::string_view> names;
        for (const auto& row : command_table())
            if (row.flags & command_waits) names.push_back(row.name);
        return names;
    }();
    // A match anywhere is enough, and the values of $NAME and [SECTION]KEY are unknown here: running a harmless text in a
    // thread of its own costs little.
    if (text.find_first_of("$[") != text.npos) return true;
    return std::any_of(waiting.begin(), waiting.end(), [&](std::string_view name) { return text.find(name) != text.npos; });
}

}  // namespace hal
