// SPDX-License-Identifier: MIT
// The letters of a .comp file. What a `-` or a `.` means depends on what is expected, so the parser
// asks for it.
#pragma once

#include <optional>
#include <string_view>
#include <utility>

#include "comp/syntax.hpp"

namespace hal::comp {

class Scanner {
public:
    Scanner(const Sources& sources, std::uint32_t source, Diagnostics& diagnostics)
        : text_(sources.get(source).text), source_(source), diagnostics_(diagnostics) {}

    /// Past blanks and comments.
    void skip();
    bool at_end() {
        skip();
        return at_ >= text_.size();
    }
    char next() { return at_end() ? '\0' : text_[at_]; }
    /// True, and past it, when `c` comes next.
    bool take(char c);
    /// At a line that consists of `;;`.
    bool at_code();
    /// Past that line: the rest of the file.
    Span read_code();

    /// A word of C: letters, digits, `_`. Empty when none comes next.
    Text word();
    /// The word that word() would give.
    std::string_view peek_word();
    /// A name for netlists: also `#`, `.` and `-`.
    Text hal_name();
    /// "…", """…""", either with r before it. Nothing when none comes next.
    std::optional<Text> string();
    bool at_string();
    /// Returns true once after an unterminated string: what follows cannot be parsed.
    bool pop_broken() { return std::exchange(broken_, false); }
    /// "file.h" or <file.h>
    std::optional<Text> header();
    /// C up to one of `stops` outside of parentheses, a string, `;`, or the word `if`.
    Text expression(std::string_view stops);

    /// Behind the next `;`, or at the `;;` line, or at the end: after an error.
    void recover();
    /// The place of what comes next; behind the last word when a line ends there.
    Span here();
    /// The empty place right behind what was read last.
    Span behind() const { return span(last_, last_ + 1); }
    Span span(std::size_t begin, std::size_t end) const;
    void error(Span at, std::string message, std::string label = "", std::string help = "");

private:
    bool starts(std::string_view what) const { return text_.substr(at_).starts_with(what); }
    std::size_t string_start() const;
    std::size_t closing_quotes(std::size_t from, std::string_view closing) const;
    /// What is open in an expression.
    struct Nesting {
        int depth = 0;  ///< of parentheses
        int questions = 0;  ///< conditional operators without their ':'
        void enter(char token) {
            depth += (token == '(') - (token == ')');
            questions += (token == '?') - (token == ':');
        }
    };
    bool at_expression_end(std::string_view stops, const Nesting& nesting) const;
    std::size_t operand_length() const;
    std::size_t token_length() const;
    Text taken(std::size_t begin);

    std::string_view text_;
    std::uint32_t source_;
    Diagnostics& diagnostics_;
    std::size_t at_ = 0;
    std::size_t last_ = 0;
    bool broken_ = false;
};

}  // namespace hal::comp
