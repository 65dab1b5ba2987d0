// SPDX-License-Identifier: MIT
// Errors in the files of a panel, each with its place in the text.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "text/config_text.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {

class PanelErrors {
public:
    explicit PanelErrors(Code code) : code_(code) {}

    /// Adds a file and returns its number for spans.
    std::uint32_t add_file(std::string name, std::string text) {
        return sources_.add(std::move(name), std::move(text));
    }
    void add(Span at, std::string sentence, std::string help = "") {
        if (found_.errors() <= text::max_errors) {
            found_.error(code_, at, std::move(sentence), "", std::move(help));
        }
    }
    const Diagnostics& found() const { return found_; }
    /// Returns all of them as they are printed, in the order of their places.
    std::string text(bool colours) const { return render(found_, sources_, colours); }

private:
    Code code_;
    Sources sources_;
    Diagnostics found_;
};

}  // namespace hal::tools
