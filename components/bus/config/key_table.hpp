// SPDX-License-Identifier: MIT
// The keys of a configuration file, or of a section of it, as a table: from one row come the
// parsing, the error texts, the names that a message offers for an unknown key, and the row of the
// reference in the page. Everything here is [setup].
//
//     const KeyTable<Bus> keys{{
//         {"cycle", time(&Bus::cycle, 10'000, 1'000'000'000), "1ms", "cycle time"},
//         {"node-id", number(&Bus::id, 1, 127), "127", "node ID of the master"},
//     }};
//     keys.apply(section, bus, report);
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "bus/config/key_report.hpp"
#include "bus/config/values.hpp"

namespace hal::bus {

/// What is known of a key without its target.
struct KeyInfo {
    std::string name;  ///< in lower case; `tpdoN`, `write OBJECT` for a kind of keys
    ValueForm form;
    std::string usual;  ///< the default, in Markdown; empty: none
    std::string about;  ///< in Markdown; empty: an alias, which is not in the reference
    bool repeatable = false;
    std::size_t min_words = 1, max_words = 1;  ///< of the value
};

/// A row of a table: a key of `Target`.
template <class Target>
struct Key {
    template <class Value>
    Key(const char* name, Value value, const char* usual, const char* about)
        : info{name, value.form(), usual, about},
          parse([value](Target& to, const Entry& entry) { return value.parse(to, entry); }) {}
    /// A key that is read elsewhere; the table has only its row of the reference and its name for
    /// suggestions.
    Key(const char* name, const char* range, const char* usual, const char* about)
        : info{name, {"", range, "VALUE"}, usual, about} {}

    /// Sets the number of words of the value, and its form.
    Key words(std::size_t min, std::size_t max, const char* usage) const {
        Key out = *this;
        out.info.min_words = min;
        out.info.max_words = max;
        out.info.form.usage = usage;
        return out;
    }
    /// The key may occur more than once.
    Key repeated() const {
        Key out = *this;
        out.info.repeatable = true;
        return out;
    }

    KeyInfo info;
    std::function<bool(Target&, const Entry&)> parse;
};

/// Returns "KEY USAGE".
std::string usage_of(const KeyInfo& key);
/// Reports "invalid KEY 'VALUE'" and what to write instead.
void reject_value(const Entry& entry, const std::string& expected, KeyReport& report);
/// Returns a row of the reference.
std::string reference_row(const std::string& prefix, const KeyInfo& key);
/// Reports a line with too few or too many words. Returns whether it has the right number.
bool check_words(const KeyInfo& key, const std::vector<Word>& words, KeyReport& report);

/// The lines of the keys that may occur once.
using GivenKeys = std::map<std::string, std::uint32_t, std::less<>>;
/// Reports a key that is given for the second time. Returns whether it is the first one.
bool check_first(const Word& key, GivenKeys& given, KeyReport& report);

template <class Target>
class KeyTable {
public:
    explicit KeyTable(std::vector<Key<Target>> keys) : keys_(std::move(keys)) {}

    const Key<Target>* find(std::string_view name) const {
        for (const Key<Target>& key : keys_) {
            if (key.info.name == name) return &key;
        }
        return nullptr;
    }

    std::vector<std::string> names() const {
        std::vector<std::string> out;
        for (const Key<Target>& key : keys_) {
            out.push_back(key.info.name);
        }
        return out;
    }

    /// Reads the value of an entry and reports an invalid one.
    void read(const Key<Target>& key, const Entry& entry, Target& to, KeyReport& report) const {
        if (!key.parse(to, entry)) {
            reject_value(entry, key.info.form.expected, report);
        }
    }

    /// Reads the keys of a section in the order of the table.
    template <class Section>
    void apply(Section& section, Target& to, KeyReport& report) const {
        for (const Key<Target>& key : keys_) {
            if (!key.parse) continue;
            if (const Entry* entry = section.find(key.info.name)) {
                read(key, *entry, to, report);
            }
        }
    }

    /// Reads a line KEY VALUE… whose key is a row.
    void read_line(const Key<Target>& key, const std::vector<Word>& words, Target& to,
                   GivenKeys& given, KeyReport& report) const {
        if (!check_words(key.info, words, report)) return;
        if (!key.info.repeatable && !check_first(words.front(), given, report)) return;
        Entry entry;
        entry.key = words.front();
        entry.value = words[1];
        entry.words = words;
        read(key, entry, to, report);
    }

    /// Returns the reference as a Markdown table, the keys behind `prefix`.
    std::string reference(const std::string& prefix = {}) const {
        std::string out = "| key | value | default | meaning |\n| --- | --- | --- | --- |\n";
        for (const Key<Target>& key : keys_) {
            if (!key.info.about.empty()) {
                out += reference_row(prefix, key.info);
            }
        }
        return out;
    }

private:
    std::vector<Key<Target>> keys_;
};

}  // namespace hal::bus
