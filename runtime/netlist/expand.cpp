// SPDX-License-Identifier: MIT
// Name ranges and sets: `[0..5]`, `{x,y,z}`.
#include <algorithm>
#include <charconv>

#include "netlist/netlist.hpp"
#include "text/quoting.hpp"

namespace hal {

namespace {

constexpr std::size_t max_names = 1'000'000;                  // that one command stands for
constexpr std::size_t max_bytes = std::size_t{256} << 20;  // of text that one command becomes
constexpr std::size_t max_parts = 1000;  // ranges and literals of one word
constexpr std::size_t word_overhead = sizeof(Token);

/// A segment of a word: a literal, the numbers from `first` to `last`, or the elements of a set.
struct Part {
    std::string_view literal;
    std::vector<std::string_view> elements;
    std::uint64_t first = 0;
    std::uint64_t last = 0;
    std::uint64_t count = 1;
    std::size_t width = 0;  ///< of a number: at least 1, more when leading zeros are kept

    bool names() const { return width > 0 || !elements.empty(); }

    void append_to(std::string& out, std::uint64_t index) const {
        if (!elements.empty()) {
            out += elements[static_cast<std::size_t>(index)];
        } else if (width > 0) {
            const std::string digits =
                std::to_string(last >= first ? first + index : first - index);
            out.append(width > digits.size() ? width - digits.size() : 0, '0');
            out += digits;
        } else {
            out += literal;
        }
    }
};

/// A word, or one element of a comma list, as the names it stands for.
struct Pattern {
    std::vector<Part> parts;
    std::uint64_t count = 1;
    std::size_t max = 0;  ///< bytes of its longest name, at most

    std::string name(std::uint64_t index) const {
        std::string text;
        // The last part runs fastest: the first one counts in steps of all combinations behind it.
        std::uint64_t step = count;
        for (const Part& part : parts) {
            step /= part.count;
            part.append_to(text, index / step % part.count);
        }
        return text;
    }
};

struct Fault {
    std::size_t begin, end;
    std::string message, help;
};

class PatternParser {
public:
    explicit PatternParser(std::string_view text) : text_(text) {}

    /// False with fault() set. Open quotes cannot occur: the parser rejects them.
    bool parse(std::size_t begin, std::size_t end, Pattern& pattern) {
        text_end_ = end;
        std::size_t literal = begin;
        for (std::size_t at = begin; at < end;) {
            const char c = text_[at];
            if (c == '"' || c == '\'') {
                at = std::min(text_.find(c, at + 1), end - 1) + 1;
                continue;
            }
            std::size_t close = at;
            if (c == '[' || c == '{') {
                close = text_.find_first_of(c == '[' ? "[]" : "{}", at + 1);
            }
            const bool range = c == '[' && close < end && text_[close] == ']' &&
                               text_.substr(at, close - at).find("..") != text_.npos;
            if (!range && c != '{') {
                ++at;
                continue;
            }
            add_literal(pattern, literal, at);
            Part part;
            if (!(range ? parse_range(at, close, part) : parse_set(at, close, part)) ||
                !add(pattern, std::move(part), at, close + 1)) {
                return false;
            }
            at = literal = close + 1;
        }
        add_literal(pattern, literal, end);
        return true;
    }

    const Fault& fault() const { return fault_; }

private:
    bool fail(std::size_t begin, std::size_t end, std::string message, std::string help = "") {
        fault_ = {begin, std::min(end, text_end_), std::move(message), std::move(help)};
        return false;
    }

    void add_literal(Pattern& pattern, std::size_t begin, std::size_t end) const {
        if (begin == end) return;
        pattern.max += end - begin;
        pattern.parts.push_back({.literal = text_.substr(begin, end - begin), .elements = {}});
    }

    bool add(Pattern& pattern, Part part, std::size_t begin, std::size_t end) {
        if (pattern.parts.size() > max_parts) {
            return fail(begin, end, "too many ranges in one word");
        }
        if (part.count > max_names || pattern.count * part.count > max_names) {
            return fail(begin, end,
                        "this word expands to more than " + std::to_string(max_names) + " names");
        }
        pattern.count *= part.count;
        std::size_t max = std::max<std::size_t>(part.width, 20);
        for (const std::string_view element : part.elements) {
            max = std::max(max, element.size());
        }
        pattern.max += max;
        pattern.parts.push_back(std::move(part));
        return true;
    }

