// SPDX-License-Identifier: MIT
#include "eds_text.hpp"
#include "text/find_row.hpp"

#include <algorithm>
#include <array>

namespace hal::canopen::eds {

namespace {

constexpr std::size_t max_bytes = 32u << 20;
constexpr std::size_t max_line = 65536;

void append_utf8(std::string& out, std::uint32_t c) {
    const auto add = [&](std::uint32_t byte) { out += static_cast<char>(byte); };
    if (c < 0x80) return add(c);
    if (c < 0x800) {
        add(0xC0 | c >> 6);
        return add(0x80 | (c & 0x3F));
    }
    if (c < 0x10000) {
        add(0xE0 | c >> 12);
        add(0x80 | (c >> 6 & 0x3F));
        return add(0x80 | (c & 0x3F));
    }
    add(0xF0 | c >> 18);
    add(0x80 | (c >> 12 & 0x3F));
    add(0x80 | (c >> 6 & 0x3F));

    add(0x80 | (c & 0x3F));
}

/// Well-formed characters of more than one byte (Unicode, table 3-7): the ranges of the first and
/// of the second byte. All others are 80..BF.
struct Utf8Row {
    unsigned first_min, first_max, second_min, second_max;
    std::size_t bytes;
};
constexpr Utf8Row well_formed[] = {{0xC2, 0xDF, 0x80, 0xBF, 2}, {0xE0, 0xE0, 0xA0, 0xBF, 3},
                                   {0xE1, 0xEC, 0x80, 0xBF, 3}, {0xED, 0xED, 0x80, 0x9F, 3},
                                   {0xEE, 0xEF, 0x80, 0xBF, 3}, {0xF0, 0xF0, 0x90, 0xBF, 4},
                                   {0xF1, 0xF3, 0x80, 0xBF, 4}, {0xF4, 0xF4, 0x80, 0x8F, 4}};

/// Returns the bytes of the UTF-8 character at `at`; 0 for invalid UTF-8.
std::size_t utf8_at(std::string_view text, std::size_t at) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
    };
    for (const Utf8Row& row : well_formed) {
        if (byte(at) < row.first_min || byte(at) > row.first_max) continue;
        if (byte(at + 1) < row.second_min || byte(at + 1) > row.second_max) return 0;
        for (std::size_t i = 2; i < row.bytes; ++i) {
            if ((byte(at + i) & 0xC0) != 0x80) return 0;
        }
        return row.bytes;
    }
    return byte(at) < 0x80 ? 1 : 0;
}

std::size_t first_bad_utf8(std::string_view text) {
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t n = utf8_at(text, at);
        if (n == 0) return at;
        at += n;
    }
    return std::string_view::npos;
}

/// Windows-1252 0x80..0x9F; the five holes are kept as control characters.
constexpr std::array<std::uint16_t, 32> windows{
    0x20AC, 0x81,   0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021, 0x02C6, 0x2030, 0x0160,
    0x2039, 0x0152, 0x8D,   0x017D, 0x8F,   0x90,   0x2018, 0x2019, 0x201C, 0x201D, 0x2022,
    0x2013, 0x2014, 0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0x9D,   0x017E, 0x0178};

std::string from_windows(std::string_view bytes) {
    std::string text;
    text.reserve(bytes.size() + bytes.size() / 8);
    for (const char c : bytes) {
        const auto byte = static_cast<unsigned char>(c);
        append_utf8(text, byte >= 0x80 && byte < 0xA0 ? windows[byte - 0x80u] : byte);
    }
    return text;
}

