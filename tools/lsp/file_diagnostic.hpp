// SPDX-License-Identifier: MIT
// A diagnostic with its places in files, as an editor shows it.
#pragma once

#include <string>
#include <vector>

#include "lsp/text_document.hpp"
#include "text/severity.hpp"

namespace hal::tools {

struct DiagnosticPlace {
    std::string path;  ///< canonical
    TextRange range;
    std::string text;
    auto operator<=>(const DiagnosticPlace&) const = default;
};

struct FileDiagnostic {
    std::string path;  ///< canonical
    TextRange range;
    Severity severity = Severity::error;
    std::string code;
    std::string message;
    std::string label;              ///< text under the range, such as "did you mean 'x'?"
    std::vector<std::string> help;  ///< one entry for each remedy
    std::vector<DiagnosticPlace> related;
    auto operator<=>(const FileDiagnostic&) const = default;
};

}  // namespace hal::tools
