// SPDX-License-Identifier: MIT
#include "lsp/applied_changes.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <set>
#include <string_view>

#include "commands/table.hpp"

namespace hal::tools {

namespace {

/// The commands of a text, and its logical lines by the line on which they begin.
struct Parsed {
    std::vector<Command> commands;  ///< ranges expanded
    std::map<std::uint32_t, std::string> lines;
};

Parsed parsed(const std::string& text, const Ini& ini) {
    Sources sources;
    Diagnostics ignored;
    const std::uint32_t source = sources.add("netlist", text);
    Parsed result;
    const TextDocument document(text);
    for (const Command& command : parse(sources, source, {&ini, {}}, ignored)) {
        const std::uint32_t first = document.position(command.span.begin).line;
        const std::uint32_t last = document.position(command.span.end).line;
        std::string line;
        for (std::uint32_t number = first; number <= last; ++number) {
            line += std::string(document.line(number)) + "\n";
        }
        result.lines[first] = std::move(line);
        for (Command& one : expand(command, ignored)) {
            result.commands.push_back(std::move(one));
        }
    }
    return result;
}

struct Objects {
    std::map<std::string, std::string> signal_of_pin;
    std::map<std::string, std::string> thread_of_function;
    std::set<std::string> signals;
    std::set<std::string> values;  ///< what is set
};

Objects objects_of(const Parsed& text) {
    Objects found;
    for (const Command& command : text.commands) {
        const auto& args = command.args;
        if (command.name.text == "net" && !args.empty()) {
            found.signals.insert(args[0].text);
            for (std::size_t i = 1; i < args.size(); ++i) {
                if (!is_arrow(args[i].text)) {
                    found.signal_of_pin[args[i].text] = args[0].text;
                }
            }
        } else if (command.name.text == "addf" && args.size() >= 2) {
            found.thread_of_function[args[0].text] = args[1].text;
        } else if ((command.name.text == "setp" || command.name.text == "sets") && !args.empty()) {
            found.values.insert(args[0].text);
        }
    }
    return found;
}

/// What undoes the removed links and functions. A pin that another signal takes is unlinked first.
std::string undo(const Objects& before, const Objects& after) {
    std::string commands;
    for (const auto& [pin, signal] : before.signal_of_pin) {
        const auto now = after.signal_of_pin.find(pin);
        if (now == after.signal_of_pin.end() || now->second != signal) {
            commands += "unlinkp " + written(pin) + "\n";
        }
    }
    for (const auto& [function, thread] : before.thread_of_function) {
        const auto now = after.thread_of_function.find(function);
        if (now == after.thread_of_function.end() || now->second != thread) {
            commands += "delf " + written(function) + " " + written(thread) + "\n";
        }
    }
    for (const std::string& signal : before.signals) {
        if (!after.signals.contains(signal)) {
            commands += "delsig " + written(signal) + "\n";
        }
    }
    return commands;
}

std::string_view first_word(std::string_view line) {
    const auto begin = std::min(line.find_first_not_of(" \t"), line.size());
    return line.substr(begin, line.find_first_of(" \t\r\n", begin) - begin);
}

/// Returns why a line cannot be part of a transaction; empty: it can.
std::string obstacle(const std::string& line) {
    const std::string_view name = first_word(line);
    const CommandRow* const row = find_command(name);
    const bool is_assignment = !row && line.find(" = ") != line.npos;
    if (is_assignment || (row && row->edits())) return "";
    return fmt::format("'{}' acts at once and cannot be part of a transaction", name);
}

/// Returns whether removing or changing such a line is compared by its objects.
bool is_compared(const std::string& line) {
    const std::string_view name = first_word(line);
    return name == "net" || name == "addf" || name == "setp" || name == "sets" ||
           !find_command(name);
}

}  // namespace

NetlistChanges netlist_changes(const std::string& before, const std::string& after,
                               const Ini& ini) {
    const Parsed old_text = parsed(before, ini);
    const Parsed new_text = parsed(after, ini);
    std::multiset<std::string> old_lines;
    for (const auto& [number, line] : old_text.lines) {
        old_lines.insert(line);
    }
    NetlistChanges changes;
    const Objects old_objects = objects_of(old_text);
    const Objects new_objects = objects_of(new_text);
    changes.removed = undo(old_objects, new_objects);
    std::uint32_t at = 0;
    for (const auto& [number, line] : new_text.lines) {
        if (const auto same = old_lines.find(line); same != old_lines.end()) {
            old_lines.erase(same);
            continue;
        }
        ++changes.lines;
        if (const std::string reason = obstacle(line); !reason.empty()) {
            changes.not_sent.push_back(fmt::format("line {}: {}", number + 1, reason));
            continue;
        }
        changes.changed.append(number - at, '\n');
        changes.changed += line;
        at = number + static_cast<std::uint32_t>(std::ranges::count(line, '\n'));
    }
    for (const std::string& line : old_lines) {
        ++changes.lines;
        if (is_compared(line)) continue;
        changes.not_sent.push_back(fmt::format("'{}' was removed or changed; what it made stays",
                                               line.substr(0, line.find('\n'))));
    }
    for (const std::string& name : old_objects.values) {
        if (!new_objects.values.contains(name)) {
            changes.not_sent.push_back(fmt::format("'{}' keeps its value", name));
        }
    }
    return changes;
}

}  // namespace hal::tools
