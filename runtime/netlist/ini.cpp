// SPDX-License-Identifier: MIT
#include <filesystem>

#include "hal/read_file.hpp"
#include "netlist/line.hpp"
#include "netlist/netlist.hpp"

namespace hal {

namespace {

constexpr std::size_t largest_file = std::size_t{1} << 30;  // spans count bytes in 32 bits
constexpr int deepest_include = 16, most_includes = 1000;

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && (is_blank(text.back()) || text.back() == '\r')) text.remove_suffix(1);
    return text;
}

}  // namespace

std::optional<std::uint32_t> read_source(Sources& sources, const std::string& path, Span asked, Diagnostics& diagnostics) {
    std::string text;
    if (read_regular_file(path, largest_file, text)) return sources.add(path, std::move(text));
    diagnostics.error("unreadable-file", asked, "cannot read '" + path + "': " + text);
    return std::nullopt;
}

/// Reads one file into an Ini, and the files it includes where they are named.
class IniReader {
public:
    IniReader(Ini& ini, Sources& sources, Diagnostics& diagnostics) : ini_(ini), sources_(sources), diagnostics_(diagnostics) {}

    void read(const std::string& path, Span asked, int depth) {
        const std::optional<std::uint32_t> source = read_source(sources_, path, asked, diagnostics_);
        if (!source) return;
        LineReader reader(sources_, *source);
        Line line;
        while (reader.next(line)) {
            if (const auto at = reader.control(); at && line.text()[*at] == '\0')
                return diagnostics_.error("binary-text", line.span(*at, *at + 1), "this is not a text file", "a control character",
                                          "an INI file is plain text in UTF-8");
            entry(line, path, depth);
        }
    }

private:
    void entry(const Line& line, const std::string& path, int depth) {
        const std::string_view text = trimmed(line.text());
        if (text.empty() || text[0] == ';') return;
        const auto begin = static_cast<std::size_t>(text.data() - line.text().data());
        const Span span = line.span(begin, begin + text.size());
        constexpr std::string_view include = "#INCLUDE";
        if (text.starts_with(include) && text.size() > include.size() && is_blank(text[include.size()])) {
            if (depth == deepest_include || ++includes_ > most_includes)
                return diagnostics_.error("bad-ini-line", span, "INI files include each other more than 16 deep or 1000 times", "",
                                          "does a file include itself?");
            const std::filesystem::path named{trimmed(text.substr(include.size()))};
            return read(named.is_absolute() ? named : std::filesystem::path(path).parent_path() / named, span, depth + 1);
        }
        if (text[0] == '#') return;
        if (text[0] == '[') {
            const std::size_t close = text.find(']');
            if (close == text.npos) return odd(span, "this section name has no ]");
            section_ = text.substr(1, close - 1);
            return;
        }
        const std::size_t equals = text.find('=');
        if (equals == text.npos || equals == 0) return odd(span, "this line is neither [SECTION] nor KEY = value, and is ignored");
        ini_.add(section_, trimmed(text.substr(0, equals)), trimmed(text.substr(equals + 1)));
    }

    void odd(Span at, std::string message) {
        if (++odd_ <= 20) diagnostics_.warning("bad-ini-line", at, std::move(message));
    }

    Ini& ini_;
    Sources& sources_;
    Diagnostics& diagnostics_;
    std::string section_;
    int odd_ = 0, includes_ = 0;
};

Ini Ini::read(Sources& sources, const std::string& path, Diagnostics& diagnostics) {
    Ini ini;
    IniReader(ini, sources, diagnostics).read(path, {}, 0);
    return ini;
}

namespace {

std::string bracketed(std::string_view section, std::string_view key) { return "[" + std::string(section) + "]" + std::string(key); }

}  // namespace

void Ini::add(std::string_view section, std::string_view key, std::string_view value) {
    first_.try_emplace(bracketed(section, key), entries_.size());
    first_.try_emplace(bracketed("", key), entries_.size());
    entries_.push_back({std::string(section), std::string(key), std::string(value)});
}

std::optional<std::string> Ini::get(std::string_view section, std::string_view key) const {
    const auto found = first_.find(bracketed(section, key));
    return found == first_.end() ? std::nullopt : std::optional(entries_[found->second].value);
}

std::vector<std::string> Ini::all(std::string_view section, std::string_view key) const {
    std::vector<std::string> values;
    for (const Entry& entry : entries_)
        if (entry.key == key && (section.empty() || entry.section == section)) values.push_back(entry.value);
    return values;
}

std::vector<std::string> Ini::names() const {
    std::vector<std::string> names;
    names.reserve(entries_.size());
    for (const Entry& entry : entries_) names.push_back(bracketed(entry.section, entry.key));
    return names;
}

}  // namespace hal
