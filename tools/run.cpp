// SPDX-License-Identifier: MIT
// `hal run` and `halrun`: netlists in real-time threads until somebody ends it.
#include <algorithm>
#include <fmt/core.h>
#include <unistd.h>

#include "machine.hpp"
#include "nodes.hpp"
#include "picture.hpp"
#include "report.hpp"
#include "say.hpp"
#include "shell/address.hpp"

namespace hal::tools {

namespace {

/// LinuxCNC's halrun: only what the commands print; threads start when the netlist says so; ends after the files unless
/// the user types.
int run_classic(Machine& machine, const Options& options) {
    const int status = machine.load();
    if ((status != 0 && !options.keep_going) || machine.stop.requested()) return status;
    return options.interactive || options.words.empty() ? std::max(status, machine.talk({"halcmd: ", "halcmd+: "})) : status;
}

int run_plain(Machine& machine, const Options& options, std::vector<NodeLine> nodes) {
    int status = options.part.empty() ? machine.load() : load_node(machine, options, std::move(nodes));
    if ((status != 0 && !options.keep_going) || machine.stop.requested()) return status;
    machine.start_threads();
    const std::string& name = machine.session.options().name;
    print(loaded_summary(machine.session));
    if (options.interactive) {
        status = std::max(status, machine.talk({"hal> ", "hal+> "}));
    } else {
        print(fmt::format("{}; in another terminal: hal shell{}\n", options.for_ns >= 0 ? "running" : "running until Ctrl-C",
                          name == "default" ? "" : " --name " + name));
        const auto picture = options.no_picture ? nullptr : Picture::start(machine.session);
        machine.stop.wait_ns(options.for_ns);
    }
    const bool faulted = machine.faulted();
    const std::string report = timing_report(machine.session);  // the threads take their figures with them
    machine.shut_down();
    print("\n" + report);
    return faulted ? 1 : status;
}

}  // namespace

int run_run(const Options& options) {
    if (options.words.empty() && !options.interactive && !options.classic)
        return fail(options, "a netlist is missing; type: hal run FILE.hal, or hal run -I");
    if (!options.dds.empty() && options.part.empty())
        return fail(options,
                    "--dds is about the nodes of a netlist for several machines: add --node NAME; dds_publish and dds_subscribe take " +
                        options.dds + " themselves");
    if (options.interactive && options.for_ns >= 0) return fail(options, "-I and --for exclude each other; leave one out");
    const auto nodes = nodes_asked_for(options);
    if (!nodes) return 1;
    Machine machine(options, own_name(options), false);
    if (!machine.serve(true)) return 1;
    return options.classic ? run_classic(machine, options) : run_plain(machine, options, *nodes);
}

}  // namespace hal::tools
