// SPDX-License-Identifier: MIT
// Where a text came from: files, shell lines, and places in them.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

namespace hal {

/// A half-open byte range in one source. `source` 0 is "nowhere" (made by the runtime itself).
struct Span {
    std::uint32_t source = 0, begin = 0, end = 0;
    bool known() const { return source != 0; }
};

/// Line and column as people count them: from 1, columns in characters (UTF-8).
struct Place {
    std::uint32_t line = 0, column = 0;
};

/// All texts of a session, for as long as spans may point into them. Not synchronised: one user at a time.
class Sources {
public:
    struct Source {
        std::string name;  ///< as messages print it: a path, "<shell>", "<commandline>", "<stdin>"
        std::string text;
        std::uint32_t first_line = 1;  ///< the number of the text's first line: a text may be a part of what messages call `name`
        mutable std::vector<std::uint32_t> line_starts = {};  ///< filled by the first question about a place
    };

    /// Adds a text and returns its number.
    std::uint32_t add(std::string name, std::string text, std::uint32_t first_line = 1);
    /// Gives the newest text back when no span points into it any more: what a shell line leaves behind that made
    /// nothing. Its number is used again. Any other text stays.
    void drop(std::uint32_t source);
    const Source& get(std::uint32_t source) const;
    std::string_view text(Span span) const;
    Place place(Span span) const;
    /// The whole line that `span` begins on, without its end of line.
    std::string_view line(Span span) const;
    /// "file:line" or "file:line:column"
    std::string location(Span span, bool column = true) const;

private:
    static std::size_t line_index(const Source& source, std::uint32_t at);

    std::deque<Source> sources_;
};

}  // namespace hal
