// SPDX-License-Identifier: MIT
// Keys of a section read by name: what each one may be, and what is said when it is not.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config_lines.hpp"

namespace hal::canopen::config {

/// A word of a value and what it stands for.
template <class T>
struct Choice {
    const char* word;
    T           value;
};

/// The keys that hold for one thing: of several sections, the later ones winning.
class Keys {
public:
    explicit Keys(Report& report) : report_(report) {}
    /// Takes a section's keys on top of those so far.
    void take(Section& section);

    const Line* find(const std::string& key);
    /// Every line whose key begins with `beginning`, in order of place.
    std::vector<Line*> all_of(std::string_view beginning) const;
    /// All lines nobody has asked for.
    std::vector<Line*> rest() const;

    void take_text(const char* key, std::string& to);
    void take_flag(const char* key, bool& to);
    /// Of 0 or more; `least` and `most` in ns. "no" and "none" are 0 where that is allowed.
    bool take_time(const char* key, Time& to, Time least, Time most, bool none = false);
    bool take_number(const char* key, std::uint64_t& to, std::uint64_t least, std::uint64_t most);
    template <class T>
    bool take_small(const char* key, T& to, std::uint64_t least, std::uint64_t most) {
        std::uint64_t value = 0;
        if (!take_number(key, value, least, most)) return false;
        return to = static_cast<T>(value), true;
    }
    template <class T, std::size_t N>
    bool take_choice(const char* key, T& to, const Choice<T> (&choices)[N]) {
        const Line* line = find(key);
        if (line == nullptr) return false;
        std::vector<std::string> words;
        for (const auto& c : choices) {
            if (lower(line->value.text) == c.word) return to = c.value, true;
            words.push_back(c.word);
        }
        refuse(*line, listed(words));
        return false;
    }
    /// "'KEY' cannot be 'VALUE'", and what it can be.
    void refuse(const Line& line, const std::string& can_be);

    Report& report() { return report_; }

private:
    Report&                      report_;
    std::map<std::string, Line*> lines_;
};

}  // namespace hal::canopen::config
