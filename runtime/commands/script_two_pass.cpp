// SPDX-License-Identifier: MIT
// `[HAL]TWOPASS`: several texts with the loads of all of them done first.
#include <algorithm>
#include <utility>

#include "commands/files.hpp"
#include "commands/script.hpp"
#include "machine/module_library.hpp"
#include "text/numbers.hpp"

namespace hal {
namespace {

bool is_include(const Command& command) {
    return command.name.text == "source" && command.args.size() == 1;
}

/// `#NOTWOPASS` anywhere in a text, case and blanks ignored.
bool opts_out(std::string_view text) {
    static constexpr std::string_view magic = "#notwopass";
    for (std::size_t at = 0; at < text.size();) {
        const auto end = std::min(text.find('\n', at), text.size());
        std::string line;
        for (const char c : text.substr(at, end - at)) {
            if (c != ' ' && c != '\t' && c != '\r') {
                line += static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
            }
        }
        if (line.starts_with(magic)) return true;
        at = end + 1;
    }
    return false;
}

/// Adds an argument of a further `loadrt` of the same module: numbers of instances are added, lists
/// are joined.
void merge_argument(Command& load, const Token& argument) {
    const auto equals = argument.text.find('=');
    const std::string key = argument.text.substr(0, equals + 1);
    for (Token& there : load.args) {
        if (equals == std::string::npos || !there.text.starts_with(key)) continue;
        const auto first = parse_natural(there.text.substr(key.size()));

        const auto second = parse_natural(argument.text.substr(key.size()));
        if (first && second && (key == "count=" || key == "num_chan=")) {
            there.text = key + std::to_string(*first + *second);
        } else if (there.text != argument.text) {
            there.text += "," + argument.text.substr(key.size());
        }
        return;
    }
    load.args.push_back(argument);
}

}  // namespace

bool Script::merge_load(const Command& command) {
    const bool asked = command.args.size() > 1 && command.args[0].text == "--linuxcnc";
    if (command.args.empty() ||
        (!asked && usual_origin(command.args[0].text) != Origin::linuxcnc)) {
        return false;
    }
    const auto name_of = [](const Command& load) {
        return load.args[load.args[0].text == "--linuxcnc" ? 1 : 0].text;
    };
    text_is_kept_ = true;
    state_.module_load_texts.push_back(command.span.source);
    session_.sources.hold(command.span.source);
    for (Command& load : *state_.module_loads) {
        if (name_of(load) != name_of(command)) continue;
        for (std::size_t i = asked ? 2 : 1; i < command.args.size(); ++i) {
            merge_argument(load, command.args[i]);
        }
        return true;
    }
    state_.module_loads->push_back(command);
    return true;
}

int Script::run_two_pass(const std::vector<std::uint32_t>& texts, Pass pass) {
    // Loading is additive here, so that the loads of all files need not be merged into one line per
    // component: doing them first, in order, gives the same instances, but for LinuxCNC's modules
    // (merge_load). loadusr comes before that, as in LinuxCNC's first pass.
    std::vector<Command> programs, loads, rest;
    std::vector<std::size_t> whole;  // places in `rest` where a text that opted out runs as it is
    std::vector<std::uint32_t> opted_out;
    const auto sort_in = [&](const auto& self, std::uint32_t text) -> void {
        Parsed parsed = parse_text(text);
        pending_.take(parsed.problems);
        for (Command& command : parsed.commands) {
            if (command.name.text == "loadusr") {
                programs.push_back(std::move(command));
            } else if (command.name.text == "loadrt") {
                loads.push_back(std::move(command));
            } else if (is_include(command)) {
                std::string path = resolve_path(command.args[0].text, shell_.options.directory),
                            content, problem;
                const bool again = std::any_of(files_.begin(), files_.end(), [&](const Open& open) {
                    return open.path == canonical_path(path);
                });
                if (again || !read_netlist(command.args[0].text, shell_.options.directory, path,
                                           content, problem)) {
                    // reports the error when it runs in its turn
                    rest.push_back(std::move(command));
                    continue;
                }
                files_.push_back({canonical_path(path), command.span});
                self(self, add_text(path, std::move(content)));
                files_.pop_back();
            } else {
                rest.push_back(std::move(command));
            }
        }
    };
    for (const std::uint32_t text : texts) {
        if (opts_out(session_.sources.get(text).text)) {
            whole.push_back(rest.size());
            opted_out.push_back(text);
            continue;
        }
        files_.push_back({own_path(text), {}});
        sort_in(sort_in, text);
        files_.pop_back();
    }
    text_is_kept_ = true;
    files_.push_back({"", {}});
    if (pass != Pass::rest) {
        run_row(programs, 0, programs.size());
        run_row(loads, 0, loads.size());
    }
    if (pass == Pass::loads) {
        rest.clear();
        whole.clear();
    }
    std::size_t at = 0;
    for (std::size_t i = 0; i < whole.size(); ++i) {
        run_row(rest, at, whole[i]);
        at = whole[i];
        finish();
        if (stop()) break;
        const bool kept = std::exchange(shell_.options.keep_going, true);
        run_commands(opted_out[i]);
        shell_.options.keep_going = kept;
    }
    run_row(rest, at, rest.size());
    files_.pop_back();
    finish();
    return failed_ ? 1 : 0;
}

}  // namespace hal
