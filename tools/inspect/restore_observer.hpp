// SPDX-License-Identifier: MIT
// Restores settings of an interface however this process ends.
#pragma once

#include <string>
#include <sys/types.h>
#include <vector>

#include "inspect/interface_settings.hpp"

namespace hal::tools {

/// A child process in a session of its own that restores what has been changed as soon as this
/// object, or the process, is gone: it waits for the end of a connection, which the kernel closes
/// also after SIGKILL. What it has to restore it has from the fork. When the child itself has been
/// killed, the destructor restores.
class RestoreObserver {
public:
    /// Starts the child. Call it before any thread is started. [setup]
    RestoreObserver(std::string interface, const std::vector<InterfaceSetting>& settings);
    ~RestoreObserver();
    RestoreObserver(const RestoreObserver&) = delete;

    /// Returns true when the child runs. [setup]
    explicit operator bool() const { return child_ > 0; }
    /// Has setting `number` restored at the end. Call it before the change. Returns false when the
    /// child is gone. [setup]
    bool add(std::size_t number);
    /// Restores now, and waits until it is done. Returns the settings that could not be restored.
    /// [setup]
    std::vector<std::string> restore();

private:
    [[noreturn]] void observe(int connection);
    std::vector<std::string> restore_here();

    std::string interface_;
    const std::vector<InterfaceSetting>& settings_;
    std::vector<std::size_t> changed_;
    int connection_ = -1;
    pid_t child_ = -1;
};

}  // namespace hal::tools
