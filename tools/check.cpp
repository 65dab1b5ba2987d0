// SPDX-License-Identifier: MIT
// `hal check`: everything wrong with netlists that can be known without running them.
#include "offline.hpp"
#include "say.hpp"

namespace hal::tools {

int run_check(const Options& options) {
    Session session(offline());
    ShellOptions how;
    how.check = how.keep_going = true;
    how.color = colours(2);
    Shell shell(session, how);
    ErrorsOnly output;
    return load_offline(shell, options, output) == 0 ? 0 : 1;
}

}  // namespace hal::tools
