// SPDX-License-Identifier: MIT
// `hal fmt`: netlists with aligned columns, in place.
#include "run/fmt.hpp"

#include <filesystem>
#include <fmt/core.h>

#include "cli/output.hpp"
#include "hal/replace_file.hpp"
#include "netlist/netlist.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {

int run_fmt(const FmtOptions& options) {
    int status = 0;
    for (const std::string& path : options.words) {
        std::string text;
        if (!read_file(path, text)) {
            status = fail(options, fmt::format("cannot read '{}': {}", path, text));
            continue;
        }
        Sources sources;
        Diagnostics diagnostics;
        const std::uint32_t source = sources.add(path == "-" ? "<stdin>" : path, text);
        const std::string formatted = format(sources, source, diagnostics);
        if (diagnostics.failed()) {
            write_all(STDERR_FILENO, render(diagnostics, sources, colours(STDERR_FILENO)));
            status = 1;
        } else if (options.check) {
            if (formatted != text) {
                status =
                    fail(options, fmt::format("'{0}' is not formatted; type: hal fmt {0}", path));
            }
        } else if (path == "-") {
            if (!print(formatted)) {
                status = 1;
            }
        } else if (formatted != text) {
            if (const std::string why = replace_file(path, formatted); !why.empty()) {
                status = fail(options, fmt::format("cannot write '{}': {}", path, why));
            }
        }
    }
    return status;
}

}  // namespace hal::tools
