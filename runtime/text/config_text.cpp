// SPDX-License-Identifier: MIT
#include "text/config_text.hpp"

#include "text/characters.hpp"

namespace hal::text {

namespace {

bool gap(char c) { return is_blank(c) || c == '\r'; }

}  // namespace

std::string message_text(const std::string& file, Severity severity, Span at,
                         const std::string& sentence, const std::string& help) {
    constexpr const char* severities[] = {"note", "warning", "error"};
    std::string out = file;
    if (at.line != 0) {
        out += ":" + std::to_string(at.line) + ":" + std::to_string(at.column);
    }
    out += std::string(": ") + severities[static_cast<std::size_t>(severity)] + ": " + sentence;
    return help.empty() ? out : out + "; " + help;
}

Lines::Lines(std::string_view text, std::string_view comment) : text_(text), comment_(comment) {
    if (text.starts_with("\xef\xbb\xbf")) {
        at_ = 3;
    }
}

std::optional<Word> Lines::next() {
    while (at_ < text_.size()) {
        const std::size_t begin = at_;
        const std::size_t stop = std::min(text_.find('\n', begin), text_.size());
        at_ = stop + 1;
        ++number_;
        std::size_t end = begin;
        while (end < stop && (comment_.find(text_[end]) == comment_.npos ||
                              (end > begin && !gap(text_[end - 1])))) {
            ++end;
        }
        const std::string_view line = trimmed(text_.substr(begin, end - begin));
        if (line.empty()) continue;
        const auto offset = static_cast<std::size_t>(line.data() - text_.data());
        return Word{std::string(line),
                    {number_, characters(text_.substr(begin, offset - begin)) + 1,
                     static_cast<std::uint32_t>(offset), static_cast<std::uint32_t>(line.size())}};
    }
    return std::nullopt;
}

Word part(const Word& whole, std::size_t begin, std::size_t end) {
    const std::string_view text = whole.text;
    while (begin < end && gap(text[begin])) {
        ++begin;
    }
    while (end > begin && gap(text[end - 1])) {
        --end;
    }
    return {std::string(text.substr(begin, end - begin)),
            {whole.at.line, whole.at.column + characters(text.substr(0, begin)),
             whole.at.offset + static_cast<std::uint32_t>(begin),
             static_cast<std::uint32_t>(end - begin)}};
}

std::vector<Word> list_of(const Word& value, char separator) {
    std::vector<Word> parts;
    for (std::size_t begin = 0; begin <= value.text.size();) {
        const std::size_t end = std::min(value.text.find(separator, begin), value.text.size());
        parts.push_back(part(value, begin, end));
        begin = end + 1;
    }
    return parts;
}

std::vector<Word> words_of(const Word& value, std::string_view more) {
    const auto between = [&](char c) { return gap(c) || more.find(c) != more.npos; };
    std::vector<Word> parts;
    const std::string_view text = value.text;
    for (std::size_t end = 0; end < text.size();) {
        std::size_t begin = end;
        while (begin < text.size() && between(text[begin])) {
            ++begin;
        }
        end = begin;
        while (end < text.size() && !between(text[end])) {
            ++end;
        }
        if (end > begin) {
            parts.push_back(part(value, begin, end));
        }
    }
    return parts;
}

IniLine ini_line(std::string_view line) {
    using Kind = IniLine::Kind;
    IniLine out{Kind::empty, trimmed(line), {}};
    if (out.whole.empty()) return out;
    if (out.whole[0] == '#' || out.whole[0] == ';') {
        out.kind = Kind::comment;
        return out;
    }
    if (out.whole[0] == '[') {
        const std::size_t close = out.whole.find(']');
        out.kind = close == out.whole.npos ? Kind::open_section : Kind::section;
        out.name = out.whole.substr(1, close == out.whole.npos ? close : close - 1);
        if (close != out.whole.npos) {
            out.value = trimmed(out.whole.substr(close + 1));
        }
        return out;
    }
    const std::size_t equals = out.whole.find('=');
    out.kind = equals == out.whole.npos || equals == 0 ? Kind::other : Kind::entry;
    if (out.kind == Kind::entry) {
        out.name = trimmed(out.whole.substr(0, equals));

        out.value = trimmed(out.whole.substr(equals + 1));
    }
    return out;
}

}  // namespace hal::text
