// SPDX-License-Identifier: MIT
// Edits that follow from the help lines of a diagnostic.
#pragma once

#include <string>
#include <vector>

#include "lsp/file_diagnostic.hpp"
#include "lsp/text_document.hpp"

namespace hal::tools {

struct QuickFix {
    std::string title;
    TextRange range;
    std::string text;
};

/// Returns the fixes of a diagnostic of this text, the most likely one first. [any]
std::vector<QuickFix> quick_fixes(const FileDiagnostic& diagnostic, const TextDocument& document);

}  // namespace hal::tools
