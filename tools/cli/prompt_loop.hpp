// SPDX-License-Identifier: MIT
// The loop that reads and executes lines: for a machine in this process (`hal run -I`), through its
// control socket (`hal shell`), for a drive.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "commands/completion.hpp"

namespace hal::tools {

/// Executes lines and prints their output.
class LineExecutor {
public:
    virtual ~LineExecutor() = default;
    /// Returns the exit status of the line. `name` and `number` give its position in messages;
    /// number 0: no position.
    virtual int execute(std::string_view line) = 0;
    virtual Completion complete(std::string_view line, std::size_t cursor) = 0;
    virtual bool collecting() const = 0;  ///< between begin and commit
    virtual bool over() const = 0;  ///< after quit, or when the connection is closed
    /// Called every few hundredths of a second while waiting for the next line, unless it is empty.
    virtual std::function<void()> meanwhile() { return {}; }
};

struct Prompt {
    std::string text, continued;
};

/// Reads lines until `quit`, the end of the input, or `stop` becomes readable. Returns 0, or, when
/// the input is not a terminal, the status of the worst line.
int run_prompt_loop(LineExecutor& executor, const Prompt& prompt, int stop = -1);

}  // namespace hal::tools
