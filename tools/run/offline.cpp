// SPDX-License-Identifier: MIT
#include "run/offline.hpp"

#include <unistd.h>

#include "cli/output.hpp"

namespace hal::tools {

void ErrorsOnly::err(std::string_view text) { write_all(STDERR_FILENO, text); }

SessionOptions offline() {
    SessionOptions options;
    options.check_only = true;
    options.virtual_clock = true;
    return options;
}

int load_offline(Shell& shell, const NetlistOptions& options, Output& output,
                 const std::function<void(const std::string& path)>& good) {
    if (!options.ini.empty() && shell.read_ini(options.ini, output) != 0) return 1;
    int bad = 0;
    for (const std::string& path : options.words) {
        if (shell.run_file(path, output) != 0) {
            ++bad;
        } else if (good) {
            good(path);
        }
    }
    return bad;
}

}  // namespace hal::tools
