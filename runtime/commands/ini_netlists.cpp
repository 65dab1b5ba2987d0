// SPDX-License-Identifier: MIT
#include "commands/ini_netlists.hpp"

#include <algorithm>
#include <iterator>
#include <sstream>
#include <utility>

#include "commands/files.hpp"
#include "commands/ini_version.hpp"
#include "commands/script.hpp"
#include "linuxcnc/find/modules.hpp"
#include "machine/session.hpp"
#include "text/quoting.hpp"

namespace hal {

void print_diagnostics(const Diagnostics& diagnostics, const Shell& shell, Output& output) {
    if (diagnostics.all().empty() || shell.options.level == Level::nothing) return;
    if (shell.options.observer) {
        shell.options.observer->reported(diagnostics, shell.session().sources);
    }
    output.err(render(diagnostics, shell.session().sources, shell.options.color));
}

int report(const Shell& shell, Output& output, Code code, std::string sentence, std::string help) {
    Diagnostics diagnostics;
    diagnostics.error(code, {}, std::move(sentence), "", std::move(help));
    const auto lock = shell.session().lock();
    print_diagnostics(diagnostics, shell, output);
    return 1;
}

int report_unreadable(const Shell& shell, Output& output, const std::string& path,
                      const std::string& problem, Code code, std::string help) {
    return report(shell, output, code, "'" + path + "' cannot be read: " + problem,
                  std::move(help));
}

namespace {

/// The shell's folder while an INI file is run.
class InFolder {
public:
    InFolder(std::string& directory, std::string folder)
        : directory_(directory), before_(std::exchange(directory, std::move(folder))) {}
    ~InFolder() { directory_ = std::move(before_); }
    InFolder(const InFolder&) = delete;

private:
    std::string& directory_;
    std::string before_;
};

/// Everything that an INI file names is relative to its folder, as in LinuxCNC.
std::string folder_of_ini(const std::string& path, const std::string& directory) {
    return folder_of(absolute_path(resolve_path(path, directory)));
}

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

/// The modules that `hal linuxcnc` loads before the netlists, where they are not LinuxCNC's own:
/// what they have is unknown. A home module adds pins to the joints.
void note_own_modules(Session& session, const Ini& ini) {
    const auto note = [&](const char* section, const char* key, const std::string& usual) {
        const std::string entry = ini.get(section, key).value_or(usual);
        const std::string module = entry.substr(0, entry.find(' '));
        if (module.empty() || module == usual) return std::optional<Absences::Cause>();
        return std::optional(session.absences().add("module " + hal::quoted(module),
                                                    "which is not loaded here", {},
                                                    Absences::Scope::component));
    };
    note("TRAJ", "TPMOD", "tpmod");
    if (const auto homing = note("EMCMOT", "HOMEMOD", "homemod")) {
        session.absences().note("joint", homing);
    }
}

std::vector<std::string> split_entry(const std::string& line) {
    std::istringstream in(line);
    return {std::istream_iterator<std::string>(in), {}};
}

}  // namespace

IniNetlists::IniNetlists(Shell& shell, Shell::State& state, const std::string& path, Output& output)
    : shell_(shell), state_(state), path_(path), output_(output) {}

/// `hal check`: whether `hal linuxcnc` would run the configuration. Returns 1 after reporting that
/// it would not.
int IniNetlists::check_version() {
    const Ini& ini = state_.session.ini;
    std::string problem = is_linuxcnc_configuration(ini) ? ini_version_problem(ini) : "";
    if (problem.empty()) return 0;
    const Ini::Entry* const version = ini.find("EMC", "VERSION");
    if (!version) {
        problem = path_ + ": " + problem;
    }
    Diagnostics diagnostics;
    diagnostics.error("ini-version", version ? version->at : Span{}, problem, "",
                      "type: update_ini " + path_);
    const auto lock = state_.session.lock();
    print_diagnostics(diagnostics, shell_, output_);
    return 1;
}

/// Rejects an INI file that names nothing to run.
int IniNetlists::reject_without_netlist() {
    Diagnostics diagnostics;
    diagnostics.error("ini-without-netlist", Span{},
                      path_ + ": names no netlist: [HAL] has neither HALFILE nor HALCMD", "",
                      "write under [HAL]: HALFILE = FILE.hal; to use the file for its values only, "
                      "type: hal run --ini " +
                          path_ + " FILE.hal");
    const auto lock = state_.session.lock();
    print_diagnostics(diagnostics, shell_, output_);
    return 1;
}

/// Reports a file that a key of [HAL] names. Returns 1.
int IniNetlists::report_missing(const char* key, const std::string& file,
                                const std::string& problem) {
    if (shell_.options.check) {
        state_.session.absences().note_missing_text(file);
    }
    if (file.ends_with(".tcl") && !state_.run_script) {
        return report_unreadable(shell_, output_, file, problem, "unsupported-file",
                                 "`hal run " + path_ +
                                     "` executes it; or rewrite it as a .hal file, where loops "
                                     "become ranges: pid.[0..5].command");
    }
    return report_unreadable(shell_, output_, file, problem, "unreadable-file",
                             "named by [HAL]" + std::string(key) + " in " + path_ +
                                 "; HALLIB_PATH and HALLIB_DIR are further search paths");
}

/// Reads the files that a key of [HAL] names, relative to the folder of the INI file. Returns 1
/// after reporting those that cannot be read.
int IniNetlists::read(const char* key, std::vector<File>& files) {
    const std::string& directory = shell_.options.directory;
    int status = 0;
    std::string at;  // of a file named by a relative path
    for (const std::string& entry : state_.session.ini.all("HAL", key)) {
        const std::vector<std::string> words = split_entry(entry);
        const std::string file = words.empty() ? "" : words[0];
        std::string text;
        std::string problem = "it is a Tcl script";
        const bool is_script = file.ends_with(".tcl");
        const bool can_run = !is_script || state_.run_script;
        if (!can_run || !read_netlist(file, directory, at, text, problem)) {
            status = report_missing(key, file, problem);
            continue;
        }
        if (is_script) {
            files.push_back({at, "", true, {words.begin() + 1, words.end()}});
            continue;
        }
        // messages name it as the INI file was named
        const bool is_beside = at == resolve_path(file, directory);
        files.push_back({is_beside ? resolve_path(file, folder_of(path_)) : at, std::move(text)});
    }
    return status;
}

bool IniNetlists::is_over(int status) const {
    const ShellOptions& options = shell_.options;
    return quit_ || (status != 0 && !options.keep_going && !options.check);
}

int IniNetlists::run_one_by_one(std::vector<File>& files) {
    int status = 0;
    for (File& file : files) {
        if (file.is_script) {
            status |= state_.run_script(file.name, file.arguments, Pass::both, output_);
        } else {
            status |= shell_.run_text(file.name, std::move(file.text), output_);
        }
        if (is_over(status)) break;
    }
    return status;
}

/// Runs the scripts one by one, and the netlists between two of them together.
int IniNetlists::run_pass(std::vector<File>& files, Pass pass) {
    int status = 0;
    for (auto file = files.begin(); file != files.end() && !is_over(status);) {
        if (file->is_script) {
            status |= state_.run_script(file->name, file->arguments, pass, output_);
            ++file;
            continue;
        }
        Script script(shell_, state_, output_);
        std::vector<std::uint32_t> sources;
        for (; file != files.end() && !file->is_script; ++file) {
            sources.push_back(script.add_text(file->name, file->text));
        }
        status |= script.run_two_pass(sources, pass);
        quit_ = quit_ || script.quit_seen();
    }
    return status;
}

int IniNetlists::run_in_two_passes(std::vector<File>& files) {
    const bool has_scripts = std::ranges::any_of(files, &File::is_script);
    if (!has_scripts && !prefers_modules()) return run_pass(files, Pass::both);
    std::vector<Command> module_loads;
    state_.module_loads = &module_loads;
    int status = run_pass(files, Pass::loads);
    state_.module_loads = nullptr;
    if (!is_over(status)) {
        status |= Script(shell_, state_, output_).run(module_loads);
    }
    if (!is_over(status)) {
        status |= run_pass(files, Pass::rest);
    }
    const auto lock = state_.session.lock();
    for (const std::uint32_t text : std::exchange(state_.module_load_texts, {})) {
        state_.session.sources.release(text);
    }
    return status;
}

int IniNetlists::run(std::vector<File>& files) {
    const bool two_pass = !state_.session.ini.get("HAL", "TWOPASS").value_or("").empty();
    return two_pass ? run_in_two_passes(files) : run_one_by_one(files);
}

int IniNetlists::run_halfiles() {
    std::string& directory = shell_.options.directory;
    const InFolder in_folder(directory, folder_of_ini(path_, directory));
    std::vector<File> files;
    const int status = read("HALFILE", files);
    if (status != 0 && !shell_.options.keep_going) return status;
    return status | run(files);
}

int IniNetlists::run() {
    std::string& directory = shell_.options.directory;
    const InFolder in_folder(directory, folder_of_ini(path_, directory));
    const Ini& ini = state_.session.ini;
    std::vector<File> files;
    std::vector<File> after_display;
    int status = 0;
    if (shell_.options.check) {
        note_programs(state_.session, ini);
        note_own_modules(state_.session, ini);
        status = check_version();
    }
    status |= read("HALFILE", files);
    // for `hal check` only: no user interface runs here
    if (shell_.options.check) {
        status |= read("POSTGUI_HALFILE", after_display);
    }
    if (status != 0 && !shell_.options.keep_going) return status;
    std::string commands;
    for (const std::string& command : ini.all("HAL", "HALCMD")) {
        commands += command + "\n";
    }
    if (status == 0 && files.empty() && commands.empty()) return reject_without_netlist();
    status |= run(files);
    if (is_over(status)) return status;
    if (!commands.empty()) {
        status |= shell_.run_text(path_ + " [HAL]HALCMD", std::move(commands), output_);
    }
    for (File& file : after_display) {
        status |= shell_.run_text(file.name, std::move(file.text), output_);
    }
    return status;
}

}  // namespace hal
