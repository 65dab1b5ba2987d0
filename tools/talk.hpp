// SPDX-License-Identifier: MIT
// Typing at a machine: in this process (`hal run -I`) or through its control socket (`hal shell`).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "shell/completion.hpp"

namespace hal::tools {

/// Whoever executes the lines. It prints what they print.
class Listener {
public:
    virtual ~Listener() = default;
    /// Returns the exit status of the line. `name` and `number` tell messages where it stood; number 0: nowhere.
    virtual int execute(std::string_view line) = 0;
    virtual Completion complete(std::string_view line, std::size_t cursor) = 0;
    virtual bool collecting() const = 0;  ///< between begin and commit
    virtual bool over() const = 0;        ///< after quit, or when the other side has gone
};

struct Prompt {
    std::string text, continued;
};

/// Reads lines until `quit`, the end of the input, or `stop` becomes readable. Returns 0, or, when the input is not a
/// terminal, the status of the worst line.
int talk(Listener& listener, const Prompt& prompt, int stop = -1);

/// Typed words as one line: words with blanks or `#` in them get quotes, as the words of a netlist would.
std::string joined(const std::vector<std::string>& words);

}  // namespace hal::tools
