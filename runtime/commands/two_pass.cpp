// SPDX-License-Identifier: MIT
#include "commands/two_pass.hpp"

#include <algorithm>
#include <utility>

#include "commands/files.hpp"
#include "linuxcnc/find/modules.hpp"
#include "text/characters.hpp"
#include "text/numbers.hpp"

namespace hal {
namespace {

bool is_include(const Command& command) {
    return command.name.text == "source" && command.args.size() == 1;
}

/// Adds an argument of a further `loadrt` of the same module: numbers of instances are added, lists
/// are joined.
void merge_argument(Command& loadrt, const Token& argument) {
    const auto equals = argument.text.find('=');
    const std::string key = argument.text.substr(0, equals + 1);
    for (Token& there : loadrt.args) {
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
    loadrt.args.push_back(argument);
}

/// Returns the index of the argument that is the module's name.
std::size_t name_at(const Command& loadrt) { return loadrt.args[0].text == "--linuxcnc" ? 1 : 0; }

}  // namespace

bool opts_out_of_two_pass(std::string_view text) {
    for (std::size_t at = 0; at < text.size();) {
        const auto end = std::min(text.find('\n', at), text.size());
        std::string line;
        for (const char c : text.substr(at, end - at)) {
            if (!is_blank(c) && c != '\r') {
                line += lower(c);
            }
        }
        if (line.starts_with("#notwopass")) return true;
        at = end + 1;
    }
    return false;
}

bool merge_load(const Command& command, std::vector<Command>& loads) {
    if (command.args.empty()) return false;
    const bool asked = command.args.size() > 1 && command.args[0].text == "--linuxcnc";
    if (!asked && usual_origin(command.args[0].text) != Origin::linuxcnc) return false;
    const std::size_t name = name_at(command);
    const auto same = std::ranges::find_if(loads, [&](const Command& load) {
        return load.args[name_at(load)].text == command.args[name].text;
    });
    if (same == loads.end()) {
        loads.push_back(command);
        return true;
    }
    for (std::size_t i = name + 1; i < command.args.size(); ++i) {
        merge_argument(*same, command.args[i]);
    }
    return true;
}

void TwoPass::add(std::uint32_t text) {
    if (opts_out_of_two_pass(texts_.text(text))) {
        whole_.push_back({text, rest_.size()});
        return;
    }
    texts_.enter(text);
    sort(text);
    texts_.leave();
}

void TwoPass::sort(std::uint32_t text) {
    ParsedText parsed = texts_.parse(text);
    problems_.take(parsed.problems);
    for (Command& command : parsed.commands) {
        if (command.name.text == "loadusr") {
            programs_.push_back(std::move(command));
        } else if (command.name.text == "loadrt") {
            loads_.push_back(std::move(command));
        } else if (is_include(command)) {
            sort_included(std::move(command));
        } else {
            rest_.push_back(std::move(command));
        }
    }
}

void TwoPass::sort_included(Command command) {
    const std::string& given = command.args[0].text;
    const std::string& directory = shell_.options.directory;
    std::string path = resolve_path(given, directory), content, problem;
    if (texts_.is_open(canonical_path(path)) ||
        !read_netlist(given, directory, path, content, problem)) {
        // reports the error when it runs in its turn
        rest_.push_back(std::move(command));
        return;
    }
    texts_.enter(canonical_path(path), command.span);
    sort(texts_.add(path, std::move(content)));
    texts_.leave();
}

}  // namespace hal
