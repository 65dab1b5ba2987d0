// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>

#include <unistd.h>

#include "netlist/line.hpp"
#include "netlist/netlist.hpp"

namespace hal {

namespace {

constexpr std::size_t max_errors = 20;                     // shown of one source
constexpr std::size_t max_words = 5'000'000;               // of one source: a million nets
// bytes of values in one source: a value may be long, and named often
constexpr std::size_t max_substituted = std::size_t{32} << 20;

std::vector<std::string> environment_names() {
    std::vector<std::string> names;
    for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) {
        names.emplace_back(*entry, std::string_view(*entry).find('='));
    }
    return names;
}

std::string reference_text(std::string_view section, std::string_view key) {
    return "[" + std::string(section) + "]" + std::string(key);
}

class Parser {
public:
    /// Without an environment every reference has a value: only the syntax is looked at.
    Parser(const Sources& sources, std::uint32_t source, const Environment* environment,
           Diagnostics& diagnostics)
        : reader_(sources, source),
          source_(source),
          environment_(environment),
          diagnostics_(diagnostics) {}

    std::vector<Command> run() {
        while (!given_up_ && reader_.next(line_)) {
            parse_line();
        }
        if (reader_.dos_ending() && environment_ != nullptr && !given_up_) {
            diagnostics_.warning("dos-line-endings", *reader_.dos_ending(),
                                 "the lines of this file end in CR LF (DOS line endings)", "",
                                 "harmless here; `hal fmt` converts them to LF");
        }
        if (errors_ > max_errors) {
            diagnostics_.error(
                "too-many-errors", last_error_,
                std::to_string(errors_ - max_errors) + " more errors in this file are not shown",
                "the last of them");
        }
        if (given_up_) {
            commands_.clear();
        }
        return std::move(commands_);
    }

private:
    void error(Code code, Span at, std::string message, std::string label = "",
               std::string help = "") {
        last_error_ = at;
        if (++errors_ <= max_errors) {
            diagnostics_.error(code, at, std::move(message), std::move(label), std::move(help));
        }
    }

    /// Counts an error that will not be shown: no work for its text and suggestions.
    bool hidden(Span at) {
        if (errors_ < max_errors) return false;
        ++errors_;
        last_error_ = at;
        return true;
    }

    void parse_line() {
        const QuoteScan quotes = scan_quotes(line_.text());
        if (!characters_good(quotes.comment)) return;
        if (quotes.open_quote) return unclosed(line_, *quotes.open_quote);
        warn_of_continued_comment(quotes.comment);

        const std::string_view text = line_.text().substr(0, quotes.comment);
        if (text.find_first_of("$[") == text.npos) return split(line_, text);
        if (!substitute(text)) return;
        const QuoteScan after = scan_quotes_only(expanded_.text());
        if (after.open_quote) return unclosed(expanded_, *after.open_quote);
        split(expanded_, expanded_.text());
    }

    /// Reports only the first line of a binary file.
    bool characters_good(std::size_t comment) {
        if (const auto at = reader_.control(); at && (*at < comment || line_.text()[*at] == '\0')) {
            error("binary-text", line_.span(*at, *at + 1), "this is not a text file",
                  "a control character",
                  "a netlist is plain text in UTF-8; the whole file was ignored");
            given_up_ = true;
            return false;
        }
        if (const auto at = reader_.carriage_return()) {
            if (!carriage_return_said_) {
                error("lone-carriage-return", line_.span(*at, *at + 1),
                      "carriage return without a line feed", "", line_ends_help);
            }
            carriage_return_said_ = true;
            return false;
        }
        return true;
    }

    void unclosed(const Line& line, std::size_t quote) {
        const std::string sign(1, line.text()[quote]);
        const bool in_value = !line.verbatim(quote, quote + 1);
        error("unterminated-quote", line.span(quote, quote + 1),
              "the quote " + sign + " is never closed",
              in_value ? "it comes from this value" : "opened here",
              "close it with " + sign +
                  " on the same line; there is no escape character, but one kind of quote may "
                  "appear inside the other");
    }

