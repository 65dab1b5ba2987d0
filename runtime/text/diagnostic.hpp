// SPDX-License-Identifier: MIT
// What went wrong, where, and what to type (docs/design.md, Errors). Formatted where it arises, rendered in one place.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "text/codes.hpp"
#include "text/severity.hpp"
#include "text/source.hpp"
#include "text/suggest.hpp"

namespace hal {

/// A place with a word about it. The first label of a diagnostic is its main place (`^^^^`), others are `----`.
struct Label {
    Span span;
    std::string text;
};

struct Diagnostic {
    Severity severity = Severity::error;
    Code code;
    std::string message;  ///< one sentence, no final stop, names quoted '…' as the user wrote them
    std::vector<Label> labels = {};
    std::vector<std::string> help = {};
};

/// Collects what a transaction finds. Not synchronised.
class Diagnostics {
public:
    void add(Diagnostic diagnostic);
    void error(Code code, Span at, std::string message, std::string label = "", std::string help = "");
    void warning(Code code, Span at, std::string message, std::string label = "", std::string help = "");
    void note(Code code, Span at, std::string message, std::string label = "", std::string help = "");
    std::size_t errors() const { return errors_; }
    std::size_t warnings() const { return warnings_; }
    std::size_t notes() const { return all_.size() - errors_ - warnings_; }
    bool failed() const { return errors_ != 0; }
    const std::vector<Diagnostic>& all() const { return all_; }
    void clear();
    /// Moves everything from `other` to the end of this.
    void take(Diagnostics& other);

private:
    std::vector<Diagnostic> all_;
    std::size_t errors_ = 0, warnings_ = 0;
};

/// One diagnostic as text, ending with a newline: the form that docs/design.md describes.
std::string render(const Diagnostic& diagnostic, const Sources& sources, bool color = false);

/// All of them in order of place (files in order of first mention), a blank line between two; past
/// the hundredth only how many more there are.
std::string render(const Diagnostics& diagnostics, const Sources& sources, bool color = false);

}  // namespace hal
