// SPDX-License-Identifier: MIT
#include "machine/setup_call.hpp"

#include <algorithm>
#include <ctime>
#include <thread>

#include <unistd.h>

#include "execute/crash_table.hpp"

namespace hal {
namespace {

// The thread that is in the call may hold any lock, the allocator's among them.
void say(const char* text) noexcept { [[maybe_unused]] const auto written = write(STDERR_FILENO, text, std::strlen(text)); }

void watch(const std::atomic<bool>& over) noexcept {
    constexpr std::int64_t name_after_ns = 2'000'000'000, end_after_ns = 15'000'000'000, nap_ns = 20'000'000;
    const SetupCallNow& call = SetupCall::now;
    std::int64_t named_ns = 0;
    for (const std::int64_t begin = monotonic_ns(); !over.load();) {
        const timespec nap{0, nap_ns};
        nanosleep(&nap, nullptr);
        const std::int64_t since = call.since_ns.load(std::memory_order_acquire);
        if (since == 0) continue;
        const std::int64_t waited = monotonic_ns() - std::max(begin, since);
        const bool ends = waited > end_after_ns;
        if (!ends && (waited < name_after_ns || named_ns == since)) continue;
        named_ns = since;
        if (ends) make_all_safe();
        say("hal: '");
        say(call.instance);
        say("' (");
        say(call.component);
        say(") has not returned from ");
        say(call.what);
        say(ends ? " for 15 s; outputs were set to their safe values; the process ends\n" : "; the machine ends after it, at the latest in 13 s\n");
        if (ends) _exit(1);
    }
}

}  // namespace

void SetupGuard::end_soon() {
    if (!begun_.exchange(true)) std::thread([over = over_] { watch(*over); }).detach();
}

}  // namespace hal
