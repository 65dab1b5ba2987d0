// SPDX-License-Identifier: MIT
#include "run/applied_changes.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "commands/table.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

namespace {

using Order = std::vector<std::string>;  // functions of a thread, and blocks()

/// A logical line: a command with its ranges expanded.
struct Line {
    std::uint32_t number = 0;
    std::string text;             ///< as it is sent, with its line ends
    std::string key;              ///< equal for lines that differ in blanks and comments only
    std::vector<Command> commands;

    const std::string& name() const { return commands.front().name.text; }
    bool is_automatic() const {
        const auto& args = commands.front().args;
        return name() == "addf" && !args.empty() && args[0].text == "--auto";
    }
    /// Returns whether the effect of such a line is compared by its objects.
    bool is_compared() const {
        return name() == "net" || (name() == "addf" && !is_automatic()) || name() == "setp" ||
               name() == "sets" || !find_command(name());
    }
};

/// What `setp NAME VALUE`, `sets NAME VALUE` or `NAME = VALUE` sets.
struct Assignment {
    std::string name;  ///< empty: another command
    std::string value;
};

Assignment assignment_of(const Command& command) {
    const auto& args = command.args;
    if (args.size() < 2) return {};
    if (command.name.text == "setp" || command.name.text == "sets") {
        return {args[0].text, args[1].text};
    }
    if (args[0].text == "=") return {command.name.text, args[1].text};
    return {};
}

/// Removes the line end and leading blanks of the first physical line.
std::string shown(const std::string& text) {
    const std::string first = text.substr(0, text.find_first_of("\r\n"));
    return first.substr(std::min(first.find_first_not_of(" \t"), first.size()));
}

/// The physical lines of a text.
class TextLines {
public:
    explicit TextLines(std::string_view text) : text_(text) {
        for (std::size_t at = text.find_first_of("\r\n"); at != text.npos;
             at = text.find_first_of("\r\n", at)) {
            const bool pair = text.substr(at, 2) == "\r\n";
            at += pair ? 2 : 1;
            starts_.push_back(at);
        }
    }
    std::uint32_t number_at(std::size_t offset) const {
        const auto next = std::ranges::upper_bound(starts_, offset);
        return static_cast<std::uint32_t>(next - starts_.begin() - 1);
    }
    /// Returns a line without its end.
    std::string_view line(std::uint32_t number) const {
        const std::size_t begin = starts_[number];
        const std::string_view rest = text_.substr(begin);
        return rest.substr(0, rest.find_first_of("\r\n"));
    }

private:
    std::string_view text_;
    std::vector<std::size_t> starts_ = {0};
};

std::vector<Line> parsed(const std::string& text, const Ini& ini) {
    Sources sources;
    Diagnostics ignored;
    const std::uint32_t source = sources.add("netlist", text);
    std::vector<Line> lines;
    const TextLines document(text);
    for (const Command& command : parse(sources, source, {&ini, {}}, ignored)) {
        Line line;
        line.number = document.number_at(command.span.begin);
        const std::uint32_t last = document.number_at(command.span.end);
        for (std::uint32_t number = line.number; number <= last; ++number) {
            line.text += std::string(document.line(number)) + "\n";
        }
        line.key = command.name.text;
        for (const Token& token : command.args) {
            line.key += '\0' + token.text;
        }
        line.commands = expand(command, ignored);
        if (!line.commands.empty()) {
            lines.push_back(std::move(line));
        }
    }
    return lines;
}

struct LastValue {
    std::string value;
    std::size_t line = 0;  ///< index
};

struct Objects {
    std::map<std::string, std::string> signal_of_pin;
    std::map<std::string, std::string> thread_of_function;
    std::set<std::string> signals;
    std::map<std::string, LastValue> values;  ///< the last ones
};

Objects objects_of(const std::vector<Line>& lines) {
    Objects found;
    for (std::size_t index = 0; index < lines.size(); ++index) {
        for (const Command& command : lines[index].commands) {
            const auto& args = command.args;
            if (command.name.text == "net" && !args.empty()) {
                found.signals.insert(args[0].text);
                for (std::size_t i = 1; i < args.size(); ++i) {
                    if (!is_arrow(args[i].text)) {
                        found.signal_of_pin[args[i].text] = args[0].text;
                    }
                }
            } else if (lines[index].is_automatic()) {
                continue;
            } else if (command.name.text == "addf" && args.size() >= 2) {
                found.thread_of_function[args[0].text] = args[1].text;
            } else if (const Assignment one = assignment_of(command); !one.name.empty()) {
                found.values[one.name] = {one.value, index};
            }
        }
    }
    return found;
}

/// Functions in an order that the text does not contain: of another file, or of `addf --auto`.
bool adds_unknown(const Line& line, const std::string& thread) {
    if (line.name() == "source") return true;
    const auto& args = line.commands.front().args;
    return line.is_automatic() && args.size() >= 2 && args[1].text == thread;
}

/// A name for such functions that no function has.
std::string block_of(const Line& line) { return " " + line.key; }
bool is_block(const std::string& name) { return name.starts_with(' '); }

/// The order of a thread while lines are applied to it.
class ThreadOrder {
public:
    explicit ThreadOrder(std::string thread) : thread_(std::move(thread)) {}

