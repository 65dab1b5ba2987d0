// SPDX-License-Identifier: MIT
// Notices that a component has closed or replaced a file descriptor of the runtime. No poll()
// reports that, and the machine would be deaf to its clients and to signals.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>

namespace hal {

struct LostDescriptor;

/// Looks at the listed descriptors every 100 ms from a thread of its own, which uses none. When one
/// is lost, it stops the machine, reports the descriptor and ends the process with status 1. A
/// limit of open files that was lowered is raised again (FileLimit).
class DescriptorWatch {
public:
    static constexpr std::int64_t interval_ns = 100'000'000;
    /// For the threads to confirm that they have stopped.
    static constexpr std::int64_t halt_timeout_ns = 500'000'000;

    /// `halt` stops the threads of the machine; `halted` returns true when their outputs have their
    /// safe values, or never will by themselves. Both are called from the thread of the watch.
    DescriptorWatch(std::function<void()> halt, std::function<bool()> halted);
    ~DescriptorWatch();
    DescriptorWatch(const DescriptorWatch&) = delete;

private:
    void work();
    [[noreturn]] void end(const LostDescriptor& lost);

    std::function<void()> halt_;
    std::function<bool()> halted_;
    std::mutex mutex_;
    std::condition_variable wake_;
    bool over_ = false;  // guarded by mutex_
    std::thread thread_;
};

}  // namespace hal
