// SPDX-License-Identifier: MIT
// `hal check`: check netlists without running them.
#include "run/check.hpp"

#include <unistd.h>

#include "cli/output.hpp"
#include "run/cell_netlists.hpp"
#include "run/offline.hpp"

namespace hal::tools {

int run_check(const CheckOptions& options) {
    auto nodes = requested_nodes(options);
    if (!nodes) return 1;
    if (!nodes->empty()) return check_cell(options, std::move(*nodes));
    Session session(offline());
    for (const std::string& name : options.assume) {
        session.absences().assume(name);
    }
    ShellOptions how;
    how.check = how.keep_going = how.notes = true;
    how.linuxcnc = options.linuxcnc;
    how.color = colours(STDERR_FILENO);
    Shell shell(session, how);
    ErrorsOnly output;
    return load_offline(shell, options, output,
                        [](const std::string& path) {
        write_all(STDERR_FILENO, path + ": no errors\n");
    }) == 0
               ? 0
               : 1;
}

}  // namespace hal::tools
