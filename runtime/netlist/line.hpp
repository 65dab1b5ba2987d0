// SPDX-License-Identifier: MIT
// Logical lines: physical lines joined at `\`, with the way back from each character to its place
// in the source.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "text/characters.hpp"
#include "text/diagnostic.hpp"
#include "text/source.hpp"

namespace hal {

/// A text of segments: verbatim parts of the source, and values that replaced references.
class Line {
public:
    std::string_view text() const { return text_; }
    /// Where the characters [begin, end) of the text stand in the source; a value stands where its
    /// reference does.
    Span span(std::size_t begin, std::size_t end) const;
    /// True when the characters [begin, end) are one verbatim segment of the source.
    bool verbatim(std::size_t begin, std::size_t end) const;

    void clear(std::uint32_t source);
    /// Appends a verbatim segment of the source.
    void append(std::string_view stretch, std::uint32_t source_begin);
    /// Appends [begin, end) of another line; calls come in rising order of place, which makes all
    /// of them linear.
    void append(const Line& line, std::size_t begin, std::size_t end);
    /// Appends a value that stands for the source text `reference`.
    void append_value(std::string_view value, Span reference);

private:
    struct Piece {
        std::size_t at;  ///< where it starts in text_
        std::uint32_t begin, end;
        bool value;
    };
    std::size_t piece_of(std::size_t at) const;

    std::uint32_t source_ = 0;
    std::string_view text_;  ///< the source itself while there is one piece, else buffer_
    std::string buffer_;
    std::vector<Piece> pieces_;
    mutable std::size_t last_piece_ = 0;  ///< places are asked for in rising order
};

/// Help for a carriage return that ends no line.
inline constexpr const char* line_ends_help =
    "end lines with LF (or CR LF); `tr '\\r' '\\n'` converts a file with CR line endings";

/// The logical lines of a source, in order.
class LineReader {
public:
    LineReader(const Sources& sources, std::uint32_t source);
    /// The next logical line, without its end of line; false at the end of the text.
    bool next(Line& line);

    /// Of the line that next() gave: the first carriage return that ends no line; the first other
    /// control character (except tabs), as positions in the line.
    std::optional<std::size_t> carriage_return() const { return carriage_return_; }
    std::optional<std::size_t> control() const { return control_; }
    bool continued() const { return continued_; }
    /// The first line end of the source so far that was CR LF.
    std::optional<Span> dos_ending() const { return dos_ending_; }

private:
    /// Removes the CR of a line end that is CR LF, and notes the first one.
    void remove_carriage_return(std::string_view& row, std::size_t newline);
    /// Notes control characters of a row that begins `offset` characters into the line.
    void note_controls(std::string_view row, std::size_t offset);

    std::uint32_t source_;
    std::string_view text_;
    std::size_t at_ = 0;
    std::optional<std::size_t> carriage_return_, control_;
    bool continued_ = false;
    std::optional<Span> dos_ending_;
};

/// What quotes and `#` do to a line: where its comment starts (its size without a comment), and
/// the quote that is never closed.
struct QuoteScan {
    std::size_t comment = 0;
    std::optional<std::size_t> open_quote;
};
QuoteScan scan_quotes(std::string_view text);

/// `$NAME`, `$(NAME)`, `[SECTION]KEY` or `[SECTION](KEY)` at a `$` or `[`.
struct Reference {
    /// none: plain text, as the range `[0..5]`
    enum Kind { none, variable, key, broken } kind = none;
    std::size_t length = 1;
    std::string_view section, name;
};
Reference reference_at(std::string_view text, std::size_t at);

/// Reports what makes a text no netlist, whatever the values of its references.
void check_syntax(const Sources& sources, std::uint32_t source, Diagnostics& diagnostics);

}  // namespace hal
