// SPDX-License-Identifier: MIT
// The guardian as the runtime sees it: starts the process, shares the image with it, ends it.
#pragma once

#include <cstdint>
#include <string>

#include "bus/guardian/child_process.hpp"
#include "modbus/master/image.hpp"

namespace hal::modbus {

/// Arguments of the program, in their order.
struct GuardianArguments {
    std::string program;  ///< path of hal-guardian
    std::string name;     ///< of the instance, for messages
    std::string file;     ///< of the configuration, for messages
    std::string link;
    std::string report;  ///< a file for what it did; empty: none
    int lock = -1;       ///< descriptor that the guardian inherits; -1: none
};

class GuardianProcess {
public:
    GuardianProcess() = default;
    ~GuardianProcess() { end(); }
    GuardianProcess(const GuardianProcess&) = delete;

    /// Starts the process and waits until it holds the line. Returns the problem, or "". [setup]
    std::string start(const GuardianArguments& arguments, const std::string& text, const Bus& bus,
                      const Plan& plan);
    const Image& image() const noexcept { return image_; }
    /// Waits for its end, for at most `limit_ns`. Returns whether it has ended; called by a thread
    /// that may wait.
    bool has_ended_within(std::int64_t limit_ns) noexcept {
        return child_.has_ended_within(limit_ns);
    }
    /// Continues a guardian that was suspended by a signal. [any]
    void resume() const noexcept { child_.resume(); }
    /// Continues it, requests the stop telegrams and the end, and waits for it, for at most
    /// end_limit_ns(). Returns false when it had to be killed. [setup]
    bool end() noexcept;
    std::int64_t end_limit_ns() const noexcept { return end_limit_ns_; }

private:
    bus::ChildProcess child_;
    Image image_;
    std::int64_t end_limit_ns_ = 0;
};

}  // namespace hal::modbus
