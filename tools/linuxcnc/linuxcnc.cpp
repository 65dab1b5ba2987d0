// SPDX-License-Identifier: MIT
#include "linuxcnc/linuxcnc.hpp"

#include <unistd.h>

#include "cli/output.hpp"
#include "commands/files.hpp"
#include "linuxcnc/configuration.hpp"
#include "linuxcnc/launch.hpp"
#include "linuxcnc/leftovers.hpp"
#include "machine/processes/programs.hpp"
#include "run/journal_option.hpp"
#include "run/run_journal.hpp"

namespace hal::tools {

namespace {

/// Returns what describes the journal to be written, without its netlist's line.
RunOptions journal_options(const LinuxcncOptions& options, const Configuration& configuration) {
    RunOptions journal;
    static_cast<NetlistOptions&>(journal) = options;
    static_cast<JournalSettings&>(journal) = options;
    journal.words = {configuration.file};
    if (!options.journal.empty()) {
        journal.journal = absolute_path(options.journal);  // the machine runs in another folder
    }
    return journal;
}

int launch(const LinuxcncOptions& options, const Configuration& configuration, MachineLock& lock,
           RunJournal* journal) {
    const std::string path = ::getenv("PATH");
    LinuxcncOptions hosted = options;
    hosted.max_gap_ns = configuration.max_gap_ns;
    hosted.max_gap_realtime_ns = configuration.max_gap_realtime_ns;
    HostedMachine machine(hosted, own_name(options), false,
                          {.sink = journal ? &journal->sink() : nullptr});
    machine.session.programs().leave_deaths_to_caller();  // Launch reports what is done
    ::setenv("PATH", path.c_str(), 1);  // a wrapper in the configuration's bin/ has precedence
    machine.shell.note_journal_option(options.journal, options.keep_ns);
    if (!machine.serve(true)) return 1;
    if (journal) {
        journal->begin(machine);
    }
    return Launch(options, configuration, machine, lock, journal).run();
}

int run_locked(const LinuxcncOptions& options, const Configuration& configuration) {
    MachineLock lock;
    if (!lock.problem().empty()) return fail(options, lock.problem());
    if (lock.took_over()) {
        remove_segments(configuration);
    }
    RunOptions journaled = journal_options(options, configuration);
    if (::chdir(configuration.folder.c_str()) != 0) {
        return fail(options, "cannot enter " + configuration.folder);
    }
    export_configuration(configuration, options);
    adopt_orphans();
    add_journal_of_netlists(journaled);
    if (const std::string problem = journaled.journal_problem(); !problem.empty()) {
        return fail(options, problem);
    }
    const int status = run_with_journal(journaled, [&](RunJournal* journal) {
        return launch(options, configuration, lock, journal);
    });
    remove_segments(configuration);
    return status;
}

}  // namespace

int run_linuxcnc(const LinuxcncOptions& options) {
    const auto configuration = read_configuration(options);
    if (!configuration) return 1;
    const int status = run_locked(options, *configuration);
    remove_expanded(*configuration);
    return status;
}

}  // namespace hal::tools
