// SPDX-License-Identifier: MIT
// Documentation strings are written in the macros of manual pages (groff_man); ours is Markdown.
#include <algorithm>
#include <utility>

#include "base/types.hpp"
#include "comp/syntax.hpp"
#include "text/quoting.hpp"

namespace hal::comp {
namespace {

/// Returns the character of the two-letter name behind `\(`, "" for an unknown one.
const char* character_named(std::string_view name) {
    static constexpr std::pair<std::string_view, const char*> characters[] = {
        {"bu", "•"}, {"em", "—"}, {"en", "–"}, {"mu", "×"}, {"di", "÷"}, {"+-", "±"}, {"<=", "≤"},
        {">=", "≥"}, {"!=", "≠"}, {"->", "→"}, {"<-", "←"}, {"de", "°"}, {"aq", "'"}, {"dq", "\""},
        {"lq", "“"}, {"rq", "”"}, {"co", "©"}, {"mc", "µ"}, {"*p", "π"}, {"sr", "√"}};
    const auto found =
        std::ranges::find(characters, name, &std::pair<std::string_view, const char*>::first);
    return found == std::end(characters) ? "" : found->second;
}

/// Returns what begins and ends the font in Markdown.
std::string_view mark_of_font(char font) {
    if (font == 'B') return "**";
    if (font == 'I') return "*";
    return "";
}

/// Converts the escapes within a line: fonts, dashes, bullets.
class EscapeConverter {
public:
    explicit EscapeConverter(std::string_view line) : line_(line) {}

    std::string convert() {
        while (at_ < line_.size()) {
            const char c = line_[at_++];
            if (c != '\\' || at_ == line_.size()) {
                out_ += c;
            } else {
                escape(line_[at_++]);
            }
        }
        out_ += open_;
        return std::move(out_);
    }

private:
    static bool is_one_of(char c, std::string_view set) { return set.find(c) != set.npos; }

    void escape(char c) {
        if (c == 'f' && at_ < line_.size()) {
            font(line_[at_++]);
        } else if (c == '(' && at_ + 1 < line_.size()) {
            out_ += character_named(line_.substr(at_, 2));
            at_ += 2;
        } else if (c == 'e' || c == '\\') {
            out_ += '\\';
        } else if (is_one_of(c, "&|^/,c:")) {
            return;  // has no width
        } else if (c == '"') {
            at_ = line_.size();  // a comment
        } else if (is_one_of(c, "~ 0")) {
            out_ += ' ';
        } else {
            out_ += c;  // \- and the like
        }
    }

    /// `which`: the letter behind `\f`; a longer name begins with [ or (.
    void font(char which) {
        out_ += open_;
        open_ = mark_of_font(which);
        out_ += open_;
        const std::size_t letter = at_ - 1;
        if (which == '[') {
            at_ = std::min(line_.find(']', letter), line_.size() - 1) + 1;
        } else if (which == '(') {
            at_ = std::min(letter + 3, line_.size());
        }
    }

