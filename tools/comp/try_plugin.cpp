// SPDX-License-Identifier: MIT
#include "comp/try_plugin.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "commands/shell.hpp"
#include "comp/toolchain.hpp"
#include "doc/page.hpp"
#include "machine/load/plugins.hpp"
#include "machine/session.hpp"
#include "text/characters.hpp"
#include "text/glyphs.hpp"

namespace hal::tools {

namespace {

using Json = nlohmann::json;
constexpr unsigned max_s = 20;  // for all that is tried

/// The first error of a shell's text, without its place and code.
std::string first_error(const std::string& text) {
    const auto at = text.find("error: ");
    if (at == std::string::npos) return "it gave no reason";
    std::string line = text.substr(at + 7, text.find('\n', at) - at - 7);
    if (const auto code = line.rfind(" ["); code != std::string::npos && line.ends_with(']')) {
        line.resize(code);
    }
    return line;
}

SessionOptions alone(bool check) {
    SessionOptions options;
    options.name = fmt::format("compile-{}", ::getpid());
    options.virtual_clock = true;
    options.check_only = check;
    return options;
}

/// Returns the option of a pin that has no effect, or "".
std::string mistake_of(const Pin& pin, const std::string& own) {
    const bool output = pin.dir == HAL_DIR_OUT;
    if (!*pin.doc) {
        return fmt::format(
            "pin '{}' has no documentation; describe it in a few words after its name", own);
    }
    if ((pin.flags & HAL_PIN_SAFE) && (pin.dir == HAL_DIR_IN || pin.dir == HAL_DIR_PARAM)) {
        return fmt::format(
            "pin '{}' is an {} and has .safe, which applies to outputs only: the value they take "
            "when the machine stops",
            own, pin.dir == HAL_DIR_IN ? "input" : "parameter");
    }
    if ((pin.flags & HAL_PIN_FINITE) && pin.type != HAL_TYPE_FLOAT) {
        return fmt::format("pin '{}' has .finite, which applies to pins of type double only", own);
    }
    if ((pin.flags & HAL_PIN_FINITE) && !output && pin.dir != HAL_DIR_IO) {
        return fmt::format("pin '{}' has .finite, which applies to outputs only", own);
    }
    return {};
}

/// What a component was doing when its process ended.
enum class Stage : int { load, construct, destroy, run };

/// "its constructor does not return within 20 s", "its destructor crashes (Segmentation fault)".
std::string end_in(Stage stage, int signal) {
    std::string how = "ends the process";
    if (signal == SIGALRM) {
        how = fmt::format("does not return within {} s", max_s);
    } else if (signal != 0) {
        how = fmt::format("crashes ({})", ::strsignal(signal));
    }
    switch (stage) {
    case Stage::load: return "the constructor of a static object of it " + how;
    case Stage::construct: return "its constructor " + how;
    case Stage::destroy: return "its destructor " + how;
    case Stage::run: break;
    }
    return "a function of it " + how + ", with the initial values of its pins";
}

/// Everything that is tried. What goes wrong is in "problem", the pin or function it is about in
/// "subject".
class Trial {
public:
    /// What a line of a netlist can name in loadrt and unload.
    static bool can_be_loaded(std::string_view name) {
        return !name.empty() && is_letter(name[0]) &&
               std::ranges::all_of(name, is_name_character) && name != "threads" && name != "all";
    }

    Trial(const std::string& name, int descriptor, bool author)
        : name_(name), descriptor_(descriptor), author_(author) {}

