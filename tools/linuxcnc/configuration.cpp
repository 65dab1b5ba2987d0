// SPDX-License-Identifier: MIT
#include "linuxcnc/configuration.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <iterator>
#include <sstream>
#include <unistd.h>

#include "cli/output.hpp"
#include "commands/files.hpp"
#include "commands/ini_version.hpp"
#include "linuxcnc/find/programs.hpp"
#include "linuxcnc/leftovers.hpp"
#include "linuxcnc/screen.hpp"
#include "text/characters.hpp"
#include "text/diagnostic.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

namespace {

namespace fs = std::filesystem;

Words words_of(const std::string& text) {
    std::istringstream in(text);
    return {std::istream_iterator<std::string>(in), {}};
}

bool executable(const std::string& file) {
    return ::access(file.c_str(), X_OK) == 0 && !fs::is_directory(file);
}

constexpr std::string_view include_word = "#INCLUDE";

bool is_include(std::string_view line) {
    return line.starts_with(include_word) && line.size() > include_word.size() &&
           is_blank(line[include_word.size()]);
}

/// The text of an INI file with the text of its includes in their place. That all can be read,
/// Ini::read has found.
std::string with_includes(const std::string& path, bool& any) {
    std::string text, whole;
    if (!read_text_file(path, text, whole)) {
        return {};
    }
    whole.clear();
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const std::string_view content = trimmed(line);
        if (!is_include(content)) {
            whole += line + "\n";
            continue;
        }
        any = true;
        whole +=
            with_includes(resolve_path(std::string(trimmed(content.substr(include_word.size()))),
                                       folder_of(path)),
                          any);
    }
    return whole;
}

/// LinuxCNC's programs do not read includes: they get a file without them, beside the INI file
/// because relative paths start there.
bool expand(Configuration& configuration, const Options& options) {
    bool any = false;
    const std::string text = with_includes(configuration.file, any);
    if (!any) return true;
    const std::string file = configuration.file + ".expanded";
    if (const std::string problem = write_file(file, text); !problem.empty()) {
        fail(options,
             fmt::format("{} has #INCLUDE, so a file with the included text is needed beside "
                         "it: {}; copy the configuration, with the files that it names, to a "
                         "folder that you can write to (LinuxCNC also keeps its parameters "
                         "there), and run the copy",
                         configuration.given, problem));

        return false;
    }
    configuration.file = file;
    configuration.expanded = true;
    return true;
}

class Reader {
public:
    Reader(const LinuxcncOptions& options, Configuration& to) : options_(options), to_(to) {}

    /// Reports all problems.
    bool read() {
        version();
        to_.task = program("TASK", "TASK", "milltask");
        const bool newer = to_.linuxcnc.version == LinuxcncVersion::v2_10;
        to_.io = newer ? Words{} : program("EMCIO", "EMCIO", "io");
        to_.halui = program("HAL", "HALUI", "");
        to_.bridge = newer ? program("HAL", "HALBRIDGE", "") : Words{};
        to_.display = program("DISPLAY", "DISPLAY", "");
        to_.planner =
            words_of(options_.planner.empty() ? value("TRAJ", "TPMOD", "tpmod") : options_.planner);
        to_.homing = words_of(options_.homing.empty() ? value("EMCMOT", "HOMEMOD", "homemod")
                                                      : options_.homing);
        to_.nml = value("LINUXCNC", "NML_FILE", value("EMC", "NML_FILE", to_.linuxcnc.nml));
        to_.nml = resolve_path(to_.nml, to_.folder);
        to_.shutdown = value("HAL", "SHUTDOWN", "");
        for (const std::string& line : to_.ini.all("APPLICATIONS", "APP")) {
            to_.applications.push_back(application(words_of(line)));
        }
        delay();
        watchdogs();
        programs();
        return valid_;
    }

private:
    void version() {
        const std::string problem = ini_version_problem(to_.ini);
        if (!problem.empty()) {
            complain(fmt::format("{}; type: update_ini {}", problem, to_.given));
        }
    }

