// SPDX-License-Identifier: MIT
#include "bus/config/section_file.hpp"

#include <algorithm>

#include "bus/config/key_table.hpp"
#include "text/characters.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal::bus {

namespace {

constexpr std::uint32_t max_lines = 20'000;

constexpr SectionKind shared_kinds[] = {{"defaults", "[defaults]", SectionUse::once},
                                        {"type", "[type NAME]", SectionUse::named}};

Word word_of(const Word& line, std::string_view part) {
    const auto begin = static_cast<std::size_t>(part.data() - line.text.data());
    return text::part(line, begin, begin + part.size());
}

/// Keys are written in any case, and with `_` for `-`.
std::string key_text(std::string_view written) {
    std::string out = lower(written);
    std::replace(out.begin(), out.end(), '_', '-');
    return out;
}

const SectionKind* find_kind(std::span<const SectionKind> kinds, std::string_view name) {
    const auto at = std::find_if(kinds.begin(), kinds.end(),
                                 [&](const SectionKind& kind) { return name == kind.name; });
    return at == kinds.end() ? nullptr : &*at;
}

bool by_offset(const Entry* a, const Entry* b) { return a->key.at.offset < b->key.at.offset; }

}  // namespace

void Keys::add(Section& section) {
    GivenKeys given;
    for (Entry& entry : section.entries) {
        entry.used = false;
        if (check_first(entry.key, given, report_)) {
            entries_[entry.key.text] = &entry;
        }
    }
}

const Entry* Keys::find(std::string_view key) {
    const auto at = entries_.find(key);
    if (at == entries_.end()) return nullptr;
    at->second->used = true;
    return at->second;
}

std::vector<Entry*> Keys::all_of(std::string_view beginning) const {
    std::vector<Entry*> out;
    for (const auto& [key, entry] : entries_) {
        if (key.starts_with(beginning)) {
            out.push_back(entry);
        }
    }
    std::sort(out.begin(), out.end(), by_offset);
    return out;
}

std::vector<Entry*> Keys::rest() const {
    std::vector<Entry*> out = all_of("");
    std::erase_if(out, [](const Entry* entry) { return entry->used; });
    return out;
}

void Keys::report_rest(std::string_view where, const std::vector<std::string>& names) {
    for (Entry* entry : rest()) {
        entry->used = true;
        report_.error(Subject::line, entry->key.at,
                      "unknown key '" + entry->key.text + "' " + std::string(where),
                      suggestion(entry->key.text, names, "the keys are"));
    }
}

void Keys::reject(const Entry& entry, const std::string& expected) {
    reject_value(entry, expected, report_);
}

SectionFile::SectionFile(std::string_view text, std::span<const SectionKind> kinds,
                         const char* example, KeyReport& report)
    : report_(report) {
    split(text, example);
    for (Section& section : sections_) {
        sort(section, kinds);
    }
}

void SectionFile::split(std::string_view text, const char* example) {
    using Kind = text::IniLine::Kind;
    text::Lines lines(text);
    while (const auto line = lines.next()) {
        if (line->at.line > max_lines) {
            report_.error(Subject::line, line->at,
                          "the file has more than " + std::to_string(max_lines) + " lines",
                          "is it the right file?");
            return;
        }
        const text::IniLine ini = text::ini_line(line->text);
        if (ini.kind == Kind::section || ini.kind == Kind::open_section) {
            split_header(*line, ini, example);
        } else if (ini.kind == Kind::entry) {
            split_entry(*line, ini);
        } else {
            report_.error(Subject::line, line->at,
                          "invalid line: neither a [section] nor KEY = VALUE",
                          "a comment begins with #");
        }
    }
}

void SectionFile::split_header(const Word& line, const text::IniLine& ini, const char* example) {
    if (ini.kind == text::IniLine::Kind::open_section) {
        report_.error(Subject::line, line.at, "section name without ']'",
                      std::string("write [bus], [type NAME] or ") + example, "missing ']'");
        return;
    }
    if (!ini.value.empty()) {
        report_.error(Subject::line, word_of(line, ini.value).at,
                      "unexpected text after the section name", "a comment begins with #");
        return;
    }
    Section section;
    section.at = line.at;
    section.words = text::words_of(word_of(line, ini.name));
    sections_.push_back(std::move(section));
}

