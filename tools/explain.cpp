// SPDX-License-Identifier: MIT
// `hal explain [CODE]`: the page of a diagnostic code, or all codes.
#include <algorithm>
#include <fmt/core.h>

#include "base/codes.hpp"
#include "base/diagnostic.hpp"
#include "options.hpp"
#include "say.hpp"

namespace hal::tools {

namespace {

std::string first_sentence(std::string_view page) {
    std::string_view sentence = page.substr(0, std::min(page.find(". "), page.find('\n')));
    if (sentence.ends_with('.')) sentence.remove_suffix(1);
    return std::string(sentence);
}

}  // namespace

int run_explain(const Options& options) {
    if (options.words.empty()) {
        std::size_t width = 0;
        for (const CodePage& code : code_pages) width = std::max(width, std::string_view(code.name).size());
        std::string text;
        for (const CodePage& code : code_pages) text += fmt::format("{:{}}  {}\n", code.name, width, first_sentence(code.page));
        return print(text) ? 0 : 1;
    }
    std::vector<std::string> names;
    for (const CodePage& code : code_pages) names.emplace_back(code.name);
    for (std::string code : options.words) {
        if (code.size() > 2 && code.front() == '[' && code.back() == ']') code = code.substr(1, code.size() - 2);  // as messages print it
        const auto row = std::find_if(std::begin(code_pages), std::end(code_pages), [&](const CodePage& c) { return code == c.name; });
        if (row == std::end(code_pages)) {
            const std::string hint = did_you_mean(code, names);
            return fail(options,
                        fmt::format("there is no diagnostic '{}'; {}", code, hint.empty() ? "type 'hal explain' for the list" : hint));
        }
        if (!print(fmt::format("{}\n\n{}\n", row->name, row->page))) return 1;
    }
    return 0;
}

}  // namespace hal::tools
