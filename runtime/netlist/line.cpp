// SPDX-License-Identifier: MIT
#include "netlist/line.hpp"

#include <algorithm>

#include "text/characters.hpp"

namespace hal {

std::size_t Line::piece_of(std::size_t at) const {
    const auto holds = [&](std::size_t i) {
        return pieces_[i].at <= at && (i + 1 == pieces_.size() || at < pieces_[i + 1].at);
    };
    if (last_piece_ < pieces_.size() && holds(last_piece_)) return last_piece_;
    const auto after =
        std::upper_bound(pieces_.begin(), pieces_.end(), at,
                         [](std::size_t offset, const Piece& piece) { return offset < piece.at; });
    return last_piece_ =
               after == pieces_.begin() ? 0 : static_cast<std::size_t>(after - pieces_.begin()) - 1;
}

Span Line::span(std::size_t begin, std::size_t end) const {
    if (pieces_.empty()) {
        return {source_, 0, 0};
    }
    const Piece& first = pieces_[piece_of(begin)];
    const auto from =
        first.value ? first.begin : static_cast<std::uint32_t>(first.begin + (begin - first.at));
    if (end <= begin) {
        return {source_, from, from};
    }
    const Piece& last = pieces_[piece_of(end - 1)];
    return {source_, from,
            last.value ? last.end : static_cast<std::uint32_t>(last.begin + (end - last.at))};
}

bool Line::verbatim(std::size_t begin, std::size_t end) const {
    const std::size_t piece = piece_of(begin);
    return !pieces_.empty() && !pieces_[piece].value &&
           (piece + 1 == pieces_.size() || end <= pieces_[piece + 1].at);
}

void Line::clear(std::uint32_t source) {
    source_ = source;
    text_ = {};
    buffer_.clear();
    pieces_.clear();
    last_piece_ = 0;
}

void Line::append(std::string_view stretch, std::uint32_t source_begin) {
    const auto source_end = static_cast<std::uint32_t>(source_begin + stretch.size());
    if (pieces_.empty()) {
        pieces_.push_back({0, source_begin, source_end, false});
        text_ = stretch;
        return;
    }
    if (stretch.empty()) return;
    if (pieces_.size() == 1) {
        buffer_ = text_;
    }
    pieces_.push_back({buffer_.size(), source_begin, source_end, false});
    buffer_ += stretch;
    text_ = buffer_;
}

void Line::append(const Line& line, std::size_t begin, std::size_t end) {
    while (begin < end) {
        const std::size_t piece = line.piece_of(begin);
        const std::size_t stop =
            piece + 1 == line.pieces_.size() ? end : std::min(end, line.pieces_[piece + 1].at);
        append(line.text_.substr(begin, stop - begin), line.span(begin, stop).begin);
        begin = stop;
    }
}

void Line::append_value(std::string_view value, Span reference) {
    if (value.empty()) return;
    if (pieces_.size() == 1) {
        buffer_ = text_;
    }
    pieces_.push_back({buffer_.size(), reference.begin, reference.end, true});
    buffer_ += value;
    text_ = buffer_;
}

LineReader::LineReader(const Sources& sources, std::uint32_t source)
    : source_(source), text_(sources.get(source).text) {
    if (text_.starts_with("\xEF\xBB\xBF")) {
        at_ = 3;  // ignores a byte-order mark
    }
}

void LineReader::remove_carriage_return(std::string_view& row, std::size_t newline) {
    if (!row.ends_with('\r')) return;
    row.remove_suffix(1);
    if (dos_ending_) return;
    const auto end = static_cast<std::uint32_t>(newline);
    dos_ending_ = Span{source_, end - 1, end};
}

static bool is_control(char c) {
    return (static_cast<unsigned char>(c) < 0x20 && c != '\t') || c == 0x7F;
}

/// Tested without a branch per character: nearly all lines have none.
static bool has_control(std::string_view row) {
    bool found = false;
    for (const char c : row) {
        found |= is_control(c);
    }
    return found;
}

void LineReader::note_controls(std::string_view row, std::size_t offset) {
    if (!has_control(row)) return;
    for (std::size_t i = 0; i < row.size(); ++i) {
        const char c = row[i];
        if (c == '\0') {
            control_ = offset + i;
            return;
        }
        if (!is_control(c)) continue;
        std::optional<std::size_t>& first = c == '\r' ? carriage_return_ : control_;
        if (!first) {
            first = offset + i;
        }
    }
}

bool LineReader::next(Line& line) {
    if (at_ >= text_.size()) return false;
    line.clear(source_);
    carriage_return_.reset();
    control_.reset();
    continued_ = false;
    for (std::size_t joined = 0;;) {
        const std::size_t newline = std::min(text_.find('\n', at_), text_.size());
        std::string_view row = text_.substr(at_, newline - at_);
        const bool last = newline == text_.size();
        if (!last) {
            remove_carriage_return(row, newline);
        }
        const bool goes_on = row.ends_with('\\');
        if (goes_on) {
            row.remove_suffix(1);
        }
        note_controls(row, joined);
        line.append(row, static_cast<std::uint32_t>(at_));
        joined += row.size();
        at_ = newline + 1;
        if (!goes_on || last || at_ >= text_.size()) return true;
        continued_ = true;
    }
}

QuoteScan scan_quotes(std::string_view text) {
    for (std::size_t at = 0; at < text.size(); ++at) {
        if (text[at] == '#') {
            return {at, {}};
        }
        if (text[at] != '\'' && text[at] != '"') continue;
        const std::size_t close = text.find(text[at], at + 1);
        if (close == text.npos) {
            return {text.size(), at};
        }
        at = close;
    }
    return {text.size(), {}};
}

namespace {

/// NAME or (NAME) at `at`, into `reference`, which starts at `start`.
void name_at(std::string_view text, std::size_t start, std::size_t at, Reference::Kind kind,
             Reference& reference) {
    std::size_t stop = at;
    const bool enclosed = at < text.size() && text[at] == '(';
    if (enclosed) {
        // Stopping at the next opening keeps a line of nothing but openings linear.
        stop = std::min(text.find_first_of(")($[", at + 1), text.size());
        reference.name = text.substr(at + 1, stop - at - 1);
    } else {
        stop = end_of_run(text, at, is_name_character);
        reference.name = text.substr(at, stop - at);
    }
    const bool closed = !enclosed || (stop < text.size() && text[stop] == ')');
    reference.kind = reference.name.empty() || !closed ? Reference::broken : kind;
    reference.length =
        std::max<std::size_t>(1, std::min(stop + (enclosed && closed), text.size()) - start);
}

}  // namespace

Reference reference_at(std::string_view text, std::size_t at) {
    Reference reference;
    if (text[at] == '$') {
        name_at(text, at, at + 1, Reference::variable, reference);
        return reference;
    }
    const std::size_t close = text.find_first_of("[]", at + 1);
    if (close == text.npos || text[close] == '[') {
        reference.kind = Reference::broken;
        return reference;
    }
    reference.section = text.substr(at + 1, close - at - 1);
    if (reference.section.find("..") != text.npos) {
        reference.length = close + 1 - at;
        return reference;
    }
    name_at(text, at, close + 1, Reference::key, reference);
    return reference;
}

}  // namespace hal
