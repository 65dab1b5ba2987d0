// SPDX-License-Identifier: MIT
#include "journal/cycle_stack.hpp"

#include <cstdint>
#include <utility>

namespace hal {
namespace {

constexpr std::size_t stack_bytes = std::size_t{1} << 20;  // as a real-time thread has

/// swapcontext() calls the kernel for the signal mask, which costs as much as a small cycle. A
/// sanitizer follows nothing else.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool jumps = false;
#else
constexpr bool jumps = true;
#endif

}  // namespace

CycleStack::CycleStack() : memory_(std::make_unique_for_overwrite<char[]>(stack_bytes)) {}

// makecontext() passes numbers of type int only.
void CycleStack::begin(unsigned high, unsigned low) {
    const auto address = std::uint64_t{high} << 32 | low;
    auto& self = *reinterpret_cast<CycleStack*>(static_cast<std::uintptr_t>(address));
    for (;;) {  // each turn is a cycle
        self.work_();
        self.ended_ = true;
        self.leave();
    }
}

bool CycleStack::run(std::function<void()> work) {
    work_ = std::move(work);
    return resume();
}

bool CycleStack::resume() {
    ended_ = false;
    if (!begun_) {
        begun_ = true;
        getcontext(&own_);
        own_.uc_stack.ss_sp = memory_.get();
        own_.uc_stack.ss_size = stack_bytes;
        own_.uc_link = nullptr;
        const auto address = static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(this));
        makecontext(&own_, reinterpret_cast<void (*)()>(&CycleStack::begin), 2,
                    static_cast<unsigned>(address >> 32), static_cast<unsigned>(address));
        if (!jumps || _setjmp(caller_jump_) == 0) {
            swapcontext(&caller_, &own_);
        }
    } else if (!jumps) {
        swapcontext(&caller_, &own_);
    } else if (_setjmp(caller_jump_) == 0) {
        _longjmp(own_jump_, 1);
    }
    return ended_;
}

void CycleStack::leave() {
    if (!jumps) {
        swapcontext(&own_, &caller_);
    } else if (_setjmp(own_jump_) == 0) {
        _longjmp(caller_jump_, 1);
    }
}

}  // namespace hal
