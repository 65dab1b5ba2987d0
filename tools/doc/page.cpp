// SPDX-License-Identifier: MIT
#include "doc/page.hpp"

namespace hal::tools {

Page threads_page() {
    Page page;
    page.name = "threads";
    page.summary = "Makes up to three real-time threads";
    page.doc =
        "Fastest first; a slower thread's period is a whole multiple of the fastest one's. "
        "`newthread NAME PERIOD` makes any number of "
        "threads, one by one; its options have the thread's number here: `cpu1=2 policy1=fifo "
        "priority1=80 spin1=50us budget1=800us`.\n\n"
        "Each thread has pins of its own: `NAME.time` and `NAME.tmax` (ns), `NAME.tmax-increased`, "
        "`NAME.threadbeat` (cycles), and what "
        "`show thread NAME` prints.\n";
    page.singleton = page.built_in = true;
    for (const char* n : {"1", "2", "3"}) {
        page.arguments.push_back(
            {std::string("name") + n, std::string("name of thread ") + n, "", false});
        page.arguments.push_back({std::string("period") + n, "its period in ns", "", false});
        page.arguments.push_back({std::string("fp") + n,
                                  "accepted and ignored: every thread may use floating point", "1",
                                  false});
    }
    return page;
}

}  // namespace hal::tools
