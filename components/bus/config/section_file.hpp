// SPDX-License-Identifier: MIT
// A configuration file of sections: `[SECTION]`, `KEY = VALUE`, comments with `#` and `;`. Sections
// [defaults] and [type NAME] have keys that apply to others. Everything here is [setup].
#pragma once

#include <deque>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bus/config/key_report.hpp"
#include "bus/config/values.hpp"

namespace hal::bus {

struct Section {
    std::vector<Word> words;  ///< of its header
    text::Span at;
    std::deque<Entry> entries;
};

/// The keys that apply to one device or bus; those of a later section override those of an earlier
/// one.
class Keys {
public:
    explicit Keys(KeyReport& report) : report_(report) {}
    /// Adds the keys of a section, all of them unused, and reports duplicates.
    void add(Section& section);
    /// Returns the entry of a key and marks it as used; nullptr: the key is not given.
    const Entry* find(std::string_view key);
    /// Returns the entries whose key begins with `beginning`, in the order of the file.
    std::vector<Entry*> all_of(std::string_view beginning) const;
    /// Returns all entries that were not used, in the order of the file.
    std::vector<Entry*> rest() const;
    /// Reports all entries that were not used: "unknown key 'KEY' WHERE".
    void report_rest(std::string_view where, const std::vector<std::string>& names);
    void reject(const Entry& entry, const std::string& expected);
    /// Reads the value of a key, if it is given, and reports an invalid one. Returns whether the key
    /// has a valid value.
    template <class Value, class Target>
    bool read(std::string_view key, const Value& value, Target& to) {
        const Entry* entry = find(key);
        if (entry == nullptr) return false;
        if (value.parse(to, *entry)) return true;
        reject(*entry, value.form().expected);
        return false;
    }

private:
    KeyReport& report_;
    std::map<std::string, Entry*, std::less<>> entries_;
};

/// Whether a kind of section may be repeated, and which words follow the kind in its header.
enum class SectionUse : std::uint8_t {
    once,  ///< [bus]
    repeated,  ///< [messages]: any number
    named,  ///< [domain NAME]: any number
    any,  ///< any number, any header: its reader checks it
};
struct SectionKind {
    const char* name;
    const char* form;  ///< "[domain NAME]"
    SectionUse use;
};

/// The sections of a file by their kind. [defaults] and [type NAME] are always among them.
class SectionFile {
public:
    /// Splits a file; `kinds` has a row for each kind of section besides [defaults] and [type
    /// NAME]. `example` is a section for help texts, as in "[node 5 NAME]".
    SectionFile(std::string_view text, std::span<const SectionKind> kinds, const char* example,
                KeyReport& report);
    SectionFile(const SectionFile&) = delete;
    SectionFile& operator=(const SectionFile&) = delete;

    /// Returns the section that occurs once; nullptr: it is missing.
    Section* one(std::string_view kind);
    const std::vector<Section*>& all(std::string_view kind) { return by_kind_[std::string(kind)]; }
    /// Adds the keys of [defaults], of the type that `section` names, and its own. Returns false
    /// after reporting that there is no such type.
    bool add_keys(Section& section, Keys& keys);
    /// Warns about each type that no section uses. `device` is a section for the help text: "[node
    /// …]".
    void warn_unused_types(const char* device);

private:
    void split(std::string_view text, const char* example);
    void split_header(const Word& line, const text::IniLine& ini, const char* example);
    void split_entry(const Word& line, const text::IniLine& ini);
    void sort(Section& section, std::span<const SectionKind> kinds);
    bool add(Section& section, const SectionKind& kind);
    void report_unknown(const Section& section, std::span<const SectionKind> kinds);
    Section* type_of(const Entry& entry);

    KeyReport& report_;
    std::deque<Section> sections_;
    std::map<std::string, std::vector<Section*>> by_kind_;
    std::map<std::string, Section*> types_;
    std::set<std::string> used_types_;
};

}  // namespace hal::bus
