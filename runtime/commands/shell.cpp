// SPDX-License-Identifier: MIT
#include "commands/shell.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <sstream>
#include <utility>
#include <vector>

#include "commands/files.hpp"
#include "commands/ini_version.hpp"
#include "commands/script.hpp"
#include "commands/shell_state.hpp"
#include "commands/table.hpp"
#include "linuxcnc/find/modules.hpp"
#include "machine/session.hpp"

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
      state_(new State{.session = sibling.session(), .latencies = sibling.state_->latencies}) {}

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

namespace {

int cannot_read(Shell& shell, Output& output, const std::string& path, const std::string& problem,
                Code code, std::string help) {
    Diagnostics diagnostics;
    diagnostics.error(code, {}, "'" + path + "' cannot be read: " + problem, "", std::move(help));
    const auto lock = shell.session().lock();
    if (shell.options.level != Level::nothing) {
        output.err(render(diagnostics, shell.session().sources, shell.options.color));
    }
    return 1;
}

}  // namespace

namespace {

/// The programs that LinuxCNC starts by itself, before the files of [HAL] and between HALFILE and
/// POSTGUI_HALFILE.
void note_programs(Session& session, const Ini& ini) {
    const auto started = [&](const char* section, const char* key, const char* otherwise,
                             std::vector<std::string> names) {
        const std::string program = ini.get(section, key).value_or(otherwise);
        if (!program.empty()) {
            session.absences().note_program(program.substr(0, program.find(' ')), names);
        }
    };
    started("EMCIO", "EMCIO", "", {"iocontrol"});
    started("HAL", "HALUI", "", {"halui"});
    const std::string display = ini.get("DISPLAY", "DISPLAY").value_or("");
    started(
        "DISPLAY", "DISPLAY", "",
        {"axisui", "pyvcp", "gladevcp", "qtvcp", "gmoccapy", display.substr(0, display.find(' '))});
}

/// `hal check`: whether `hal linuxcnc` would run the configuration. Returns 1 after reporting that it would not.
int check_version(Shell& shell, const std::string& path, Output& output) {
    const Ini& ini = shell.session().ini;
    std::string problem = is_linuxcnc_configuration(ini) ? ini_version_problem(ini) : "";
    if (problem.empty()) return 0;
    const Ini::Entry* const version = ini.find("EMC", "VERSION");
    if (!version) {
        problem = path + ": " + problem;
    }
    Diagnostics diagnostics;
    diagnostics.error("ini-version", version ? version->at : Span{}, problem, "",
                      "type: update_ini " + path);
    const auto lock = shell.session().lock();
    if (shell.options.level != Level::nothing) {
        output.err(render(diagnostics, shell.session().sources, shell.options.color));
    }
    return 1;
}

/// Rejects an INI file that names nothing to run.
int reject_without_netlist(Shell& shell, const std::string& path, Output& output) {
    Diagnostics diagnostics;
    diagnostics.error("ini-without-netlist", Span{},
                      path + ": names no netlist: [HAL] has neither HALFILE nor HALCMD", "",
                      "write under [HAL]: HALFILE = FILE.hal; to use the file for its values only, "
                      "type: hal run --ini " +
                          path + " FILE.hal");
    const auto lock = shell.session().lock();
    if (shell.options.level != Level::nothing) {
        output.err(render(diagnostics, shell.session().sources, shell.options.color));
    }
    return 1;
}

}  // namespace

int Shell::run_file(const std::string& path, Output& output) {
    if (path.ends_with(".ini")) return run_ini(path, output);
    if (path.ends_with(".tcl")) {
        return cannot_read(
            *this, output, path, "it is a Tcl script", "unsupported-file",
            "`hal run` executes it, and `haltcl` on a running machine; here only .hal and .ini "
            "files are supported, with loops as ranges: pid.[0..5].command");
    }
    std::string text, problem;
    if (!read_text_file(resolve_path(path, options.directory), text, problem, true)) {
        if (options.check) {
            state_->session.absences().note_missing_text(path);
        }
        return cannot_read(*this, output, path, problem, "unreadable-file", "");
    }
    return run_text(path, std::move(text), output);
}

int Shell::read_ini(const std::string& path, Output& output) {
    Diagnostics diagnostics;
    const auto lock = state_->session.lock();
    Ini ini =
        Ini::read(state_->session.sources, resolve_path(path, options.directory), diagnostics);
    if (!diagnostics.all().empty() && options.level != Level::nothing) {
        output.err(render(diagnostics, state_->session.sources, options.color));
    }
    if (diagnostics.failed()) return 1;
    state_->session.ini = std::move(ini);
    return 0;
}

/// One netlist named by [HAL]HALFILE or [HAL]POSTGUI_HALFILE.
struct HalFile {
    std::string name;  ///< as messages call it; of a script, its path
    std::string text;
    bool script = false;
    std::vector<std::string> arguments = {};  ///< of a script
};

namespace {

std::vector<std::string> words_of(const std::string& line) {
    std::istringstream in(line);
    return {std::istream_iterator<std::string>(in), {}};
}

}  // namespace

void Shell::run_scripts_with(ScriptRunner runner) { state_->run_script = std::move(runner); }

