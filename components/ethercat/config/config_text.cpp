// SPDX-License-Identifier: MIT
#include "ethercat/config/config_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace hal::ethercat::config {

namespace {

constexpr std::uint32_t most_lines = 20'000;

using master::Type;
constexpr TypeWord type_list[] = {
    {"bit", "BOOL", Type::bit, 1},        {"u8", "USINT", Type::u8, 8},
    {"u16", "UINT", Type::u16, 16},       {"u32", "UDINT", Type::u32, 32},
    {"u64", "ULINT", Type::u64, 64},      {"s8", "SINT", Type::s8, 8},
    {"s16", "INT", Type::s16, 16},        {"s32", "DINT", Type::s32, 32},
    {"s64", "LINT", Type::s64, 64},       {"real32", "REAL", Type::real32, 32},
    {"real64", "LREAL", Type::real64, 64}};

}  // namespace

const char* code_of(Topic topic) {
    constexpr const char* codes[] = {"ethercat-line", "ethercat-value", "ethercat-object",
                                     "ethercat-slave"};
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
        if (ini.kind == Kind::section && !ini.value.empty()) {
            report.error(Topic::line, word(ini.value).at, "unexpected text after the section name",
                         "a comment begins with #");
        } else if (ini.kind == Kind::open_section) {
            report.error(Topic::line, whole->at, "section name without ']'",
                         "write [bus], [type NAME] or [slave 0 NAME]", "missing ']'");
        } else if (ini.kind == Kind::section) {
            sections.push_back({words_of(word(ini.name)), whole->at, {}});
        } else if (ini.kind != Kind::entry) {
            report.error(Topic::line, whole->at,
                         "invalid line: neither a [section] nor KEY = VALUE",
                         "a comment begins with #");
        } else if (ini.value.empty()) {
            report.error(Topic::value, word(ini.name).at,
                         "'" + std::string(ini.name) + "' has no value",
                         "write " + std::string(ini.name) + " = VALUE, or delete the line");
        } else if (sections.empty()) {
            report.error(Topic::line, whole->at, "this line is before the first section",
                         "begin the file with [bus]");
        } else {
            Line line{word(ini.name), word(ini.value)};
            std::replace(line.key.text.begin(), line.key.text.end(), '_', '-');
            line.key.text = lower(line.key.text);
            sections.back().lines.push_back(std::move(line));
        }
    }
    return sections;
}

std::optional<Address> address(std::string_view text) {
    const auto hex = [](std::string_view digits, unsigned most,
                        std::size_t length) -> std::optional<unsigned> {
        if (digits.starts_with("0x") || digits.starts_with("0X")) {
            digits.remove_prefix(2);
        }
        if (digits.empty() || digits.size() > length) {
            return {};
        }
        const auto value = parse_natural("0x" + std::string(digits));
        if (!value || *value > most) {
            return {};
        }
        return static_cast<unsigned>(*value);
    };
    const std::size_t colon = std::min(text.find(':'), text.size());
    Address out;
    out.has_sub = colon < text.size();
    const auto index = hex(text.substr(0, colon), 0xffff, 4);
    const auto sub =
        out.has_sub ? hex(text.substr(colon + 1), 0xff, 2) : std::optional<unsigned>(0);
    if (!index || !sub || *index == 0 || (colon != 4 && colon != 6)) {
        return {};
    }
    out.index = static_cast<std::uint16_t>(*index);
    out.sub = static_cast<std::uint8_t>(*sub);
    return out;
}

std::string address_text(std::uint16_t index, unsigned sub) {
    char out[16];
    std::snprintf(out, sizeof out, "%04X:%02X", index + 0U, sub);
    return out;
}

const TypeWord* type_named(std::string_view word) {
    for (const TypeWord& t : type_list) {
        if (same_word(word, t.word) || same_word(word, t.esi)) return &t;
    }
    if (word == "BIT" || word == "BIT1") return &type_list[0];
    if (word == "BYTE" || word == "BITARR8") return &type_list[1];
    if (word == "WORD" || word == "BITARR16") return &type_list[2];
    if (word == "DWORD" || word == "BITARR32") return &type_list[3];
    return nullptr;
}

Type type_of(unsigned bits, bool with_sign) {
    if (bits == 1) return Type::bit;
    const unsigned width = bits <= 8 ? 0 : bits <= 16 ? 1 : bits <= 32 ? 2 : 3;
    return static_cast<Type>(static_cast<unsigned>(with_sign ? Type::s8 : Type::u8) + width);
}

