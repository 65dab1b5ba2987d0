// SPDX-License-Identifier: MIT
#include "inspect/finding.hpp"

#include <algorithm>
#include <array>
#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "cli/output.hpp"

namespace hal::tools {

namespace {

/// Returns the lines that show a finding. `as` is an earlier finding with the same advice, or
/// nullptr.
std::string described(const Finding& finding, const Finding* as, bool colour) {
    static constexpr std::array<const char*, 3> codes{"\033[32m", "\033[33m", "\033[31m"};
    const std::string verdict =
        colour ? fmt::format("{}{}\033[0m", codes[static_cast<std::size_t>(finding.verdict)],
                             to_string(finding.verdict))
               : to_string(finding.verdict);
    std::string text = fmt::format("{}  {:15} {}\n", verdict, finding.subject, finding.sentence);
    if (as) {
        return text + fmt::format("      {:15}   try: the same as for {}\n", "", as->subject);
    }
    if (!finding.remedy.empty()) {
        text += fmt::format("      {:15}   try: {}\n", "", finding.advice());
    }
    if (!finding.other.empty()) {
        text += fmt::format("      {:15}   or:  {}\n", "", finding.other);
    }
    return text;
}

}  // namespace

const char* to_string(Verdict verdict) noexcept {
    static constexpr std::array<const char*, 3> words{"good", "fair", "poor"};
    return words[static_cast<std::size_t>(verdict)];
}

bool print_findings(const std::vector<Finding>& findings) {
    const bool colour = colours(STDOUT_FILENO);
    for (auto finding = findings.begin(); finding != findings.end(); ++finding) {
        const auto same = std::find_if(findings.begin(), finding, [&](const Finding& before) {
            return !finding->remedy.empty() && before.advice() == finding->advice() &&
                   (finding->other.empty() || before.other == finding->other);
        });
        if (!print(described(*finding, same == finding ? nullptr : &*same, colour))) return false;
    }
    return true;
}

nlohmann::ordered_json json_of(const Finding& finding) {
    return {{"verdict", to_string(finding.verdict)},
            {"subject", finding.subject},
            {"sentence", finding.sentence},
            {"remedy", finding.advice()},
            {"other", finding.other}};
}

}  // namespace hal::tools
