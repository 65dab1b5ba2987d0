// SPDX-License-Identifier: MIT
// The only source that includes CLI11: a row per subcommand, and what its options are.
#include "commands.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/core.h>
#include <optional>

#include "base/diagnostic.hpp"
#include "base/types.hpp"
#include "options.hpp"
#include "paths.hpp"
#include "say.hpp"

namespace hal::tools {

namespace {

struct Subcommand {
    const char* name;
    const char* usage;    ///< what may follow the name
    const char* summary;
    int (*run)(const Options&);
    void (*declare)(CLI::App&, Options&);
    bool verbatim = false;  ///< from the first word on everything belongs to the words, `-1` and `--` too
};

void words(CLI::App& app, Options& o, const char* name, const char* what, bool required = true) {
    CLI::Option* option = app.add_option(name, o.words, what);
    if (required) option->required();
}

void for_how_long(CLI::App& app, Options& o, const char* what) {
    const auto take = [&o](const std::string& text) {
        const auto ns = parse_duration_ns(text, false);
        if (!ns || *ns < 0) throw CLI::ValidationError("--for", fmt::format("'{}' is not a duration; write 10s, 250ms or 2min", text));
        o.for_ns = *ns;
    };
    app.add_option_function<std::string>("--for", take, what)->type_name("TIME");
}

void named(CLI::App& app, Options& o, const char* what) { app.add_option("-N,--name", o.name, what)->type_name("NAME"); }

void netlists(CLI::App& app, Options& o) {
    app.add_option("-i,--ini", o.ini, "where [SECTION]KEY is looked up")->type_name("FILE");
    app.add_flag("-k,--keep-going", o.keep_going, "go on after an error, command by command, as halcmd -k does");
}

void declare_run(CLI::App& app, Options& o) {
    words(app, o, "FILE", "netlists (.hal), or an INI file whose [HAL]HALFILE names them", false);
    app.add_flag("-I,--interactive", o.interactive, "open the shell after loading; leaving it ends the run");
    for_how_long(app, o, "stop after 10s, 250ms, 2min …; without it: until Ctrl-C");
    named(app, o, "of this instance, when several run on one machine (default: default)");
    netlists(app, o);
    app.add_flag("--no-picture", o.no_picture, "no live picture in the terminal");
}

void declare_sim(CLI::App& app, Options& o) {
    words(app, o, "FILE", "netlists (.hal), or an INI file whose [HAL]HALFILE names them");
    for_how_long(app, o, "advance the virtual clock by 10s, 250ms … after loading");
    app.add_option("--cycles", o.cycles, "advance by so many cycles of the fastest thread after loading")->type_name("N");
    named(app, o, "of the instance");
    netlists(app, o);
    app.add_flag("--report", o.report, "print the timing report on stderr at the end");
}

void declare_shell(CLI::App& app, Options& o) {
    named(app, o, "of the instance to talk to; needed when several run");
    app.add_flag("-f,--file", o.from_file, "the first word is a file of commands; without one: standard input");
    app.add_option("-e,--execute", o.execute, "execute this command; may be repeated")->type_name("COMMAND")->allow_extra_args(false);
    app.add_option("-i,--ini", o.ini, "where [SECTION]KEY is looked up, with -f")->type_name("FILE");
    app.add_flag("-k,--keep-going", o.keep_going, "go on after an error");
    app.add_flag("-s,--script", o.script, "output for scripts: no titles, one line per item");
    app.add_flag("--json", o.json, "output as JSON");
    app.add_flag("--echo", o.echo, "echo each command on stderr");
    app.add_flag_callback("-q", [&o] { o.loudness = Loudness::errors; }, "print errors only (the default)");
    app.add_flag_callback("-Q", [&o] { o.loudness = Loudness::nothing; }, "print nothing, not even errors");
    app.add_flag_callback("-v", [&o] { o.loudness = Loudness::results; }, "print the result of each command");
    app.prefix_command();
}

void declare_check(CLI::App& app, Options& o) {
    words(app, o, "FILE", "netlists, in the order they would be loaded");
    app.add_option("-i,--ini", o.ini, "where [SECTION]KEY is looked up")->type_name("FILE");
}

void declare_fmt(CLI::App& app, Options& o) {
    words(app, o, "FILE", "netlists to format in place; - formats standard input");
    app.add_flag("--check", o.check, "change nothing; exit code 1 when a file is not formatted");
}

void declare_graph(CLI::App& app, Options& o) {
    words(app, o, "FILE", "netlists, in the order they would be loaded");
    app.add_option("-o,--output", o.output, "a .svg or .dot file; without it DOT goes to standard output")->type_name("FILE");
    app.add_option("-i,--ini", o.ini, "where [SECTION]KEY is looked up")->type_name("FILE");
}

void declare_doc(CLI::App& app, Options& o) {
    words(app, o, "COMPONENT", "as loadrt takes it; without it: all there are", false);
    app.add_flag("--markdown", o.markdown, "as Markdown");
    app.add_flag("--json", o.json, "as JSON");
    app.add_flag("--man", o.man, "as a troff page: hal doc pid --man | man -l -");
}

void declare_explain(CLI::App& app, Options& o) {
    words(app, o, "CODE", "what stands in [brackets] at the end of a message; without it: all", false);
}

void declare_record(CLI::App& app, Options& o) {
    words(app, o, "CHANNEL FILE", "the number of the sampler (default 0), then the file to write (default: standard output)", false);
    app.add_option("-c,--channel", o.channel, "a sampler by its number or by its instance's name")->type_name("CHANNEL");
    app.add_flag("--csv", o.csv, "comma-separated, with a line of column names first");
    app.add_option("-n,--count", o.count, "end after so many samples")->type_name("N");
    app.add_flag("-t,--tag", o.tag, "begin each line with the sample's number");
    named(app, o, "of the instance to read from");
}

void declare_play(CLI::App& app, Options& o) {
    words(app, o, "CHANNEL FILE", "the number of the streamer (default 0), then the file to read (default: standard input)", false);
    app.add_option("-c,--channel", o.channel, "a streamer by its number or by its instance's name")->type_name("CHANNEL");
    named(app, o, "of the instance to feed");
}

void declare_doctor(CLI::App& app, Options& o) {
    app.add_option("--seconds", o.seconds, "how long each measurement takes (default 2)")->type_name("S")->check(CLI::Range(0.0, 3600.0));
    app.add_flag("--json", o.json, "as JSON");
}

void declare_completion(CLI::App& app, Options& o) { words(app, o, "SHELL", "bash"); }

constexpr Subcommand table[] = {
    {"run", "FILE… [-- ARG…]", "load netlists and run them in real-time threads", run_run, declare_run},
    {"sim", "FILE… [--for TIME] [-- ARG…]", "the same on a virtual clock: deterministic, as fast as it goes", run_sim, declare_sim},
    {"shell", "[COMMAND…]", "talk to a running instance: one command, a file of them, or interactively", run_shell, declare_shell, true},
    {"check", "FILE…", "everything wrong with netlists that can be known without running them", run_check, declare_check},
    {"fmt", "FILE…", "format netlists", run_fmt, declare_fmt},
    {"graph", "FILE… [-o OUT]", "draw netlists", run_graph, declare_graph},
    {"doc", "[COMPONENT]", "the manual page of a component", run_doc, declare_doc},
    {"explain", "[CODE]", "what a diagnostic means and what to do", run_explain, declare_explain},
    {"record", "[CHANNEL] [FILE]", "write what a sampler samples", run_record, declare_record},
    {"play", "[CHANNEL] [FILE]", "feed a streamer", run_play, declare_play},
    {"doctor", "", "what on this machine spoils real time", run_doctor, declare_doctor},
    {"completion", "SHELL", "print a completion script: source <(hal completion bash)", run_completion, declare_completion},
};

const Subcommand* find(std::string_view name) {
    const auto* row = std::find_if(std::begin(table), std::end(table), [&](const Subcommand& s) { return name == s.name; });
    return row == std::end(table) ? nullptr : row;
}

std::string overview() {
    std::string text = "Halcyon: control components, wired by netlists, run in real-time threads.\n\nusage: hal COMMAND …\n\n";
    for (const Subcommand& row : table) text += fmt::format("  {:11} {}\n", row.name, row.summary);
    return text + "\nhal help COMMAND says more. A first try: hal run halfiles/furuta/hang.hal --for 10s\n";
}

std::unique_ptr<CLI::App> app_of(const Subcommand& row, Options& options) {
    auto app = std::make_unique<CLI::App>(row.summary, fmt::format("hal {}", row.name));
    row.declare(*app, options);
    app->set_help_flag("-h,--help", "print this");
    app->allow_extras();  // worded here, not by the library
    return app;
}

std::string help_of(const Subcommand& row) {
    Options options;
    const auto app = app_of(row, options);
    std::string text = fmt::format("hal {}: {}\n\nusage: hal {} {}\n", row.name, row.summary, row.name, row.usage);
    for (const CLI::Option* option : app->get_options())
        if (option->get_positional()) text += fmt::format("\n  {:24} {}", option->get_name(true), option->get_description());
    text += "\n";
    for (const CLI::Option* option : app->get_options([](const CLI::Option* o) { return o->nonpositional(); })) {
        const std::string value = option->get_expected_min() > 0 && !option->get_type_name().empty() ? " " + option->get_type_name() : "";
        std::string names;
        for (const std::string& name : option->get_snames()) names += (names.empty() ? "-" : ", -") + name;
        for (const std::string& name : option->get_lnames()) names += (names.empty() ? "--" : ", --") + name;
        text += fmt::format("  {:24} {}\n", names + value, option->get_description());
    }
    return text;
}

std::vector<std::string> option_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options()) {
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
        for (const std::string& name : option->get_snames()) names.push_back("-" + name);
    }
    return names;
}

