// SPDX-License-Identifier: MIT
// Monitors one interface in a thread of its own, so that no cycle has to: up or down, lost and
// returned, bit rate, state of the controller. All of it is reported by rtnetlink.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "link/counting.hpp"
#include "link/system.hpp"
#include "netlink/link_monitor.hpp"

namespace hal::can::socketcan {

/// An interface as the kernel describes it.
struct Interface {
    int index = 0;  ///< 0: no such interface
    bool is_can = false;
    bool up = false;
    bool has_echo = false;  ///< the driver returns a frame that was on the bus
    bool listen_only = false;
    unsigned mtu = 0;
    std::string kind;  ///< "vcan", "can", "vxcan", …
    std::uint32_t bit_rate = 0;
    std::uint32_t data_rate = 0;
    bool has_state = false;
    State state = State::active;
    bool has_counters = false;
    std::uint8_t send_errors = 0;
    std::uint8_t receive_errors = 0;
};

/// Queries the kernel. [setup]
Interface ask(const std::string& name);

class ControllerMonitor {
public:
    /// Starts the thread. It calls `reopen` when an interface of that name has returned under
    /// another number. [setup]
    ControllerMonitor(std::string name, Counting&, int index, std::uint32_t restart_ms,
                      std::function<bool(int index)> reopen);

    /// Checks now. One write to an eventfd, which never waits. [realtime]
    void nudge() noexcept { monitor_->nudge(); }
    std::atomic<bool> wants_restart{false};

private:
    void look();
    void publish_figures(const Interface& now);
    State publish_state(const Interface& now, State before);
    /// Restarts a controller that is off the bus when its time is over, or on request.
    void follow_bus_off(const Interface& now);
    bool restart_controller(int index);

    const std::string name_;
    Counting& counting_;
    int index_;
    const std::uint32_t restart_ms_;
    const std::function<bool(int)> reopen_;
    std::int64_t off_since_ns_ = 0;
    std::optional<link::LinkMonitor> monitor_;  // the last one: its thread uses all of the above
};

}  // namespace hal::can::socketcan
