// SPDX-License-Identifier: MIT
// A cycle with a stack of its own, which can be left in the middle and continued later. Cycles of
// several threads overlap like this on a single thread.
#pragma once

#include <csetjmp>
#include <functional>
#include <memory>

#include <ucontext.h>

namespace hal {

/// [setup]
class CycleStack {
public:
    CycleStack();
    CycleStack(const CycleStack&) = delete;

    /// Calls `work` on this stack. Returns true when it has ended, and false when it has called
    /// leave(). `work` throws nothing.
    bool run(std::function<void()> work);
    /// Continues `work` behind leave(). Returns like run().
    bool resume();
    /// Returns to who called run() or resume(). Called by `work`.
    void leave();

private:
    static void begin(unsigned high, unsigned low);

    std::unique_ptr<char[]> memory_;
    ucontext_t own_{};
    ucontext_t caller_{};
    std::jmp_buf own_jump_;
    std::jmp_buf caller_jump_;
    std::function<void()> work_;
    bool begun_ = false;
    bool ended_ = true;
};

}  // namespace hal
