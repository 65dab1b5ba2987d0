// SPDX-License-Identifier: MIT
// Diagnostics as text. Everything printed here may come from a hostile file: it is windowed and
// escaped.
#include <algorithm>

#include "text/diagnostic.hpp"
#include "text/glyphs.hpp"
#include "text/quoting.hpp"
#include "text/rendered_order.hpp"
#include "text/typed_command.hpp"

namespace hal {

namespace {

constexpr std::size_t window_columns = 100;  // of a source line that is longer
constexpr std::size_t columns_before = 40;   // shown in front of the place
constexpr std::size_t max_bytes = 8 * window_columns;  // of a window; characters may have no width
constexpr std::size_t tab_stop = 8;
constexpr std::string_view ellipsis = "…";

struct Style {
    const char *error = "", *warning = "", *note = "", *gutter = "", *strong = "", *off = "";
    const char* of(Severity severity) const {
        if (severity == Severity::error) return error;
        if (severity == Severity::warning) return warning;
        return note;
    }
};
constexpr Style plain{};
constexpr Style colored{"\033[1;31m", "\033[1;33m", "\033[1;36m", "\033[34m", "\033[1m", "\033[0m"};

constexpr const char* word(Severity severity) {
    if (severity == Severity::error) return "error";
    if (severity == Severity::warning) return "warning";
    return "note";
}

/// A label with the columns its span has in the row being drawn.
struct Mark {
    const Label* label = nullptr;
    bool main = false;
    std::uint32_t line = 0;
    std::size_t begin = 0;
    std::size_t end = 0;  ///< bytes from the start of the line
    std::size_t column = 0;
    std::size_t column_end = std::string::npos;
    bool visible = false;
};

std::string right_aligned(std::string_view text, std::size_t width) {
    return std::string(width > text.size() ? width - text.size() : 0, ' ').append(text);
}

class Renderer {
public:
    Renderer(const Diagnostic& diagnostic, const Sources& sources, const Style& style)
        : diagnostic_(diagnostic), sources_(sources), style_(style) {}

    std::string render() {
        header();
        collect();
        while (!marks_.empty()) {
            row();
        }
        for (const Label& label : diagnostic_.labels) {
            if (!label.span.known() && !label.text.empty()) {
                line_of("= note: ", label.text);
            }
        }
        for (const std::string& help : diagnostic_.help) {
            line_of("= help: ", as_typed(help));
        }
        return std::move(out_);
    }

private:
    void header() {
        const Span at = diagnostic_.labels.empty() ? Span{} : diagnostic_.labels[0].span;
        if (at.known()) {
            out_ += printable(sources_.location(at), std::string::npos) + ": ";
        }
        out_ += style_.of(diagnostic_.severity) + std::string(word(diagnostic_.severity)) + ": " +
                style_.off;
        out_ += style_.strong + printable(diagnostic_.message) + style_.off + " [" +
                std::string(diagnostic_.code.name()) + "]\n";
    }

    void collect() {
        for (const Label& label : diagnostic_.labels) {
            if (!label.span.known() || sources_.get(label.span.source).text.empty()) continue;
            // Where the line starts: `place` counts characters, carets need bytes.
            const std::string_view text = sources_.get(label.span.source).text;

            const std::string_view line = sources_.line(label.span);
            const std::size_t start = line.data() == nullptr
                                          ? text.size()
                                          : static_cast<std::size_t>(line.data() - text.data());
            Mark mark{.label = &label,
                      .main = &label == diagnostic_.labels.data(),
                      .line = sources_.place(label.span).line};
            mark.begin = std::min<std::size_t>(
                label.span.begin - std::min<std::size_t>(start, label.span.begin), line.size());
            mark.end = std::clamp<std::size_t>(
                label.span.end - std::min<std::size_t>(start, label.span.end), mark.begin,
                line.size());
            marks_.push_back(mark);
            gutter_ = std::max(gutter_, std::to_string(mark.line).size());
        }
    }