    void run() {
        Diagnostics diagnostics;
        const Plugins plugins;
        const auto plugin = plugins.open(name_, {}, diagnostics);
        if (!plugin) {
            std::string why = diagnostics.all().empty() ? "it cannot be opened"
                                                        : diagnostics.all().front().message;
            if (const auto at = why.find("is not a usable component: "); at != std::string::npos) {
                why.erase(0, at + 27);
            }
            return bad("no-component", why);
        }
        if (const std::string_view own = plugin->component->name; !can_be_loaded(own)) {
            return bad("name",
                       fmt::format("'{}' cannot be a component's name: it is made of letters, "
                                   "digits, underscores, hyphens and dots, begins with "
                                   "a letter, and is neither threads nor all",
                                   own));
        }
        stage(Stage::construct);
        Page page;
        std::string needs;
        if (!gather(*plugin->component, page, needs, [this] { stage(Stage::destroy); })) {
            page.functions.clear();
            page.pins.clear();
        }
        const bool arguments = !page.arguments.empty();
        std::string function = page.functions.empty() ? "" : page.full_name(page.functions.front());
        if (const auto n = function.find(".N"); n != std::string::npos) {
            function.replace(n, 2, ".0");
        }
        answer_ = {{"name", plugin->component->name},
                   {"summary", page.summary},
                   {"pins", page.pins.size()},
                   {"functions", page.functions.size()},
                   {"function", function},
                   {"needs", ""}};
        const bool starts =
            plugin->component->abi_minor < 1 || (plugin->component->flags & HAL_COMPONENT_STARTS);
        answer_["starts"] = starts;
        if (!construct(arguments) || !answer_["needs"].get<std::string>().empty() || starts) {
            return finish();
        }
        cycles();
        finish();
    }

private:
    void stage(Stage what) {
        write_all(descriptor_, Json{{"stage", static_cast<int>(what)}}.dump() + "\n");
    }
    /// Notes that what was made is destroyed next.
    struct EndOfBlock {
        Trial& trial;
        ~EndOfBlock() { trial.stage(Stage::destroy); }
    };
    void finish() { write_all(descriptor_, answer_.dump() + "\n"); }
    void bad(const char* what, const std::string& why) {
        answer_["kind"] = what;
        answer_["problem"] = why;
        finish();
    }

    /// Loads the component as a netlist would. `has_arguments`: a failure may be that of a default.
    /// Returns whether it may run.
    bool construct(bool has_arguments) {
        stage(Stage::construct);
        Session session(alone(true));
        Shell shell(session, ShellOptions{});
        TextOutput output;
        const EndOfBlock end{*this};
        if (shell.run_text("compile", "loadrt " + name_ + "\n", output) != 0) {
            const std::string reason = first_error(output.err_text);
            const bool needs_arguments = has_arguments && !is_of_declaration(reason);
            answer_[needs_arguments ? "needs" : "problem"] = reason;
            return needs_arguments;
        }
        if (!author_) return true;
        for (const auto& component : session.model().components) {
            for (const auto& instance : component->instances) {
                if (!check_pins(*instance)) return false;
                hint_at_shared_pins(*instance);
            }
        }
        return true;
    }

    /// Returns whether an error of loadrt is about a declaration, which no argument changes.
    static bool is_of_declaration(const std::string& error) {
        return error.find("declare") != std::string::npos ||
               error.find("virtual") != std::string::npos;
    }

    /// Returns whether the declarations of all pins are valid; notes the first mistake.
    bool check_pins(const Instance& instance) {
        for (const auto& pin : instance.pins) {
            const std::string mistake = mistake_of(*pin, own_name(*pin, instance));
            if (mistake.empty()) continue;
            answer_["problem"] = mistake;
            return false;
        }
        return true;
    }

    /// The name of a pin without that of its instance.
    static std::string own_name(const Pin& pin, const Instance& instance) {
        const std::string prefix = instance.name + ".";
        return pin.name.starts_with(prefix) ? pin.name.substr(prefix.size()) : pin.name;
    }

    /// Notes that all functions have to run in one thread, if a pin belongs to all of them.
    void hint_at_shared_pins(const Instance& instance) {
        if (instance.functions.size() < 2) return;
        const auto shared = std::ranges::find_if(
            instance.pins, [](const auto& pin) { return pin->function == nullptr; });
        if (shared == instance.pins.end()) return;
        answer_["hint"] = fmt::format(
            "its {} functions share pin '{}' and others that name no function, so they "
            "have to run in one thread; for pins "
            "of one function name it: {{*this, FUNCTION, \"{}\", ...}}",
            instance.functions.size(), (*shared)->name, own_name(**shared, instance));
    }

