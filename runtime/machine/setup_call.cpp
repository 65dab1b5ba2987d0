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
void print(const char* text) noexcept { [[maybe_unused]] const auto written = write(STDERR_FILENO, text, std::strlen(text)); }

void watch(const SetupGuard::Flags& flags) noexcept {
    constexpr std::int64_t name_after_ns = 2'000'000'000, end_after_ns = 15'000'000'000;
    const SetupCallNow& call = SetupCall::now;
    std::int64_t named_ns = 0, ending_ns = 0;
    while (!flags.over.load()) {
        const timespec nap{0, ending_ns == 0 ? 100'000'000 : 20'000'000};
        nanosleep(&nap, nullptr);
        if (ending_ns == 0 && flags.ending.load()) ending_ns = monotonic_ns(), named_ns = 0;
        const std::int64_t since = call.since_ns.load(std::memory_order_acquire);
        if (since == 0) continue;
        const std::int64_t waited = monotonic_ns() - std::max(ending_ns, since);
        const bool ends = ending_ns != 0 && waited > end_after_ns;
        if (!ends && (waited < name_after_ns || named_ns == since)) continue;
        named_ns = since;
        if (ends) make_all_safe();
        print("hal: '");
        print(call.instance);
        print("' (");
        print(call.component);
        print(") has not returned from ");
        print(call.what);
        print(ends             ? " for 15 s; outputs set to their safe values; the process ends\n"
              : ending_ns != 0 ? " for 2 s; the machine ends when it returns, at the latest in 13 s\n"
                               : " for 2 s; all commands wait for it\n");
        if (ends) _exit(1);
    }
}

}  // namespace

SetupGuard::SetupGuard() {
    std::thread([flags = flags_] { watch(*flags); }).detach();
}

}  // namespace hal
