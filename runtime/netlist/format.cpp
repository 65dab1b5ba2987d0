// SPDX-License-Identifier: MIT
// `hal fmt`. Works on the text itself: nothing is substituted, nothing expanded.
#include <algorithm>
#include <array>

#include "netlist/line.hpp"
#include "netlist/netlist.hpp"

namespace hal {

namespace {

constexpr std::size_t line_width = 100;   // up to which continuation lines are joined
// a longer word does not push the columns of its neighbours
constexpr std::size_t widest_cell = 60;
constexpr std::size_t max_blank_lines = 2;

/// What fills a column when lines are aligned: words with a blank between them.
using Cells = std::vector<std::string>;

/// One command as it will be written.
struct Row {
    Cells cells;
    std::string comment;
};

std::size_t width(std::string_view text) {
    return static_cast<std::size_t>(
        std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

class Formatter {
public:
    Formatter(const Sources& sources, std::uint32_t source, Diagnostics& diagnostics)
        : sources_(sources), source_(source), diagnostics_(diagnostics) {}

    std::string run() {
        const std::string& text = sources_.get(source_).text;
        Diagnostics found;
        check_syntax(sources_, source_, found);
        const bool good = !found.failed();
        diagnostics_.take(found);
        if (!good) return text;

        out_.reserve(text.size() + text.size() / 8);
        LineReader reader(sources_, source_);
        while (reader.next(line_)) {
            line(reader.continued());
        }
        flush();
        // A word that begins with a byte-order mark must not lose it by becoming the first of the
        // file.
        if (out_.starts_with("\xEF\xBB\xBF")) {
            out_.insert(0, "\n");
        }
        return std::move(out_);
    }

private:
    void line(bool continued) {
        const std::string_view text = line_.text();
        const std::size_t comment = scan_quotes(text).comment;
        const std::vector<std::string_view> words = words_of(text.substr(0, comment));
        const std::string remark = comment < text.size() ? comment_text(comment) : "";
        if (words.empty() && remark.empty()) {
            flush();
            ++blank_lines_;
            return;
        }
        if (words.empty()) {
            flush();
            begin_line();
            end_line(remark);
            after_comment_ = true;
            return;
        }
        // a new part: its title stands apart
        if (words[0] == "node" && (words.size() < 2 || words[1] != "=")) {
            flush();
            if (!after_comment_) {
                blank_lines_ = std::max<std::size_t>(blank_lines_, 1);
            }
        }
        after_comment_ = false;
        if (continued && write_with_breaks(words, remark)) return;
        const std::string kind(words.size() > 1 && words[1] == "=" ? words[1] : words[0]);
        if (kind != kind_) {
            flush();
        }
        kind_ = kind;
        rows_.push_back({cells(words), remark});
    }

    /// The comment as it stands in the source, with the lines a `\` joined to it.
    std::string comment_text(std::size_t comment) const {
        std::string_view raw = sources_.text(line_.span(comment, line_.text().size()));
        std::string text;
        for (const char c : raw) {
            if (c != '\r') {
                text += c;
            }
        }
        while (!text.empty() && (is_blank(text.back()) || text.back() == '\n')) {
            text.pop_back();
        }
        return text;
    }

    static std::vector<std::string_view> words_of(std::string_view text) {
        while (!text.empty() && is_blank(text.back())) {
            text.remove_suffix(1);
        }
        std::vector<std::string_view> words;
        for (std::size_t at = 0;;) {
            at = end_of_run(text, at, is_blank);
            if (at == text.size()) return words;
            const std::size_t stop = word_end(text, at);
            words.push_back(text.substr(at, stop - at));
            // Whether a `[` in these belongs to a pattern depends on the INI file: they stay as
            // they are.
            if (words[0] == "show" || words[0] == "list") {
                return {text.substr(at)};
            }
            at = stop;
        }
    }

    /// The end of the word at `at`: blanks between quotes and in the names of references do not end
    /// it.
    static std::size_t word_end(std::string_view text, std::size_t at) {
        char quote = 0;
        while (at < text.size() && (quote != 0 || !is_blank(text[at]))) {
            const char c = text[at];
            if (c == '$' || c == '[') {
                at += reference_at(text, at).length;
                continue;
            }
            if (quote == 0 && (c == '"' || c == '\'')) {
                quote = c;
            } else if (c == quote) {
                quote = 0;
            }
            ++at;
        }
        return at;
    }

    /// Writes a command that is too long for one line with the line breaks that its user gave it.
    /// Returns false, and writes nothing, for one that fits or has none.
    bool write_with_breaks(const std::vector<std::string_view>& words, const std::string& remark) {
        if (joined_width(words) <= line_width) return false;
        const std::string text = with_breaks(words);
        const bool has_breaks = text.find('\n') != text.npos;
        if (!has_breaks) return false;
        flush();
        begin_line();
        out_ += text;
        if (!remark.empty()) {
            out_ += "  ";
        }
        end_line(remark);
        return true;
    }
    static std::size_t joined_width(const std::vector<std::string_view>& words) {
        std::size_t total = words.size() - 1;  // the blanks between them
        for (const std::string_view word : words) {
            total += width(word);
        }
        return total;
    }
    /// The words of the line, with a break where the source has one between two of them. A break
    /// inside a word joins its parts.
    std::string with_breaks(const std::vector<std::string_view>& words) const {
        std::string text;
        std::uint32_t previous_end = 0;
        for (const std::string_view word : words) {
            const auto at = static_cast<std::size_t>(word.data() - line_.text().data());
            const Span span = line_.span(at, at + word.size());
            if (!text.empty()) {
                const std::string_view gap = sources_.text({source_, previous_end, span.begin});
                const bool is_broken = gap.find('\n') != gap.npos;
                text += is_broken ? " \\\n    " : " ";
            }
            text += word;
            previous_end = span.end;
        }
        return text;
    }

    /// Words grouped into columns. The first column is the command, the last one is never padded.
    static Cells cells(const std::vector<std::string_view>& words) {
        static constexpr std::array<std::string_view, 10> tables{
            "setp",   "sets",   "addf",   "delf",  "initf",
            "newsig", "linkps", "linksp", "alias", "newthread"};
        Cells cells{std::string(words[0])};
        const bool table = std::find(tables.begin(), tables.end(), words[0]) != tables.end() ||
                           (words.size() > 1 && words[1] == "=");
        const bool net = words[0] == "net";
        // net: the signal, the pins in front of the first arrow, the rest. loadrt: the component,
        // the rest.
        std::size_t columns = 2;
        if (table) {
            columns = 6;
        } else if (words[0] == "loadrt") {
            columns = 3;
        }
        for (std::size_t i = 1; i < words.size(); ++i) {
            const bool next =
                net ? i <= 2 || (cells.size() == 3 && is_arrow(words[i])) : cells.size() < columns;
            if (next) {
                cells.emplace_back(words[i]);
            } else {
                cells.back().append(" ").append(words[i]);
            }
        }
        return cells;
    }

    /// Writes the block of equal commands met so far, its columns aligned.
    void flush() {
        const std::vector<std::size_t> widths = column_widths(rows_);
        std::vector<std::string> lines;
        std::size_t comment_column = 0;
        for (const Row& row : rows_) {
            lines.push_back(aligned(row.cells, widths));
            const std::size_t length = width(lines.back());
            if (!row.comment.empty() && length <= line_width) {
                comment_column = std::max(comment_column, length);
            }
        }
        for (std::size_t i = 0; i < rows_.size(); ++i) {
            begin_line();
            out_ += lines[i];
            if (!rows_[i].comment.empty()) {
                pad(out_, width(lines[i]), comment_column);
                out_ += "  ";
            }
            end_line(rows_[i].comment);
        }
        rows_.clear();
    }
    /// The last cell of a row has no column, and a cell that is too wide does not widen its own.
    static std::vector<std::size_t> column_widths(const std::vector<Row>& rows) {
        std::vector<std::size_t> widths;
        for (const Row& row : rows) {
            for (std::size_t i = 0; i + 1 < row.cells.size(); ++i) {
                if (widths.size() <= i) {
                    widths.push_back(0);
                }
                const std::size_t cell = width(row.cells[i]);
                if (cell <= widest_cell) {
                    widths[i] = std::max(widths[i], cell);
                }
            }
        }
        return widths;
    }
    static std::string aligned(const Cells& cells, const std::vector<std::size_t>& widths) {
        std::string text;
        for (std::size_t i = 0; i + 1 < cells.size(); ++i) {
            text += cells[i];
            pad(text, width(cells[i]), widths[i]);
            text += ' ';
        }
        return text + cells.back();
    }
    /// Appends blanks to what is `length` wide.
    static void pad(std::string& text, std::size_t length, std::size_t column) {
        if (length < column) {
            text.append(column - length, ' ');
        }
    }

    /// Blank lines that stood here: none at the start of the text, at most two in a row.
    void begin_line() {
        if (!out_.empty()) {
            out_.append(std::min(blank_lines_, max_blank_lines), '\n');
        }
        blank_lines_ = 0;
    }

    void end_line(const std::string& comment) {
        out_ += comment;
        // A backslash that had blanks behind it must not become one that joins lines.
        if (out_.ends_with('\\')) {
            out_ += ' ';
        }
        out_ += '\n';
    }

    const Sources& sources_;
    std::uint32_t source_;
    Diagnostics& diagnostics_;
    Line line_;
    std::string out_;
    std::vector<Row> rows_;  ///< commands of one kind that follow each other
    std::string kind_;
    std::size_t blank_lines_ = 0;
    bool after_comment_ = false;  ///< the line before is one
};

}  // namespace

std::string format(const Sources& sources, std::uint32_t source, Diagnostics& diagnostics) {
    return Formatter(sources, source, diagnostics).run();
}

}  // namespace hal