    void warn_of_continued_comment(std::size_t comment) {
        if (comment == line_.text().size() || !reader_.continued()) return;
        // Two pieces of the source: the comment swallowed at least one more physical line.
        const Span whole = line_.span(comment, line_.text().size());
        if (line_.verbatim(comment, line_.text().size())) return;
        diagnostics_.warning(
            "continued-comment", {source_, whole.begin, whole.begin + 1},
            "this comment ends in \\ and therefore includes the next line, which is not executed",
            "", "remove the \\, or move the comment to the end of the last line");
    }

    /// As scan_quotes, for text whose comment is gone: a `#` from a value is a character like any
    /// other.
    static QuoteScan scan_quotes_only(std::string_view text) {
        for (std::size_t at = text.find_first_of("'\""); at != text.npos;
             at = text.find_first_of("'\"", at + 1)) {
            const std::size_t close = text.find(text[at], at + 1);
            if (close == text.npos) {
                return {text.size(), at};
            }
            at = close;
        }
        return {text.size(), {}};
    }

    /// line_ up to its comment into expanded_, references replaced. False when one of them is
    /// wrong.
    bool substitute(std::string_view text) {
        expanded_.clear(source_);
        const std::size_t command = text.find_first_not_of(" \t\v\f");
        const std::string_view verb =
            command == text.npos
                ? ""
                : text.substr(command, text.find_first_of(" \t\v\f", command) - command);
        // `show pin pid.[01]*`: a `[` that names no key is part of a pattern
        const bool patterns = verb == "show" || verb == "list";
        bool good = true;
        std::size_t done = 0;
        for (std::size_t at = text.find_first_of("$["); at != text.npos;
             at = text.find_first_of("$[", at)) {
            const Reference reference = reference_at(text, at);
            const std::size_t end = at + reference.length;
            const Span span = line_.span(at, end);
            if (reference.kind == Reference::none ||
                (patterns && text[at] == '[' && !names_key(reference))) {
                at = end;
                continue;
            }
            const std::string* value =
                reference.kind == Reference::broken
                    ? broken(text.substr(at, 100), span)
                    : look_up(reference, text.substr(at, reference.length), span);
            good = good && value != nullptr;
            if (good) {
                substituted_ += value->size();
                if (substituted_ > max_substituted) {
                    error("substitution-too-long", span,
                          "the values that replace references in this file exceed 32 MB in total");
                    return false;
                }
                expanded_.append(line_, done, at);
                expanded_.append_value(*value, span);
            }
            at = done = end;
        }
        expanded_.append(line_, done, text.size());
        return good;
    }

    bool names_key(const Reference& reference) const {
        return reference.kind == Reference::key && environment_ != nullptr &&
               environment_->ini != nullptr &&
               environment_->ini->get(reference.section, reference.name);
    }

    const std::string* broken(std::string_view rest, Span at) {
        if (hidden(at)) return nullptr;
        rest = rest.substr(0, rest.find_first_of(" \t"));
        if (rest[0] == '$') {
            error("bad-reference", at, "missing name of an environment variable after '$'", "",
                  "write $NAME or $(NAME)");
        } else if (rest.find("..") != rest.npos) {
            error("bad-range", at, "missing ] of this range", "",
                  "write a range as [0..5], without spaces");
        } else {
            error("bad-reference", at, "'[' does not begin a valid [SECTION]KEY", "",
                  "write [SECTION]KEY or [SECTION](KEY) for a value of the INI file, or [0..5] for "
                  "a range of names");
        }
        return nullptr;
    }

    /// The value a reference (written as `text`) stands for, or null after reporting that there is
    /// none.
    const std::string* look_up(const Reference& reference, std::string_view text, Span at) {
        static const std::string any = "x";
        if (environment_ == nullptr) return &any;
        auto known = values_.find(text);
        if (known == values_.end()) {
            known = values_
                        .emplace(text, reference.kind == Reference::variable
                                           ? variable(std::string(reference.name))
                                           : key(reference))
                        .first;
        }
        if (known->second) return &*known->second;
        if (hidden(at)) return nullptr;
        if (reference.kind == Reference::variable) {
            report_variable(reference, at);
        } else {
            report_key(reference, at);
        }
        return nullptr;
    }

    std::optional<std::string> variable(const std::string& name) const {
        if (environment_->variable) return environment_->variable(name);
        const char* value = std::getenv(name.c_str());
        return value == nullptr ? std::nullopt : std::optional<std::string>(value);
    }

