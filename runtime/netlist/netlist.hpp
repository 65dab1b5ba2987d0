// SPDX-License-Identifier: MIT
// Text to commands and back: LinuxCNC's .hal syntax (halcmd(1)) plus name ranges and sets.
// Knows no component and no pin: step 1 of docs/design.md.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "text/diagnostic.hpp"
#include "text/source.hpp"

namespace hal {

/// A word as the command sees it: after substitution, quotes kept as LinuxCNC keeps them. `span` is
/// where it stands in the source; a substituted or expanded word points at the text it came from.
struct Token {
    std::string text;
    Span span;
};

/// One logical line: continuation lines joined, comment gone, arrows still among the arguments.
struct Command {
    Token name;
    std::vector<Token> args;
    Span span;  ///< from the first to the last token
};

/// Reads a whole file into `sources`. What goes wrong is one error at `asked`, the place that named
/// the file.
std::optional<std::uint32_t> read_source(Sources& sources, const std::string& path, Span asked,
                                         Diagnostics& diagnostics);

/// An INI file as LinuxCNC reads it: `[SECTION]`, `KEY = value`, `#` and `;` comments on lines of
/// their own, `\` joins lines, `#INCLUDE file`, repeated keys keep all values.
class Ini {
public:
    /// Reads a file. Problems go to `diagnostics` (with places in the INI file itself).
    static Ini read(Sources& sources, const std::string& path, Diagnostics& diagnostics);
    /// First value of the key; an empty section searches all, as `[]KEY` does.
    std::optional<std::string> get(std::string_view section, std::string_view key) const;
    /// All values of a repeated key, in order (`[HAL]HALFILE`).
    std::vector<std::string> all(std::string_view section, std::string_view key) const;
    /// Every "[SECTION]KEY" there is, for suggestions.
    std::vector<std::string> names() const;
    bool empty() const { return entries_.empty(); }
    /// The file that stands beside the netlist, as one types it, for the help when none was given;
    /// or "".
    const std::string& candidate() const { return candidate_; }
    void set_candidate(std::string path) { candidate_ = std::move(path); }

    struct Entry {
        std::string section, key, value;
        Span at = {};  ///< of the value, if the file was read here
        std::string place = {};  ///< "FILE:LINE", if a client has read it
    };
    const std::vector<Entry>& entries() const { return entries_; }
    /// The entry that get() takes its value from, or nullptr.
    const Entry* find(std::string_view section, std::string_view key) const;
    void add(Entry entry);

private:
    std::vector<Entry> entries_;
    std::string candidate_;
    /// "[SECTION]KEY" and "[]KEY" to the first entry
    std::unordered_map<std::string, std::size_t> first_;
};

/// What `$NAME` and `[SECTION]KEY` are looked up in.
struct Environment {
    const Ini* ini = nullptr;
    /// empty: the process environment
    std::function<std::optional<std::string>(const std::string&)> variable;
};

/// All commands of a source. Every problem is reported with its place; the faulty line gives no
/// command and the rest is still parsed. Bounded work: time and memory are linear in the text.
std::vector<Command> parse(const Sources& sources, std::uint32_t source,
                           const Environment& environment, Diagnostics& diagnostics);

/// A command with name ranges `[0..5]` and sets `{x,y,z}` as the plain commands it stands for.
/// Ranges in the first argument (the thing the command is about) make a command per name, other
/// arguments' ranges run along with it and must have as many names; where the first argument has
/// none, ranges stand for the list of names, in place.
/// `net j[0..2]-cmd traj.[0..2].out => pid.[0..2].command` is three commands,
/// `net on s.on => pid.{x,y}.enable` is one. In `key=value` they stand for a comma list:
/// `names={x,y}-pid` is `names=x-pid,y-pid`. Several in one word are combined, the last one running
/// fastest. What stands between quotes is left alone, and so is all of print, echo, help, loadusr,
/// source and save. A faulty command gives none, and an error.
std::vector<Command> expand(const Command& command, Diagnostics& diagnostics);

/// A command of words that were separated before: one-shot commands of a command line. Nothing in
/// them is substituted and no quote is special. Appends the words to `text` as one line, quoted
/// where that shows their boundaries; the spans point into it, as source `source`.
Command command_of(const std::vector<std::string>& words, std::uint32_t source, std::string& text);

/// The word as it has to be written in a netlist to arrive as one word: `config=a b` is `config="a
/// b"`.
std::string written(std::string_view word);

/// The word without the pair of quotes that encloses it.
std::string_view without_quotes(std::string_view word);

/// True for `=>`, `<=` and `<=>`.
bool is_arrow(std::string_view word);

/// The text with columns aligned within blocks, one blank between words, comments and blank lines
/// kept (`hal fmt`). Formatting twice changes nothing; the commands it parses to are the same.
std::string format(const Sources& sources, std::uint32_t source, Diagnostics& diagnostics);

}  // namespace hal