    void delay() {
        const std::string text = value("APPLICATIONS", "DELAY", "0");
        const auto seconds = parse_real(text);
        if (!seconds || !(*seconds >= 0 && *seconds <= 3600)) {
            complain(fmt::format("[APPLICATIONS]DELAY is {}, not a time of 0..3600 seconds", text));
            return;
        }
        to_.applications_delay_ns = static_cast<std::int64_t>(*seconds * 1e9);
    }

    /// Keys of our own: what is not tolerated of task and of the CPU.
    void watchdogs() {
        constexpr std::int64_t usual_task_timeout_ns = 5'000'000'000;
        // of threads without a real-time priority, which others may delay at any time
        constexpr std::int64_t usual_gap_ns = 2'000'000'000;
        const bool declared = to_.ini.get("HALCYON", "MAX_CPU_GAP").has_value();
        to_.max_gap_ns = usual_gap_ns;
        to_.task_timeout_ns = usual_task_timeout_ns;
        limit("MAX_CPU_GAP", to_.max_gap_ns);
        limit("TASK_TIMEOUT", to_.task_timeout_ns);
        if (declared) {
            to_.max_gap_realtime_ns = to_.max_gap_ns;
        }
    }

    void limit(const char* key, std::int64_t& ns) {
        const auto text = to_.ini.get("HALCYON", key);
        if (!text) return;
        const auto given = parse_duration_ns(*text);
        if (!given) {
            complain(
                fmt::format("[HALCYON]{} is '{}', not a time; write 500ms, 2s or 0", key, *text));
        }
        ns = given.value_or(0);
    }

    /// The programs of LinuxCNC, and those that the INI file names.
    void programs() {
        for (const std::string& name :
             {std::string("linuxcncsvr"), to_.io.empty() ? "" : to_.io[0], to_.task[0]}) {
            if (!name.empty() && find_part(name).empty()) {
                report_missing_part(name);
                break;  // the others are in the same package
            }
        }
        require("[HAL]HALUI", to_.halui);
        require("[HAL]HALBRIDGE", to_.bridge);
        display();
        for (const Words& application : to_.applications) {
            require("[APPLICATIONS]APP", application);
        }
    }

    void report_missing_part(const std::string& name) {
        valid_ = false;
        if (to_.linuxcnc.libraries.empty()) {
            fail(options_, fmt::format("'{}' is not installed; type: sudo apt-get install "
                                       "linuxcnc-uspace",
                                       name));
            return;
        }
        fail(options_, fmt::format("'{}' is missing in the source tree {}, which LINUXCNC_HOME "
                                   "names; build it there",
                                   name, to_.linuxcnc.home));
    }

    void display() {
        if (to_.display.empty()) {
            complain(
                "[DISPLAY]DISPLAY is missing: the machine runs as long as its display does; "
                "write DISPLAY = axis, linuxcncrsh, ./my-ui.py or dummy");
            return;
        }
        if (to_.display[0] != "dummy") {
            require("[DISPLAY]DISPLAY", to_.display);
        }
        if (!opens_windows(to_.display[0])) return;
        if (const std::string problem = screen_problem(); !problem.empty()) {
            complain(
                fmt::format("[DISPLAY]DISPLAY is '{}', which opens windows, and {}; start it in a "
                            "terminal of the desktop, or on another computer after: ssh -X",
                            to_.display[0], problem));
        }
    }

    /// A source tree has its own programs: those of a LinuxCNC that is installed as well, which
    /// PATH leads to, are of another version.
    std::string find_part(const std::string& name) {
        const bool own = name == "linuxcncsvr" || name == "io" || name == "milltask";
        if (to_.linuxcnc.libraries.empty() || !own) return find_program(to_, name);
        std::vector<std::string> folders = to_.linuxcnc.programs;
        folders.insert(folders.begin(), to_.folder + "/bin");
        for (const std::string& folder : folders) {
            if (executable(folder + "/" + name)) return folder + "/" + name;
        }
        return {};
    }

    /// Whether a display is one of LinuxCNC's that need a screen.
    static bool opens_windows(const std::string& program) {
        static constexpr std::string_view all[] = {"axis",  "gmoccapy", "gscreen",   "mdro",
                                                   "qtvcp", "touchy",   "tklinuxcnc"};
        return std::ranges::find(all, program) != std::end(all);
    }