int no_such_command(const std::string& word) {
    Options options;
    if (!word.empty() && word[0] == '-') return fail(options, fmt::format("there is no option '{}'; type: hal help", word));
    const auto ends = [&](std::string_view end) { return word.size() > end.size() && word.ends_with(end); };
    if (ends(".hal") || ends(".ini")) return fail(options, fmt::format("'{0}' is not a command; to run it type: hal run {0}", word));
    std::vector<std::string> names = {"help"};
    for (const Subcommand& row : table) names.emplace_back(row.name);
    const std::string hint = did_you_mean(word, names);
    return fail(options, fmt::format("there is no command '{}'; {}", word, hint.empty() ? "type: hal help" : hint));
}

int help(const std::vector<std::string>& about) {
    if (about.empty()) return print(overview()) ? 0 : 1;
    const Subcommand* row = find(about.front());
    return row ? (print(help_of(*row)) ? 0 : 1) : no_such_command(about.front());
}

/// Reads `arguments` into `options`. Returns an exit code when that is the end of it.
std::optional<int> read(const Subcommand& row, std::vector<std::string> arguments, Options& options) {
    const auto app = app_of(row, options);
    std::vector<std::string> behind;
    if (const auto dashes = std::find(arguments.begin(), arguments.end(), "--"); !row.verbatim && dashes != arguments.end()) {
        options.arguments.assign(dashes + 1, arguments.end());
        arguments.erase(dashes, arguments.end());
    }
    try {
        std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
        app->parse(std::move(arguments));
    } catch (const CLI::CallForHelp&) {
        return print(help_of(row)) ? 0 : 1;
    } catch (const CLI::RequiredError&) {
        return fail(options, fmt::format("something is missing; type: hal {} {}", row.name, row.usage));
    } catch (const CLI::ParseError& error) {
        std::string what = error.what();
        std::replace(what.begin(), what.end(), '\n', ' ');
        return fail(options, fmt::format("{}; see: hal help {}", what, row.name));
    }
    const std::vector<std::string> extra = app->remaining();
    if (row.verbatim) {
        if (!extra.empty() && extra.front().size() > 1 && extra.front()[0] == '-' && !(extra.front() == "--")) {
            const std::string hint = did_you_mean(extra.front(), option_names(*app));
            return fail(options, fmt::format("there is no option '{}'; {}", extra.front(),
                                             hint.empty() ? fmt::format("see: hal help {}", row.name) : hint));
        }
        options.words.assign(extra.begin() + (!extra.empty() && extra.front() == "--"), extra.end());
    } else if (!extra.empty()) {
        const std::string hint = did_you_mean(extra.front(), option_names(*app));
        const bool option = extra.front().starts_with('-');
        return fail(options, fmt::format("{} '{}'; {}", option ? "there is no option" : "nothing is expected at", extra.front(),
                                         option && !hint.empty() ? hint : fmt::format("see: hal help {}", row.name)));
    }
    return std::nullopt;
}

}  // namespace

int run_command_line(int argc, char** argv) {
    const std::vector<std::string> all(argv + std::min(argc, 1), argv + argc);
    if (all.empty()) return help({});
    if (all[0] == "help" || all[0] == "--help" || all[0] == "-h") return help({all.begin() + 1, all.end()});
    if (all[0] == "--version" || all[0] == "version") return print(fmt::format("hal {}\n", paths::version)) ? 0 : 1;
    const Subcommand* row = find(all[0]);
    if (!row) return no_such_command(all[0]);
    Options options;
    options.program = fmt::format("hal {}", row->name);
    if (const auto end = read(*row, {all.begin() + 1, all.end()}, options)) return *end;
    return row->run(options);
}

std::vector<Completion> completions() {
    std::vector<Completion> all;
    for (const Subcommand& row : table) {
        Options options;
        all.push_back({row.name, option_names(*app_of(row, options))});
    }
    return all;
}

}  // namespace hal::tools