    void cycles() {
        stage(Stage::construct);
        Session session(alone(false));
        Shell shell(session, ShellOptions{});
        TextOutput output;
        const EndOfBlock end{*this};
        std::string text =
            "loadrt threads name1=hal-compile period1=1000000\nloadrt " + name_ + "\n";
        if (shell.run_text("compile", text, output) != 0) {
            return void(answer_["problem"] = first_error(output.err_text));
        }
        stage(Stage::run);
        text.clear();
        for (const auto& component : session.model().components) {
            for (const auto& function : component->functions) {
                text += "addf " + function->name + " hal-compile\n";
            }
        }
        if (shell.run_text("compile", text + "start\nadvance 3 cycles\n", output) != 0) {
            return void(answer_["problem"] = first_error(output.err_text));
        }
        for (const FaultRecord& fault : session.reports().faults()) {
            std::string what = fault.sentence.substr(fault.sentence.find(": ") + 2);
            what = what.substr(0, what.find(';'));
            answer_["problem"] = "with the initial values of its pins " + what;
            return;
        }
    }

    std::string name_;
    int descriptor_;
    bool author_;
    Json answer_ = Json::object();
};

std::vector<std::string> lines_of(const PluginSource& source) {
    std::string text;
    std::vector<std::string> lines;
    if (!read_file(source.path, text)) return lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) {
        lines.push_back(line);
    }
    return lines;
}

/// "FILE:LINE: " of what a problem is about: the last line that has the name it quotes in double
/// quotes (of a duplicate, the second).
std::string place_of(const std::string& problem, const PluginSource& source) {
    const std::vector<std::string> lines = lines_of(source);
    const auto found = [&](const std::string& text) {
        for (std::size_t i = lines.size(); i-- > 0;) {
            if (lines[i].find(text) != std::string::npos &&
                lines[i].find("HAL_COMPONENT") == std::string::npos) {
                return i + 1;
            }
        }
        return std::size_t{0};
    };
    std::size_t line =
        problem.find("must not be virtual") != std::string::npos ? found("virtual ") : 0;
    for (std::size_t at = 0; line == 0 && (at = problem.find('\'', at)) != std::string::npos;) {
        const auto end = problem.find('\'', at + 1);
        if (end == std::string::npos) break;
        std::string name = problem.substr(at + 1, end - at - 1);
        at = end + 1;
        line = found("\"" + name + "\"");
        for (auto dot = name.find('.'); line == 0 && dot != std::string::npos;
             dot = name.find('.')) {
            name.erase(0, dot + 1);
            line = found("\"" + name + "\"");
        }
    }
    return line == 0 ? "" : fmt::format("{}:{}: ", source.path, line);
}

/// What the process that tries a plugin reported before it ended.
struct TrialReport {
    Stage stage = Stage::load;  ///< what it did last
    Json answer = Json::object();  ///< of Trial; empty if the process ended before it had one
    int signal = 0;  ///< the signal that ended the process, or 0

    bool is_complete() const { return !answer.empty() && signal == 0; }
    std::string text(const char* key) const { return answer.value(key, std::string()); }
};

/// Parses the lines of a Trial: a stage whenever the next one begins, and an answer.
TrialReport parse_report(const std::string& text, int wait_status) {
    TrialReport report;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        Json message = Json::parse(line, nullptr, false);
        if (!message.is_object()) continue;
        if (message.contains("stage")) {
            report.stage = static_cast<Stage>(message["stage"].get<int>());
        } else {
            report.answer = std::move(message);
        }
    }
    if (WIFSIGNALED(wait_status)) {
        report.signal = WTERMSIG(wait_status);
    }
    return report;
}

/// Puts a folder before all others in which plugins are looked for.
void prepend_plugin_path(const std::string& folder) {
    const char* const path = std::getenv("HALCYON_PLUGIN_PATH");
    const std::string others = path && *path ? ":" + std::string(path) : "";
    ::setenv("HALCYON_PLUGIN_PATH", (folder + others).c_str(), 1);
}

