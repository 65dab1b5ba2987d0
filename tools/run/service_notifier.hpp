// SPDX-License-Identifier: MIT
// Reports the state of a run to the service manager that started it: systemd's protocol of
// sd_notify(3), datagrams of lines KEY=VALUE to the socket $NOTIFY_SOCKET.
#pragma once

#include <cstdint>
#include <string>
#include <thread>

namespace hal::tools {

class ServiceNotifier {
public:
    /// Takes NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID from the environment, so that programs
    /// of the machine do not inherit them. [setup]
    ServiceNotifier();
    ~ServiceNotifier();
    ServiceNotifier(const ServiceNotifier&) = delete;

    /// Returns true when the service manager restarts this process unless it reports progress.
    bool watchdog() const { return !socket_.empty() && watchdog_us_ > 0; }
    /// Starts to report progress. Returns the path of a device as `ThreadControl::attach_watchdog`
    /// opens it: a byte written there is a sign of progress, `V` ends the reports; empty, and sets
    /// `problem`, when that fails.
    std::string watchdog_device(std::string& problem);

    /// Reports that the machine runs; `status` is a line that `systemctl status` shows.
    void ready(const std::string& status);
    /// Reports that the machine is shutting down.
    void stopping();

private:
    void send(const std::string& lines) const;
    void forward(int from) const;

    std::string socket_;  // empty: no service manager
    std::int64_t watchdog_us_ = 0;
    int pipe_ = -1;  // the end that is written to
    std::thread forwarder_;
};

}  // namespace hal::tools
