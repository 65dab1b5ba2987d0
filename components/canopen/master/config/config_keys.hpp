// SPDX-License-Identifier: MIT
// Reads the keys of a section by name and reports invalid values.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config_lines.hpp"

namespace hal::canopen::config {

/// A word of a value and its meaning.
template <class T>
struct Choice {
    const char* word;
    T value;
};

/// The keys that apply to one node or bus; a later section overrides an earlier one.
class Keys {
public:
    explicit Keys(Report& report) : report_(report) {}
    /// Adds the keys of a section; they override those added before.
    void take(Section& section);

    const Line* find(const std::string& key);
    /// Returns every line whose key begins with `beginning`, in the order of the file.
    std::vector<Line*> all_of(std::string_view beginning) const;
    /// Returns all lines that were not read yet.
    std::vector<Line*> rest() const;

    void take_text(const char* key, std::string& to);
    void take_flag(const char* key, bool& to);
    /// Reads a time of `least` to `most` ns; with `none`, "no" and "none" are 0. Returns whether
    /// the key has a valid value.
    bool take_time(const char* key, Time& to, Time least, Time most, bool none = false);
    bool take_number(const char* key, std::uint64_t& to, std::uint64_t least, std::uint64_t most);
    template <class T>
    bool take_small(const char* key, T& to, std::uint64_t least, std::uint64_t most) {
        std::uint64_t value = 0;
        if (!take_number(key, value, least, most)) return false;
        to = static_cast<T>(value);
        return true;
    }
    template <class T, std::size_t N>
    bool take_choice(const char* key, T& to, const Choice<T> (&choices)[N]) {
        const Line* line = find(key);
        if (line == nullptr) return false;
        std::vector<std::string> words;
        for (const auto& c : choices) {
            if (same_word(line->value.text, c.word)) {
                to = c.value;
                return true;
            }
            words.push_back(c.word);
        }
        reject(*line, listed(words));
        return false;
    }
    /// Reports "invalid KEY 'VALUE'" and what to write instead.
    void reject(const Line& line, const std::string& instead);

    Report& report() { return report_; }

private:
    Report& report_;
    std::map<std::string, Line*> lines_;
};

}  // namespace hal::canopen::config
