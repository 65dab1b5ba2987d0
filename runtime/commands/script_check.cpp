// SPDX-License-Identifier: MIT
// What `hal check` does in place of commands that act.
#include <filesystem>

#include "commands/script.hpp"

namespace hal {

void Script::note_program(const Command& command) {
    std::vector<std::string> names;
    std::string program;
    for (std::size_t i = 0; i < command.args.size(); ++i) {
        const std::string& word = command.args[i].text;
        const bool named = word == "-Wn" && i + 1 < command.args.size();
        if (named) {
            names.push_back(command.args[++i].text);
        }
        if (named || word.starts_with('-')) continue;
        // Many programs take the name of their component as an argument: pyvcp -c panel panel.xml
        names.push_back(std::filesystem::path(word).stem().string());
        if (program.empty()) {
            program = word;
        }
    }
    session_.absences().note_program(program, names);
}

}  // namespace hal
