// SPDX-License-Identifier: MIT
#include "linuxcnc/linuxcnc.hpp"

#include <unistd.h>

#include "cli/output.hpp"
#include "linuxcnc/configuration.hpp"
#include "linuxcnc/launch.hpp"
#include "linuxcnc/leftovers.hpp"

namespace hal::tools {

namespace {

int run_locked(const LinuxcncOptions& options, const Configuration& configuration) {
    MachineLock lock;
    if (!lock.problem().empty()) return fail(options, lock.problem());
    if (lock.took_over()) {
        remove_segments(configuration);
    }
    if (::chdir(configuration.folder.c_str()) != 0) {
        return fail(options, "cannot enter " + configuration.folder);
    }
    export_configuration(configuration, options);
    adopt_orphans();
    int status = 1;
    {
        const std::string path = ::getenv("PATH");
        LinuxcncOptions hosted = options;
        hosted.max_gap_ns = configuration.max_gap_ns;
        hosted.max_gap_realtime_ns = configuration.max_gap_realtime_ns;
        HostedMachine machine(hosted, own_name(options), false);
        ::setenv("PATH", path.c_str(), 1);  // a wrapper in the configuration's bin/ has precedence
        if (!machine.serve(true)) return 1;
        status = Launch(options, configuration, machine, lock).run();
    }
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