    std::string_view line_;
    std::size_t at_ = 0;
    std::string out_;
    std::string_view open_;  // what ends the font in use
};

std::string inline_text(std::string_view line) { return EscapeConverter(line).convert(); }

std::string_view trimmed(std::string_view text) {
    const std::size_t begin = text.find_first_not_of(" \t\n");
    return begin == std::string_view::npos
               ? std::string_view()
               : text.substr(begin, text.find_last_not_of(" \t\n") - begin + 1);
}

// The arguments of a macro: words, or in quotes.
std::vector<std::string> arguments(std::string_view line) {
    std::vector<std::string> all;
    for (std::size_t i = 0; i < line.size();) {
        if (line[i] == ' ' || line[i] == '\t') {
            ++i;
            continue;
        }
        const bool quoted = line[i] == '"';
        std::size_t end = quoted ? line.find('"', i + 1) : line.find_first_of(" \t", i);
        end = std::min(end, line.size());
        all.emplace_back(line.substr(i + quoted, end - i - quoted));
        i = end + quoted;
    }
    return all;
}

class Converter {
public:
    std::string convert(std::string_view text) {
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t end = std::min(text.find('\n', at), text.size());
            line(text.substr(at, end - at));
            at = end + 1;
        }
        if (verbatim_) {
            verbatim(false);
        }
        return std::string(trimmed(out_));
    }

private:
    void paragraph() {
        while (out_.ends_with(' ')) {
            out_.pop_back();
        }
        if (!out_.empty() && !out_.ends_with("\n\n")) {
            out_ += out_.ends_with('\n') ? "\n" : "\n\n";
        }
    }
    void verbatim(bool on) {
        if (on == verbatim_) return;
        if (on) {
            paragraph();
        }
        out_ += "```\n";
        verbatim_ = on;
    }
    void line(std::string_view line) {
        if (line.starts_with(".") || line.starts_with("'\\\"")) return macro(line);
        if (verbatim_) return void((out_ += raw_text(line)) += '\n');
        if (tag_ && !trimmed(line).empty()) {  // the line behind .TP is what the paragraph explains
            tag_ = false;
            return void(out_ += "**" + std::string(trimmed(plain(inline_text(line)))) + "**\n");
        }
        (out_ += inline_text(line)) += '\n';
    }
    /// A macro with its arguments, whose escapes are converted.
    struct Macro {
        std::string_view name;
        std::vector<std::string> words;
        std::string all;  ///< the words, separated by blanks
    };
    struct MacroRow {
        std::string_view name;
        void (Converter::*convert)(const Macro& macro);
    };

    static Macro parse_macro(std::string_view line) {
        const std::size_t end = std::min(line.find_first_of(" \t", 1), line.size());
        Macro macro{line.substr(1, end - 1), arguments(line.substr(end)), {}};
        for (std::string& word : macro.words) {
            word = inline_text(word);
            append_item(macro.all, word, " ");
        }
        return macro;
    }

    void begin_verbatim(const Macro&) { verbatim(true); }
    void end_verbatim(const Macro&) { verbatim(false); }
    void begin_paragraph(const Macro&) { paragraph(); }
    void ignore(const Macro&) {}

    void break_line(const Macro&) {
        if (out_.empty() || verbatim_) return;
        if (out_.ends_with('\n')) {
            out_.insert(out_.size() - 1, "\\");
        } else {
            out_ += "\\\n";
        }
    }

    void tagged_paragraph(const Macro&) {
        paragraph();
        tag_ = true;
    }

    void indented_paragraph(const Macro& macro) {
        paragraph();
        const std::string mark = macro.words.empty() ? "" : plain(macro.words[0]);
        const bool is_bullet =
            mark == "•" || mark == "-" || mark == "*" || mark == "o" || mark == "·";
        if (is_bullet) {
            out_ += "- ";
        } else if (!mark.empty()) {
            out_ += "**" + mark + "**\n";
        }
    }

    void heading(const Macro& macro) {
        paragraph();
        out_ += (macro.name == "SH" ? "## " : "### ") + macro.all + "\n\n";
    }

    void bold(const Macro& macro) { out_ += "**" + macro.all + "**\n"; }
    void italic(const Macro& macro) { out_ += "*" + macro.all + "*\n"; }

    static bool is_fonts_in_turn(std::string_view name) {
        return name.size() == 2 && name.find_first_not_of("BIR") == std::string_view::npos;
    }
    /// The words have the two fonts in turn, without blanks between them.
    void fonts_in_turn(const Macro& macro) {
        for (std::size_t i = 0; i < macro.words.size(); ++i) {
            const std::string_view mark = mark_of_font(macro.name[i % 2]);
            out_ += mark;
            out_ += macro.words[i];
            out_ += mark;
        }
        out_ += '\n';
    }

