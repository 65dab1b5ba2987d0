// SPDX-License-Identifier: MIT
#include "shell/shell.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include "session/session.hpp"
#include "shell/commands.hpp"
#include "shell/files.hpp"
#include "shell/script.hpp"
#include "shell/state.hpp"

namespace hal {
namespace {

void write_all(FILE* file, FILE* other, std::string_view text) {
    std::fflush(other);
    std::fwrite(text.data(), 1, text.size(), file);
    std::fflush(file);
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

void ProcessOutput::out(std::string_view text) { write_all(stdout, stderr, text); }
void ProcessOutput::err(std::string_view text) { write_all(stderr, stdout, text); }

Shell::Shell(Session& session, ShellOptions o)
    : options(std::move(o)), state_(new State{session, std::make_shared<Processes>(session), false, {}, false, {}, {}}) {}

Shell::Shell(Shell& sibling, ShellOptions o)
    : options(std::move(o)), state_(new State{sibling.session(), sibling.state_->processes, false, {}, false, {}, {}}) {}

Shell::~Shell() = default;

Session& Shell::session() const { return state_->session; }
Processes& Shell::processes() const { return *state_->processes; }
bool Shell::collecting() const { return state_->collecting; }
bool Shell::quit() const { return state_->quit; }
void Shell::cancel(bool on) { state_->cancelled.store(on, std::memory_order_relaxed); }

void Shell::look_up(std::function<std::optional<std::string>(const std::string&)> variable) { state_->variable = std::move(variable); }

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
    const std::scoped_lock lock(shell.session().mutex);
    if (shell.options.level != Level::nothing) output.err(render(diagnostics, shell.session().sources, shell.options.color));
    return 1;
}

}  // namespace

int Shell::run_file(const std::string& path, Output& output) {
    if (path.ends_with(".ini")) return run_ini(path, output);
    if (path.ends_with(".tcl"))
        return cannot_read(*this, output, path, "it is a Tcl script", "unsupported-file",
                           "only .hal and .ini files are read; loops and name lists are written with [0..5] and {x,y,z}");
    std::string text, problem;
    if (!read_text_file(resolve_path(path, options.directory), text, problem))
        return cannot_read(*this, output, path, problem, "unreadable-file", "");
    return run_text(path, std::move(text), output);
}

int Shell::read_ini(const std::string& path, Output& output) {
    Diagnostics diagnostics;
    const std::scoped_lock lock(state_->session.mutex);
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
    for (const std::string& entry : ini.all("HAL", "HALFILE")) {
        std::string file = entry.substr(0, entry.find(' ')), text, problem;
        if (file.starts_with("LIB:")) {
            const char* const library = std::getenv("HALLIB_DIR");
            file = (library ? std::string(library) + "/" : "") + file.substr(4);
        }
        if (file.ends_with(".tcl")) {
            status = cannot_read(*this, output, file, "it is a Tcl script", "unsupported-file",
                                 "write it as a .hal file; loops become ranges: pid.[0..5].command");
        } else if (const std::string name = resolve_path(file, folder_of(path));
                   read_text_file(resolve_path(file, options.directory), text, problem)) {
            texts.emplace_back(name, std::move(text));
        } else {
            status = cannot_read(*this, output, file, problem, "unreadable-file", "named by [HAL]HALFILE in " + path);
        }
    }
    if (status != 0 && !options.keep_going) return status;
    std::string commands;
    for (const std::string& command : ini.all("HAL", "HALCMD")) commands += command + "\n";

    const bool two_pass = !ini.get("HAL", "TWOPASS").value_or("").empty();
    if (two_pass) {
        Script script(*this, *state_, output);
        std::vector<std::uint32_t> sources;
        for (auto& [name, text] : texts) sources.push_back(state_->session.sources.add(name, std::move(text)));
        status |= script.run_two_pass(sources);
        if (script.quit_seen()) return status;
    } else {
        for (auto& [name, text] : texts) {
            status |= run_text(name, std::move(text), output);
            if (status != 0 && !options.keep_going && !options.check) return status;
        }
    }
    if (status != 0 && !options.keep_going && !options.check) return status;
    if (!commands.empty()) status |= run_text(path + " [HAL]HALCMD", std::move(commands), output);
    return status;
}

bool Shell::may_wait(std::string_view text) {
    static const auto waiting = [] {
        std::vector<std::string_view> names;
        for (const auto& row : command_table())
            if (row.flags & command_waits) names.push_back(row.name);
        return names;
    }();
    // A word anywhere is enough, and what $NAME and [SECTION]KEY stand for is not known here: running a harmless text in a
    // thread of its own costs little.
    if (text.find_first_of("$[") != text.npos) return true;
    return std::any_of(waiting.begin(), waiting.end(), [&](std::string_view name) { return text.find(name) != text.npos; });
}

}  // namespace hal
