// SPDX-License-Identifier: MIT
// The text of an EDS: converts the bytes of a file to UTF-8 lines, sections and keys with their
// spans.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "text/characters.hpp"
#include "text/config_text.hpp"

namespace hal::canopen::eds {

using hal::lower;
using hal::same_word;
using hal::Severity;
using hal::trimmed;
using text::Span;

/// Subject of a message: its diagnostic code, with a page each (`hal explain`).
/// `hal can eds check` has a code for each, in this order.
enum class Topic : std::uint8_t {
    unreadable,  ///< the file is rejected
    syntax,      ///< lines, sections, encoding
    missing,     ///< a mandatory key or section is missing
    count,       ///< a list or count differs from what the file contains
    value,       ///< a number, a limit, a date
    object,      ///< an object as a whole: its type, its entries, its mapping
    number,      ///< a number or value that cannot be read
    conflict,    ///< two descriptions of the same object that differ
    undescribed, ///< an object that is listed but not described
    truncated,   ///< the file ends within a line
};

using Message = text::Message<Topic>;

/// Returns whether a problem of this topic makes a value of the file unreliable: a master or tool
/// that configures a device with the file must reject it.
constexpr bool unreliable(Topic topic) {
    return topic == Topic::number || topic == Topic::conflict || topic == Topic::undescribed ||
           topic == Topic::truncated;
}

/// Formats "line 12, column 3: warning: sentence; help", for logs without a renderer.
std::string to_string(const Message& message);

/// Converts the bytes to UTF-8 with `\n` line ends: removes a byte order mark, converts UTF-16 and
/// Windows-1252, accepts a lone `\r` as line end. Reports what is unusual in `messages`. Returns
/// false if the bytes are not text.
bool decode(std::string_view bytes, std::string& text, std::vector<Message>& messages);

struct IniKey {
    std::string name, value;
    Span at, value_at;
    bool used = false;
};

struct IniSection {
    std::string name;
    Span at;
    std::vector<IniKey> keys;
    std::vector<std::string> comments;  ///< whole lines, with their `;` or `#`
    bool used = false;

    IniKey* find(std::string_view key);  ///< not case sensitive
};

/// The sections in file order. Merges duplicate sections and keeps the last value of a duplicate
/// key; reports both.
class Ini {
public:
    void parse(std::string_view text, std::vector<Message>& messages);
    IniSection* find(std::string_view name);
    std::vector<IniSection>& sections() { return sections_; }
    /// comments before the first section
    const std::vector<std::string>& preamble() const { return preamble_; }

private:
    class Parser;
    std::vector<IniSection> sections_;
    std::unordered_map<std::string, std::size_t> by_name_;
    std::vector<std::string> preamble_;
};

}  // namespace hal::canopen::eds