    void macro(std::string_view line) {
        static const std::vector<MacroRow> rows{
            {"nf", &Converter::begin_verbatim},
            {"EX", &Converter::begin_verbatim},
            {"fi", &Converter::end_verbatim},
            {"EE", &Converter::end_verbatim},
            {"P", &Converter::begin_paragraph},
            {"PP", &Converter::begin_paragraph},
            {"LP", &Converter::begin_paragraph},
            {"sp", &Converter::begin_paragraph},
            {"RS", &Converter::begin_paragraph},
            {"RE", &Converter::begin_paragraph},
            {"br", &Converter::break_line},
            {"TP", &Converter::tagged_paragraph},
            {"TQ", &Converter::tagged_paragraph},
            {"IP", &Converter::indented_paragraph},
            {"HP", &Converter::indented_paragraph},
            {"SH", &Converter::heading},
            {"SS", &Converter::heading},
            {"B", &Converter::bold},
            {"SB", &Converter::bold},
            {"I", &Converter::italic},
            {"", &Converter::ignore},
            {"TH", &Converter::ignore},
            {"ft", &Converter::ignore},
            {"ad", &Converter::ignore},
            {"na", &Converter::ignore},
            {"in", &Converter::ignore},
            {"ti", &Converter::ignore},
        };
        if (line.starts_with(".B") || line.starts_with(".I ")) {
            tag_ = false;
        }
        const Macro macro = parse_macro(line);
        const auto row = std::find_if(rows.begin(), rows.end(),
                                      [&](const MacroRow& one) { return one.name == macro.name; });
        if (row != rows.end()) {
            (this->*row->convert)(macro);
        } else if (is_fonts_in_turn(macro.name)) {
            fonts_in_turn(macro);
        } else if (!macro.name.starts_with("\\\"")) {
            (out_ += inline_text(line)) += '\n';  // not a macro after all: ".5 is a half"
        }
    }
    static std::string plain(std::string text) {
        std::erase(text, '*');
        return text;
    }
    static std::string raw_text(std::string_view line) { return plain(inline_text(line)); }

    std::string out_;
    bool verbatim_ = false;
    bool tag_ = false;
};

std::string joined(const std::vector<Text>& texts, const char* between) {
    std::string all;
    for (const Text& text : texts) {
        const std::string converted = markdown_of(text.text);
        if (!converted.empty()) {
            append_item(all, converted, between);
        }
    }
    return all;
}

}  // namespace

std::string markdown_of(std::string_view text) { return Converter().convert(text); }

std::string line_of(std::string_view text) {
    std::string line;
    for (const char c : markdown_of(text)) {
        const bool blank = c == '\n' || c == ' ';
        if (!blank || !line.ends_with(' ')) {
            line += blank ? ' ' : c;
        }
    }
    return std::string(trimmed(line));
}

std::string manual(const Tree& tree) {
    std::string all = joined(tree.description, "\n\n");
    const auto section = [&](const char* title, const std::vector<Text>& texts,
                             const char* between) {
        if (const std::string text = joined(texts, between); !text.empty()) {
            all += (all.empty() ? "## " : "\n\n## ") + std::string(title) + "\n\n" + text;
        }
    };
    // what an instance without load arguments does not show
    std::vector<Text> personal;
    for (const Item& item : tree.items) {
        if (!item.condition.given() && !item.count.given()) continue;
        static constexpr const char* dirs[] = {"in", "out", "io", "rw"};
        std::string row = "- " + item.name.hal + " (" + name(item.type) + " " +
                          dirs[static_cast<std::size_t>(item.dir)] + ")";
        if (item.count.given()) {
            row += ", as many as " + item.count.text + " and at most " + std::to_string(item.size);
        }
        if (item.condition.given()) {
            row += ", if " + item.condition.text;
        }
        if (const std::string doc = line_of(item.doc.text); !doc.empty()) {
            row += ": " + doc;
        }
        personal.push_back({row, item.name.span});
    }
    section("Pins that depend on the personality", personal, "\n");
    section("Examples", tree.examples, "\n\n");
    section("Notes", tree.notes, "\n\n");
    section("See also", tree.see_also, ", ");
    section("Author", tree.author, "\n\n");
    section("License", tree.license, "\n\n");
    return all;
}

}  // namespace hal::comp
