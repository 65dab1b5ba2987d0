// SPDX-License-Identifier: MIT
// The guardian as the runtime sees it: starts the process, shares the image with it, ends it.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstddef>
#include <memory>
#include <string>

#include "link/system.hpp"
#include "modbus/master/image.hpp"

namespace hal::modbus {

/// Arguments of the program, in their order.
struct GuardianArguments {
    std::string program;  ///< path of hal-guardian
    std::string name;     ///< of the instance, for messages
    std::string file;     ///< of the configuration, for messages
    std::string link;
    std::string report;  ///< a file for what it did; empty: none
};

/// Descriptors of the guardian.
inline constexpr int guardian_memory_fd = 3;
inline constexpr int guardian_text_fd = 4;

/// Returns the file in which a guardian of a link leaves what it did; empty: there is no folder for
/// it. Creates the folder. [setup]
std::string report_file(const std::string& link);
/// Returns the content of the file and deletes it. [setup]
std::string take_report(const std::string& file);

class GuardianProcess {
public:
    GuardianProcess() = default;
    ~GuardianProcess();
    GuardianProcess(const GuardianProcess&) = delete;

    /// Starts the process and waits until it holds the line. Returns the problem, or "". [setup]
    std::string start(const GuardianArguments& arguments, const std::string& text, const Bus& bus,
                      const Plan& plan);
    const Image& image() const noexcept { return image_; }
    /// Waits for its end, for at most `limit_ns`. Returns whether it has ended; called by a thread
    /// that may wait.
    bool has_ended_within(std::int64_t limit_ns) noexcept;
    /// Continues a guardian that was suspended by a signal. [any]
    void resume() const noexcept;
    /// Continues it, requests the stop telegrams and the end, and waits for it. Returns false when
    /// it had to be killed. [setup]
    bool end() noexcept;

private:
    void* memory_ = nullptr;
    std::size_t size_ = 0;
    Image image_;
    pid_t pid_ = -1;
    link::Descriptor process_;
};

}  // namespace hal::modbus
