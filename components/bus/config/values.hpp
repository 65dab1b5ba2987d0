// SPDX-License-Identifier: MIT
// The values that a key of a configuration file can have: what a value looks like, and how it is
// stored. A row of a key table names one of them:
//
//     {"heartbeat", time(&Bus::heartbeat, 1ms, 60s).or_none(), "100ms", "heartbeat period"},
//     {"on-stop", choice(&Bus::at_stop, stops), "stopped", "state of the nodes at a stop"},
//
// The member that receives the value is a pointer to a member, or a function that returns a
// reference to it. Everything here is [setup].
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "text/characters.hpp"
#include "text/config_text.hpp"
#include "text/numbers.hpp"

namespace hal::bus {

using text::Word;

/// A key and its value.
struct Entry {
    Word key;    ///< lower case, dashes
    Word value;  ///< as written
    /// the key and the words of its value, of a line without `=`
    std::vector<Word> words{};
    std::string written{};  ///< the key as written
    bool used = false;
};

/// Formats a time as configuration files write it: "250us".
std::string time_text(std::int64_t ns);
/// Parses a time with a unit and perhaps a sign, -10us; without a unit in units of `bare_unit_ns`,
/// 0: only 0 needs none.
std::optional<std::int64_t> parse_time(std::string_view text, double bare_unit_ns = 0.0);
/// Parses a bit rate: 125000, 500k, 1M.
std::optional<std::uint32_t> parse_bit_rate(std::string_view text, double min, double max);
/// Parses yes, true, on, 1, no, false, off, 0.
std::optional<bool> parse_flag(std::string_view text);
/// Parses a name of at most 40 letters, digits, `-`, `_` and the characters `more`.
bool is_name(std::string_view text, std::string_view more = {});

/// A text with what a value looks like, for three readers: `expected` ends the sentence "write …",
/// `range` is the column of the reference, `usage` stands for the value in "write KEY …".
struct ValueForm {
    std::string expected;
    std::string range;
    std::string usage = "VALUE";
};
ValueForm time_form(std::int64_t min, std::int64_t max, bool none, bool bare);
ValueForm number_form(std::uint64_t min, std::uint64_t max);
ValueForm flag_form();
ValueForm choice_form(const std::vector<std::string>& words);
ValueForm rate_form(double min, double max);

/// A time in ns.
template <class Get>
class TimeValue {
public:
    TimeValue(Get get, std::int64_t min, std::int64_t max) : get_(get), min_(min), max_(max) {}
    /// "no", "none" and "0" are 0.
    TimeValue or_none() const {
        TimeValue out = *this;
        out.none_ = true;
        return out;
    }
    /// A time without a unit is in microseconds.
    TimeValue bare_microseconds() const {
        TimeValue out = *this;
        out.bare_ = true;
        return out;
    }
    /// The member counts in units of this many ns.
    TimeValue in(std::int64_t unit_ns) const {
        TimeValue out = *this;
        out.unit_ = unit_ns;
        return out;
    }
    ValueForm form() const { return time_form(min_, max_, none_, bare_); }
    template <class Target>
    bool parse(Target& to, const Entry& entry) const {
        const std::string word = lower(entry.value.text);
        const bool is_none = none_ && (word == "no" || word == "none" || word == "0");
        const auto value = parse_time(entry.value.text, bare_ ? 1e3 : 0.0);
        if (!is_none && (!value || *value < min_ || *value > max_)) return false;
        auto& member = std::invoke(get_, to);
        const std::int64_t time = is_none ? 0 : *value / unit_;
        member = static_cast<std::remove_reference_t<decltype(member)>>(time);
        return true;
    }

private:
    Get get_;
    std::int64_t min_, max_;
    std::int64_t unit_ = 1;
    bool none_ = false;
    bool bare_ = false;
};

/// A whole number, decimal or hexadecimal with 0x.
template <class Get>
class NumberValue {
public:
    NumberValue(Get get, std::uint64_t min, std::uint64_t max) : get_(get), min_(min), max_(max) {}
    ValueForm form() const { return number_form(min_, max_); }
    template <class Target>
    bool parse(Target& to, const Entry& entry) const {
        const auto value = parse_natural(entry.value.text);
        if (!value || *value < min_ || *value > max_) return false;
        auto& member = std::invoke(get_, to);
        member = static_cast<std::remove_reference_t<decltype(member)>>(*value);
        return true;
    }

private:
    Get get_;
    std::uint64_t min_, max_;
};

/// yes or no.
template <class Get>
class FlagValue {
public:
    explicit FlagValue(Get get) : get_(get) {}
    ValueForm form() const { return flag_form(); }
    template <class Target>
    bool parse(Target& to, const Entry& entry) const {
        const auto value = parse_flag(entry.value.text);
        if (!value) return false;
        std::invoke(get_, to) = *value;
        return true;
    }

private:
    Get get_;
};

/// Any text.
template <class Get>
class TextValue {
public:
    TextValue(Get get, const char* usage) : get_(get), usage_(usage) {}
    ValueForm form() const { return {"a text", "text", usage_}; }
    template <class Target>
    bool parse(Target& to, const Entry& entry) const {
        std::invoke(get_, to) = entry.value.text;
        return true;
    }

private:
    Get get_;
    const char* usage_;
};

/// A bit rate in bit/s.
template <class Get>
class RateValue {
public:
    RateValue(Get get, double min, double max) : get_(get), min_(min), max_(max) {}
    ValueForm form() const { return rate_form(min_, max_); }
    template <class Target>
    bool parse(Target& to, const Entry& entry) const {
        const auto value = parse_bit_rate(entry.value.text, min_, max_);
        if (!value) return false;
        std::invoke(get_, to) = *value;
        return true;
    }

private:
    Get get_;
    double min_, max_;
};

/// A word and what it selects.
template <class T>
struct Choice {
    const char* word;
    T value;
};

template <class Get, class T>
class ChoiceValue {
public:
    ChoiceValue(Get get, std::span<const Choice<T>> choices) : get_(get), choices_(choices) {}
    ValueForm form() const {
        std::vector<std::string> words;
        for (const Choice<T>& one : choices_) {
            words.push_back(one.word);
        }
        return choice_form(words);
    }
    template <class Target>
    bool parse(Target& to, const Entry& entry) const {
        for (const Choice<T>& one : choices_) {
            if (!same_word(entry.value.text, one.word)) continue;
            std::invoke(get_, to) = one.value;
            return true;
        }
        return false;
    }

private:
    Get get_;
    std::span<const Choice<T>> choices_;
};

/// A value with a form of its own. `parse` returns false for an invalid value, which is then
/// reported; it may report other errors itself.
template <class Parse>
class OwnValue {
public:
    OwnValue(ValueForm form, Parse function) : form_(std::move(form)), parse_(function) {}
    ValueForm form() const { return form_; }
    template <class Target>
    bool parse(Target& to, const Entry& entry) const {
        return std::invoke(parse_, to, entry);
    }

private:
    ValueForm form_;
    Parse parse_;
};

template <class Get>
TimeValue<Get> time(Get get, std::int64_t min, std::int64_t max) {
    return {get, min, max};
}
template <class Get>
NumberValue<Get> number(Get get, std::uint64_t min, std::uint64_t max) {
    return {get, min, max};
}
template <class Get>
FlagValue<Get> flag(Get get) {
    return FlagValue<Get>(get);
}
template <class Get>
TextValue<Get> text_value(Get get, const char* usage = "TEXT") {
    return {get, usage};
}
template <class Get>
RateValue<Get> bit_rate(Get get, double min, double max) {
    return {get, min, max};
}
template <class Get, class T, std::size_t N>
ChoiceValue<Get, T> choice(Get get, const Choice<T> (&choices)[N]) {
    return {get, choices};
}
/// `expected` is what to write; `range` is the column of the reference.
template <class Parse>
OwnValue<Parse> own(std::string expected, std::string range, Parse parse,
                    std::string usage = "VALUE") {
    return {{std::move(expected), std::move(range), std::move(usage)}, parse};
}

}  // namespace hal::bus