    bool parse_range(std::size_t open, std::size_t close, Part& part) {
        const std::string_view inside = text_.substr(open + 1, close - open - 1);
        const std::size_t dots = inside.find("..");
        const std::string_view bounds[] = {inside.substr(0, dots), inside.substr(dots + 2)};
        std::uint64_t* values[] = {&part.first, &part.last};
        for (int i = 0; i < 2; ++i) {
            const auto [stop, status] =
                std::from_chars(bounds[i].begin(), bounds[i].end(), *values[i]);
            if (bounds[i].empty() || stop != bounds[i].end() ||
                status == std::errc::invalid_argument) {
                return fail(open, close + 1, "the bounds of a range must be whole numbers",
                            "write [0..5], [00..11] or [5..0]; for a list of names write {x,y,z}");
            }
            if (status != std::errc{} || bounds[i].size() > 18) {
                return fail(open, close + 1, "the bounds of this range are too large");
            }
            if (bounds[i].size() > 1 && bounds[i][0] == '0') {
                part.width = std::max(bounds[0].size(), bounds[1].size());
            }
        }
        part.count =
            (part.last >= part.first ? part.last - part.first : part.first - part.last) + 1;
        part.width = std::max<std::size_t>(part.width, 1);
        return true;
    }

    bool parse_set(std::size_t open, std::size_t close, Part& part) {
        if (close >= text_end_) {
            return fail(open, open + 1, "missing } of this set",
                        "write a set as {x,y,z}, without spaces");
        }
        if (text_[close] == '{') {
            return fail(open, close + 1, "sets cannot be nested",
                        "list all names in one set: {x,y,z}");
        }
        const std::string_view inside = text_.substr(open + 1, close - open - 1);
        if (inside.find("..") != inside.npos) {
            return fail(open, close + 1, "a set cannot contain a range",
                        "write the range without the set: [0..5]");
        }
        for (std::size_t at = 0; at <= inside.size();) {
            const std::size_t comma = std::min(inside.find(',', at), inside.size());
            if (comma == at) {
                return fail(open, close + 1, "empty name in this set", "write a set as {x,y,z}");
            }
            part.elements.push_back(inside.substr(at, comma - at));
            at = comma + 1;
        }
        part.count = part.elements.size();
        return true;
    }

    std::string_view text_;
    std::size_t text_end_ = 0;
    Fault fault_;
};

/// A token: one pattern, or after `key=` the elements of a comma list.
struct Word {
    const Token* token = nullptr;
    std::string_view head;  ///< "key=", or nothing
    std::vector<Pattern> patterns;
    bool ranged = false;
    std::uint64_t count = 1;
    std::size_t max = 0;

    std::string name(std::uint64_t index) const {
        for (const Pattern& pattern : patterns) {
            if (index < pattern.count) return std::string(head) + pattern.name(index);
            index -= pattern.count;
        }
        return {};
    }
    std::string list() const {
        std::string text(head);
        for (const Pattern& pattern : patterns) {
            for (std::uint64_t i = 0; i < pattern.count; ++i) {
                text += (text.size() > head.size() || i > 0 ? "," : "") + pattern.name(i);
            }
        }
        return text;
    }
};

bool has_range(std::string_view text) {
    return text.find('{') != text.npos ||
           (text.find('[') != text.npos && text.find("..") != text.npos);
}

class Expander {
public:
    Expander(const Command& command, Diagnostics& diagnostics)
        : command_(command), diagnostics_(diagnostics) {}

    std::vector<Command> run() {
        words_.reserve(command_.args.size() + 1);
        if (!add(command_.name)) {
            return {};
        }
        for (const Token& arg : command_.args) {
            if (!add(arg)) {
                return {};
            }
        }
        const std::size_t subject = subject_index();
        const bool per_name = subject < words_.size() && words_[subject].ranged;
        if (!per_name) return in_place();

        const Word& leader = words_[subject];
        std::size_t bytes = 0;
        for (const Word& word : words_) {
            if (word.ranged && word.count != leader.count) return mismatch(leader, word);
            bytes += word.max + word_overhead;
        }
        if (bytes > max_bytes / leader.count) return too_long();
        std::vector<Command> commands(static_cast<std::size_t>(leader.count));
        for (std::size_t i = 0; i < commands.size(); ++i) {
            Command& made = commands[i];
            made.span = command_.span;
            made.args.reserve(command_.args.size());
            for (const Word& word : words_) {
                Token token{word.ranged ? word.name(i) : word.token->text, word.token->span};
                if (&word == words_.data()) {
                    made.name = std::move(token);
                } else {
                    made.args.push_back(std::move(token));
                }
            }
        }
        return commands;
    }

private:
    /// The word whose names make a command each: `name = value` is about its first word, alias and
    /// unalias about their second argument.
    std::size_t subject_index() const {
        if (!command_.args.empty() && command_.args[0].text == "=") return 0;
        const std::string& verb = command_.name.text;
        return verb == "alias" || verb == "unalias" ? 2 : 1;
    }

