// SPDX-License-Identifier: MIT
#include "execute/wait.hpp"

#include <algorithm>
#include <climits>
#include <ctime>
#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "execute/core.hpp"

namespace hal {
namespace {

// on 32-bit machines: the call that takes seconds of 64 bits, as this build has them
#ifdef SYS_futex_time64
constexpr long futex_call = SYS_futex_time64;
#else
constexpr long futex_call = SYS_futex;
#endif

void relax() noexcept {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__) || defined(__arm__)
    asm volatile("yield");
#endif
}

}  // namespace

std::int64_t Wait::spin(std::int64_t deadline_ns) noexcept {
    std::int64_t now = monotonic_ns();
    while (now < deadline_ns) {
        relax();
        now = monotonic_ns();
    }
    return now;
}

void Wait::sleep(std::int64_t deadline_ns) const noexcept {
    const timespec at = to_timespec(deadline_ns - spin_ns);
    while (monotonic_ns() < deadline_ns - spin_ns) {
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr);
    }
}

bool Wait::sleep(std::int64_t deadline_ns, const std::atomic<std::uint32_t>& bell,
                 std::uint32_t heard) const noexcept {
    const timespec at = to_timespec(deadline_ns - spin_ns);
    while (monotonic_ns() < deadline_ns - spin_ns) {
        // FUTEX_WAIT_BITSET takes an absolute CLOCK_MONOTONIC time
        syscall(futex_call, &bell, FUTEX_WAIT_BITSET_PRIVATE, heard, &at, nullptr,
                FUTEX_BITSET_MATCH_ANY);
        if (bell.load(std::memory_order_acquire) != heard) return false;
    }
    return true;
}

void Wait::ring(std::atomic<std::uint32_t>& bell) noexcept {
    bell.fetch_add(1, std::memory_order_release);
    syscall(futex_call, &bell, FUTEX_WAKE_PRIVATE, INT_MAX, nullptr, nullptr, 0);
}

std::int64_t Wait::default_spin_ns(std::int64_t period_ns) noexcept {
    return std::min<std::int64_t>(period_ns * 2 / 5, 150'000);
}

}  // namespace hal
