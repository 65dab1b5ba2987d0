// SPDX-License-Identifier: MIT
// `hal manual [PAGE…]`: the manual pages: hal, one for each command and each group of commands, and
// halcmd for the commands of netlists and of the shell.
#include "manual.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <string_view>
#include <vector>

#include "cli/output.hpp"
#include "commands/help.hpp"
#include "commands/table.hpp"
#include "doc/markdown.hpp"
#include "doc/troff.hpp"
#include "paths.hpp"
#include "subcommand.hpp"
#include "text/suggest.hpp"

namespace hal::tools {

namespace {

struct CommandPage {
    std::string name;  ///< of the page: hal-can-dump
    std::string troff;
};

std::string page_name(std::string_view command) {
    std::string name = fmt::format("hal {}", command);
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

std::string head(const std::string& name, const std::string& summary) {
    std::string title = name;
    std::transform(title.begin(), title.end(), title.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return fmt::format(
        ".TH \"{}\" 1 \"\" \"Halcyon {}\" \"Halcyon commands\"\n.SH NAME\n{} \\- {}\n",
        troff(title), paths::version, troff(name), troff(summary));
}

std::string synopsis(const std::string& usage) {
    return fmt::format(".SH SYNOPSIS\n.nf\n{}\n.fi\n", troff(usage));
}

/// A term in bold, and what it means, indented below.
std::string entry(const std::string& term, const std::string& text) {
    return fmt::format(".TP\n\\fB{}\\fR\n{}\n", troff(term), text.empty() ? "\\&" : troff(text));
}

std::string see_also(const std::string& page) {
    return fmt::format(".SH SEE ALSO\n\\fB{}\\fR(1)\n", troff(page));
}

constexpr const char* exit_status =
    ".SH EXIT STATUS\n0: it is done. Any other status: it is not done, or not all of it; the message on "
    "standard error names what, and what to type.\n";

std::string page_of(const Subcommand& row, const std::string& parent) {
    const auto options = row.make_options();
    const OptionSet set(*options, row.name, row.summary);
    std::string arguments;
    std::string declared;
    for (const OptionSet::Row& one : set.rows()) {
        (one.positional ? arguments : declared) += entry(one.names, one.text);
    }
    std::string text = head(page_name(row.name), row.summary);
    text += synopsis(fmt::format("hal {} {}", row.name, row.usage));
    if (!arguments.empty()) {
        text += ".SH ARGUMENTS\n" + arguments;
    }
    text += ".SH OPTIONS\n" + declared;
    return text + exit_status + see_also(parent);
}

/// Whether a command is one of the group.
bool belongs(const Subcommand& row, const Group& group) {
    return !row.missing_package() &&
           std::string_view(row.name).starts_with(fmt::format("{} ", group.name));
}

const Group* group_of(const Subcommand& row) {
    for (const Group& group : subcommand_groups()) {
        if (belongs(row, group)) return &group;
    }
    return nullptr;
}

std::string page_of(const Group& group) {
    std::string text = head(page_name(group.name), group.purpose);
    text += synopsis(fmt::format("hal {} COMMAND …", group.name)) + ".SH COMMANDS\n";
    for (const Subcommand& row : subcommands()) {
        if (belongs(row, group)) {
            text += entry(page_name(row.name) + "(1)", row.summary);
        }
    }
    return text + see_also("hal");
}

std::string page_of_hal() {
    std::string text = head("hal", "control components, wired by netlists, run in real-time threads");
    text += synopsis("hal COMMAND …\nhal help [COMMAND]\nhal --version [--json]") +
            ".SH COMMANDS\n";
    const Group* last = nullptr;
    for (const Subcommand& row : subcommands()) {
        if (row.missing_package()) continue;
        const Group* const group = group_of(row);
        if (!group) {
            text += entry(page_name(row.name) + "(1)", row.summary);
        } else if (group != last) {
            text += entry(page_name(group->name) + "(1)", group->purpose);
        }
        last = group;
    }
    return text + exit_status +
           ".SH SEE ALSO\n\\fBhalcmd\\fR(1) has the commands of netlists and of the shell. "
           "\\fBhal doc\\fR prints the page of a component; \\fBman hal\\-NAME\\fR shows it.\n";
}

std::string page_of_halcmd() {
    std::string text = head("halcmd", "commands of netlists and of the shell of a running machine");
    text += synopsis("halcmd [OPTION…] [COMMAND [ARG…]]\nhal shell [COMMAND…]");
    const std::string manual = command_manual();
    if (const auto rendered = markdown_as_man(manual)) return text + *rendered + see_also("hal");
    text += ".SH COMMANDS\n";
    for (const CommandRow& row : command_table()) {
        text += entry(to_string(row.usage()), row.summary);
    }
    return text + see_also("hal");
}

/// Returns the pages of all commands that this build has, hal and halcmd first.
std::vector<CommandPage> command_pages() {
    std::vector<CommandPage> pages{{"hal", page_of_hal()}, {"halcmd", page_of_halcmd()}};
    for (const Group& group : subcommand_groups()) {
        const auto all = subcommands();
        if (std::any_of(all.begin(), all.end(),
                        [&](const Subcommand& row) { return belongs(row, group); })) {
            pages.push_back({page_name(group.name), page_of(group)});
        }
    }
    for (const Subcommand& row : subcommands()) {
        if (row.missing_package()) continue;
        const Group* const group = group_of(row);
        const std::string parent = group ? page_name(group->name) : "hal";
        pages.push_back({page_name(row.name), page_of(row, parent)});
    }
    return pages;
}

/// Returns the pages that were typed, or all. Empty after printing an error.
std::vector<CommandPage> chosen_pages(const ManualOptions& options) {
    const std::vector<CommandPage> all = command_pages();
    if (options.words.empty()) return all;
    std::vector<std::string> names;
    for (const CommandPage& page : all) {
        names.push_back(page.name);
    }
    std::vector<CommandPage> chosen;
    for (const std::string& name : options.words) {
        const auto found = std::find(names.begin(), names.end(), name);
        if (found == names.end()) {
            const std::string hint = did_you_mean(name, names);
            fail(options, fmt::format("unknown page '{}'; {}", name,
                                      hint.empty() ? "type the command with hyphens: hal-can-dump"
                                                   : hint));
            return {};
        }
        chosen.push_back(all[static_cast<std::size_t>(found - names.begin())]);
    }
    return chosen;
}

/// Writes each page to a file. Returns what failed; empty: nothing.
std::string write_pages(const std::vector<CommandPage>& pages, const std::string& folder) {
    std::error_code problem;
    std::filesystem::create_directories(folder, problem);
    if (problem) return fmt::format("cannot create '{}': {}", folder, problem.message());
    for (const CommandPage& page : pages) {
        std::string why = write_file(fmt::format("{}/{}.1", folder, page.name), page.troff);
        if (!why.empty()) return why;
    }
    return "";
}

}  // namespace

int run_manual(const ManualOptions& options) {
    const std::vector<CommandPage> pages = chosen_pages(options);
    if (pages.empty()) return 1;
    if (!options.output.empty()) {
        const std::string why = write_pages(pages, options.output);
        return why.empty() ? 0 : fail(options, why);
    }
    return exit_code(std::all_of(pages.begin(), pages.end(),
                                 [](const CommandPage& page) { return print(page.troff); }));
}

}  // namespace hal::tools
