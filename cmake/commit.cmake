# SPDX-License-Identifier: MIT
# cmake -DGIT=PROGRAM -DROOT=FOLDER -DOUTPUT=FILE -P commit.cmake
# Writes a source with the commit that is checked out in ROOT; without GIT, with the one that `git archive` wrote, or `unknown`.
set(commit unknown)
set(archived)
if(EXISTS "${ROOT}/cmake/commit.txt")
    file(STRINGS "${ROOT}/cmake/commit.txt" archived LIMIT_COUNT 1)
endif()
if(archived MATCHES "^[0-9a-f]+$")
    string(SUBSTRING "${archived}" 0 10 commit)
endif()
if(GIT)
    execute_process(COMMAND "${GIT}" -c safe.directory=* -C "${ROOT}" rev-parse --short=10 HEAD
                    OUTPUT_VARIABLE found OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE result)
    if(result EQUAL 0)
        set(commit "${found}")
    endif()
endif()
file(CONFIGURE OUTPUT "${OUTPUT}" @ONLY CONTENT [[
// SPDX-License-Identifier: MIT
// Generated: the commit that was checked out when this was built.
#include "paths.hpp"

namespace hal::paths {
constinit const std::string_view commit = "@commit@";
}  // namespace hal::paths
]])
file(TOUCH_NOCREATE "${OUTPUT}")  # the same commit as before: still as new as what it depends on