    std::optional<std::string> key(const Reference& reference) const {
        return environment_->ini == nullptr
                   ? std::nullopt
                   : environment_->ini->get(reference.section, reference.name);
    }

    void report_variable(const Reference& reference, Span at) {
        const std::string name(reference.name);
        const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
            return c == '_' || std::isalnum(static_cast<unsigned char>(c));
        });
        error("unset-variable", at, "the environment variable '" + name + "' is not set",
              environment_->variable ? "" : did_you_mean(name, environment_names()),
              "set it before the command: " + (plain ? name + "=…" : "env '" + name + "=…'") +
                  " hal …");
    }

    std::string ini_to_give() const {
        const bool is_known =
            environment_->ini != nullptr && !environment_->ini->candidate().empty();
        return is_known ? environment_->ini->candidate() : "FILE.ini";
    }

    void report_key(const Reference& reference, Span at) {
        const std::string name = reference_text(reference.section, reference.name);
        if (environment_->ini == nullptr || environment_->ini->empty()) {
            const std::string file = ini_to_give();
            return error("unset-ini-key", at,
                         "'" + name + "' has no value: no INI file was given, or it has no keys",
                         "", "specify it with --ini " + file + " (halcmd: -i " + file + ")");
        }
        const std::vector<std::string> names = environment_->ini->names();
        std::vector<std::string> section;
        for (const std::string& candidate : names) {
            if (candidate.starts_with("[" + std::string(reference.section) + "]")) {
                section.push_back(candidate.substr(reference.section.size() + 2));
            }
        }
        const std::string help =
            section.empty() || reference.section.empty()
                ? ""
                : "keys of [" + std::string(reference.section) + "]: " + listed(section);
        error("unset-ini-key", at, "unknown key '" + name + "': not in the INI file",
              did_you_mean(name, names), help);
    }

    void split(const Line& line, std::string_view text) {
        Command command;
        std::size_t at = 0;
        std::size_t first = 0;
        std::size_t last = 0;
        bool named = false;
        const auto word_end = [&](std::size_t from) {
            std::size_t stop = from;
            while (stop < text.size() && !is_blank(text[stop])) {
                const bool quote = text[stop] == '"' || text[stop] == '\'';
                stop = (quote ? text.find(text[stop], stop + 1) : stop) + 1;
            }
            return stop;
        };
        for (;;) {
            at = end_of_run(text, at, is_blank);
            if (at == text.size()) break;
            const std::size_t stop = word_end(at);
            Token token{std::string(text.substr(at, stop - at)), line.span(at, stop)};
            if (++words_ > max_words) {
                given_up_ = true;
                return error("too-many-words", token.span,
                             "this file has more than " + std::to_string(max_words) + " words", "",
                             "it is probably not a netlist; the whole file was ignored");
            }
            if (named) {
                if (command.args.empty()) {
                    command.args.reserve(4);
                }
                command.args.push_back(std::move(token));
            } else {
                first = at;
                command.name = std::move(token);
                named = true;
            }
            at = last = stop;
        }
        if (!named) return;
        command.span = line.span(first, last);
        commands_.push_back(std::move(command));
    }

    LineReader reader_;
    std::uint32_t source_;
    const Environment* environment_;
    Diagnostics& diagnostics_;
    Line line_, expanded_;
    std::vector<Command> commands_;
    /// of references met, as they are written
    std::map<std::string, std::optional<std::string>, std::less<>> values_;
    std::size_t errors_ = 0;
    std::size_t words_ = 0;
    std::size_t substituted_ = 0;
    Span last_error_;
    bool given_up_ = false;
    bool carriage_return_said_ = false;
};

}  // namespace

std::vector<Command> parse(const Sources& sources, std::uint32_t source,
                           const Environment& environment, Diagnostics& diagnostics) {
    return Parser(sources, source, &environment, diagnostics).run();
}

void check_syntax(const Sources& sources, std::uint32_t source, Diagnostics& diagnostics) {
    Parser(sources, source, nullptr, diagnostics).run();
}

bool is_arrow(std::string_view word) { return word == "=>" || word == "<=" || word == "<=>"; }

}  // namespace hal
