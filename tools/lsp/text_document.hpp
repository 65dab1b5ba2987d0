// SPDX-License-Identifier: MIT
// A text as an editor counts it: lines from 0, columns in UTF-16 code units (Language Server
// Protocol 3.17, Position).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hal::tools {

struct TextPosition {
    std::uint32_t line = 0;
    std::uint32_t character = 0;  ///< UTF-16 code units from the beginning of the line
    bool operator==(const TextPosition&) const = default;
    auto operator<=>(const TextPosition&) const = default;
};

/// Half-open.
struct TextRange {
    TextPosition begin, end;
    bool operator==(const TextRange&) const = default;
    auto operator<=>(const TextRange&) const = default;
};

/// A line ends with LF, CR LF or CR. Positions behind the end of a line or of the text count as
/// that end; one between the halves of a surrogate pair counts as the beginning of its character.
/// [setup]
class TextDocument {
public:
    explicit TextDocument(std::string text = "");

    const std::string& text() const { return text_; }
    std::uint32_t line_count() const { return static_cast<std::uint32_t>(line_starts_.size()); }
    /// Returns a line without its end; empty behind the last one.
    std::string_view line(std::uint32_t number) const;
    std::size_t line_start(std::uint32_t number) const;
    /// Returns the byte offset of a position.
    std::size_t offset(TextPosition at) const;
    /// Returns the position of a byte offset. One within a character counts as its beginning, one
    /// within the end of a line or behind the text as the end of the line.
    TextPosition position(std::size_t offset) const;
    TextRange range(std::size_t begin, std::size_t end) const {
        return {position(begin), position(end)};
    }
    void replace(TextRange range, std::string_view text);

private:
    void find_lines();

    std::string text_;
    std::vector<std::size_t> line_starts_;
};

}  // namespace hal::tools
