// SPDX-License-Identifier: MIT
// A result of `hal doctor`.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace hal::tools {

enum class Verdict { good, fair, poor };

/// The result of one check.
struct Finding {
    Verdict verdict = Verdict::good;
    std::string subject;
    std::string sentence;
    /// what to type; empty when no action is needed. A command begins with `sudo`
    std::string remedy = {};
    std::string other = {};  ///< what to type instead, where there is a choice
    std::string then = {};   ///< what remains to be done after the remedy

    std::string advice() const { return then.empty() ? remedy : remedy + ", then " + then; }
};

/// Returns "good", "fair" or "poor". [any]
const char* to_string(Verdict) noexcept;

/// Prints findings as text; one with the advice of an earlier one refers to it. Returns false when
/// the output is closed. [setup]
bool print_findings(const std::vector<Finding>&);

nlohmann::ordered_json json_of(const Finding&);

}  // namespace hal::tools
