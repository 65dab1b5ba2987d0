// SPDX-License-Identifier: MIT
#include "run/replay_panel.hpp"

#include <csignal>
#include <fmt/core.h>
#include <string>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include "cli/other_program.hpp"
#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "journal/keyframes.hpp"
#include "machine/processes/address.hpp"
#include "run/moment_link.hpp"
#include "run/replay_server.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {
namespace {

/// The process of `hal panel`. It ends with this object.
class PanelProcess {
public:
    PanelProcess(const std::string& instance, std::uint16_t port)
        : process_(start_program("hal-panel",
                                 {"panel", "--name", instance, "--port", std::to_string(port)},
                                 Lifetime::of_this)),
          descriptor_(process_ < 0 ? -1
                                   : static_cast<int>(::syscall(SYS_pidfd_open, process_, 0))) {}
    ~PanelProcess() {
        if (descriptor_ < 0) return;
        // by its descriptor: MomentLink may have waited for it already
        ::syscall(SYS_pidfd_send_signal, descriptor_, SIGTERM, nullptr, 0);
        ::waitpid(process_, nullptr, 0);
        ::close(descriptor_);
    }
    PanelProcess(const PanelProcess&) = delete;

    bool runs() const { return descriptor_ >= 0; }
    /// A descriptor that becomes readable when the process has ended.
    int end() const { return descriptor_; }

private:
    const pid_t process_;
    const int descriptor_;
};

}  // namespace

int run_replay_panel(const ReplayOptions& options, JournalFile& file, const WhatIf& change) {
    Keyframes frames;
    MomentLink moment(frames);
    ReplayServer server(file, moment);
    if (!moment.start(options, file, change)) return 1;
    StopRequest stop;
    stop.when_signalled([&moment] { moment.interrupt(true); });
    const std::string name = options.name.empty() ? "replay" : options.name;
    Diagnostics diagnostics;
    if (!server.open(name, diagnostics)) {
        write_all(STDERR_FILENO, render(diagnostics, Sources{}));
        return 1;
    }
    if (!options.until.empty()) {
        server.begin_with({"goto", options.until});
    }
    if (!options.break_condition.empty()) {
        server.begin_with({"goto", "0s"});
        server.begin_with({"break", options.break_condition});
        server.begin_with({"continue"});
    }
    const PanelProcess panel(name, options.port);
    if (!panel.runs()) return 1;
    if (!server.serve({stop.fd(), panel.end()})) {
        return fail(options, ended_unexpectedly);
    }
    const bool is_wanted = stop.requested() || server.ended();
    stop.release();
    return is_wanted ? 0 : 1;
}

}  // namespace hal::tools