std::string from_utf16(std::string_view bytes, bool big, bool& whole) {
    std::string text;
    const auto unit = [&](std::size_t i) {
        const unsigned a = static_cast<unsigned char>(bytes[i]);

        const unsigned b = static_cast<unsigned char>(bytes[i + 1]);
        return big ? a << 8 | b : b << 8 | a;
    };
    whole = bytes.size() % 2 == 0;
    for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
        std::uint32_t c = unit(i);
        if (c >= 0xD800 && c < 0xDC00 && i + 3 < bytes.size() &&
            (unit(i + 2) & 0xFC00u) == 0xDC00u) {
            c = 0x10000 + ((c & 0x3FF) << 10) + (unit(i + 2) & 0x3FF);
            i += 2;
        } else if (c >= 0xD800 && c < 0xE000) {
            c = 0xFFFD;
            whole = false;
        }
        append_utf8(text, c);
    }
    return text;
}

std::uint32_t line_of(std::string_view text, std::size_t at) {
    return 1 + static_cast<std::uint32_t>(std::count(
                   text.begin(),
                   text.begin() + static_cast<std::ptrdiff_t>(std::min(at, text.size())), '\n'));
}

}  // namespace

std::string to_string(const Message& message) {
    constexpr std::array<const char*, 3> words{"note", "warning", "error"};
    std::string text;
    if (message.at.line != 0) {
        text = "line " + std::to_string(message.at.line) + ", column " +
               std::to_string(message.at.column) + ": ";
    }
    text +=
        std::string(words[static_cast<std::size_t>(message.severity)]) + ": " + message.sentence;
    return message.help.empty() ? text : text + "; " + message.help;
}

namespace {

/// Adds the messages about the encoding of a file, by their lines.
class EncodingReport {
public:
    explicit EncodingReport(std::vector<Message>& messages) : messages_(messages) {}
    void add(Severity severity, std::uint32_t line, std::string sentence, std::string help) {
        messages_.push_back(
            {severity, Topic::syntax, {line, 1, 0, 0}, std::move(sentence), std::move(help)});
    }
    /// Returns false.
    bool refuse(std::string sentence, std::string help) {
        messages_.push_back({Severity::error,
                             Topic::unreadable,
                             {0, 1, 0, 0},
                             std::move(sentence),
                             std::move(help)});
        return false;
    }

private:
    std::vector<Message>& messages_;
};

/// Returns the text in UTF-8. UTF-16 is recognised by its byte order mark, or by zeros in the high
/// bytes of the first characters; what is not UTF-8 counts as Windows-1252.
std::string to_utf8(std::string_view bytes, EncodingReport& report) {
    const auto starts = [&](std::string_view mark) { return bytes.starts_with(mark); };
    bool whole = true;
    if (starts("\xFF\xFE") || starts("\xFE\xFF")) {
        std::string plain = from_utf16(bytes.substr(2), starts("\xFE\xFF"), whole);
        report.add(Severity::warning, 1, "the file is UTF-16 text",
                   "save it as ASCII: most tools read nothing else");
        if (!whole) {
            report.add(Severity::warning, 1, "truncated UTF-16 characters", "");
        }
        return plain;
    }
    if (bytes.size() >= 4 && bytes[1] == 0 && bytes[3] == 0 && bytes[0] != 0) {
        report.add(Severity::warning, 1, "the file is UTF-16 text without a byte order mark",
                   "save it as ASCII: most tools read nothing else");
        return from_utf16(bytes, false, whole);
    }
    if (starts("\xEF\xBB\xBF")) {
        bytes.remove_prefix(3);
        report.add(Severity::note, 1, "the file begins with a byte order mark",
                   "some tools then miss the first section; save it without");
    }
    const std::size_t bad = first_bad_utf8(bytes);
    if (bad == std::string_view::npos) return std::string(bytes);
    report.add(Severity::note, line_of(bytes, bad),
               "invalid UTF-8; the file was read as Windows-1252", "CiA 306 requires ASCII");
    return from_windows(bytes);
}

/// Returns the text with `\n` as its only line end. `\n` with any number of `\r` before it is one,
/// and a `\r` elsewhere is one, too.
std::string with_plain_line_ends(std::string_view plain, EncodingReport& report) {
    std::string text;
    text.reserve(plain.size());
    bool lone = false;
    for (std::size_t i = 0; i < plain.size(); ++i) {
        if (plain[i] != '\r') {
            text += plain[i];
            continue;
        }
        const std::size_t next = std::min(plain.find_first_not_of('\r', i), plain.size());
        if (next < plain.size() && plain[next] == '\n') {
            i = next - 1;
        } else {
            text += '\n';
            lone = true;
        }
    }
    if (lone) {
        report.add(Severity::note, 1, "lines end with a carriage return only", "");
    }
    return text;
}

/// Returns the offset of the beginning of a line, from 1; the size of the text behind the last one.
std::size_t begin_of_line(std::string_view text, std::uint32_t line) {
    std::size_t at = 0;
    for (std::uint32_t n = 1; n < line; ++n) {
        at = text.find('\n', at);
        if (at == std::string_view::npos) return text.size();
        ++at;
    }
    return std::min(at, text.size());
}

}  // namespace