/// The child process: tries the plugin for at most max_s seconds, without output of its own, and
/// writes the report to `report_fd`.
[[noreturn]] void run_trial(const std::string& folder, const std::string& name,
                            const PluginSource& source, int report_fd) {
    const int null_device = ::open("/dev/null", O_RDWR);
    ::dup2(null_device, STDOUT_FILENO);
    ::dup2(null_device, STDERR_FILENO);
    std::signal(SIGALRM, SIG_DFL);
    ::alarm(max_s);
    prepend_plugin_path(folder);
    Trial(name, report_fd, source.language == Language::cpp).run();
    ::_exit(0);  // what the plugin would do at exit is not asked for
}

/// Tries the plugin in a child process, which it may crash. Returns nullopt, with errno, if no
/// process can be started.
std::optional<TrialReport> try_in_child(const std::string& folder, const std::string& name,
                                        const PluginSource& source) {
    int pipe_ends[2];
    if (::pipe2(pipe_ends, O_CLOEXEC) != 0) return std::nullopt;
    const auto [read_end, write_end] = pipe_ends;
    const pid_t child = ::fork();
    if (child == 0) {
        run_trial(folder, name, source, write_end);
    }
    const int fork_error = errno;
    ::close(write_end);
    if (child < 0) {
        ::close(read_end);
        errno = fork_error;
        return std::nullopt;
    }
    std::string text;
    const int wait_status = finish_program(child, read_end, text);
    return parse_report(text, wait_status);
}

/// Describes a plugin whose process ended before it had an answer.
void describe_end(const TrialReport& report, const std::string& name, BuiltPlugin& built) {
    built.loads = report.stage != Stage::load;
    const std::string subject = built.loads ? "component '" + name + "': " : "";
    built.problem = subject + end_in(report.stage, report.signal);
}

void describe_problem(const TrialReport& report, const PluginSource& source, BuiltPlugin& built) {
    built.problem = report.text("problem");
    built.loads = report.text("kind") != "no-component";
    if (built.loads) {
        built.problem = place_of(built.problem, source) + built.problem;
    }
}

void describe_component(const TrialReport& report, BuiltPlugin& built) {
    built.name = report.text("name");
    built.summary = report.text("summary");
    built.function = report.text("function");
    built.needs = report.text("needs");
    built.hint = report.text("hint");
    built.starts = report.answer.value("starts", false);
    built.pins = report.answer.value("pins", std::size_t{0});
    built.functions = report.answer.value("functions", std::size_t{0});
}

}  // namespace

bool try_plugin(const std::string& folder, const std::string& name, const PluginSource& source,
                BuiltPlugin& built) {
    const std::optional<TrialReport> report = try_in_child(folder, name, source);
    if (!report) {
        built.problem = fmt::format("it cannot be tried: {}", std::strerror(errno));
        return false;
    }
    if (!report->is_complete()) {
        describe_end(*report, name, built);
        return false;
    }
    if (!report->text("problem").empty()) {
        describe_problem(*report, source, built);
        return false;
    }
    describe_component(*report, built);
    return true;
}

std::string without_false_hint(const std::string& messages, const PluginSource& source) {
    static const std::regex line_there(R"(using\s+(hal::)?Component::Component)"),
        leads_in(R"(: In instantiation of|required from|^In file included from|^ +from )");
    const std::vector<std::string> text = lines_of(source);
    if (std::none_of(text.begin(), text.end(),
                     [](const std::string& line) { return std::regex_search(line, line_there); })) {
        return messages;
    }
    std::vector<std::string> kept;
    std::istringstream in(messages);
    bool dropping = false;
    for (std::string line; std::getline(in, line);) {
        if (line.find("static assertion failed") != std::string::npos &&
            line.find("missing line in the component: using") != std::string::npos) {
            while (!kept.empty() && std::regex_search(kept.back(), leads_in)) {
                kept.pop_back();
            }
            dropping = true;
            continue;
        }
        dropping = dropping && (line.starts_with(' ') || line.find("note: ") != std::string::npos);
        if (!dropping) {
            kept.push_back(line);
        }
    }
    std::string all;
    for (const std::string& line : kept) {
        all += line + "\n";
    }
    return all;
}

}  // namespace hal::tools