std::optional<std::vector<std::uint8_t>> value_bytes(std::string_view value, const TypeWord& type,
                                                     std::string& problem) {
    std::uint64_t raw = 0;
    if (is_real(type.type)) {
        const auto real = parse_real(value);
        if (!real) {
            problem = "a number, as in 1.5";
            return std::nullopt;
        }
        if (type.type == Type::real32) {
            const auto single = static_cast<float>(*real);
            std::uint32_t bits = 0;
            std::memcpy(&bits, &single, sizeof bits);
            raw = bits;
        } else {
            std::memcpy(&raw, &*real, sizeof raw);
        }
    } else {
        const bool negative = value.starts_with('-');
        const auto natural = parse_natural(negative ? value.substr(1) : value);
        const bool hexadecimal = value.starts_with("0x");
        const unsigned bits = type.bits;
        const std::uint64_t all = bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
        const std::uint64_t highest = is_signed(type.type) && !hexadecimal ? all >> 1 : all;
        if (!natural || (negative && (!is_signed(type.type) || *natural > (all >> 1) + 1)) ||
            (!negative && *natural > highest)) {
            problem =
                "a number of " +
                (is_signed(type.type) ? "-" + std::to_string((all >> 1) + 1) : std::string("0")) +
                ".." + std::to_string(is_signed(type.type) ? all >> 1 : all) +
                ", decimal or with 0x";
            return {};
        }
        raw = negative ? 0 - *natural : *natural;
    }
    std::vector<std::uint8_t> out;
    for (unsigned i = 0; i < (type.bits + 7U) / 8; ++i) {
        out.push_back(static_cast<std::uint8_t>(raw >> (8 * i)));
    }
    return out;
}

void Keys::take(Section& section) {
    std::map<std::string, const Line*> own;
    for (Line& line : section.lines) {
        const auto [before, fresh] = own.emplace(line.key.text, &line);
        if (!fresh) {
            report_.error(Topic::line, line.key.at,
                          "duplicate key '" + line.key.text + "' in this section",
                          "first in line " + std::to_string(before->second->key.at.line) +
                              "; delete one of them",
                          "duplicate");
        } else {
            line.used = false;
            lines_[line.key.text] = &line;
        }
    }
}

Line* Keys::find(const std::string& key) {
    const auto at = lines_.find(key);
    if (at == lines_.end()) return nullptr;
    at->second->used = true;
    return at->second;
}

std::vector<Line*> Keys::all() const {
    std::vector<Line*> out;
    for (const auto& [key, line] : lines_) {
        out.push_back(line);
    }
    std::sort(out.begin(), out.end(),
              [](const Line* a, const Line* b) { return a->key.at.offset < b->key.at.offset; });
    return out;
}

void Keys::reject(const Line& line, const std::string& instead) {
    report_.error(Topic::value, line.value.at,
                  "invalid " + line.key.text + " '" + line.value.text + "'", "write " + instead);
}

void Keys::take_text(const char* key, std::string& to) {
    if (const Line* line = find(key)) {
        to = line->value.text;
    }
}

void Keys::take_flag(const char* key, bool& to) {
    const Line* line = find(key);
    if (line == nullptr) return;
    for (const char* word : {"yes", "true", "on", "1"}) {
        if (same_word(line->value.text, word)) return void(to = true);
    }
    for (const char* word : {"no", "false", "off", "0"}) {
        if (same_word(line->value.text, word)) return void(to = false);
    }
    reject(*line, "yes or no");
}

std::optional<std::int64_t> signed_duration(std::string_view text) {
    const bool negative = text.starts_with('-');
    const auto value = parse_duration_ns(negative ? text.substr(1) : text, 0.0);
    if (!value) {
        return {};
    }
    return negative ? -*value : *value;
}

bool Keys::take_time(const char* key, std::int64_t& to, std::int64_t least, std::int64_t most) {
    const Line* line = find(key);
    if (line == nullptr) return false;
    const auto value = signed_duration(line->value.text);
    if (value && *value >= least && *value <= most) {
        to = *value;
        return true;
    }
    const auto text = [](std::int64_t t) {
        if (t % 1'000'000'000 == 0) return std::to_string(t / 1'000'000'000) + "s";
        if (t % 1'000'000 == 0) return std::to_string(t / 1'000'000) + "ms";
        if (t % 1'000 == 0) return std::to_string(t / 1000) + "us";
        return std::to_string(t) + "ns";
    };
    reject(*line, "a time of " + text(least) + ".." + text(most) + ", as in 1ms or 250us");
    return false;
}

bool Keys::take_number(const char* key, std::uint64_t& to, std::uint64_t least,
                       std::uint64_t most) {
    const Line* line = find(key);
    if (line == nullptr) return false;
    const auto value = parse_natural(line->value.text);
    if (value && *value >= least && *value <= most) {
        to = *value;
        return true;
    }
    reject(*line, "a number of " + std::to_string(least) + ".." + std::to_string(most) +
                      ", decimal or with 0x");
    return false;
}

}  // namespace hal::ethercat::config
