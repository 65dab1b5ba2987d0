// SPDX-License-Identifier: MIT
// The command line after `hal`: finds the row of the subcommand, prints help, reads the options.
#include "command_line.hpp"

#include <algorithm>
#include <cstdlib>
#include <fmt/format.h>
#include <iterator>
#include <memory>
#include <optional>

#include "base/tree_packages.hpp"
#include "cli/option_set.hpp"
#include "cli/other_program.hpp"
#include "cli/output.hpp"
#include "commands/table.hpp"
#include "paths.hpp"
#include "subcommand.hpp"
#include "text/diagnostic.hpp"
#include "text/find_row.hpp"
#include "text/quoting.hpp"
#include "text/typed_command.hpp"

namespace hal::tools {

namespace {

const Group* find_group(std::string_view name) {
    return find_row(subcommand_groups(), name, &Group::name);
}

/// Whether the name of the command begins with these words, and has more.
bool begins(const Subcommand& row, std::string_view words) {
    const std::string_view name = row.name;
    return name.size() > words.size() && name.starts_with(words) && name[words.size()] == ' ';
}

/// Whether the command is in a group, and this build has it.
bool belongs(const Subcommand& row, const Group& group) {
    return !row.missing_package() && begins(row, group.name);
}

/// The package of the commands that begin with these words, where this build leaves all of them
/// out; else nullptr.
const TreePackage* missing_package(std::string_view words) {
    const TreePackage* missing = nullptr;
    for (const Subcommand& row : subcommands()) {
        if (!begins(row, words)) continue;
        missing = row.missing_package();
        if (!missing) return nullptr;
    }
    return missing;
}

/// Reports that a command is in a package that this build leaves out.
int refuse(std::string_view command, const TreePackage& package) {
    Options options;
    options.program = fmt::format("hal {}", command);
    return fail(options, package.problem());
}

/// The purpose, and the second words of the commands: `time slots of a CAN bus: plan`.
std::string summary_of(const Group& group) {
    std::vector<std::string_view> names;
    for (const Subcommand& row : subcommands()) {
        if (!belongs(row, group)) continue;
        std::string_view name = row.name;
        name.remove_prefix(std::string_view(group.name).size() + 1);
        name = name.substr(0, name.find(' '));
        if (names.empty() || names.back() != name) names.push_back(name);
    }
    return fmt::format("{}: {}", group.purpose, fmt::join(names, ", "));
}

/// A command of the script `hal` of a clone, which carries it out itself.
struct CloneCommand {
    std::string_view name, usage, summary;
};

constexpr CloneCommand clone_commands[] = {
    {"build", "[NAME | FILE]…", "build everything, or what these components and netlists need"},
    {"test", "[quick]", "run all tests, or those of the release build only"},
    {"board", "armhf | arm64", "run the unit and netlist tests for a board, under an emulator"},
    {"bench", "[OPTION]…", "print the figures"},
    {"package", "[armhf | arm64 | --release KEY]", "make Debian packages in build/packages"},
};

const CloneCommand* find_clone_command(std::string_view name) {
    const auto* const found = std::ranges::find(clone_commands, name, &CloneCommand::name);
    return found == std::end(clone_commands) ? nullptr : found;
}

/// Whether the script of a clone has started this program.
bool is_in_clone() { return std::getenv("HALCYON_BUILD") != nullptr; }

/// Prints the help of a command that only a clone has. Returns the exit code.
int help_of(const CloneCommand& command) {
    if (is_in_clone()) {
        return exit_code(print(fmt::format("hal {}: {}\n\nusage: ./hal {} {}\n", command.name,
                                           command.summary, command.name, command.usage)));
    }
    return fail(Options{}, fmt::format("'{0}' is a command of a clone of the sources; type there: "
                                       "./hal {0} {1}",
                                       command.name, command.usage));
}

struct Found {
    const Subcommand* row = nullptr;
    std::size_t words = 0;  ///< number of typed words that form its name
};

/// Returns the row with the longest name that matches the typed words.
Found find(const std::vector<std::string>& typed) {
    Found found;
    std::string name;
    for (std::size_t i = 0; i < typed.size() && i < 4; ++i) {
        name += (i == 0 ? "" : " ") + typed[i];
        for (const Subcommand& row : subcommands()) {
            if (name == row.name) {
                found = {&row, i + 1};
            }
        }
    }
    return found;
}

std::string overview() {
    std::string text =
        "Halcyon: control components, wired by netlists, run in real-time threads.\n\nusage: hal "
        "COMMAND …\n\n";
    const Group* last = nullptr;
    for (const Subcommand& row : subcommands()) {
        if (row.missing_package()) continue;
        const std::string_view name(row.name);
        const Group* group = find_group(name.substr(0, name.find(' ')));
        if (group == nullptr) {
            text += fmt::format("  {:11} {}\n", row.name, row.summary);
        } else if (group != last) {
            text += fmt::format("  {:11} {}\n", group->name, summary_of(*group));
        }
        last = group;
    }
    if (is_in_clone()) {
        text += "\nIn this clone also:\n";
        for (const CloneCommand& command : clone_commands) {
            text += fmt::format("  {:11} {}\n", command.name, command.summary);
        }
    }
    return text +
           "\nFor details: hal help COMMAND. A first try: hal examples furuta/hang --for "
           "10s\n";
}

std::string help_of(const Group& group) {
    std::string text = fmt::format("hal {}: {}\n\nusage: hal {} COMMAND …\n\n", group.name,
                                   group.purpose, group.name);
    for (const Subcommand& row : subcommands()) {
        if (belongs(row, group)) {
            text += fmt::format("  {:16} {}\n", row.name, row.summary);
        }
    }
    return text + fmt::format("\nFor details: hal help {} COMMAND.\n", group.name);
}

std::string help_of(const Subcommand& row) {
    const auto options = row.make_options();
    const OptionSet set(*options, row.name, row.summary);
    return fmt::format("hal {}: {}\n\nusage: hal {} {}\n", row.name, row.summary, row.name,
                       row.usage) +
           set.help();
}

std::vector<std::string> names_in(const Group& group) {
    std::vector<std::string> names;
    for (const Subcommand& row : subcommands()) {
        if (belongs(row, group)) {
            names.emplace_back(row.name);
        }
    }
    return names;
}

/// Returns what may follow `hal`: the commands of this build, and the groups.
std::vector<std::string> first_words() {
    std::vector<std::string> names = {"help"};
    for (const Subcommand& row : subcommands()) {
        if (!row.missing_package()) {
            names.emplace_back(row.name);
        }
    }
    for (const Group& group : subcommand_groups()) {
        names.emplace_back(group.name);
    }
    return names;
}

int no_such_command(const std::vector<std::string>& typed) {
    Options options;
    std::string word = typed.front();
    if (!word.empty() && word[0] == '-') {
        return fail(options, fmt::format("unknown option '{}'; type: hal help", word));
    }
    const auto ends = [&](std::string_view end) {
        return word.size() > end.size() && word.ends_with(end);
    };
    if (const CloneCommand* const command = find_clone_command(word)) return help_of(*command);
    if (ends(".hal") || ends(".ini")) {
        return fail(options,
                    fmt::format("'{0}' is not a command; to run it type: hal run {0}", word));
    }
    if (!find_group(word) && find_command(word)) {
        return fail(options, fmt::format("'{0}' is a command of the shell; to run it in a running "
                                         "machine type: hal shell {1}",
                                         word, fmt::join(typed, " ")));
    }
    const Group* const group = find_group(word);
    if (group && typed.size() > 1) {
        word += " " + typed[1];
    }
    const TreePackage* const missing = group ? missing_package(word) : nullptr;
    if (missing) return refuse(word, *missing);
    const std::string hint = did_you_mean(word, group ? names_in(*group) : first_words());
    if (!hint.empty()) return fail(options, fmt::format("unknown command '{}'; {}", word, hint));
    const std::string about = group ? fmt::format(" {}", group->name) : "";
    return fail(options, fmt::format("unknown command '{}'; type: hal help{}", word, about));
}

std::string version_text() {
    std::string built;
    std::string left_out;
    for (const TreePackage& p : tree_packages) {
        std::string& list = p.built() ? built : left_out;
        append_item(list, p.name);
        if (p.state == PackageState::switched_off) {
            list += fmt::format(" ({}=OFF)", package_switch(p.name));
        } else if (!p.built()) {
            list += fmt::format(" (needs {})", p.needs);
        }
    }
    std::string text = fmt::format("hal {} (commit {})\npackages: {}\n", paths::version,
                                   paths::commit, built.empty() ? "none, the core alone" : built);
    if (!left_out.empty()) {
        text += fmt::format("left out: {}\n", left_out);
    }
    return text;
}

std::string version_json() {
    std::string packages;
    for (const TreePackage& p : tree_packages) {
        packages +=
            fmt::format(R"({}{{"name":"{}","summary":"{}","built":{},"switch":"{}","needs":"{}"}})",
                        packages.empty() ? "\n " : ",\n ", p.name, p.summary, p.built(),
                        package_switch(p.name), p.needs);
    }
    return fmt::format(R"({{"version":"{}","commit":"{}","packages":[{}]}})", paths::version,
                       paths::commit, packages) +
           "\n";
}

/// `hal --version [--json]`.
int print_version(const std::vector<std::string>& words) {
    if (words.empty()) return exit_code(print(version_text()));
    if (words.size() == 1 && words[0] == "--json") return exit_code(print(version_json()));
    const std::string& extra = words[0] == "--json" ? words[1] : words[0];
    return fail(Options{}, fmt::format("unexpected argument '{}'; type: hal --version --json, or "
                                       "hal --version",
                                       extra));
}

int help(const std::vector<std::string>& about) {
    if (about.empty()) return exit_code(print(as_typed(overview())));
    if (const Found found = find(about); found.row) {
        const TreePackage* const missing = found.row->missing_package();
        if (missing) return refuse(found.row->name, *missing);
        return exit_code(print(help_of(*found.row)));
    }
    if (const Group* group = find_group(about.front()); group && about.size() == 1) {
        const TreePackage* const missing = missing_package(group->name);
        if (missing) return refuse(group->name, *missing);
        return exit_code(print(help_of(*group)));
    }
    // The common beginning of some commands: can sdo, can eds.
    std::string start, text;
    for (const std::string& word : about) {
        start += word + " ";
    }
    for (const Subcommand& row : subcommands()) {
        if (!row.missing_package() && std::string_view(row.name).starts_with(start)) {
            text += fmt::format("  {:16} {}\n", row.name, row.summary);
        }
    }
    if (!text.empty()) {
        return exit_code(
            print(fmt::format("usage: hal {}COMMAND …\n\n{}\nFor details: hal help {}COMMAND.\n",
                              start, text, start)));
    }
    return no_such_command(about);
}

/// Returns what to type in place of an unknown option; never another option of one letter.
std::string option_hint(const Subcommand& row, const std::string& unknown,
                        const std::vector<std::string>& names) {
    const std::string help = fmt::format("see: hal help {}", row.name);
    const std::string option = unknown.substr(0, unknown.find('='));
    const bool is_output = option.starts_with("-o") || option == "--output";
    if (is_output && row.name == std::string_view("record")) {
        return fmt::format("the file is the first word: hal {} {}", row.name, row.usage);
    }
    if (is_output && std::find(names.begin(), names.end(), "--record") != names.end()) {
        return "did you mean '--record'?";
    }
    if (option.size() > 2) {
        const std::string hint = did_you_mean(option, names);
        return hint.empty() ? help : hint;
    }
    return help;
}

/// Reads `arguments` into `options`. Returns an exit code when the program must exit.
std::optional<int> read(const Subcommand& row, std::vector<std::string> arguments,
                        Options& options) {
    OptionSet set(options, row.name, row.summary);
    if (const auto dashes = std::find(arguments.begin(), arguments.end(), "--");
        !row.verbatim && dashes != arguments.end()) {
        options.arguments.assign(dashes + 1, arguments.end());
        arguments.erase(dashes, arguments.end());
    }
    const OptionSet::Reading reading = set.read(std::move(arguments));
    switch (reading.outcome) {
    case OptionSet::Outcome::good: break;
    case OptionSet::Outcome::help: return exit_code(print(help_of(row)));
    case OptionSet::Outcome::missing:
        return fail(options, fmt::format("missing argument; type: hal {} {}", row.name, row.usage));
    case OptionSet::Outcome::bad:
        return fail(options, fmt::format("{}; see: hal help {}", reading.problem, row.name));
    }
    std::vector<std::string> extra = reading.extra;
    const bool dashed = !extra.empty() && extra.front().starts_with('-');
    if (row.verbatim && (!dashed || extra.front().size() == 1 || extra.front() == "--")) {
        if (dashed && extra.front() == "--") {
            extra.erase(extra.begin());
        }
        options.words = std::move(extra);
    } else if (dashed) {
        return fail(options, fmt::format("unknown option '{}'; {}", extra.front(),
                                         option_hint(row, extra.front(), set.names())));
    } else if (!extra.empty()) {
        return fail(options, fmt::format("unexpected argument '{}'; see: hal help {}",
                                         extra.front(), row.name));
    }
    return std::nullopt;
}

bool is_help(std::string_view word) { return word == "help" || word == "--help" || word == "-h"; }

/// Handles words that name no command: a group alone prints its help.
int run_group(const std::vector<std::string>& all) {
    const Group* const group = find_group(all[0]);
    if (!group) return no_such_command(all);
    if (const TreePackage* const missing = missing_package(group->name)) {
        return refuse(group->name, *missing);
    }
    return all.size() == 1 || is_help(all[1]) ? help({all[0]}) : no_such_command(all);
}

}  // namespace

int run_command_line(int argc, char** argv) {
    const std::vector<std::string> all(argv + std::min(argc, 1), argv + argc);
    if (all.empty()) return help({});
    if (is_help(all[0])) return help({all.begin() + 1, all.end()});
    if (all[0] == "--version" || all[0] == "version") {
        return print_version({all.begin() + 1, all.end()});
    }
    const auto [row, name_words] = find(all);
    if (!row) return run_group(all);
    if (const TreePackage* const missing = row->missing_package()) {
        return refuse(row->name, *missing);
    }
    if (!row->run) return become_program(program_of(row->part), argv);
    const auto options = row->make_options();
    options->program = fmt::format("hal {}", row->name);
    if (const auto end = read(
            *row, {all.begin() + static_cast<std::ptrdiff_t>(name_words), all.end()}, *options)) {
        return *end;
    }
    if (row->needs_tools && row->needs_tools(*options)) {
        return become_program(program_of(Part::tools), argv);
    }
    return row->run(*options);
}

namespace {

/// The entry of a command, which is that of its group where it has one.
CompletionEntry& entry_of(const Subcommand& row, std::vector<CompletionEntry>& all) {
    const std::string_view name = row.name;
    const std::string_view first = name.substr(0, name.find(' '));
    if (all.empty() || all.back().name != first) {
        const Group* const group = find_group(first);
        all.push_back({std::string(first), group ? group->purpose : row.summary, {}, {}});
    }
    return all.back();
}

/// Adds the second word of a command of a group: of those with a third word only once.
void add_word(const Subcommand& row, std::vector<CompletionWord>& to) {
    const std::string_view name = row.name;
    const auto space = name.find(' ');
    if (space == name.npos) return;
    const std::string_view rest = name.substr(space + 1);
    const std::string word(rest.substr(0, rest.find(' ')));
    if (!to.empty() && to.back().name == word) return;
    to.push_back({word, row.summary});
}

void add_option(const OptionSet::Row& row, const std::string& name,
                std::vector<CompletionOption>& to) {
    const bool known = std::any_of(
        to.begin(), to.end(), [&](const CompletionOption& other) { return other.name == name; });
    if (!known) {
        to.push_back({{name, row.text}, row.takes_value});
    }
}

}  // namespace

std::vector<CompletionEntry> completions() {
    std::vector<CompletionEntry> all;
    for (const Subcommand& row : subcommands()) {
        if (row.missing_package()) continue;
        CompletionEntry& entry = entry_of(row, all);
        add_word(row, entry.words);
        const auto options = row.make_options();
        for (const OptionSet::Row& option : OptionSet(*options, row.name, row.summary).rows()) {
            for (const std::string& name : option.long_names) {
                add_option(option, "--" + name, entry.options);
            }
            for (const std::string& name : option.short_names) {
                add_option(option, "-" + name, entry.options);
            }
        }
    }
    return all;
}

}  // namespace hal::tools
