// SPDX-License-Identifier: MIT
// The text below an EDS: bytes of any vendor's editor to UTF-8 lines, sections and keys, each with its place.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace hal::canopen::eds {

enum class Severity : std::uint8_t { note, warning, error };

/// What a message is about; the program has a page on each.
enum class Topic : std::uint8_t {
    unreadable,  ///< the file is refused
    syntax,      ///< lines, sections, encoding
    missing,     ///< a key or a section that has to be there
    count,       ///< lists and numbers of things that do not agree with what follows
    value,       ///< a number, a limit, a date
    object,      ///< an object as a whole: its kind, its entries, its mapping
};

/// A place in the decoded text. Lines and columns from 1, columns in characters; offset and length in bytes.
struct Place {
    std::uint32_t line = 0, column = 0, offset = 0, length = 0;
    /// Where something was read is not part of what it is: all places are equal.
    friend bool operator==(const Place&, const Place&) { return true; }
};

struct Message {
    Severity    severity = Severity::warning;
    Topic       topic = Topic::syntax;
    Place       at;
    std::string sentence;  ///< no final stop; names quoted '…' as the file has them
    std::string help;      ///< what to type, or what was assumed; may be empty
};

/// "line 12, column 3: warning: sentence; help", for logs without a renderer.
std::string to_string(const Message& message);

/// The bytes as UTF-8 with `\n` line ends: a byte order mark goes, UTF-16 and Windows-1252 are translated, lone `\r` end lines.
/// What was unusual is said in `messages`; false when it is no text at all.
bool decode(std::string_view bytes, std::string& text, std::vector<Message>& messages);

struct IniKey {
    std::string name, value;
    Place       at, value_at;
    bool        used = false;
};

struct IniSection {
    std::string              name;
    Place                    at;
    std::vector<IniKey>      keys;
    std::vector<std::string> comments;  ///< whole lines, with their `;` or `#`
    bool                     used = false;

    IniKey* find(std::string_view key);  ///< upper and lower case are the same
};

/// Sections in file order. A section that comes twice is one, a key that comes twice has its last value; both are said.
class Ini {
public:
    void                            parse(std::string_view text, std::vector<Message>& messages);
    IniSection*                     find(std::string_view name);
    std::vector<IniSection>&        sections() { return sections_; }
    const std::vector<std::string>& preamble() const { return preamble_; }  ///< comments before the first section

private:
    std::vector<IniSection>                      sections_;
    std::unordered_map<std::string, std::size_t> by_name_;
    std::vector<std::string>                     preamble_;
};

std::string_view trimmed(std::string_view text);
std::string      lower(std::string_view text);
bool             same_word(std::string_view a, std::string_view b);  ///< but for upper and lower case

}  // namespace hal::canopen::eds
