// SPDX-License-Identifier: MIT
// Reads lines from the user, with history and completion on a terminal.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "commands/completion.hpp"

namespace hal::tools {

/// Waits until `descriptor` or `stop` (-1: none) is readable. Returns false for `stop`. Calls
/// `meanwhile` every 10 ms.
bool wait_readable(int descriptor, int stop, const std::function<void()>& meanwhile = {});

/// Reads lines of a descriptor as they arrive, without editing.
class LineReader {
public:
    explicit LineReader(int descriptor, int stop = -1, std::function<void()> meanwhile = {})
        : descriptor_(descriptor), stop_(stop), meanwhile_(std::move(meanwhile)) {}
    /// Returns false at the end of the input, or when `stop` became readable. A last line without
    /// end of line counts.
    bool read(std::string& line);
    /// Returns the error number of the read that ended the input; 0: it ended in order.
    int error() const { return error_; }
    /// Returns true when the next line is buffered: read() does not wait.
    bool waiting() const { return waiting_.find('\n', begin_) != std::string::npos; }

private:
    int descriptor_, stop_;
    std::function<void()> meanwhile_;
    std::string waiting_;
    std::size_t begin_ = 0;
    bool ended_ = false;
    int error_ = 0;
};

class Editor {
public:
    using Completer = std::function<Completion(std::string_view line, std::size_t cursor)>;

    /// On a terminal the history is kept in $XDG_STATE_HOME/halcyon/history. `stop`, `meanwhile`:
    /// see wait_readable.
    Editor(Completer complete, int stop, const std::function<void()>& meanwhile = {});
    ~Editor();
    Editor(const Editor&) = delete;

    /// Ctrl-C returns an empty line; Ctrl-D on an empty line, the end of the input and `stop`
    /// return false.
    bool read(const std::string& prompt, std::string& line);

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Returns the longest common prefix of the candidates.
std::string common_prefix(const std::vector<Candidate>& candidates);

/// Returns the list for an ambiguous completion: a candidate and its hint per column, as wide as
/// the terminal.
std::string candidate_table(const std::vector<Candidate>& candidates, std::size_t columns);

}  // namespace hal::tools
