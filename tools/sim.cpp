// SPDX-License-Identifier: MIT
// `hal sim`: netlists on a virtual clock. Standard output has what the commands print and nothing else.
#include <fmt/core.h>
#include <unistd.h>

#include "machine.hpp"
#include "nodes.hpp"
#include "report.hpp"
#include "say.hpp"

namespace hal::tools {

int run_sim(const Options& options) {
    const bool advance = options.for_ns >= 0 || options.cycles != 0;
    if (options.for_ns >= 0 && options.cycles != 0) return fail(options, "--for and --cycles exclude each other; leave one out");
    auto nodes = nodes_asked_for(options);
    if (!nodes) return 1;
    if (!nodes->empty()) return sim_cell(options, std::move(*nodes));
    Machine machine(options, options.name.empty() ? fmt::format("sim-{}", ::getpid()) : options.name, true);
    if (!machine.serve(!options.name.empty())) return 1;
    int status = machine.load();
    if (status == 0 && advance) {
        machine.start_threads();
        machine.advance(options.for_ns, options.cycles);
    }
    ProcessOutput output;
    for (const std::string& command : options.execute)
        if (status == 0 && !machine.stop.requested()) status = machine.shell.execute(command, output, "<commandline>");
    if (machine.faulted() || machine.stop.requested()) status = 1;
    if (options.report) write_all(STDERR_FILENO, timing_report(machine.session));
    return status;
}

}  // namespace hal::tools
