// SPDX-License-Identifier: MIT
// journal: `journal FILE` in a netlist, and what a journaled machine has recorded so far as a file.
#include <optional>
#include <string>

#include "commands/table.hpp"
#include "machine/run/execution_sink.hpp"
#include "netlist/journal_line.hpp"

namespace hal {
namespace {

constexpr const char* start_help = "start the machine with: hal run --journal FILE.mcap";

void report(Context& context, const std::string& problem, const char* help = "") {
    context.diagnostics.error("cannot-write", context.span(1),
                              "'" + context.argument(1) + "' cannot be written: " + problem, "",
                              help);
}

void save_journal(Context& context) {
    if (!context.argument(1).ends_with(".mcap")) {
        return report(context, "its format is unknown", "name the file .mcap");
    }
    if (context.checking()) return;
    ExecutionSink* const sink = context.session.options().sink;
    if (!sink) return report(context, "this machine has no journal", start_help);
    const std::string path = context.path(context.argument(1));
    context.lock.unlock();  // a long journal takes seconds, and nobody waits for it
    const std::string problem = sink->save(path);
    context.lock.lock();
    if (!problem.empty()) {
        report(context, problem);
    }
}

}  // namespace

void command_journal(Context& context) {
    if (is_journal_request(context.command)) {
        if (context.count() == 2) return save_journal(context);
        context.diagnostics.error("wrong-arguments", context.command.span,
                                  "journal save needs a file", "", context.usage());
        return;
    }
    const std::optional<JournalLine> line =
        parse_journal_line(context.command, context.diagnostics);
    if (!line) return;
    const SessionOptions& options = context.session.options();
    const bool may_have_one = context.checking() || options.sink || options.virtual_clock;
    if (!may_have_one) {
        context.diagnostics.warning(
            "ignored-option", context.command.span,
            "this machine has no journal: it begins with the machine", "",
            "write the line into a netlist that hal run or hal linuxcnc is given, "
            "or type: hal run --journal FILE.mcap");
        return;
    }
    const Sources& sources = context.session.sources;
    const std::string origin = sources.location(context.command.span, false);
    const std::string other = context.shell.note_journal(*line, origin);
    if (other.empty()) return;
    if (other.starts_with("--")) {
        context.diagnostics.warning("ignored-option", context.command.span,
                                    "a machine has one journal, and the command line names it by " +
                                        other + ": this line is ignored");
    } else {
        context.diagnostics.warning("ignored-option", context.command.span,
                                    "a machine has one journal, and that of " + other +
                                        " is another one: this line is ignored",
                                    "", "remove one of the two lines");
    }
}

}  // namespace hal
