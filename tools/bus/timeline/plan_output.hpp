// SPDX-License-Identifier: MIT
// What every plan of a bus does with its configuration and its picture.
#pragma once

#include <string>
#include <unistd.h>
#include <utility>

#include "bus/timeline/timeline.hpp"
#include "cli/options.hpp"
#include "cli/output.hpp"
#include "text/diagnostic.hpp"
#include "text/glyphs.hpp"

namespace hal::tools {

/// Prints what the reader of a configuration has found, with the lines of the file. `code` returns
/// the diagnostic code of a message. Returns false when there was an error. [setup]
template <class Messages, class CodeOf>
bool print_findings(const std::string& file, const std::string& text, const Messages& messages,
                    CodeOf code) {
    Sources sources;
    const std::uint32_t source = sources.add(file, text);
    Diagnostics found;
    for (const auto& message : messages) {
        const Severity severities[] = {Severity::note, Severity::warning, Severity::error};
        Diagnostic d{severities[static_cast<std::size_t>(message.severity)], code(message),
                     message.sentence};
        const auto& at = message.at;
        d.labels.push_back({hal::Span{source, at.offset, at.offset + at.length}, message.label});
        if (!message.help.empty()) {
            d.help.push_back(message.help);
        }
        found.add(std::move(d));
    }
    write_all(STDERR_FILENO, render(found, sources, colours(STDERR_FILENO)));
    return !found.failed();
}

/// Writes the picture to the file of --svg, or prints it for `-`. Returns the exit code. [setup]
inline int write_picture(const Options& options, const std::string& svg, bool json,
                         const Timeline& timeline) {
    if (json) return fail(options, "--json and --svg exclude each other");
    const std::string picture = timeline_svg(timeline);
    if (svg == "-") return print(picture) ? 0 : 1;
    const std::string why = write_file(svg, picture);
    return why.empty() ? 0 : fail(options, why);
}

}  // namespace hal::tools
