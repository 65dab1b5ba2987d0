// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cstdio>

#include "eds_reader.hpp"
#include "text/characters.hpp"
#include "text/numbers.hpp"
#include "text/suggest.hpp"

namespace hal::canopen::eds {

namespace {

bool is_hex(char c) { return hex_digit(c) >= 0; }

unsigned hex_value(std::string_view text) {
    unsigned value = 0;
    for (const char c : text) {
        value = value << 4 | static_cast<unsigned>(hex_digit(c));
    }
    return value;
}

}  // namespace

std::string hex(std::uint64_t value, int digits) {
    std::array<char, 24> text{};
    std::snprintf(text.data(), text.size(), "0x%0*llX", digits,
                  static_cast<unsigned long long>(value));
    return text.data();
}

std::string label(std::uint16_t index) { return hex(index).substr(2); }

std::string label(std::uint16_t index, unsigned sub) {
    return label(index) + "sub" + hex(sub, 1).substr(2);
}

namespace {

std::string without_blanks(std::string_view text) {
    std::string out(text);
    std::erase_if(out, [](char c) { return c == ' ' || c == '\t'; });
    return out;
}

/// The meaning of what follows the index in a section name, except for sub-indices.
SectionName::What what_of(std::string_view word) {
    using What = SectionName::What;
    if (word.empty()) return What::object;
    if (same_word(word, "Name")) return What::names;
    if (same_word(word, "Value")) return What::values;
    if (same_word(word, "Denotation")) return What::denotations;
    if (same_word(word, "ObjectLinks")) return What::links;
    return What::other;
}

}  // namespace

SectionName section_name(std::string_view name) {
    SectionName out;
    const std::string squeezed = without_blanks(name);
    std::string_view rest = squeezed;
    out.odd = squeezed.size() != name.size();
    out.odd = remove_hex_prefix(rest) || out.odd;
    const std::string_view index = rest.substr(0, 4);
    if (index.size() < 4 || !std::all_of(index.begin(), index.end(), is_hex)) return {};
    out.index = static_cast<std::uint16_t>(hex_value(index));
    rest.remove_prefix(4);
    if (!same_word(rest.substr(0, 3), "sub")) {
        out.what = what_of(rest);
        return out.what != SectionName::What::other ? out : SectionName{};
    }
    rest.remove_prefix(3);
    out.odd = remove_hex_prefix(rest) || out.odd;
    const bool is_number =
        !rest.empty() && rest.size() <= 4 && std::all_of(rest.begin(), rest.end(), is_hex);
    if (!is_number) return {};
    out.what = SectionName::What::sub;
    out.sub = hex_value(rest);
    return out;
}

void Keys::cut_comment(IniKey& key) {
    for (std::size_t i = 1; i < key.value.size(); ++i) {
        if ((key.value[i] != ';' && key.value[i] != '#') ||
            (key.value[i - 1] != ' ' && key.value[i - 1] != '\t' && key.value[i] != ';')) {
            continue;
        }
        Span at = key.value_at;
        at.offset += static_cast<std::uint32_t>(i);
        at.length -= static_cast<std::uint32_t>(i);

        at.column += static_cast<std::uint32_t>(i);
        const std::string value(trimmed(std::string_view(key.value).substr(0, i)));
        report(Severity::note, Topic::syntax, at,
               "comment after the value of '" + key.name + "' ignored",
               "write comments on lines of their own, with ';'");
        key.value = value;
        key.value_at.length = static_cast<std::uint32_t>(value.size());
        return;
    }
}

std::string Keys::text(IniSection& section, std::string_view key) {
    IniKey* found = section.find(key);
    if (found == nullptr) {
        return {};
    }
    found->used = true;
    return found->value;
}

IniKey* Keys::read(IniSection& section, std::string_view key) {
    IniKey* const found = section.find(key);
    if (found != nullptr) {
        found->used = true;
        cut_comment(*found);
    }
    return found;
}

IniKey* Keys::read_value(IniSection& section, std::string_view key, const std::string& what,
                         const char* consequence) {
    IniKey* const found = read(section, key);
    if (found != nullptr && !found->value.empty()) return found;
    if (consequence != nullptr) {
        const Span at = found != nullptr ? found->value_at : section.at;
        const char* const problem = found != nullptr ? "empty" : "missing";
        report(Severity::warning, Topic::missing, at,
               "'" + std::string(key) + "' of " + what + " is " + problem, consequence);
    }
    return nullptr;
}

std::string Keys::bare(IniSection& section, std::string_view key) {
    const IniKey* const found = read(section, key);
    return found != nullptr ? found->value : std::string();
}

std::optional<std::uint64_t> Keys::parse(IniSection& section, IniKey& key, std::uint64_t max) {
    key.used = true;
    cut_comment(key);
    const std::string in = "'" + key.name + "' of [" + section.name + "]";
    const std::optional<Number> number = parse_number(key.value);
    if (!number || number->node_id) {
        // 0007 as in a section's name, 1A00 without 0x
        const bool bare_hex = !key.value.empty() && key.value.size() <= 8 &&
                              std::all_of(key.value.begin(), key.value.end(), is_hex);
        report(Severity::warning, Topic::number, key.value_at,
               in + " is not a number: '" + key.value.substr(0, 60) + "'",
               bare_hex ? "write 0x" + key.value : "write it as in 12 or 0x0C");
        return {};
    }
    if (number->spelling == Spelling::octal) {
        report(Severity::warning, Topic::value, key.value_at,
               in + " begins with 0 and is read as octal: " + std::to_string(number->magnitude),
               "write " + hex(number->magnitude, 1) + ", or remove the 0");
    }
    if (number->spelling == Spelling::decimal_with_zero) {
        report(Severity::warning, Topic::value, key.value_at,
               in + " begins with 0 but is not octal; read as decimal " +
                   std::to_string(number->magnitude),
               "remove the 0");
    }
    if ((number->negative && number->magnitude != 0) || number->magnitude > max) {
        report(Severity::warning, Topic::number, key.value_at,
               in + " is out of range: '" + key.value + "'",
               "the range is 0.." + std::to_string(max));
        return {};
    }
    return number->magnitude;
}

std::optional<std::uint64_t> Keys::number(IniSection& section, std::string_view key,
                                          std::uint64_t max) {
    IniKey* found = section.find(key);
    if (found == nullptr) {
        return {};
    }
    found->used = true;
    if (found->value.empty()) {
        return {};
    }
    return parse(section, *found, max);
}

bool Keys::flag(IniSection& section, std::string_view key, bool otherwise) {
    const IniKey* const found = read(section, key);
    if (found == nullptr || found->value.empty()) return otherwise;
    const auto number = parse_number(found->value);
    if (number && !number->node_id && number->magnitude < 2) return number->magnitude == 1;
    for (const std::string_view word : {"true", "yes", "y", "no", "false", "n"}) {
        if (!same_word(found->value, word)) continue;
        const bool yes = word[0] == 't' || word[0] == 'y';
        report(Severity::warning, Topic::value, found->value_at,
               "'" + found->name + "' is 0 or 1, not '" + found->value + "'",
               yes ? "write 1" : "write 0");
        return yes;
    }
    const bool yes = number && number->magnitude != 0;
    const char* help = otherwise ? "read as 1, the default" : "read as 0";
    if (yes) {
        help = "read as 1";
    }
    report(Severity::warning, Topic::value, found->value_at,
           "'" + found->name + "' is 0 or 1, not '" + found->value.substr(0, 60) + "'", help);
    return number ? yes : otherwise;
}

std::map<unsigned, IniKey*> Keys::list(IniSection& section, const char* count_key) {
    std::map<unsigned, IniKey*> out;
    for (IniKey& key : section.keys) {
        if (key.name.empty() || !is_digit(key.name[0])) continue;
        const auto number = parse_number(key.name);
        if (!number || number->magnitude > 0xFFFF) continue;
        const auto [at, fresh] = out.emplace(static_cast<unsigned>(number->magnitude), &key);
        if (!fresh) {
            report(Severity::warning, Topic::conflict, key.at,
                   "duplicate number " + key.name + " in [" + section.name + "]",
                   "the first one is used");
        }
        key.used = true;
    }
    if (count_key == nullptr) return out;
    IniKey* count = section.find(count_key);
    if (count == nullptr) {
        report(Severity::warning, Topic::missing, section.at,
               "'" + std::string(count_key) + "' is missing in [" + section.name + "]",
               "write " + std::string(count_key) + "=" + std::to_string(out.size()));
        return out;
    }
    count->used = true;
    std::uint64_t said = out.size();
    if (!count->value.empty()) {
        const auto number = parse(section, *count, 0xFFFF);
        if (!number) return out;
        said = *number;
    }
    if (count->value.empty() || said != out.size()) {
        report(Severity::warning, Topic::count, count->value_at,
               "'" + count->name + "' of [" + section.name + "] is " +
                   (count->value.empty() ? "empty" : std::to_string(said)) +
                   ", the section lists " + std::to_string(out.size()),
               "write " + count->name + "=" + std::to_string(out.size()));
    }
    return out;
}

Extras Keys::rest(IniSection& section, std::initializer_list<std::string_view> known) {
    section.used = true;
    Extras out;
    for (const std::string& comment : section.comments) {
        out.emplace_back("", comment);
    }
    std::vector<std::string> missing;
    for (const std::string_view name : known) {
        if (section.find(name) == nullptr) {
            missing.emplace_back(name);
        }
    }
    for (IniKey& key : section.keys) {
        if (key.used) continue;
        key.used = true;
        if (const auto close = similar(key.name, missing, 1); !close.empty()) {
            report(Severity::warning, Topic::missing, key.at,
                   "unknown key '" + key.name + "' in [" + section.name + "]",
                   "did you mean '" + close[0] + "'? The key was kept unchanged");
        }
        out.emplace_back(key.name, key.value);
    }
    return out;
}

bool compactable(const Object& o) {
    if (o.compact == 0 || o.entries.size() != o.compact + 1 || o.compact > 0xFE) return false;
    Entry first;
    first.name = "NrOfObjects";
    first.data_type = 0x05;
    first.access = Access::ro;

    first.default_value = std::to_string(o.compact);
    if (o.entries[0] != first) return false;
    const Entry& one = o.entries[1];
    for (std::size_t i = 1; i < o.entries.size(); ++i) {
        Entry same = o.entries[i];
        if (same.sub != i) return false;
        same.sub = one.sub;
        same.name = one.name;
        same.denotation = one.denotation;

        same.parameter_value = one.parameter_value;
        if (same != one || !one.extras.empty() || !one.upload_file.empty() ||
            !one.download_file.empty()) {
            return false;
        }
    }
    return one.type == ObjectType::var && one.flags == o.flags && one.data_type == o.data_type;
}

}  // namespace hal::canopen::eds