    /// Draws the first mark left, and with it all others that are to be seen in the same piece of
    /// the same line.
    void row() {
        const Mark first = marks_[0];
        const Span span = first.label->span;
        if (!first.main && span.source != shown_source_) {
            out_ += style_.gutter + right_aligned("in", gutter_) + style_.off + " " +
                    printable(sources_.location(span), std::string::npos) + "\n";
        }
        shown_source_ = span.source;

        const std::string text = lay_out(sources_.line(span), first);
        gutter(right_aligned(std::to_string(first.line), gutter_));
        out_ += text;
        out_.resize(out_.find_last_not_of(' ') + 1);
        out_ += "\n";

        std::vector<Mark> drawn;
        std::erase_if(marks_, [&](const Mark& mark) {
            if (mark.visible) {
                drawn.push_back(mark);
            }
            return mark.visible;
        });
        // The text of the place that ends last stands beside its underline, the others below, from
        // right to left.
        std::stable_sort(drawn.begin(), drawn.end(),
                         [](const Mark& a, const Mark& b) { return a.column_end > b.column_end; });
        underline(drawn);
        for (std::size_t i = 1; i < drawn.size(); ++i) {
            if (drawn[i].label->text.empty()) continue;
            gutter(std::string(gutter_, ' '));
            out_ +=
                std::string(drawn[i].column, ' ') + colored_text(drawn[i], drawn[i].label->text);
        }
    }

    void underline(const std::vector<Mark>& drawn) {
        std::size_t width = 0;
        for (const Mark& mark : drawn) {
            width = std::max(width, mark.column_end);
        }
        std::string signs(width, ' ');
        for (const bool main : {false, true}) {  // where two places overlap the main one is seen
            for (const Mark& mark : drawn) {
                if (mark.main == main) {
                    signs.replace(mark.column, mark.column_end - mark.column,
                                  mark.column_end - mark.column, main ? '^' : '-');
                }
            }
        }
        gutter(std::string(gutter_, ' '));
        for (std::size_t at = 0; at < signs.size();) {
            const std::size_t stop = std::min(signs.find_first_not_of(signs[at], at), signs.size());
            const char* color = signs[at] == '-' ? style_.gutter : "";
            if (signs[at] == '^') {
                color = style_.of(diagnostic_.severity);
            }
            out_ += color + signs.substr(at, stop - at) + (*color != 0 ? style_.off : "");
            at = stop;
        }
        const std::string& text = drawn[0].label->text;
        if (!text.empty()) {
            out_ += " " + colored_text(drawn[0], text);
        } else {
            out_ += "\n";
        }
    }

    std::string colored_text(const Mark& mark, const std::string& text) const {
        const char* color = mark.main ? style_.of(diagnostic_.severity) : style_.gutter;
        return color + printable(text) + style_.off + "\n";
    }

    /// The piece of `line` around `first` as it is printed; notes the columns of all marks that lie
    /// in it.
    std::string lay_out(std::string_view line, const Mark& first) {
        const bool fits = line.size() <= max_bytes && width_of(line) <= window_columns;
        const std::size_t start = fits ? 0 : window_start(line, first.begin);
        std::string text(start > 0 ? ellipsis : "");
        std::size_t column = start > 0 ? 1 : 0;
        std::size_t at = start;
        std::vector<Mark*> here;
        for (Mark& mark : marks_) {
            if (mark.label->span.source == first.label->span.source && mark.line == first.line &&
                mark.begin >= start) {
                here.push_back(&mark);
            }
        }
        const auto note = [&](std::size_t from, std::size_t to, std::size_t width) {
            for (Mark* mark : here) {
                if (mark->begin >= from && mark->begin < to) {
                    mark->column = column;
                    mark->visible = true;
                }
                if (mark->end > from && mark->end <= to) {
                    mark->column_end = column + width;
                }
            }
        };
        while (at < line.size() && at < start + max_bytes && column < window_columns) {
            const Glyph glyph = glyph_in(line, at, column);
            note(at, at + glyph.bytes, glyph.columns);
            if (line[at] == '\t') {
                text.append(glyph.columns, ' ');
            } else {
                append_glyph(text, line, at, glyph);
            }
            column += glyph.columns;
            at += glyph.bytes;
        }
        if (at < line.size()) {
            text += ellipsis;
        } else {
            note(at, at + 1, 0);  // places behind the last character
        }
        for (Mark* mark : here) {
            if (mark->visible) {
                mark->column_end = std::max(std::min(mark->column_end, column), mark->column + 1);
            }
        }
        return text;
    }