    void require(const char* key, const Words& program) {
        if (!program.empty() && find_program(to_, program[0]).empty()) {
            report_missing(key, program[0]);
        }
    }

    void report_missing(const char* key, const std::string& program) {
        const std::string beside = resolve_path(program, to_.folder);
        std::string why = "it is not in PATH";
        if (fs::exists(beside) && program.find('/') == program.npos) {
            why = fmt::format("it is not in PATH; for the file beside the INI file write ./{}",
                              program);
        } else if (fs::exists(beside)) {
            why = fmt::format("it is not executable; type: chmod +x {}", beside);
        } else if (program.find('/') != program.npos) {
            why = "No such file or directory";
        }
        complain(fmt::format("{} is '{}', which cannot be started: {}", key, program, why));
    }

    Words program(const char* section, const char* key, const char* otherwise) {
        return with_home(words_of(value(section, key, otherwise)));
    }
    static Words with_home(Words words) {
        if (!words.empty() && words[0].starts_with('~')) {
            words[0] = resolve_path(words[0], "");
        }
        return words;
    }
    /// Also a file beside the INI file, without ./ before its name.
    Words application(Words words) {
        if (words.empty() || words[0].find('/') != std::string::npos) {
            return with_home(std::move(words));
        }
        if (find_program(to_, words[0]).empty() && executable(to_.folder + "/" + words[0])) {
            words[0] = "./" + words[0];
        }
        return words;
    }
    std::string value(const char* section, const char* key, const std::string& otherwise) {
        const auto found = to_.ini.get(section, key);
        return found && !found->empty() ? *found : otherwise;
    }
    void complain(const std::string& sentence) {
        valid_ = false;
        fail(options_, fmt::format("{}: {}", to_.given, sentence));
    }

    const LinuxcncOptions& options_;
    Configuration& to_;
    bool valid_ = true;
};

/// Reports the netlists of [HAL]HALFILE that cannot be read, where the INI file has other errors,
/// so that nothing runs that would find them.
void report_unreadable_netlists(const Configuration& configuration,
                                const LinuxcncOptions& options) {
    export_configuration(configuration, options);  // where LIB:FILE is
    for (const std::string& entry : configuration.ini.all("HAL", "HALFILE")) {
        const Words words = words_of(entry);
        std::string path;
        std::string text;
        std::string problem;
        if (words.empty() || read_netlist(words[0], configuration.folder, path, text, problem)) {
            continue;
        }
        fail(options, fmt::format("{}: [HAL]HALFILE is '{}', which cannot be read: {}",
                                  configuration.given, words[0], problem));
    }
}

void set_variable(const char* name, const std::string& value, bool replace = true) {
    ::setenv(name, value.c_str(), replace ? 1 : 0);
}

std::string with_rest(const std::string& first, const char* variable) {
    const char* const rest = std::getenv(variable);
    return rest && *rest ? first + ":" + rest : first;
}

/// The variable with the folder first, or as it is if it has the folder: then what is before the
/// folder, such as our library, is to stay there.
std::string with_folder(const std::string& folder, const char* variable) {
    const char* const before = std::getenv(variable);
    const std::string there = before ? before : "";
    return (":" + there + ":").find(":" + folder + ":") == there.npos ? with_rest(folder, variable)
                                                                      : there;
}

}  // namespace

std::string find_program(const Configuration& configuration, const std::string& program) {
    if (program.find('/') != program.npos) {
        const std::string file = resolve_path(program, configuration.folder);
        return executable(file) ? file : "";
    }
    std::istringstream folders(
        with_rest(fmt::format("{}/bin:{}", configuration.folder,
                              fmt::join(configuration.linuxcnc.programs, ":")),
                  "PATH"));
    for (std::string folder; std::getline(folders, folder, ':');) {
        if (std::string file = (folder.empty() ? "." : folder) + "/" + program; executable(file)) {
            return file;
        }
    }
    // Its Tcl programs are not in PATH: tklinuxcnc.
    const std::string script = configuration.linuxcnc.tcl + "/" + program + ".tcl";
    return executable(script) ? script : "";
}