bool decode(std::string_view bytes, std::string& text, std::vector<Message>& messages) {
    EncodingReport report(messages);
    text.clear();
    if (bytes.size() > max_bytes) {
        return report.refuse("the file is larger than 32 MiB", "is it the right file?");
    }
    std::string plain = to_utf8(bytes, report);
    const auto zeros = static_cast<std::size_t>(std::count(plain.begin(), plain.end(), '\0'));
    if (zeros > plain.size() / 16 + 4) {
        return report.refuse("not a text file",
                             "an EDS consists of [sections] and Key=Value lines");
    }
    if (zeros != 0) {
        report.add(Severity::warning, line_of(plain, plain.find('\0')),
                   "zero byte in the text ignored", "");
        std::erase(plain, '\0');
    }
    text = with_plain_line_ends(plain, report);
    for (Message& message : messages) {
        message.at.offset = static_cast<std::uint32_t>(begin_of_line(text, message.at.line));
    }
    return true;
}

IniKey* IniSection::find(std::string_view key) {
    return find_row_if(keys, [&](const IniKey& one) { return same_word(one.name, key); });
}

IniSection* Ini::find(std::string_view name) {
    const auto found = by_name_.find(lower(name));
    return found == by_name_.end() ? nullptr : &sections_[found->second];
}

/// Reads the lines of a file into its sections.
class Ini::Parser {
public:
    Parser(Ini& ini, std::string_view text, std::vector<Message>& messages)
        : ini_(ini), text_(text), messages_(messages) {}

    void parse() {
        for (std::size_t start = 0; start < text_.size();) {
            const std::size_t stop = std::min(text_.find('\n', start), text_.size());
            ++number_;
            line_start_ = start;
            is_cut_ = stop == text_.size();
            line(trimmed(text_.substr(start, stop - start)));
            start = stop + 1;
        }
    }

private:
    Span place(std::string_view part) const {
        const auto offset = static_cast<std::size_t>(part.data() - text_.data());
        std::uint32_t column = 1;
        for (std::size_t i = line_start_; i < offset; ++i) {
            column += (text_[i] & 0xC0) != 0x80;
        }
        return Span{number_, column, static_cast<std::uint32_t>(offset),
                    static_cast<std::uint32_t>(part.size())};
    }
    void report_as(Severity severity, Topic topic, std::string_view part, std::string sentence,
                   std::string help) {
        messages_.push_back({severity, topic, place(part), std::move(sentence), std::move(help)});
    }
    void report(Severity severity, std::string_view part, std::string sentence, std::string help) {
        report_as(severity, Topic::syntax, part, std::move(sentence), std::move(help));
    }
    void keep(std::string comment) {
        auto& comments = section_ != nullptr ? section_->comments : ini_.preamble_;
        comments.push_back(std::move(comment));
    }

