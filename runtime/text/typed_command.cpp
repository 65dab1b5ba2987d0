// SPDX-License-Identifier: MIT
#include "text/typed_command.hpp"

#include <cctype>
#include <cstdlib>

namespace hal {
namespace {

/// Whether a command begins at `at`: behind the beginning, a blank or an opening mark, and before a
/// word.
bool is_command(std::string_view text, std::size_t at, std::string_view program) {
    constexpr std::string_view marks = " \n`'(";
    const bool begins = at == 0 || marks.find(text[at - 1]) != std::string_view::npos;
    const std::size_t behind = at + program.size();
    return begins && behind < text.size() &&
           std::isalpha(static_cast<unsigned char>(text[behind])) != 0;
}

}  // namespace

std::string started_as() {
    const char* const started = std::getenv("HALCYON_STARTED_AS");
    return started == nullptr || *started == '\0' ? "hal" : started;
}

std::string as_typed(std::string_view text) {
    constexpr std::string_view program = "hal ";
    const std::string typed = started_as() + " ";
    std::string changed;
    std::size_t from = 0;
    for (std::size_t at = text.find(program); at != std::string_view::npos;
         at = text.find(program, at + program.size())) {
        if (!is_command(text, at, program)) continue;
        changed += text.substr(from, at - from);
        changed += typed;
        from = at + program.size();
    }
    return changed.append(text.substr(from));
}

}  // namespace hal
