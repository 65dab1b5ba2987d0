// SPDX-License-Identifier: MIT
#include "talk.hpp"

#include <algorithm>
#include <unistd.h>
#include <vector>

#include "editor.hpp"

namespace hal::tools {

int talk(Listener& listener, const Prompt& prompt, int stop) {
    Editor editor([&](std::string_view line, std::size_t cursor) { return listener.complete(line, cursor); }, stop);
    const bool person = ::isatty(STDIN_FILENO);
    int worst = 0;
    for (std::string line, more; !listener.over();) {
        if (!editor.read(listener.collecting() ? prompt.continued : prompt.text, line)) break;
        while (line.ends_with('\\') && editor.read(prompt.continued, more)) {
            line.pop_back();
            line += more;
        }
        worst = std::max(worst, listener.execute(line));
    }
    return person ? 0 : worst;
}

std::string joined(const std::vector<std::string>& words) {
    if (words.size() == 1) return words.front();
    std::string line;
    for (const std::string& word : words) {
        if (!line.empty()) line += ' ';
        if (!word.empty() && word.find_first_of(" \t#") == std::string::npos) {
            line += word;
            continue;
        }
        // key=a b becomes key="a b": quotes stay in the word, and a component takes them off its arguments' values.
        const auto equals = word.find('=');
        const auto value = equals == std::string::npos || word.find_first_of(" \t#") < equals ? 0 : equals + 1;
        const char quote = word.find('"') == std::string::npos ? '"' : '\'';
        line += word.substr(0, value) + quote + word.substr(value) + quote;
    }
    return line;
}

}  // namespace hal::tools
