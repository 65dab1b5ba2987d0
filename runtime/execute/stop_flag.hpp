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
        page_->may_run.store(!stopped, order);
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
};

}  // namespace hal
