// SPDX-License-Identifier: MIT
#include "netlist/journal_line.hpp"

#include "text/numbers.hpp"

namespace hal {
namespace {

constexpr std::string_view keep = "keep=";
constexpr std::int64_t min_keep_ns = 1'000'000'000;

}  // namespace

bool is_journal_request(const Command& command) {
    return !command.args.empty() && command.args[0].text == "save";
}

std::optional<JournalLine> parse_journal_line(const Command& command, Diagnostics& diagnostics) {
    if (command.args.empty()) return std::nullopt;
    JournalLine line{command.args[0].text};
    if (!line.file.ends_with(".mcap")) {
        diagnostics.error("bad-argument", command.args[0].span,
                          "'" + line.file + "' is not a valid name of a journal", "",
                          "name the file .mcap");
        return std::nullopt;
    }
    if (command.args.size() == 1) return line;
    const Token& option = command.args[1];
    const bool is_keep = option.text.starts_with(keep);
    const auto keep_ns = is_keep
                             ? parse_duration_ns(std::string_view(option.text).substr(keep.size()))
                             : std::nullopt;
    if (!keep_ns || *keep_ns < min_keep_ns) {
        diagnostics.error("bad-argument", option.span,
                          "'" + option.text + "' is not a valid duration of a journal", "",
                          "write keep=10min; the shortest is keep=1s");
        return std::nullopt;
    }
    line.keep_ns = *keep_ns;
    return line;
}

std::optional<JournalLine> journal_line(const Command& command) {
    if (command.name.text != "journal" || is_journal_request(command)) return std::nullopt;
    Diagnostics reported_when_run;
    return parse_journal_line(command, reported_when_run);
}

}  // namespace hal
