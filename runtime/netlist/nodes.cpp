// SPDX-License-Identifier: MIT
#include "netlist/nodes.hpp"

#include <algorithm>

#include "base/types.hpp"
#include "text/characters.hpp"

namespace hal {
namespace {

constexpr std::size_t longest_name = 32;
constexpr std::size_t max_nodes = 100;
constexpr std::int64_t shortest_ns = 100'000;
constexpr std::int64_t max_ns = 60'000'000'000;

bool good_name(std::string_view name) {
    const auto good = [](char c) { return is_name_character(c) && c != '.'; };
    return !name.empty() && name.size() <= longest_name &&
           std::all_of(name.begin(), name.end(), good);
}

/// Names and options of one line.
struct ParsedLine {
    std::vector<const Token*> names;
    std::int64_t rate_ns = 0;
    std::int64_t deadline_ns = 0;
    Span options_at;
};

bool read_option(const Token& token, std::size_t equals, ParsedLine& line,
                 Diagnostics& diagnostics) {
    const std::string key = token.text.substr(0, equals);
    const std::string value = token.text.substr(equals + 1);
    if (key != "rate" && key != "deadline") {
        diagnostics.error("unknown-argument", token.span, "node has no option '" + key + "'",
                          did_you_mean(key, {"rate", "deadline"}), to_string(node_usage));
        return false;
    }
    const auto ns = parse_duration_ns(value);
    if (!ns || *ns < shortest_ns || *ns > max_ns) {
        diagnostics.error("bad-argument", token.span, "'" + value + "' is not a valid interval", "",
                          "the range is 100us..60s; for example 5ms or 0.1s");
        return false;
    }
    (key == "rate" ? line.rate_ns : line.deadline_ns) = *ns;
    line.options_at = token.span;
    return true;
}

bool read_line(const Command& command, ParsedLine& line, Diagnostics& diagnostics) {
    bool good = true;
    for (const Token& token : command.args) {
        if (const auto equals = token.text.find('='); equals != std::string::npos) {
            good = read_option(token, equals, line, diagnostics) && good;
        } else if (!good_name(token.text)) {
            diagnostics.error("bad-node", token.span,
                              "'" + token.text.substr(0, 100) + "' is not a valid node name", "",
                              "use letters, digits, - and _, at most " +
                                  std::to_string(longest_name) + " of them");
            good = false;
        } else {
            line.names.push_back(&token);
        }
    }
    if (line.names.empty() && good) {
        diagnostics.error("wrong-arguments", command.name.span,
                          "node takes at least 1 argument, not 0", "", to_string(node_usage));
        return false;
    }
    const bool all = std::any_of(line.names.begin(), line.names.end(),
                                 [](const Token* t) { return t->text == "all"; });
    if (all && (line.names.size() > 1 || line.options_at.known())) {
        diagnostics.error("bad-node", line.names.size() > 1 ? line.names[1]->span : line.options_at,
                          "'all' cannot be combined with names or options: it means every node", "",
                          "node all");
        return false;
    }
    return good;
}

/// Sets rate= and deadline= of a node; different values in two lines are an error.
void parse_options(NodeLine& node, const ParsedLine& line, Diagnostics& diagnostics) {
    const bool again =
        (line.rate_ns != 0 && node.rate_ns != 0 && line.rate_ns != node.rate_ns) ||
        (line.deadline_ns != 0 && node.deadline_ns != 0 && line.deadline_ns != node.deadline_ns);
    if (again) {
        Diagnostic d{Severity::error,
                     "bad-argument",
                     "node '" + node.name + "' has two different values of rate= or deadline=",
                     {{line.options_at, "second time"}},
                     {}};
        d.labels.push_back({node.options_at, "first time"});
        d.help.emplace_back("set rate= and deadline= in one of its lines only");
        diagnostics.add(std::move(d));
        return;
    }
    if (line.options_at.known()) {
        node.options_at = line.options_at;
    }
    if (line.rate_ns != 0) {
        node.rate_ns = line.rate_ns;
    }
    if (line.deadline_ns != 0) {
        node.deadline_ns = line.deadline_ns;
    }
}

}  // namespace

bool is_node_line(const Command& command) {
    return command.name.text == "node" && (command.args.empty() || command.args[0].text != "=");
}

void collect_nodes(const std::vector<Command>& commands, std::vector<NodeLine>& nodes,
                   Diagnostics& diagnostics) {
    for (const Command& written : commands) {
        if (!is_node_line(written)) continue;
        for (const Command& command : expand(written, diagnostics)) {
            ParsedLine line;
            if (!read_line(command, line, diagnostics)) continue;
            for (const Token* const token : line.names) {
                if (token->text == "all") continue;
                auto node = std::find_if(nodes.begin(), nodes.end(),
                                         [&](const NodeLine& n) { return n.name == token->text; });
                if (node == nodes.end()) {
                    if (nodes.size() == max_nodes) {
                        diagnostics.error(
                            "bad-node", token->span,
                            "more than " + std::to_string(max_nodes) + " nodes in this netlist");
                        return;
                    }
                    node = nodes.insert(nodes.end(), NodeLine{token->text, token->span, 0, 0, {}});
                }
                parse_options(*node, line, diagnostics);
            }
        }
    }
    for (const NodeLine& node : nodes) {
        if (node.deadline() < 2 * node.rate()) {
            diagnostics.error(
                "bad-argument", node.options_at,
                "node '" + node.name + "' sends every " +
                    format_duration(static_cast<double>(node.rate())) +
                    ", but its readers wait only " +
                    format_duration(static_cast<double>(node.deadline())),
                "",
                "use a deadline of at least twice the interval, so that one message may be late");
        }
    }
}

void keep_part(std::string_view name, std::vector<Command>& commands) {
    bool mine = true;
    Diagnostics said_by_collect_nodes;
    std::erase_if(commands, [&](const Command& command) {
        if (!is_node_line(command)) return !mine;
        mine = false;
        for (const Command& one : expand(command, said_by_collect_nodes)) {
            for (const Token& token : one.args) {
                mine = mine || token.text == name || token.text == "all";
            }
        }
        return true;
    });
}

}  // namespace hal