    const Order& functions() const { return functions_; }
    /// False: the machine would reject a line, because a function is already in the thread.
    bool is_valid() const { return valid_; }

    void apply(const Line& line) {
        if (adds_unknown(line, thread_)) return functions_.push_back(block_of(line));
        if (line.is_automatic()) return;
        for (const Command& command : line.commands) {
            const auto& args = command.args;
            if (args.size() < 2 || args[1].text != thread_) continue;
            if (command.name.text == "addf") {
                add(args[0].text, args.size() > 2 ? args[2].text : "-1");
            } else if (command.name.text == "delf") {
                remove(args[0].text);
            }
        }
    }
    void remove(const std::string& function) { std::erase(functions_, function); }

private:
    void add(const std::string& function, const std::string& position_text) {
        valid_ = valid_ && std::ranges::find(functions_, function) == functions_.end();
        const auto size = static_cast<int>(functions_.size());
        int position = -1;
        parse_whole(std::string_view(position_text).substr(position_text.starts_with('+') ? 1 : 0),
                    position);
        const int index = position > 0 ? position - 1 : size + 1 + position;
        functions_.insert(functions_.begin() + std::clamp(index, 0, size), function);
    }

    const std::string thread_;
    Order functions_;
    bool valid_ = true;
};

/// Two texts, and which lines of the new one are sent.
class Comparison {
public:
    Comparison(const std::string& before, const std::string& after, const Ini& ini)
        : old_lines_(parsed(before, ini)),
          lines_(parsed(after, ini)),
          old_(objects_of(old_lines_)),
          new_(objects_of(lines_)),
          sent_(lines_.size()) {
        match();
        while (send_last_values() || send_orders()) {
        }
    }

    NetlistChanges changes() const {
        NetlistChanges found;
        found.removed = undo();
        write_changed(found);
        write_removed(found.not_sent);
        for (const auto& [name, last] : old_.values) {
            if (!new_.values.contains(name)) {
                found.not_sent.push_back(fmt::format("'{}' keeps its value", name));
            }
        }
        write_moved(found.not_sent);
        write_orders(found.not_sent);
        return found;
    }

private:
    /// Finds the lines that are new, and those that were removed.
    void match() {
        std::map<std::string, std::vector<std::size_t>> by_key;
        for (std::size_t i = old_lines_.size(); i > 0; --i) {
            by_key[old_lines_[i - 1].key].push_back(i - 1);
        }
        std::vector<bool> kept(old_lines_.size());
        for (std::size_t i = 0; i < lines_.size(); ++i) {
            auto& same = by_key[lines_[i].key];
            if (same.empty()) {
                sent_[i] = true;
                continue;
            }
            kept_.push_back({same.back(), i});
            kept[same.back()] = true;
            same.pop_back();
        }
        for (std::size_t i = 0; i < old_lines_.size(); ++i) {
            if (!kept[i]) {
                removed_.push_back(i);
            }
        }
    }

    /// Sends the line with the last value of a name when the machine would have another. Returns
    /// whether a line was added.
    bool send_last_values() {
        std::map<std::string, std::string> machine;
        for (const auto& [name, last] : old_.values) {
            machine[name] = last.value;
        }
        for (std::size_t i = 0; i < lines_.size(); ++i) {
            if (!sent_[i]) continue;
            for (const Command& command : lines_[i].commands) {
                const Assignment one = assignment_of(command);
                machine[one.name] = one.value;
            }
        }
        bool added = false;
        for (const auto& [name, last] : new_.values) {
            if (machine[name] != last.value && !sent_[last.line]) {
                sent_[last.line] = true;
                added = true;
            }
        }
        return added;
    }

    std::set<std::string> threads() const {
        std::set<std::string> found;
        for (const auto* const objects : {&old_, &new_}) {
            for (const auto& [function, thread] : objects->thread_of_function) {
                found.insert(thread);
            }
        }
        return found;
    }
    static ThreadOrder order_of(const std::vector<Line>& lines, const std::string& thread) {
        ThreadOrder order(thread);
        for (const Line& line : lines) {
            order.apply(line);
        }
        return order;
    }
    bool is_removed(const std::string& function, const std::string& thread) const {
        const auto now = new_.thread_of_function.find(function);
        return resent_.contains(thread) || now == new_.thread_of_function.end() ||
               now->second != thread;
    }
    /// Returns whether the thread has the order of the new text after the lines are sent.
    bool has_order(const std::string& thread) const {
        ThreadOrder machine = order_of(old_lines_, thread);
        for (const auto& [function, in_thread] : old_.thread_of_function) {
            if (in_thread == thread && is_removed(function, thread)) {
                machine.remove(function);
            }
        }
        for (std::size_t i = 0; i < lines_.size(); ++i) {
            if (sent_[i]) {
                machine.apply(lines_[i]);
            }
        }
        return machine.is_valid() &&
               machine.functions() == order_of(lines_, thread).functions();
    }
    /// Adds the functions of threads in another order again. Returns whether there was one.
    bool send_orders() {
        bool added = false;
        for (const std::string& thread : threads()) {
            if (has_order(thread) || resent_.contains(thread)) continue;
            if (std::ranges::any_of(order_of(old_lines_, thread).functions(), is_block)) continue;
            if (std::ranges::any_of(order_of(lines_, thread).functions(), is_block)) continue;
            resent_.insert(thread);
            added = true;
            for (std::size_t i = 0; i < lines_.size(); ++i) {
                sent_[i] = sent_[i] || adds_to(lines_[i], thread);
            }
        }
        return added;
    }
    static bool adds_to(const Line& line, const std::string& thread) {
        return line.name() == "addf" &&
               std::ranges::any_of(line.commands, [&](const Command& command) {
                   return command.args.size() >= 2 && command.args[1].text == thread;
               });
    }

