// SPDX-License-Identifier: MIT
// A thread that checks network interfaces whenever the kernel reports a change, so that no cycle
// has to.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "link/system.hpp"

namespace hal::link {

class LinkMonitor {
public:
    /// Starts the thread. It calls `look` after every rtnetlink report about an interface, at least
    /// every `every_ms` (also without rtnetlink), after nudge(), and when the descriptor `also` is
    /// readable. [setup]
    LinkMonitor(const char* thread_name, int every_ms, std::function<void()> look, int also = -1);
    /// Stops the thread; waits for a call of `look` to end. [setup]
    ~LinkMonitor();
    LinkMonitor(const LinkMonitor&) = delete;
    LinkMonitor& operator=(const LinkMonitor&) = delete;

    /// Triggers a check now. One write to an eventfd, which never waits. [realtime]

    void nudge() noexcept;

private:
    void run();

    const int every_ms_, also_;
    const std::function<void()> look_;
    Descriptor events_, wake_;
    std::atomic<bool> ending_{false};
    std::thread thread_;
};

}  // namespace hal::link
