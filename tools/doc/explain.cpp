// SPDX-License-Identifier: MIT
// `hal explain [CODE]`: the page of a diagnostic code, or all codes.
#include "doc/explain.hpp"

#include <algorithm>
#include <fmt/core.h>

#include "cli/output.hpp"
#include "text/diagnostic.hpp"
#include "text/fault_pages.hpp"

namespace hal::tools {

namespace {

std::string first_sentence(std::string_view page) {
    std::string_view sentence = page.substr(0, std::min(page.find(". "), page.find('\n')));
    if (sentence.ends_with('.')) {
        sentence.remove_suffix(1);
    }
    return std::string(sentence);
}

}  // namespace

int run_explain(const ExplainOptions& options) {
    const std::vector<CodePage> pages = all_code_pages();
    if (options.words.empty()) {
        std::size_t width = 0;
        for (const CodePage& code : pages) {
            width = std::max(width, std::string_view(code.name).size());
        }
        std::string text;
        for (const CodePage& code : pages) {
            text += fmt::format("{:{}}  {}\n", code.name, width, first_sentence(code.page));
        }
        return exit_code(print(text));
    }
    std::vector<std::string> names;
    for (const CodePage& code : pages) {
        names.emplace_back(code.name);
    }
    for (std::string code : options.words) {
        // as messages print it
        if (code.size() > 2 && code.front() == '[' && code.back() == ']') {
            code = code.substr(1, code.size() - 2);
        }
        const auto row = std::find_if(pages.begin(), pages.end(),
                                      [&](const CodePage& c) { return code == c.name; });
        if (row == pages.end()) {
            const std::string hint = did_you_mean(code, names);
            return fail(options,
                        fmt::format("unknown code '{}'; {}", code,
                                    hint.empty() ? "type 'hal explain' for the list" : hint));
        }
        if (!print(fmt::format("{}\n\n{}\n", row->name, row->page))) return 1;
    }
    return 0;
}

}  // namespace hal::tools
