// SPDX-License-Identifier: MIT
// What went wrong, where, and what to type (docs/design.md, Errors). Formatted where it arises,
// rendered in one place.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "text/codes.hpp"
#include "text/severity.hpp"
#include "text/source.hpp"
#include "text/suggest.hpp"

namespace hal {

/// A place with a word about it. The first label of a diagnostic is its main place (`^^^^`), others
/// are `----`.
struct Label {
    Span span;
    std::string text;
};

/// An unknown name, for which a diagnostic offers similar ones: they are looked up when it is
/// rendered and stand beside the main place.
struct UnknownName {
    std::string name;
    /// which names it may be one of: a number that means something to who offers them
    std::uint32_t group = 0;
    std::uint32_t before = NameIndex::all;  ///< only names with a number below this one existed
    std::shared_ptr<const NameIndex> among = {};  ///< nullptr: not offered yet
};

struct Diagnostic {
    Severity severity = Severity::error;
    Code code;
    std::string message;  ///< one sentence, no final stop, names quoted '…' as the user wrote them
    std::vector<Label> labels = {};
    std::vector<std::string> help = {};
    std::optional<UnknownName> unknown = {};
};

/// Collects what a transaction finds. Not synchronised.
class Diagnostics {
public:
    void add(Diagnostic diagnostic);
    void error(Code code, Span at, std::string message, std::string label = "",
               std::string help = "");
    void warning(Code code, Span at, std::string message, std::string label = "",
                 std::string help = "");
    void note(Code code, Span at, std::string message, std::string label = "",
              std::string help = "");
    /// An error about a name for which similar ones are looked up later.
    void error(Code code, Span at, std::string message, UnknownName unknown, std::string help = "");
    /// Offers names to the diagnostics whose unknown name has none yet; `names` is called once for
    /// each group among them, and may return nullptr.
    void offer(const std::function<std::shared_ptr<const NameIndex>(std::uint32_t group)>& names);
    /// Looks up similar names for what render() prints. Takes time, but uses nothing but this
    /// object and the names that were offered. Once `stop` is requested no more are looked up, and
    /// render() looks up none either.
    void look_up(const std::stop_token& stop = {});
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
    std::size_t errors_ = 0;
    std::size_t warnings_ = 0;
};

/// One diagnostic as text, ending with a newline: the form that docs/design.md describes.
std::string render(const Diagnostic& diagnostic, const Sources& sources, bool color = false);

/// All of them in order of place (files in order of first mention), a blank line between two; past
/// the hundredth only how many more there are.
std::string render(const Diagnostics& diagnostics, const Sources& sources, bool color = false);

}  // namespace hal
