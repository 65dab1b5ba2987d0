// SPDX-License-Identifier: MIT
#include <filesystem>

#include "hal/read_file.hpp"
#include "netlist/line.hpp"
#include "netlist/netlist.hpp"
#include "text/config_text.hpp"

namespace hal {

namespace {

constexpr std::size_t max_file_size = std::size_t{1} << 30;  // spans count bytes in 32 bits
constexpr int deepest_include = 16;
constexpr int max_includes = 1000;

}  // namespace

std::optional<std::uint32_t> read_source(Sources& sources, const std::string& path, Span asked,
                                         Diagnostics& diagnostics) {
    std::string text;
    if (read_regular_file(path, max_file_size, text)) {
        const std::uint32_t source = sources.add(path, std::move(text));
        sources.hold(source);  // its values may be used at any time
        return source;
    }
    diagnostics.error("unreadable-file", asked, "cannot read '" + path + "': " + text);
    return std::nullopt;
}

/// Reads one file into an Ini, and the files it includes where they are named.
class IniReader {
public:
    IniReader(Ini& ini, Sources& sources, Diagnostics& diagnostics)
        : ini_(ini), sources_(sources), diagnostics_(diagnostics) {}

    void read(const std::string& path, Span asked, int depth) {
        const std::optional<std::uint32_t> source =
            read_source(sources_, path, asked, diagnostics_);
        if (!source) return;
        LineReader reader(sources_, *source);
        Line line;
        while (reader.next(line)) {
            if (const auto at = reader.control(); at && line.text()[*at] == '\0') {
                return diagnostics_.error("binary-text", line.span(*at, *at + 1),
                                          "this is not a text file", "a control character",
                                          "an INI file is plain text in UTF-8");
            }
            if (const auto at = reader.carriage_return()) {
                return diagnostics_.error("lone-carriage-return", line.span(*at, *at + 1),
                                          "carriage return without a line feed", "",
                                          line_ends_help);
            }
            entry(line, path, depth);
        }
    }

private:
    void entry(const Line& line, const std::string& path, int depth) {
        using Kind = text::IniLine::Kind;
        const text::IniLine ini = text::ini_line(line.text());
        if (ini.kind == Kind::empty) return;
        const auto begin = static_cast<std::size_t>(ini.whole.data() - line.text().data());
        const Span span = line.span(begin, begin + ini.whole.size());
        switch (ini.kind) {
        case Kind::empty: return;
        case Kind::comment: return include(ini.whole, span, path, depth);
        case Kind::section: section_ = ini.name; return;
        case Kind::open_section: return warn(span, "section name without ']'");
        case Kind::entry:
            return ini_.add({section_, std::string(ini.name), std::string(ini.value),
                             value_span(line, ini.value)});
        case Kind::other:
            return warn(span, "invalid line, ignored: neither [SECTION] nor KEY = value");
        }
    }

    static Span value_span(const Line& line, std::string_view value) {
        const auto begin = static_cast<std::size_t>(value.data() - line.text().data());
        return line.span(begin, begin + value.size());
    }

    /// Reads the file that the comment `#INCLUDE FILE` names.
    void include(std::string_view comment, Span span, const std::string& path, int depth) {
        constexpr std::string_view word = "#INCLUDE";
        if (!comment.starts_with(word) || comment.size() == word.size() ||
            !is_blank(comment[word.size()])) {
            return;
        }
        if (depth == deepest_include || ++includes_ > max_includes) {
            return diagnostics_.error(
                "bad-ini-line", span,
                "INI files include each other more than 16 deep or 1000 times", "",
                "does a file include itself?");
        }
        const std::filesystem::path named{trimmed(comment.substr(word.size()))};
        read(named.is_absolute() ? named : std::filesystem::path(path).parent_path() / named, span,
             depth + 1);
    }

    void warn(Span at, std::string message) {
        if (++warned_ <= text::max_errors + 1) {
            diagnostics_.warning("bad-ini-line", at, std::move(message));
        }
    }

    Ini& ini_;
    Sources& sources_;
    Diagnostics& diagnostics_;
    std::string section_;
    std::size_t warned_ = 0;
    int includes_ = 0;
};

Ini Ini::read(Sources& sources, const std::string& path, Diagnostics& diagnostics) {
    Ini ini;
    IniReader(ini, sources, diagnostics).read(path, {}, 0);
    return ini;
}

namespace {

std::string bracketed(std::string_view section, std::string_view key) {
    return "[" + std::string(section) + "]" + std::string(key);
}

}  // namespace

void Ini::add(Entry entry) {
    first_.try_emplace(bracketed(entry.section, entry.key), entries_.size());
    first_.try_emplace(bracketed("", entry.key), entries_.size());
    entries_.push_back(std::move(entry));
}

const Ini::Entry* Ini::find(std::string_view section, std::string_view key) const {
    const auto found = first_.find(bracketed(section, key));
    return found == first_.end() ? nullptr : &entries_[found->second];
}

std::optional<std::string> Ini::get(std::string_view section, std::string_view key) const {
    const Entry* const entry = find(section, key);
    return entry ? std::optional(entry->value) : std::nullopt;
}

std::vector<std::string> Ini::all(std::string_view section, std::string_view key) const {
    std::vector<std::string> values;
    for (const Entry& entry : entries_) {
        if (entry.key == key && (section.empty() || entry.section == section)) {
            values.push_back(entry.value);
        }
    }
    return values;
}

std::vector<std::string> Ini::names() const {
    std::vector<std::string> names;
    names.reserve(entries_.size());
    for (const Entry& entry : entries_) {
        names.push_back(bracketed(entry.section, entry.key));
    }
    return names;
}

}  // namespace hal
