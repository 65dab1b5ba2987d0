// SPDX-License-Identifier: MIT
// help, explain, print, echo and the other commands about the shell itself; the manual made from
// the command table.
#include <algorithm>

#include <fmt/format.h>

#include "commands/help.hpp"
#include "commands/script.hpp"
#include "commands/table.hpp"
#include "text/fault_pages.hpp"
#include "text/numbers.hpp"

namespace hal {
namespace {

std::string names_of(const CommandRow& row) {
    return *row.also ? std::string(row.name) + ", " + row.also : row.name;
}

/// Returns the page of a diagnostic code; empty: unknown code.
std::string page_of(std::string_view code) {
    for (const CodePage& row : all_code_pages()) {
        if (code == row.name) return row.page;
    }
    return "";
}

}  // namespace

void command_source(Context& context) { context.script.source(context); }

// The node lines of the main file have been removed by now: parts are selected before the first
// command runs.
void command_node(Context& context) {
    const bool typed =
        context.session.sources.get(context.command.span.source).name.starts_with('<');
    context.diagnostics.error(
        "misplaced-node", context.command.name.span,
        std::string("`node` lines ") + (typed
                                            ? "are not allowed in the shell"
                                            : "are not allowed in a file that is read by `source`"),
        "",
        typed ? "write them in a netlist, then type: hal run FILE --node " + context.argument(0)
              : "write `node " + context.argument(0) + "` above the `source` line");
}

void command_print(Context& context) {
    std::string text =
        context.session.sources.location(context.command.span, false) + ": HALCMD MSG:";
    for (const auto& token : context.command.args) {
        text += " " + token.text;
    }
    context.output.err(text + "\n");
}

void command_echo(Context& context) {
    context.shell.options.echo = true;
    context.output.out("Echo on\n");
}

void command_unecho(Context& context) {
    context.shell.options.echo = false;
    context.output.out("Echo off\n");
}

void command_debug(Context& context) {
    const std::string& text = context.argument(0);
    int level = -1;
    if (!parse_whole(text, level) || level < 0 || level > 5) {
        context.diagnostics.error("unknown-word", context.span(0),
                                  "'" + text + "' is not a valid level", "",
                                  "levels are 0..5: 0 prints nothing, 5 everything");
        return;
    }
    if (context.checking()) return;
    context.shell.options.level = static_cast<Level>(std::min(level, 3));
}

void command_help(Context& context) {
    if (context.count() == 0) {
        if (context.checking()) return;
        std::string text;
        for (const auto& row : command_table()) {
            if (row.is_for_tests()) continue;
            text += fmt::format("  {:<14} {}\n", names_of(row), row.summary);
        }
        context.output.out(text + "`help COMMAND` describes a command, `explain CODE` an error.\n");
        return;
    }
    const std::string& name = context.argument(0);
    if (const CommandRow* const row = find_command(name)) {
        if (context.checking()) return;
        context.output.out(to_string(row->usage()) + "\n  " + row->summary + "\n" +
                           (*row->help ? std::string(row->help) + "\n" : ""));
        return;
    }
    context.diagnostics.error("unknown-command", context.span(0), "unknown command '" + name + "'",
                              did_you_mean(name, command_names()), "`help` lists all commands");
}

void command_explain(Context& context) {
    const std::string& code = context.argument(0);
    const std::string page = page_of(code);
    if (!page.empty() && context.checking()) return;
    if (!page.empty()) return context.output.out(page + "\n");
    std::vector<std::string> codes;
    for (const CodePage& row : all_code_pages()) {
        codes.emplace_back(row.name);
    }
    context.diagnostics.error("unknown-word", context.span(0), "unknown error code '" + code + "'",
                              did_you_mean(code, codes));
}

void command_quit(Context& context) { context.script.quit(); }

void command_nothing(Context&) {}

std::string command_manual() {
    std::string text = "# Commands\n";
    for (const auto& row : command_table()) {
        text += fmt::format("\n## {}\n\n    {}\n\n{}{}.\n", names_of(row), to_string(row.usage()),
                            static_cast<char>(std::toupper(row.summary[0])), row.summary + 1);
        if (*row.help) {
            text += fmt::format("\n{}\n", row.help);
        }
    }
    return text;
}

}  // namespace hal
