// SPDX-License-Identifier: MIT
// Netlists, values and diagnostics: parse, expand, format, render. Dictionary: netlist.dict.
#include <cstdint>
#include <string>
#include <string_view>

#include "base/types.hpp"
#include "netlist/netlist.hpp"
#include "tests/fuzz/driver/require.hpp"

namespace {

using hal::fuzz::require;

std::string words(const std::vector<hal::Command>& commands) {
    std::string text;
    for (const hal::Command& command : commands) {
        text += command.name.text + '\0';
        for (const hal::Token& arg : command.args) {
            text += arg.text + '\0';
        }
        text += '\n';
    }
    return text;
}

void check_spans(const hal::Sources& sources, std::uint32_t source,
                 const std::vector<hal::Command>& commands) {
    const std::size_t size = sources.get(source).text.size();
    std::size_t last = 0;
    for (const hal::Command& command : commands) {
        require(!command.name.text.empty(), "a command has a name");
        require(command.span.begin >= last && command.span.end <= size,
                "commands stand one after the other");
        last = command.span.end;
        std::size_t word = command.name.span.begin;
        require(word == command.span.begin, "a command starts with its name");
        for (const hal::Token& arg : command.args) {
            require(!arg.text.empty(), "a word is not empty");
            require(arg.span.begin >= word && arg.span.begin < arg.span.end &&
                        arg.span.end <= command.span.end,
                    "words stand one after the other");
            word = arg.span.begin;
        }
    }
}

void check_format(hal::Sources& sources, std::uint32_t source,
                  const std::vector<hal::Command>& commands, const hal::Environment& environment) {
    hal::Diagnostics found;
    const std::string once = hal::format(sources, source, found);
    if (found.failed()) {
        return require(once == sources.get(source).text, "a faulty text is not formatted");
    }
    const auto again = sources.add("formatted.hal", once);
    require(hal::format(sources, again, found) == once, "formatting twice changes nothing");
    hal::Diagnostics of_formatted;
    const std::vector<hal::Command> after = hal::parse(sources, again, environment, of_formatted);
    require(words(after) == words(commands), "formatting keeps the meaning");
}

void check_value(const std::string& text) {
    for (const hal::TypeRow& row : hal::types) {
        const hal::Parsed parsed = hal::parse_value(row.type, text);
        if (!parsed.problem.empty()) continue;
        const hal::Parsed again =
            hal::parse_value(row.type, hal::format_exact(row.type, parsed.value));
        // NaN has no sign in text; everything else is restored bit by bit.
        const bool nan = row.type == HAL_TYPE_FLOAT && parsed.value.real != parsed.value.real;
        require(again.problem.empty() && (nan || again.value.raw == parsed.value.raw),
                "a value is read back as it was");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view input(reinterpret_cast<const char*>(data), size);
    hal::Sources sources;
    hal::Diagnostics found;
    const auto source = sources.add("input.hal", std::string(input));
    const hal::Environment environment{
        .ini = nullptr, .variable = [](const std::string& name) -> std::optional<std::string> {
        if (name == "UNSET") return std::nullopt;
        return name.size() % 3 == 0 ? "" : name.size() % 3 == 1 ? "{x,y}" : "two words";
    }};

    const std::vector<hal::Command> commands = hal::parse(sources, source, environment, found);
    check_spans(sources, source, commands);
    check_format(sources, source, commands, environment);

    std::size_t names = 0;
    for (const hal::Command& command : commands) {
        hal::Diagnostics of_command;
        const std::vector<hal::Command> plain = hal::expand(command, of_command);
        require(plain.empty() == of_command.failed(), "a command is expanded or rejected");
        for (const hal::Command& one : plain) {
            require(one.span.begin == command.span.begin && !one.name.text.empty(),
                    "expansion keeps the place");
        }
        found.take(of_command);
        if ((names += plain.size()) > 100'000) {
            break;  // a few huge ranges are enough
        }
    }

    for (const hal::Command& command : commands) {
        if (!command.args.empty()) {
            check_value(command.args.back().text);
        }
    }

    const std::string text = hal::render(found, sources);

    const std::string colored = hal::render(found, sources, true);
    for (const char c : text) {
        require(static_cast<unsigned char>(c) >= 0x20 || c == '\n',
                "nothing raw reaches the terminal");
    }
    require(colored.size() >= text.size(), "colors are added only");
    return 0;
}