/// Reads the files that a key of [HAL] names, relative to the folder of the INI file. Returns 1
/// after reporting those that cannot be read.
int Shell::take_files(const std::string& path, const char* key, std::vector<HalFile>& files,
                      Output& output) {
    int status = 0;
    std::string at;  // of a file named by a relative path
    for (const std::string& entry : state_->session.ini.all("HAL", key)) {
        std::vector<std::string> words = words_of(entry);
        const std::string file = words.empty() ? "" : words[0];
        std::string text, problem = "it is a Tcl script";
        const bool script = file.ends_with(".tcl");
        if ((!script || state_->run_script) &&
            read_netlist(file, options.directory, at, text, problem)) {
            // Messages name it as the INI file was named.
            const std::string beside = resolve_path(file, options.directory);
            if (script) {
                files.push_back({at, "", true, {words.begin() + 1, words.end()}});
            } else {
                files.push_back(
                    {at == beside ? resolve_path(file, folder_of(path)) : at, std::move(text)});
            }
            continue;
        }
        if (options.check) {
            state_->session.absences().note_missing_text(file);
        }
        status = script && !state_->run_script
                     ? cannot_read(*this, output, file, problem, "unsupported-file",
                                   "`hal run " + path +
                                       "` executes it; or rewrite it as a .hal file, where loops "
                                       "become ranges: pid.[0..5].command")
                     : cannot_read(*this, output, file, problem, "unreadable-file",
                                   "named by [HAL]" + std::string(key) + " in " + path +
                                       "; HALLIB_PATH and HALLIB_DIR are further search paths");
    }
    return status;
}

int Shell::run_halfiles(const std::string& path, Output& output) {
    const Borrowed in_folder(options.directory,
                             folder_of(absolute_path(resolve_path(path, options.directory))));
    std::vector<HalFile> files;
    const int status = take_files(path, "HALFILE", files, output);
    if (status != 0 && !options.keep_going) return status;
    bool quit = false;
    return status | run_taken(files, quit, output);
}

/// Runs netlists that were read, with [HAL]TWOPASS. Sets `quit` when a `quit` in them ends the
/// loading.
int Shell::run_taken(std::vector<HalFile>& files, bool& quit, Output& output) {
    int status = 0;
    const auto over = [&] {
        return quit || (status != 0 && !options.keep_going && !options.check);
    };
    const bool two_pass = !state_->session.ini.get("HAL", "TWOPASS").value_or("").empty();
    if (!two_pass) {
        for (HalFile& file : files) {
            status |= file.script
                          ? state_->run_script(file.name, file.arguments, Pass::both, output)
                          : run_text(file.name, std::move(file.text), output);
            if (over()) break;
        }
        return status;
    }
    const bool scripts =
        std::any_of(files.begin(), files.end(), [](const HalFile& file) { return file.script; });
    std::vector<Command> module_loads;
    for (const Pass pass : scripts || prefers_modules() ? std::vector{Pass::loads, Pass::rest}
                                                        : std::vector{Pass::both}) {
        state_->module_loads = pass == Pass::loads ? &module_loads : nullptr;
        for (auto file = files.begin(); file != files.end() && !over();) {
            if (file->script) {
                status |= state_->run_script(file->name, file->arguments, pass, output);
                ++file;
                continue;
            }
            Script script(*this, *state_, output);
            std::vector<std::uint32_t> sources;
            for (; file != files.end() && !file->script; ++file) {
                sources.push_back(script.add_text(file->name, file->text));
            }
            status |= script.run_two_pass(sources, pass);
            quit = quit || script.quit_seen();
        }
        state_->module_loads = nullptr;
        if (pass == Pass::loads && !over()) {
            status |= Script(*this, *state_, output).run(module_loads);
        }
    }
    const auto lock = state_->session.lock();
    for (const std::uint32_t text : std::exchange(state_->module_load_texts, {})) {
        state_->session.sources.release(text);
    }
    return status;
}

int Shell::run_ini(const std::string& path, Output& output) {
    if (read_ini(path, output) != 0) return 1;
    const Ini& ini = state_->session.ini;
    // As LinuxCNC does, everything named in the file is relative to its folder.
    const Borrowed in_folder(options.directory,
                             folder_of(absolute_path(resolve_path(path, options.directory))));
    if (options.check) {
        note_programs(state_->session, ini);
    }
    std::vector<HalFile> files, after_display;
    int status = options.check ? check_version(*this, path, output) : 0;
    status |= take_files(path, "HALFILE", files, output);
    // for `hal check` only: no user interface runs here
    if (options.check) {
        status |= take_files(path, "POSTGUI_HALFILE", after_display, output);
    }
    if (status != 0 && !options.keep_going) return status;
    std::string commands;
    for (const std::string& command : ini.all("HAL", "HALCMD")) {
        commands += command + "\n";
    }
    if (status == 0 && files.empty() && commands.empty()) {
        return reject_without_netlist(*this, path, output);
    }
    bool quit = false;
    status |= run_taken(files, quit, output);
    if (quit || (status != 0 && !options.keep_going && !options.check)) return status;
    if (!commands.empty()) {
        status |= run_text(path + " [HAL]HALCMD", std::move(commands), output);
    }
    for (HalFile& file : after_display) {
        status |= run_text(file.name, std::move(file.text), output);
    }
    return status;
}

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
    if (!diagnostics.all().empty() && options.level != Level::nothing) {
        output.err(render(diagnostics, state_->session.sources, options.color));
    }
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
