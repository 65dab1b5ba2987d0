// SPDX-License-Identifier: MIT
#include "config_lines.hpp"

#include <algorithm>
#include <cmath>

namespace hal::canopen::config {

namespace {

constexpr std::uint32_t most_lines = 20'000;

/// Types as in `write 0x2000 u16 = 5`.
constexpr std::pair<const char*, Type> types[] = {
    {"bool", Type::boolean},   {"i8", Type::integer8},    {"i16", Type::integer16},
    {"i32", Type::integer32},  {"i64", Type::integer64},  {"u8", Type::unsigned8},
    {"u16", Type::unsigned16}, {"u32", Type::unsigned32}, {"u64", Type::unsigned64},
    {"real32", Type::real32},  {"real64", Type::real64},  {"text", Type::visible_string}};

}  // namespace

const char* code_of(Topic topic) {
    constexpr const char* codes[] = {"canopen-line", "canopen-value", "canopen-object",
                                     "canopen-node", "canopen-load"};
    return codes[static_cast<std::size_t>(topic)];
}

std::vector<Section> split(std::string_view file, Report& report) {
    using Kind = text::IniLine::Kind;
    std::vector<Section> sections;
    text::Lines lines(file);
    while (const auto whole = lines.next()) {
        if (whole->at.line > most_lines) {
            report.error(Topic::line, whole->at,
                         "the file has more than " + std::to_string(most_lines) + " lines",
                         "is it the right file?");
            break;
        }
        const text::IniLine ini = text::ini_line(whole->text);
        const auto word = [&](std::string_view of) {
            const auto begin = static_cast<std::size_t>(of.data() - whole->text.data());
            return text::part(*whole, begin, begin + of.size());
        };
        if (ini.kind == Kind::open_section || (ini.kind == Kind::section && !ini.value.empty())) {
            if (ini.kind == Kind::section) {
                report.error(Topic::line, word(ini.value).at,
                             "unexpected text after the section name", "a comment begins with #");
            } else {
                report.error(Topic::line, whole->at, "section name without ']'",
                             "write [bus], [type NAME] or [node 5 NAME]", "missing ']'");
            }
            continue;
        }
        if (ini.kind == Kind::section) {
            Section section;
            section.at = whole->at;
            section.words = words_of(word(ini.name));
            sections.push_back(std::move(section));
            continue;
        }
        if (ini.kind != Kind::entry) {
            report.error(Topic::line, whole->at,
                         "invalid line: neither a [section] nor KEY = VALUE",
                         "a comment begins with #");
            continue;
        }
        Line line{word(ini.name), {}, {}};
        if (ini.value.empty()) {
            report.error(Topic::value, line.key.at, "'" + line.key.text + "' has no value",
                         "write " + line.key.text + " = VALUE, or delete the line");
            continue;
        }
        line.value = word(ini.value);
        line.written = line.key.text;
        std::transform(line.key.text.begin(), line.key.text.end(), line.key.text.begin(),
                       [](char c) { return c == '_' ? '-' : lower(c); });
        if (sections.empty()) {
            report.error(Topic::line, whole->at, "this line is before the first section",
                         "begin the file with [bus]");
            continue;
        }
        sections.back().lines.push_back(std::move(line));
    }
    return sections;
}

std::optional<std::uint32_t> rate(std::string_view text) {
    const auto value = parse_quantity(text);
    if (!value) {
        return {};
    }
    const double unit = value->unit == "k"    ? 1e3
                        : value->unit == "M"  ? 1e6
                        : value->unit.empty() ? 1
                                              : 0;
    const double bits = value->number * unit;
    if (bits < 5e3 || bits > 20e6) {
        return {};
    }
    return static_cast<std::uint32_t>(std::lround(bits));
}

std::optional<Time> duration(std::string_view text) { return parse_duration_ns(text, 0.0); }

std::optional<bool> yes_or_no(std::string_view text) {
    for (const char* word : {"yes", "true", "on", "1"}) {
        if (same_word(text, word)) return true;
    }
    for (const char* word : {"no", "false", "off", "0"}) {
        if (same_word(text, word)) return false;
    }
    return {};
}

std::optional<Type> type_named(std::string_view word) {
    for (const auto& [name, type] : types) {
        if (same_word(word, name)) return type;
    }
    return {};
}

std::optional<std::pair<std::uint16_t, std::uint8_t>> address(std::string_view text,
                                                              bool& has_sub) {
    if (!text.starts_with("0x")) {
        return {};
    }
    const std::size_t colon = std::min(text.find(':'), text.size());
    has_sub = colon < text.size();
    const auto index = parse_natural(text.substr(0, colon));
    const auto sub =
        has_sub ? parse_natural(text.substr(colon + 1)) : std::optional<std::uint64_t>(0);
    if (!index || !sub || *index > 0xffff || *sub > 0xff) {
        return {};
    }
    return std::pair(static_cast<std::uint16_t>(*index), static_cast<std::uint8_t>(*sub));
}

std::string object_label(std::uint16_t index, unsigned sub, bool single) {
    constexpr char digits[] = "0123456789ABCDEF";
    std::string out = "0x";
    for (int shift = 12; shift >= 0; shift -= 4) {
        out += digits[index >> shift & 15];
    }
    return single ? out : out + ":" + std::to_string(sub);
}

}  // namespace hal::canopen::config
