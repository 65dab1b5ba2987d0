// SPDX-License-Identifier: MIT
// What all readers of configuration files share: spans, messages with a limit, lines without
// comments, words, sections and keys. A reader turns each line into words and reports what is wrong
// at the word:
//
//     for (text::Lines lines(file); auto line = lines.next();) {
//         const auto words = text::words_of(*line);
//         if (words[0].text != "cycle") messages.error(Topic::line, words[0].at, "unknown key '" + words[0].text + "'");
//     }
//
// Everything here is [setup].
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "text/quoting.hpp"
#include "text/severity.hpp"

namespace hal::text {

/// A segment of a file. Line and column count from 1, columns in characters; offset and length are
/// in bytes.
struct Span {
    std::uint32_t line = 0;
    std::uint32_t column = 0;
    std::uint32_t offset = 0;
    std::uint32_t length = 0;
    /// Where a value was read is not part of the value: all spans are equal.
    friend constexpr bool operator==(const Span&, const Span&) { return true; }
};

/// A message about a file. `Topic` is the reader's enumeration of diagnostic codes.
template <class Topic>
struct Message {
    Severity severity = Severity::error;
    Topic topic{};
    Span at;
    std::string sentence;  ///< no final stop; names quoted '…'
    std::string help{};  ///< what to type; may be empty
    std::string label{};  ///< shown at the caret; may be empty
    std::string argument{};  ///< the load argument it is about, if no file was read
};

/// Errors kept per file. One more is kept, so that the host reports that there are more.
inline constexpr std::size_t max_errors = 100;

/// Collects the messages about one file.
template <class Topic>
class Messages {
public:
    void add(Severity severity, Topic topic, Span at, std::string sentence, std::string help = {},
             std::string label = {}) {
        if (severity == Severity::error && ++errors_ > max_errors + 1) return;
        all.push_back(
            {severity, topic, at, std::move(sentence), std::move(help), std::move(label)});
    }
    void error(Topic topic, Span at, std::string sentence, std::string help = {},
               std::string label = {}) {
        add(Severity::error, topic, at, std::move(sentence), std::move(help), std::move(label));
    }
    void warning(Topic topic, Span at, std::string sentence, std::string help = {},
                 std::string label = {}) {
        add(Severity::warning, topic, at, std::move(sentence), std::move(help), std::move(label));
    }
    void note(Topic topic, Span at, std::string sentence, std::string help = {},
              std::string label = {}) {
        add(Severity::note, topic, at, std::move(sentence), std::move(help), std::move(label));
    }
    /// Reports an invalid load argument.
    void argument(Topic topic, std::string name, std::string sentence, std::string help) {
        error(topic, {}, std::move(sentence), std::move(help));
        all.back().argument = std::move(name);
    }
    bool failed() const { return errors_ != 0; }

    std::vector<Message<Topic>> all;

private:
    std::size_t errors_ = 0;
};

/// Orders messages by their place in the file and drops repeated ones.
template <class Topic>
void sort(std::vector<Message<Topic>>& messages) {
    std::stable_sort(messages.begin(), messages.end(),
                     [](const auto& a, const auto& b) { return a.at.offset < b.at.offset; });
    std::size_t kept = 0;
    for (auto& message : messages) {
        bool repeated = false;
        for (std::size_t i = kept; i-- > 0 && messages[i].at.offset == message.at.offset;) {
            repeated = repeated || messages[i].sentence == message.sentence;
        }
        if (repeated) continue;
        if (&messages[kept] != &message) {
            messages[kept] = std::move(message);
        }
        ++kept;
    }
    messages.resize(kept);
}

/// Returns whether there is no error among the messages.
template <class Topic>
bool good(const std::vector<Message<Topic>>& messages) {
    return std::none_of(messages.begin(), messages.end(),
                        [](const auto& m) { return m.severity == Severity::error; });
}

/// Formats a message as "file:12:7: error: sentence; help", for logs and hosts without a renderer.
std::string message_text(const std::string& file, Severity severity, Span at,
                         const std::string& sentence, const std::string& help);

/// Formats each error on a line of its own.
template <class Topic>
std::string errors_text(const std::vector<Message<Topic>>& messages, const std::string& file) {
    std::string out;
    for (const auto& m : messages) {
        if (m.severity == Severity::error) {
            append_item(out, message_text(file, m.severity, m.at, m.sentence, m.help), "\n");
        }
    }
    return out;
}

/// A word, value or line of a file and where it is.
struct Word {
    std::string text;
    Span at;
    bool empty() const { return text.empty(); }
};

/// The lines of a file that are not empty, without their comments and the blanks at both ends. A
/// comment begins with one of the characters
/// `comment` at the beginning of a line or after a blank.
class Lines {
public:
    explicit Lines(std::string_view text, std::string_view comment = "#;");
    std::optional<Word> next();

private:
    std::string_view text_, comment_;
    std::size_t at_ = 0;
    std::uint32_t number_ = 0;
};

/// Returns the bytes [begin, end) of a word without blanks at both ends.
Word part(const Word& whole, std::size_t begin, std::size_t end);
/// Splits "a, b, c" at `separator`; parts may be empty.
std::vector<Word> list_of(const Word& value, char separator = ',');
/// Splits at blanks and at `more`; no word is empty.
std::vector<Word> words_of(const Word& value, std::string_view more = {});

/// A line of a file of sections and keys, as parts of the line itself without blanks at both ends.
struct IniLine {
    enum class Kind : std::uint8_t { empty, comment, section, open_section, entry, other };
    /// open_section: its `]` is missing; other: neither a section nor KEY = value
    Kind kind = Kind::empty;
    std::string_view whole;
    std::string_view name;  ///< of the section, or the key
    std::string_view value = {};  ///< of the key; text after the `]` of a section
};
/// Splits a line of an INI file: `[SECTION]`, `KEY = value`, whole-line comments with `#` and `;`.
IniLine ini_line(std::string_view line);

/// A problem in a text of which only byte offsets are known.
struct Problem {
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
    std::string sentence, help;
};

/// Adds a problem, as long as there are not more than errors of a file.
inline void add(std::vector<Problem>& problems, Problem problem) {
    if (problems.size() <= max_errors) {
        problems.push_back(std::move(problem));
    }
}
inline void add(std::vector<Problem>& problems, std::size_t begin, std::size_t end,
                std::string sentence, std::string help) {
    add(problems, {static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end),
                   std::move(sentence), std::move(help)});
}

}  // namespace hal::text
