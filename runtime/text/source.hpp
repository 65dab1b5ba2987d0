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
    std::uint32_t source = 0;
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
    bool known() const { return source != 0; }
};

/// Line and column as people count them: from 1, columns in characters (UTF-8).
struct Place {
    std::uint32_t line = 0;
    std::uint32_t column = 0;
};

/// All texts of a session, for as long as spans may point into them: a text is freed by drop(), or
/// by sweep() unless it is held or in use. Not synchronised: one user at a time.
class Sources {
public:
    struct Source {
        std::string name;  ///< as messages print it: a path, "<shell>", "<commandline>", "<stdin>"
        std::string text;
        /// the number of the text's first line: a text may be a part of what messages call `name`
        std::uint32_t first_line = 1;
        /// filled by the first question about a place
        mutable std::vector<std::uint32_t> line_starts = {};
        std::uint32_t holders = 0;  ///< see hold()
        bool free = false;  ///< its number is to be used again
    };

    /// Adds a text and returns its number.
    std::uint32_t add(std::string name, std::string text, std::uint32_t first_line = 1);
    /// Keeps a text whatever sweep() is given, until as many calls of release(). Source 0 is
    /// ignored.
    void hold(std::uint32_t source);
    void release(std::uint32_t source);
    /// Frees a text into which no span points any more, unless it is held. Its number is used
    /// again.
    void drop(std::uint32_t source);
    /// True when so many texts have been added since the last sweep() that another one is worth its
    /// time.
    bool worth_sweeping() const;
    /// Frees all texts that are neither held nor `in_use`, which has an entry for each number up to
    /// the largest one in use.
    void sweep(const std::vector<bool>& in_use);
    /// The number and the size of the texts that are kept.
    std::size_t count() const { return sources_.size() - free_.size(); }
    std::size_t bytes() const { return bytes_; }
    const Source& get(std::uint32_t source) const;
    std::string_view text(Span span) const;
    Place place(Span span) const;
    /// The whole line that `span` begins on, without its end of line.
    std::string_view line(Span span) const;
    /// "file:line" or "file:line:column"
    std::string location(Span span, bool column = true) const;

private:
    static std::size_t line_index(const Source& source, std::uint32_t at);

    void free(std::uint32_t source);

    std::deque<Source> sources_;
    std::vector<std::uint32_t> free_;  // numbers that are to be used again
    std::size_t bytes_ = 0;  // of all texts
    std::size_t swept_count_ = 0;
    std::size_t swept_bytes_ = 0;  // after the last sweep
};

}  // namespace hal
