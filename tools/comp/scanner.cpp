// SPDX-License-Identifier: MIT
#include "comp/scanner.hpp"

#include <algorithm>

#include "text/characters.hpp"

namespace hal::comp {
namespace {

bool is_gap(char c) { return is_blank(c) || c == '\n' || c == '\r'; }
bool begins_word(char c) { return is_letter(c) || c == '_'; }
bool is_word(char c) { return is_alphanumeric(c) || c == '_'; }
bool is_hal(char c) { return is_name_character(c) || c == '#'; }

void append_utf8(std::string& to, unsigned long code) {
    const auto continuation = [](unsigned long bits) {
        return static_cast<char>(0x80 | (bits & 0x3F));
    };
    if (code < 0x80) {
        to += static_cast<char>(code);
    } else if (code < 0x800) {
        to += static_cast<char>(0xC0 | (code >> 6));
        to += continuation(code);
    } else {
        to += static_cast<char>(0xE0 | (code >> 12));
        to += continuation(code >> 6);
        to += continuation(code);
    }
}

/// Reads digits of a base from `at` on, as many as `max_digits`. The emitted C strings cannot hold
/// a zero, which becomes a question mark.
unsigned long code_point(std::string_view raw, std::size_t& at, std::size_t max_digits,
                         unsigned base) {
    static constexpr std::string_view digits = "0123456789abcdef";
    unsigned long value = 0;
    for (std::size_t n = 0; n < max_digits && at < raw.size(); ++n, ++at) {
        const std::size_t digit = digits.find(lower(raw[at]));
        if (digit >= base) break;
        value = value * base + digit;
    }
    return value == 0 ? '?' : value;
}

/// Appends what the escape behind the backslash at `at - 1` stands for. Returns the index behind
/// it.
std::size_t unescape(std::string_view raw, std::size_t at, std::string& text) {
    const char c = raw[at];
    if (c >= '0' && c <= '7') {
        append_utf8(text, code_point(raw, at, 3, 8));
        return at;
    }
    ++at;
    if (c == 'x' || c == 'u') {
        append_utf8(text, code_point(raw, at, c == 'x' ? 2 : 4, 16));
        return at;
    }
    constexpr std::string_view plain = "nt\\\"'abfvr\n";
    constexpr std::string_view meanings[] = {"\n", "\t", "\\", "\"", "'", " ",
                                             " ",  " ",  " ",  "",   ""};
    const std::size_t row = plain.find(c);
    if (row == plain.npos) {
        text += '\\';
        text += c;
    } else {
        text += meanings[row];
    }
    return at;
}

/// The escapes that C and Python have in common; any other backslash is one.
std::string unescaped(std::string_view raw) {
    std::string text;
    for (std::size_t i = 0; i < raw.size();) {
        if (raw[i] == '\\' && i + 1 < raw.size()) {
            i = unescape(raw, i + 1, text);
        } else {
            text += raw[i++];
        }
    }
    return text;
}

}  // namespace

Span Scanner::span(std::size_t begin, std::size_t end) const {
    const std::size_t max = text_.size();
    return {source_, static_cast<std::uint32_t>(std::min(begin, max)),
            static_cast<std::uint32_t>(std::min(end, max))};
}

void Scanner::error(Span at, std::string message, std::string label, std::string help) {
    diagnostics_.error("bad-component-source", at, std::move(message), std::move(label),
                       std::move(help));
}

void Scanner::skip() {
    while (at_ < text_.size()) {
        if (is_gap(text_[at_])) {
            ++at_;
        } else if (starts("//")) {
            at_ = std::min(text_.find('\n', at_), text_.size());
        } else if (starts("/*")) {
            const std::size_t end = text_.find("*/", at_ + 2);
            if (end == std::string_view::npos) {
                error(span(at_, at_ + 2), "unterminated comment", "", "end it with */");
            }
            at_ = end == std::string_view::npos ? text_.size() : end + 2;
        } else {
            break;
        }
    }
}

bool Scanner::take(char c) {
    if (next() != c) return false;
    last_ = ++at_;
    return true;
}

bool Scanner::at_code() {
    skip();
    if (!starts(";;")) return false;
    const std::size_t begin = text_.rfind('\n', at_) + 1;
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    return end_of_run(text_, begin, is_gap) == at_ &&
           end_of_run(text_.substr(0, end), at_ + 2, is_gap) == end;
}

Span Scanner::read_code() {
    at_ = std::min(text_.find('\n', at_), text_.size() - 1) + 1;
    return span(at_, text_.size());
}

Text Scanner::taken(std::size_t begin) {
    last_ = at_;
    return {std::string(text_.substr(begin, at_ - begin)), at_ > begin ? span(begin, at_) : Span{}};
}

std::string_view Scanner::peek_word() {
    skip();
    if (at_ >= text_.size() || !begins_word(text_[at_])) return {};
    return text_.substr(at_, end_of_run(text_, at_, is_word) - at_);
}

Text Scanner::word() {
    const std::size_t length = peek_word().size();
    const std::size_t begin = at_;
    if (length == 0) {
        return {};
    }
    at_ += length;
    return taken(begin);
}

Text Scanner::hal_name() {
    skip();
    const std::size_t begin = at_;
    const char first = next();
    if (!begins_word(first) && first != '#' && first != '.') return {};
    at_ = end_of_run(text_, at_, is_hal);
    return taken(begin);
}

// Where the opening quotes are; npos when no string comes next.
std::size_t Scanner::string_start() const {
    const std::string_view rest = text_.substr(at_);
    if (rest.starts_with('"')) return at_;
    return rest.starts_with("r\"") || rest.starts_with("R\"") ? at_ + 1 : std::string_view::npos;
}

bool Scanner::at_string() {
    skip();
    return string_start() != std::string_view::npos;
}

/// Returns where the closing quotes are, searched from `from` on; npos: nowhere. A string between
/// single quotation marks ends in its line.
std::size_t Scanner::closing_quotes(std::size_t from, std::string_view closing) const {
    for (std::size_t end = from; end < text_.size(); ++end) {
        if (text_.substr(end).starts_with(closing)) return end;
        if (text_[end] == '\n' && closing.size() == 1) break;
        if (text_[end] == '\\') {
            ++end;
        }
    }
    return std::string_view::npos;
}

std::optional<Text> Scanner::string() {
    skip();
    const std::size_t begin = at_;
    const std::size_t quote = string_start();
    if (quote == std::string_view::npos) {
        return {};
    }
    const bool raw = quote != at_;
    const bool triple = text_.substr(quote).starts_with("\"\"\"");
    const std::string_view closing = triple ? "\"\"\"" : "\"";
    const std::size_t from = quote + closing.size();
    const std::size_t end = closing_quotes(from, closing);
    if (end == std::string_view::npos) {
        error(span(begin, from), "unterminated string", "",
              triple ? "end it with \"\"\""
                     : "end it with \"; text of several lines goes between \"\"\" and \"\"\"");
        at_ = triple ? text_.size() : std::min(text_.find('\n', begin), text_.size());
        last_ = at_;
        broken_ = true;
        return Text{"", span(begin, from)};
    }
    at_ = end + closing.size();
    Text text = taken(begin);
    text.text = raw ? std::string(text_.substr(from, end - from))
                    : unescaped(text_.substr(from, end - from));
    std::erase_if(text.text, [](char c) { return c == '\r' || c == '\0'; });
    return text;
}

std::optional<Text> Scanner::header() {
    skip();
    const std::size_t begin = at_;
    if (next() != '"' && next() != '<') {
        return {};
    }
    const std::size_t end = text_.find(text_[at_] == '<' ? '>' : '"', at_ + 1);
    if (end == std::string_view::npos ||
        text_.substr(at_, end - at_).find('\n') != std::string_view::npos) {
        return {};
    }
    at_ = end + 1;
    return taken(begin);
}

bool Scanner::at_expression_end(std::string_view stops, const Nesting& nesting) const {
    if (at_ >= text_.size()) return true;
    const char c = text_[at_];
    if (c == ';' || string_start() != std::string_view::npos) return true;
    if (nesting.depth > 0) return false;
    const bool of_conditional = c == ':' && nesting.questions > 0;
    if (of_conditional || starts("==")) return false;
    return c == ')' || stops.find(c) != std::string_view::npos;
}

/// The length of a number or a word of C; 0 when none comes next.
std::size_t Scanner::operand_length() const {
    if (!is_word(text_[at_])) return 0;
    return end_of_run(text_, at_, [](char c) { return is_word(c) || c == '.'; }) - at_;
}

/// The length of the token that comes next in an expression.
std::size_t Scanner::token_length() const {
    if (const std::size_t operand = operand_length()) return operand;
    if (text_[at_] == '\'') {
        // a character: 'a', '\n', '\x20'
        const std::size_t close = text_.find('\'', at_ + 2);
        if (close != std::string_view::npos && close < at_ + 6) return close + 1 - at_;
    }
    for (const std::string_view comparison : {"==", "!=", "<=", ">="}) {
        if (starts(comparison)) return 2;
    }
    return 1;
}

Text Scanner::expression(std::string_view stops) {
    skip();
    const std::size_t begin = at_;
    std::size_t end = at_;
    Nesting nesting;
    std::string text;
    while (!at_expression_end(stops, nesting)) {
        if (is_gap(text_[at_]) || starts("//") || starts("/*")) {
            skip();
            if (!text.empty()) {
                text += ' ';
            }
            continue;
        }
        const std::string_view token = text_.substr(at_, token_length());
        if (token == "if" && nesting.depth == 0) break;
        nesting.enter(token[0]);
        text += token;
        at_ += token.size();
        end = at_;
    }
    if (nesting.depth > 0) {
        error(span(begin, end), "'(' without ')'");
    }
    while (text.ends_with(' ')) {
        text.pop_back();
    }
    if (end == begin) return {std::move(text), Span{}};
    last_ = end;
    return {std::move(text), span(begin, end)};
}

void Scanner::recover() {
    while (at_ < text_.size()) {
        if (at_code()) {
            return;  // skips blanks and comments, too
        }
        if (at_ >= text_.size()) return;
        if (text_[at_] == ';') {
            last_ = ++at_;
            return;
        }
        if (string_start() != std::string_view::npos) {
            const std::size_t before = diagnostics_.errors();
            string();
            if (diagnostics_.errors() != before) return;
        } else {
            ++at_;
        }
    }
}

Span Scanner::here() {
    skip();
    if (at_ >= text_.size() ||
        text_.substr(last_, at_ - last_).find('\n') != std::string_view::npos) {
        return behind();
    }
    return span(at_, std::max(end_of_run(text_, at_, is_hal), at_ + 1));
}

}  // namespace hal::comp
