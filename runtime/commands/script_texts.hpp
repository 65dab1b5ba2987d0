// SPDX-License-Identifier: MIT
// The texts that a Script reads: it holds them in the session's sources, parses them, and knows
// which files include the one that is being read. Internal to the shell.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "commands/shell_state.hpp"
#include "machine/session.hpp"
#include "netlist/netlist.hpp"
#include "text/diagnostic.hpp"

namespace hal {

struct ParsedText {
    std::vector<Command> commands;
    Diagnostics problems;  ///< of the text itself
    /// Returns whether all of it was ignored, because it is not a netlist.
    bool is_ignored() const;
};

/// A file that is being read.
struct OpenFile {
    std::string path;  ///< canonical; "": not a file
    Span at;           ///< of the `source` command, in the file before
};

/// All members need the session's lock. [setup]
class ScriptTexts {
public:
    ScriptTexts(Shell& shell, Shell::State& state) : shell_(shell), state_(state) {}
    /// Releases the texts, and drops them unless keep() was called. No transaction is open.
    ~ScriptTexts();
    ScriptTexts(const ScriptTexts&) = delete;

    /// Adds a text to the session's sources for as long as this object lives, and longer when
    /// something made by it points into it.
    std::uint32_t add(std::string name, std::string text, std::uint32_t first_line = 1);
    /// Something that outlives the script points into a text.
    void keep() { kept_ = true; }
    /// Returns the commands of a text; of a netlist for several machines those of this one.
    ParsedText parse(std::uint32_t source);
    std::string_view text(std::uint32_t source) const {
        return state_.session.sources.get(source).text;
    }
    /// Returns true for a text that is a file, and not typed.
    bool is_file(std::uint32_t source) const;

    /// The files being read, the outermost first.
    const std::vector<OpenFile>& open_files() const { return files_; }
    bool is_open(const std::string& canonical) const;
    void enter(std::string canonical, Span at = {}) {
        files_.push_back({std::move(canonical), at});
    }
    void enter(std::uint32_t source) { enter(own_path(source)); }
    void leave() { files_.pop_back(); }

private:
    std::string own_path(std::uint32_t source) const;
    void keep_part(std::uint32_t source, ParsedText& parsed) const;

    Shell& shell_;
    Shell::State& state_;
    std::vector<std::uint32_t> texts_;  // of add()
    std::vector<OpenFile> files_;
    bool kept_ = false;
};

}  // namespace hal