    void line(std::string_view line) {
        if (line.empty()) return;
        if (line.size() > max_line) {
            return report(Severity::warning, line.substr(0, 1),
                          "line of " + std::to_string(line.size()) + " bytes ignored",
                          "the limit is 255 characters");
        }
        using LineKind = text::IniLine::Kind;
        const text::IniLine parts = text::ini_line(line);
        const std::string_view name = trimmed(parts.name);
        switch (parts.kind) {
        case LineKind::comment: return comment(line);
        case LineKind::section:
            if (!parts.value.empty() && parts.value[0] != ';') {
                report(parts.value[0] == '#' ? Severity::note : Severity::warning, parts.value,
                       "text after the section name ignored",
                       "write comments on lines of their own");
            }
            return section(line, name, line.substr(0, line.find(']') + 1));
        case LineKind::open_section:
            report(Severity::warning, line, "section name without ']'",
                   "write [" + std::string(name) + "]");
            return section(line, name, line);
        case LineKind::other: return invalid(line);
        default: return key(line, name, parts.value);
        }
    }

    void comment(std::string_view line) {
        if (line[0] == '#' && line.find('=') != std::string_view::npos) {
            report(Severity::note, line.substr(0, 1), "line that begins with '#' read as a comment",
                   "comments of an EDS begin with ';'");
        }
        keep(std::string(line));
    }

    void invalid(std::string_view line) {
        report(Severity::warning, line,
               line[0] == '=' ? "missing key before '='"
                              : "invalid line: neither a [section] nor Key=Value",
               "the line was kept as a comment; comments begin with ';'");
        keep("; " + std::string(line));
    }

    /// `heading`: the part of the line with the name.
    void section(std::string_view line, std::string_view name, std::string_view heading) {
        keys_.clear();
        const auto [at, fresh] = ini_.by_name_.try_emplace(lower(name), ini_.sections_.size());
        if (fresh) {
            ini_.sections_.push_back({std::string(name), place(heading), {}, {}});
            section_ = &ini_.sections_.back();
            return;
        }
        section_ = &ini_.sections_[at->second];
        report(Severity::warning, line, "duplicate section [" + std::string(name) + "]",
               "first in line " + std::to_string(section_->at.line) +
                   "; keys that are here again replace those");
        for (std::size_t i = 0; i < section_->keys.size(); ++i) {
            keys_.emplace(lower(section_->keys[i].name), i);
        }
    }

    void key(std::string_view line, std::string_view name, std::string_view value) {
        if (section_ == nullptr) return key_outside(line);
        if (is_cut_) {
            report_as(
                Severity::warning, Topic::truncated, line,
                "the file ends within a line: the value of '" + std::string(name) + "' may be cut",
                "copy the file again, or end its last line with a line end");
        }
        IniKey key{std::string(name), std::string(value), place(name),
                   place(value.empty() ? line : value)};
        const auto [at, fresh] = keys_.try_emplace(lower(name), section_->keys.size());
        if (fresh) {
            section_->keys.push_back(std::move(key));
        } else {
            replace(section_->keys[at->second], std::move(key), name);
        }
    }

    void key_outside(std::string_view line) {
        if (!said_outside_) {
            report(Severity::warning, line, "key before the first section",
                   "the lines before the first section were kept as comments");
        }
        said_outside_ = true;
        keep("; " + std::string(line));
    }

    void replace(IniKey& old, IniKey&& key, std::string_view name) {
        const std::string sentence = "duplicate key '" + key.name + "' in [" + section_->name + "]";
        if (old.value == key.value) {
            report(Severity::note, name, sentence, "both have the same value");
        } else {
            report_as(Severity::warning, Topic::conflict, name, sentence,
                      "line " + std::to_string(old.at.line) + " has '" + old.value + "'; '" +
                          key.value + "' is used");
        }
        old = std::move(key);
    }

    Ini& ini_;
    std::string_view text_;
    std::vector<Message>& messages_;
    IniSection* section_ = nullptr;
    std::unordered_map<std::string, std::size_t> keys_;  // of the section being read
    std::uint32_t number_ = 0;
    std::size_t line_start_ = 0;
    bool is_cut_ = false;  // the file ends within the line
    bool said_outside_ = false;
};

void Ini::parse(std::string_view text, std::vector<Message>& messages) {
    Parser(*this, text, messages).parse();
}

}  // namespace hal::canopen::eds
