// SPDX-License-Identifier: MIT
#include "cli/prompt_loop.hpp"

#include <algorithm>
#include <unistd.h>
#include <vector>

#include "cli/editor.hpp"
#include "cli/output.hpp"

namespace hal::tools {

int run_prompt_loop(LineExecutor& executor, const Prompt& prompt, int stop) {
    Editor editor([&](std::string_view line, std::size_t cursor) {
        return executor.complete(line, cursor);
    }, stop, executor.meanwhile());
    const bool person = ::isatty(STDIN_FILENO);
    int worst = 0;
    for (std::string line, more; !executor.over();) {
        if (!editor.read(executor.collecting() ? prompt.continued : prompt.text, line)) break;
        while (line.ends_with('\\') && editor.read(prompt.continued, more)) {
            line.pop_back();
            line += more;
        }
        worst = std::max(worst, executor.execute(line));
    }
    if (executor.collecting()) {
        write_all(STDERR_FILENO, "'begin' without 'commit': the collected edits had no effect\n");
        worst = 1;
    }
    return person ? 0 : worst;
}

}  // namespace hal::tools
