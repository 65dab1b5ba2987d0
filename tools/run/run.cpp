// SPDX-License-Identifier: MIT
// `hal run` and `halrun`: netlists in real-time threads until the program is ended.
#include "run/run.hpp"

#include <algorithm>
#include <csignal>
#include <cstring>
#include <fmt/core.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "machine/processes/address.hpp"
#include "run/cell_netlists.hpp"
#include "run/examples.hpp"
#include "run/fault_lines.hpp"
#include "run/hosted_machine.hpp"
#include "run/picture.hpp"
#include "run/report.hpp"
#include "run/service_notifier.hpp"
#include "text/typed_command.hpp"

namespace hal::tools {

namespace {

/// Ends the machine. Returns 1, after printing the reason, when a component could not stop what it
/// drives.
int end_machine(HostedMachine& machine) {
    const std::string report = machine.end_report();
    write_all(STDERR_FILENO, report);
    return report.empty() ? 0 : 1;
}

/// LinuxCNC's halrun: only what the commands print; threads start at the netlist's `start`; ends
/// after the files unless the user types.
int run_classic(HostedMachine& machine, const RunOptions& options) {
    const int status = machine.load();
    if ((status != 0 && !options.keep_going) || machine.stop.requested()) {
        return std::max(status, end_machine(machine));
    }
    const bool converses = options.interactive || options.words.empty();
    int said = 0;
    if (options.tcl) {
        said = machine.run_script("", {}, Pass::both);
    } else if (converses) {
        said = machine.converse({"halcmd: ", "halcmd+: "});
    }
    const int faulted = machine.faulted() ? 1 : 0;
    return std::max({status, said, faulted, end_machine(machine)});
}

/// Returns the reason of the end, unless the user ended the run here.
std::string end_reason(int signal) {
    const char* const name = signal == 0 || signal == SIGINT ? nullptr : ::sigabbrev_np(signal);
    return name ? fmt::format("ended by SIG{}\n", name) : "";
}

/// Opens the device of --watchdog, or that of a service manager with a watchdog. Returns false
/// after printing the error.
bool attach_watchdog(HostedMachine& machine, const RunOptions& options, ServiceNotifier& service) {
    if (options.watchdog.empty() && !service.watchdog()) return true;
    const char* const name = service.watchdog() ? "WatchdogSec= of the service" : "--watchdog";
    const auto lock = machine.session.lock();
    std::string problem, device = options.watchdog;
    if (machine.session.model().threads.empty()) {
        problem = fmt::format("{} needs a thread whose progress feeds the {}; the netlist has none",
                              name, service.watchdog() ? "watchdog" : "device");
    } else if (service.watchdog() && !device.empty()) {
        problem = "--watchdog and WatchdogSec= of the service exclude each other; leave one out";
    } else if (service.watchdog()) {
        device = service.watchdog_device(problem);
    }
    if (problem.empty() && machine.session.threads().attach_watchdog(device, problem)) return true;
    fail(options, problem);
    return false;
}

int run_plain(HostedMachine& machine, const RunOptions& options, std::vector<NodeLine> nodes,
              ServiceNotifier& service, RunJournal* journal) {
    int status =
        options.part.empty() ? machine.load() : load_node(machine, options, std::move(nodes));
    if ((status != 0 && !options.keep_going) || machine.stop.requested()) {
        return std::max(status, end_machine(machine));
    }
    if (!attach_watchdog(machine, options, service)) return 1;
    if (journal) {
        journal->begin(machine);
        if (const int failed = journal->begin_values(machine); failed != 0) return failed;
    }
    machine.start_threads();
    const std::string& name = machine.session.options().name;
    service.ready(fmt::format("machine '{}' runs; to control it: hal shell --name {}", name, name));
    print(loaded_summary(machine.session));
    if (options.interactive) {
        const FaultLines faults(machine.session);
        status = std::max(status, machine.converse({"hal> ", "hal+> "}));
    } else {
        const std::string duration = options.for_ns >= 0 ? "running" : "running until Ctrl-C";
        print(as_typed(fmt::format("{}; in another terminal: hal shell{}\n", duration,
                                   name == "default" ? "" : " --name " + name)));
        const auto picture = options.no_picture ? nullptr : Picture::start(machine.session);
        const FaultLines faults(machine.session, [&picture](const std::string& line) {
            if (picture) {
                picture->print_above(line);
            } else {
                write_all(STDERR_FILENO, line);
            }
        });
        machine.stop.wait_ns(options.for_ns);
    }
    const bool faulted = machine.faulted();
    service.stopping();
    if (journal) {
        journal->end_values();
    }
    // the threads take their figures with them
    const std::string report = timing_report(machine.session);
    const std::string failed_stops = machine.end_report();
    print("\n" + end_reason(machine.stop.signal()) + report);
    if (!failed_stops.empty()) {
        write_all(STDERR_FILENO, failed_stops);
        status = 1;
    }
    if (!options.watchdog.empty() && !machine.session.threads().watchdog_disarmed()) {
        const std::string& problem = machine.session.threads().watchdog_problem();
        const std::string reason = problem.empty()
                                       ? " was not disarmed, because a thread does not end"
                                       : " cannot be disarmed: " + problem;
        status =
            fail(options, options.watchdog + reason + "; it resets this host after its timeout");
    }
    return faulted ? 1 : status;
}

}  // namespace

int run_run(const RunOptions& options) { return run_machine(options, nullptr); }

int run_machine(const RunOptions& options, RunJournal* journal) {
    if (options.words.empty() && !options.interactive && !options.classic) {
        print(list_of(find_examples()) + "\n");
        return fail(options,
                    "missing netlist; type: hal run FILE.hal, hal run -I, or for one of "
                    "these machines: hal examples NAME");
    }
    for (const std::string& path : options.words) {
        const std::string example = options.classic ? "" : example_meant_by(path);
        if (example.empty()) continue;
        return fail(options, fmt::format("'{}' is not in this folder; to run the example from any "
                                         "folder type: hal examples {}",
                                         path, example));
    }
    if (!options.dds.empty() && options.part.empty()) {
        return fail(options,
                    "--dds applies to nodes of a netlist for several machines: add --node NAME; "
                    "dds_publish and dds_subscribe take " +
                        options.dds + " themselves");
    }
    if (const std::string problem = options.journal_problem(); !problem.empty()) {
        return fail(options, problem);
    }
    if (options.interactive && options.for_ns >= 0) {
        return fail(options, "-I and --for exclude each other; leave one out");
    }
    const auto nodes = requested_nodes(options);
    if (!nodes) return 1;
    ServiceNotifier service;  // before there are other threads, because it changes the environment
    HostedMachine machine(options, own_name(options), false,
                          {.sink = journal ? &journal->sink() : nullptr});
    machine.stop_at_once();
    if (!options.is_of_netlist) {
        machine.shell.note_journal_option(options.journal, options.keep_ns);
    }
    if (!machine.serve(true)) return 1;
    return options.classic ? run_classic(machine, options)
                           : run_plain(machine, options, *nodes, service, journal);
}

}  // namespace hal::tools
