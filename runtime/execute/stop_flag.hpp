// SPDX-License-Identifier: MIT
// Whether the functions of a thread may run. A process that was copied by fork() must not run them
// a second time.
#pragma once

#include <atomic>

namespace hal {

/// A flag in a page of its own that the kernel clears in a child process, where it reads as TRUE:
/// whatever way a function copies the process, no function runs behind it in the copy. Where the
/// kernel cannot do that (before 4.14), the copy is not recognised.
class StopFlag {
public:
    StopFlag();  ///< [setup]
    ~StopFlag();
    StopFlag(const StopFlag&) = delete;

    bool load(std::memory_order order) const noexcept { return !page_->may_run.load(order); }
    void store(bool stopped, std::memory_order order) noexcept {
        stopped_.store(stopped, std::memory_order_relaxed);
        page_->may_run.store(!stopped, order);
    }
    /// This process is a copy that continues in the place of its parent: the flag has the value
    /// that it had there.
    void continue_in_copy() noexcept {
        page_->may_run = !stopped_;
        page_->original = true;
    }
    /// Returns true in a child process.
    bool in_copy() const noexcept { return !page_->original.load(std::memory_order_relaxed); }
    /// Returns what load() reads.
    const void* memory() const noexcept { return page_; }

private:
    struct Page {
        std::atomic<bool> may_run{true};
        std::atomic<bool> original{true};
    };
    Page* const page_;
    std::atomic<bool> stopped_{false};  // the same value in memory that a child keeps
};

}  // namespace hal