void SectionFile::split_entry(const Word& line, const text::IniLine& ini) {
    Entry entry;
    entry.key = word_of(line, ini.name);
    if (ini.value.empty()) {
        report_.error(Subject::value, entry.key.at, "'" + entry.key.text + "' has no value",
                      "write " + entry.key.text + " = VALUE, or delete the line");
        return;
    }
    if (sections_.empty()) {
        report_.error(Subject::line, line.at, "this line is before the first section",
                      "begin the file with [bus]");
        return;
    }
    entry.value = word_of(line, ini.value);
    entry.written = entry.key.text;
    entry.key.text = key_text(entry.written);
    sections_.back().entries.push_back(std::move(entry));
}

void SectionFile::sort(Section& section, std::span<const SectionKind> kinds) {
    const std::string name = section.words.empty() ? "" : lower(section.words[0].text);
    const SectionKind* kind = find_kind(kinds, name);
    if (kind == nullptr) {
        kind = find_kind(shared_kinds, name);
    }
    if (kind == nullptr) return report_unknown(section, kinds);
    if (!add(section, *kind)) return;
    by_kind_[name].push_back(&section);
}

bool SectionFile::add(Section& section, const SectionKind& kind) {
    if (kind.use == SectionUse::any) return true;
    const std::size_t words = kind.use == SectionUse::named ? 2 : 1;
    if (section.words.size() != words) {
        report_.error(Subject::line, section.at,
                      std::string("invalid section name: expected ") + kind.form);
        return false;
    }
    const auto& before = by_kind_[kind.name];
    if (kind.use == SectionUse::once && !before.empty()) {
        report_.error(Subject::line, section.at, std::string("duplicate section ") + kind.form,
                      "first in line " + std::to_string(before.front()->at.line), "duplicate");
        return false;
    }
    const bool is_type = std::string_view(kind.name) == "type";
    if (is_type && !types_.emplace(section.words[1].text, &section).second) {
        report_.error(Subject::line, section.words[1].at,
                      "duplicate type '" + section.words[1].text + "'",
                      "rename or delete one of them", "duplicate");
        return false;
    }
    return true;
}

void SectionFile::report_unknown(const Section& section, std::span<const SectionKind> kinds) {
    const std::string name = section.words.empty() ? "" : section.words[0].text;
    std::vector<std::string> names;
    std::string forms;
    const auto list = [&](const SectionKind& kind) {
        names.push_back(kind.name);
        append_item(forms, kind.form);
    };
    list(kinds.front());  // [bus]
    std::for_each(std::begin(shared_kinds), std::end(shared_kinds), list);
    std::for_each(kinds.begin() + 1, kinds.end(), list);
    const std::string near = did_you_mean(lower(name), names);
    report_.error(Subject::line, section.at, "unknown section '" + name + "'",
                  near.empty() ? "the sections are " + forms : near);
}

Section* SectionFile::one(std::string_view kind) {
    const auto& sections = all(kind);
    return sections.empty() ? nullptr : sections.front();
}

Section* SectionFile::type_of(const Entry& entry) {
    const std::string& name = entry.value.text;
    if (const auto at = types_.find(name); at != types_.end()) {
        used_types_.insert(name);
        return at->second;
    }
    std::vector<std::string> names;
    for (const auto& [other, section] : types_) {
        names.push_back(other);
    }
    std::string help = did_you_mean(name, names);
    if (help.empty()) {
        help = names.empty() ? "write [type " + name + "]" : "the types are: " + listed(names);
    }
    report_.error(Subject::line, entry.value.at, "unknown type '" + name + "'", help);
    return nullptr;
}

bool SectionFile::add_keys(Section& section, Keys& keys) {
    if (Section* defaults = one("defaults")) {
        keys.add(*defaults);
    }
    const auto names_type = [](const Entry& entry) { return entry.key.text == "type"; };
    const auto named = std::find_if(section.entries.begin(), section.entries.end(), names_type);
    bool known = true;
    if (named != section.entries.end()) {
        Section* type = type_of(*named);
        known = type != nullptr;
        if (type != nullptr) {
            keys.add(*type);
        }
    }
    keys.add(section);
    return known;
}

void SectionFile::warn_unused_types(const char* device) {
    for (const auto& [name, section] : types_) {
        if (used_types_.contains(name)) continue;
        report_.warning(Subject::line, section->at, "unused type '" + name + "'",
                        "write type = " + name + " below a " + device + ", or delete the section");
    }
}

}  // namespace hal::bus
