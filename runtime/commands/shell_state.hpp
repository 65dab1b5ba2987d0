// SPDX-License-Identifier: MIT
// What a Shell holds. Internal to the shell.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "commands/linuxcnc_check.hpp"
#include "commands/shell.hpp"
#include "netlist/journal_line.hpp"
#include "netlist/netlist.hpp"

namespace hal {

struct Shell::State {
    Session& session;
    bool collecting = false;               ///< after `begin`
    std::vector<Command> collected = {};
    bool quit = false;
    std::atomic<bool> cancelled{false};    ///< set by any thread, read by a command that waits
    /// What $NAME means to this shell; empty: the environment of the process. A client of the
    /// socket brings its own.
    std::function<std::optional<std::string>(const std::string&)> variable = {};
    /// Lines of `show latency` about signals between machines, shared by all shells of the session
    /// and read with its lock held.
    std::shared_ptr<std::vector<std::string>> latencies =
        std::make_shared<std::vector<std::string>>();
    struct NotedJournal {
        JournalLine journal;
        std::string origin;  ///< where it is named; empty: nowhere yet
    };
    /// What Shell::note_journal() has noted, shared by all shells of the session as well.
    std::shared_ptr<NotedJournal> journal = std::make_shared<NotedJournal>();
    ScriptRunner run_script = {};
    LinuxcncCheck linuxcnc_check = {};  ///< `hal check --linuxcnc`
    /// With TWOPASS, while the loads are gathered: one `loadrt` for each LinuxCNC module, which is
    /// loaded once; else nullptr.
    std::vector<Command>* module_loads = nullptr;
    std::vector<std::uint32_t> module_load_texts = {};  ///< of the session's sources, held for them
    /// what [SECTION]KEY means to this shell, when it is not the session's INI file
    std::optional<Ini> ini = {};
};

}  // namespace hal