    /// As glyph_at, with tabs up to their stop.
    static Glyph glyph_in(std::string_view line, std::size_t at, std::size_t column) {
        return line[at] == '\t' ? Glyph{1, tab_stop - column % tab_stop, false}
                                : glyph_at(line, at);
    }

    static std::size_t width_of(std::string_view line) {
        std::size_t column = 0;
        for (std::size_t at = 0; at < line.size();) {
            const Glyph glyph = glyph_in(line, at, column);
            column += glyph.columns;
            at += glyph.bytes;
        }
        return column;
    }

    /// Where the window on a long line begins, so that `place` is in it.
    static std::size_t window_start(std::string_view line, std::size_t place) {
        std::size_t at = place;
        std::size_t before = 0;
        while (at > 0 && place - at < max_bytes / 2) {
            std::size_t previous = at - 1;
            while (previous > 0 && at - previous < 4 && (line[previous] & 0xC0) == 0x80) {
                --previous;
            }
            before += width_of(line.substr(previous, at - previous));
            if (before > columns_before) return at;
            at = previous;
        }
        return at;
    }

    void gutter(const std::string& number) { out_ += style_.gutter + number + " | " + style_.off; }

    void line_of(std::string_view head, const std::string& text) {
        out_ += style_.gutter + std::string(gutter_ + 1, ' ') + std::string(head) + style_.off;
        for (std::size_t at = 0; at <= text.size();) {
            const std::size_t stop = std::min(text.find('\n', at), text.size());
            if (at != 0) {
                out_ += std::string(gutter_ + 1 + head.size(), ' ');
            }
            out_ += printable(std::string_view(text).substr(at, stop - at)) + "\n";
            at = stop + 1;
        }
    }

    const Diagnostic& diagnostic_;
    const Sources& sources_;
    const Style& style_;
    std::string out_;
    std::vector<Mark> marks_;
    std::size_t gutter_ = 5;
    std::uint32_t shown_source_ = 0;
};

}  // namespace

std::string render(const Diagnostic& diagnostic, const Sources& sources, bool color) {
    if (diagnostic.unknown && diagnostic.unknown->among) {
        Diagnostics one;
        one.add(diagnostic);
        one.look_up();
        return Renderer(one.all()[0], sources, color ? colored : plain).render();
    }
    return Renderer(diagnostic, sources, color ? colored : plain).render();
}

std::vector<std::size_t> rendered_order(const Diagnostics& diagnostics) {
    const auto place = [](const Diagnostic& d) {
        return d.labels.empty() ? Span{} : d.labels[0].span;
    };
    std::vector<std::uint32_t> files;  // in order of first mention
    struct Entry {
        std::size_t file;
        std::uint32_t begin;
        std::size_t index;
    };
    std::vector<Entry> entries;
    for (std::size_t i = 0; i < diagnostics.all().size(); ++i) {
        const Span at = place(diagnostics.all()[i]);
        auto file = std::find(files.begin(), files.end(), at.source);
        if (file == files.end()) {
            file = files.insert(files.end(), at.source);
        }
        entries.push_back(
            {static_cast<std::size_t>(file - files.begin()), at.known() ? at.begin : 0, i});
    }
    std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        return a.file != b.file ? a.file < b.file : a.begin < b.begin;
    });
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < std::min(entries.size(), max_rendered); ++i) {
        order.push_back(entries[i].index);
    }
    return order;
}

std::string render(const Diagnostics& diagnostics, const Sources& sources, bool color) {
    std::string out;
    const std::size_t all = diagnostics.all().size();
    const std::vector<std::size_t> order = rendered_order(diagnostics);
    for (const std::size_t i : order) {
        append_item(out, render(diagnostics.all()[i], sources, color), "\n");
    }
    if (all > order.size()) {
        out += "\nand " + std::to_string(all - order.size()) + " more not shown; fix these first\n";
    }
    return out;
}

}  // namespace hal