    /// What undoes the removed links and functions. A pin that another signal takes is unlinked
    /// first.
    std::string undo() const {
        std::string commands;
        for (const auto& [pin, signal] : old_.signal_of_pin) {
            const auto now = new_.signal_of_pin.find(pin);
            if (now == new_.signal_of_pin.end() || now->second != signal) {
                commands += "unlinkp " + written(pin) + "\n";
            }
        }
        for (const auto& [function, thread] : old_.thread_of_function) {
            if (is_removed(function, thread)) {
                commands += "delf " + written(function) + " " + written(thread) + "\n";
            }
        }
        for (const std::string& signal : old_.signals) {
            if (!new_.signals.contains(signal)) {
                commands += "delsig " + written(signal) + "\n";
            }
        }
        return commands;
    }

    void write_changed(NetlistChanges& found) const {
        std::uint32_t at = 0;
        for (std::size_t i = 0; i < lines_.size(); ++i) {
            if (!sent_[i]) continue;
            const Line& line = lines_[i];
            if (const std::string reason = obstacle(line); !reason.empty()) {
                found.not_sent.push_back(fmt::format("line {}: {}", line.number + 1, reason));
                continue;
            }
            found.changed.append(line.number - at, '\n');
            found.changed += line.text;
            at = line.number + static_cast<std::uint32_t>(std::ranges::count(line.text, '\n'));
        }
    }
    /// Returns why a line cannot be part of a transaction; empty: it can.
    static std::string obstacle(const Line& line) {
        const CommandRow* const row = find_command(line.name());
        const bool is_assignment = !row && line.text.find(" = ") != line.text.npos;
        if (is_assignment || (row && row->edits())) return "";
        return fmt::format("'{}' acts at once and cannot be part of a transaction", line.name());
    }

    void write_removed(std::vector<std::string>& not_sent) const {
        for (const std::size_t i : removed_) {
            if (old_lines_[i].is_compared()) continue;
            not_sent.push_back(fmt::format("'{}' was removed or changed; what it made stays",
                                           shown(old_lines_[i].text)));
        }
    }
    /// Names the first line, of those that are not compared, that was moved in front of another.
    void write_moved(std::vector<std::string>& not_sent) const {
        std::size_t last = 0;
        for (const auto& [before, after] : kept_) {
            if (lines_[after].is_compared()) continue;
            if (before < last) {
                not_sent.push_back(fmt::format("line {}: '{}' has another position among the other "
                                               "commands; that takes effect with the next start",
                                               lines_[after].number + 1,
                                               shown(lines_[after].text)));
                return;
            }
            last = before;
        }
    }
    void write_orders(std::vector<std::string>& not_sent) const {
        for (const std::string& thread : threads()) {
            if (has_order(thread)) continue;
            not_sent.push_back(fmt::format("the new order of functions in thread '{}' takes effect "
                                           "with the next start: `source` or `addf --auto` adds "
                                           "some of them",
                                           thread));
        }
        const bool other_links = old_.signal_of_pin != new_.signal_of_pin ||
                                 old_.thread_of_function != new_.thread_of_function ||
                                 std::ranges::find(sent_, true) != sent_.end();
        for (std::size_t i = 0; i < lines_.size(); ++i) {
            if (!other_links || sent_[i] || !lines_[i].is_automatic()) continue;
            not_sent.push_back(fmt::format("line {}: '{}' chooses an order again with the next "
                                           "start only",
                                           lines_[i].number + 1, shown(lines_[i].text)));
        }
    }

    const std::vector<Line> old_lines_;
    const std::vector<Line> lines_;
    const Objects old_;
    const Objects new_;
    std::vector<bool> sent_;  // by the lines of the new text
    std::vector<std::pair<std::size_t, std::size_t>> kept_;  // old line, new line; by the new one
    std::vector<std::size_t> removed_;
    std::set<std::string> resent_;  // threads whose functions are all added again
};

}  // namespace

NetlistChanges netlist_changes(const std::string& before, const std::string& after,
                               const Ini& ini) {
    return Comparison(before, after, ini).changes();
}

}  // namespace hal::tools