std::optional<Configuration> read_configuration(const LinuxcncOptions& options) {
    Configuration configuration;
    configuration.given = options.words.empty() ? "" : options.words[0];
    if (options.words.size() != 1 || !configuration.given.ends_with(".ini")) {
        const std::string extra = options.words.size() > 1 ? options.words[1] : configuration.given;
        fail(options,
             options.words.size() > 1
                 ? fmt::format("unexpected argument '{}'; arguments of the display go behind --",
                               extra)
                 : fmt::format("'{}' is not an INI file; type: hal linuxcnc FILE.ini", extra));
        return std::nullopt;
    }
    configuration.linuxcnc = linuxcnc_installation();
    if (const std::string problem = ask_version(configuration.linuxcnc); !problem.empty()) {
        fail(options, problem);
        return std::nullopt;
    }
    configuration.file = absolute_path(configuration.given);
    configuration.folder = folder_of(configuration.file);
    // the working folder changes
    if (configuration.given.find('/') != std::string::npos) {
        configuration.given = configuration.file;
    }
    Sources sources;
    Diagnostics diagnostics;
    configuration.ini = Ini::read(sources, configuration.given, diagnostics);
    write_all(STDERR_FILENO, render(diagnostics, sources, colours(STDERR_FILENO)));
    if (diagnostics.failed()) return std::nullopt;
    if (!Reader(options, configuration).read()) {
        report_unreadable_netlists(configuration, options);
        return std::nullopt;
    }
    if (!expand(configuration, options)) return std::nullopt;
    return configuration;
}

void remove_expanded(const Configuration& configuration) {
    if (configuration.expanded) {
        ::unlink(configuration.file.c_str());
    }
}

void export_configuration(const Configuration& configuration, const LinuxcncOptions& options) {
    const Installation& of = configuration.linuxcnc;
    set_variable("INI_FILE_NAME", configuration.file);
    set_variable(launcher_variable, std::to_string(::getpid()));
    set_variable("CONFIG_DIR", configuration.folder);
    set_variable("NMLFILE", configuration.nml);
    if (options.linuxcnc_modules) {
        set_variable("HALCYON_MODULES", "linuxcnc");
    }
    set_variable("HAL_RTMOD_DIR", of.modules, false);
    set_variable("HALLIB_DIR", of.hallib);
    set_variable("HALLIB_PATH",
                 (options.halfiles.empty() ? "" : canonical_path(options.halfiles) + ":") +
                     ".:" + of.hallib);
    set_variable("HALCMD", options.keep_going ? "halcmd -k" : "halcmd");
    set_variable("REALTIME",
                 "true");  // programs run it with `start` or `stop`; the machine does both itself
    set_variable("LINUXCNC_HOME", of.home);
    set_variable("LINUXCNC_TCL_DIR", of.tcl);
    set_variable("LINUXCNC_LANG_DIR", of.messages);
    set_variable("LINUXCNC_EMCSH", "wish");
    set_variable("LINUXCNC_HELP_DIR", of.help);
    set_variable("LINUXCNC_NCFILES_DIR", of.ncfiles);
    set_variable("PYOPENGL_PLATFORM", "x11", false);
    set_variable("TRAJ_COORDINATES", configuration.ini.get("TRAJ", "COORDINATES").value_or(""));
    set_variable("KINS_KINEMATICS", configuration.ini.get("KINS", "KINEMATICS").value_or(""));
    set_variable("PYTHONPATH", with_folder(of.python, "PYTHONPATH"));
    if (!of.libraries.empty()) {
        set_variable("EMC2_HOME", of.home);
        set_variable("LD_LIBRARY_PATH", with_folder(of.libraries, "LD_LIBRARY_PATH"));
        set_variable("TCLLIBPATH", of.tcl);
    }
    std::error_code unknown;
    const std::string own = fs::read_symlink("/proc/self/exe", unknown).parent_path().string();
    set_variable("PATH", with_rest(fmt::format("{}/bin:{}/bin:{}:{}", configuration.folder,
                                               linuxcnc_folder(), own, fmt::join(of.programs, ":")),
                                   "PATH"));
}

}  // namespace hal::tools