    bool add(const Token& token) {
        Word word{.token = &token, .head = {}, .patterns = {}};
        word.max = token.text.size();
        if (has_range(token.text) && !parse(token, word)) return false;
        words_.push_back(std::move(word));
        return true;
    }

    bool parse(const Token& token, Word& word) {
        const std::string_view text = token.text;
        const std::size_t key = text.find_first_of("=[{\"'");
        const bool list =
            key != text.npos && key > 0 && text[key] == '=' && &token != &command_.name;
        word.head = list ? text.substr(0, key + 1) : std::string_view{};
        PatternParser parser(text);
        std::size_t max = word.head.size();
        word.count = 0;
        for (std::size_t at = word.head.size(); at <= text.size();) {
            const std::size_t stop = list ? element_end(text, at) : text.size();
            Pattern pattern;
            if (!parser.parse(at, stop, pattern)) {
                const Fault& fault = parser.fault();
                diagnostics_.error("bad-range", place(token, fault.begin, fault.end), fault.message,
                                   "", fault.help);
                return false;
            }
            word.ranged = word.ranged || std::any_of(pattern.parts.begin(), pattern.parts.end(),
                                                     [](const Part& p) { return p.names(); });
            word.count += pattern.count;
            max = std::max(max, word.head.size() + pattern.max);
            list_bytes_ += pattern.count * (pattern.max + 1);
            word.patterns.push_back(std::move(pattern));
            at = stop + 1;
            if (word.count > max_names) {
                diagnostics_.error(
                    "bad-range", token.span,
                    "this word expands to more than " + std::to_string(max_names) + " names");
                return false;
            }
        }
        if (!word.ranged) {
            word.count = 1;
            word.patterns.clear();
            return true;
        }
        word.max = max;
        return true;
    }

    /// The comma that ends the element at `at`: not one in a set or between quotes.
    static std::size_t element_end(std::string_view text, std::size_t at) {
        for (; at < text.size(); ++at) {
            const char c = text[at];
            if (c == ',') return at;
            if (c == '{' || c == '"' || c == '\'') {
                at = text.find(c == '{' ? '}' : c, at + 1);
            }
            if (at == text.npos) return text.size();
        }
        return text.size();
    }

    /// Part of a token in the source, as far as the token stands there as it is.
    static Span place(const Token& token, std::size_t begin, std::size_t end) {
        if (token.span.end - token.span.begin != token.text.size()) return token.span;
        return {token.span.source, token.span.begin + static_cast<std::uint32_t>(begin),
                token.span.begin + static_cast<std::uint32_t>(end)};
    }

    std::vector<Command> in_place() {
        if (list_bytes_ > max_bytes) return too_long();
        std::uint64_t names = 0;
        for (const Word& word : words_) {
            names += word.ranged ? word.count : 0;
        }
        if (names == 0) {
            return {command_};
        }
        if (names > max_names) return too_long();
        Command made{command_.name, {}, command_.span};
        for (std::size_t i = 0; i < command_.args.size(); ++i) {
            const Word& word = words_[i + 1];
            const Span span = word.token->span;
            if (!word.ranged) {
                made.args.push_back(*word.token);
            } else if (!word.head.empty()) {
                made.args.push_back({word.list(), span});
            } else {
                for (std::uint64_t index = 0; index < word.count; ++index) {
                    made.args.push_back({word.name(index), span});
                }
            }
        }
        return {std::move(made)};
    }

    std::vector<Command> mismatch(const Word& leader, const Word& word) {
        const auto names = [](const Word& w) { return counted(w.count, "name"); };
        Diagnostic made{.code = "range-length",
                        .message = "'" + leader.token->text + "' expands to " + names(leader) +
                                   ", '" + word.token->text + "' to " + std::to_string(word.count)};
        made.labels = {{word.token->span, names(word)}, {leader.token->span, names(leader)}};
        made.help.push_back(
            "ranges and sets of one command are expanded in parallel, so they need the same number "
            "of names");
        diagnostics_.add(std::move(made));
        return {};
    }

    std::vector<Command> too_long() {
        diagnostics_.error("bad-range", command_.span,
                           "the ranges of this command expand to too many names", "",
                           "at most " + std::to_string(max_names) + " names, and 256 MB of text");
        return {};
    }

    const Command& command_;
    Diagnostics& diagnostics_;
    std::vector<Word> words_;
    std::uint64_t list_bytes_ = 0;
};

}  // namespace

std::vector<Command> expand(const Command& command, Diagnostics& diagnostics) {
    const bool plain = !has_range(command.name.text) &&
                       std::none_of(command.args.begin(), command.args.end(),
                                    [](const Token& t) { return has_range(t.text); });
    if (plain) {
        return std::vector<Command>(1, command);  // a list would be copied again
    }
    return Expander(command, diagnostics).run();
}

}  // namespace hal
