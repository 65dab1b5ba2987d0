// SPDX-License-Identifier: MIT
#include "journal/cycle_stack.hpp"

#include <cstdint>
#include <utility>

namespace hal {
namespace {

constexpr std::size_t stack_bytes = std::size_t{1} << 20;  // as a real-time thread has

}  // namespace

CycleStack::CycleStack() : memory_(std::make_unique_for_overwrite<char[]>(stack_bytes)) {}

// makecontext() passes numbers of type int only.
void CycleStack::begin(unsigned high, unsigned low) {
    const auto address = std::uint64_t{high} << 32 | low;
    auto& self = *reinterpret_cast<CycleStack*>(static_cast<std::uintptr_t>(address));
    self.work_();
    self.ended_ = true;
}

bool CycleStack::run(std::function<void()> work) {
    work_ = std::move(work);
    ended_ = false;
    getcontext(&own_);
    own_.uc_stack.ss_sp = memory_.get();
    own_.uc_stack.ss_size = stack_bytes;
    own_.uc_link = &caller_;
    const auto address = static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(this));
    makecontext(&own_, reinterpret_cast<void (*)()>(&CycleStack::begin), 2,
                static_cast<unsigned>(address >> 32), static_cast<unsigned>(address));
    return resume();
}

bool CycleStack::resume() {
    swapcontext(&caller_, &own_);
    return ended_;
}

void CycleStack::leave() { swapcontext(&own_, &caller_); }

}  // namespace hal
