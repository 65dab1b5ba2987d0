// SPDX-License-Identifier: MIT
#include "machine/report/setup_guard.hpp"

#include <algorithm>
#include <ctime>
#include <thread>

#include <unistd.h>

#include "execute/crash_table.hpp"
#include "execute/process_setup.hpp"
#include "machine/load/setup_call.hpp"
#include "machine/report/crash.hpp"

namespace hal {
namespace {

// The thread that is in the call may hold any lock, the allocator's among them.
void print_text(const char* text) noexcept {
    [[maybe_unused]] const auto written = write(STDERR_FILENO, text, std::strlen(text));
}

/// Prints a duration in whole seconds, rounded up.
void print_seconds(std::int64_t ns) noexcept {
    char text[24];
    char* at = text + sizeof text;
    *--at = '\0';
    std::int64_t seconds = (ns + 999'999'999) / 1'000'000'000;
    do {
        *--at = static_cast<char>('0' + seconds % 10);
    } while ((seconds /= 10) != 0);
    print_text(at);
    print_text(" s");
}

void print_name(const SetupCallNow& call) noexcept {
    print_text("hal: '");
    print_text(call.instance);
    print_text("' (");
    print_text(call.component);
    print_text(")");
}

void print_announced(const SetupCallNow& call, std::int64_t expected_ns) noexcept {
    print_name(call);
    print_text(" needs up to ");
    print_seconds(expected_ns);
    print_text(" to ");
    print_text(call.what);
    print_text(": ");
    print_text(call.why);
    print_text("\n");
}

/// Ends the process when the end of the machine takes longer than its limit: a thread of the machine
/// or of the runtime may get no CPU time for as long as others use it. `since_ns`: when it was first
/// seen in no call of a component; 0: not yet.
void limit_end(const SetupGuard::Flags& flags, std::int64_t& since_ns) noexcept {
    const std::int64_t limit = flags.limit_ns.load();
    const std::int64_t now = monotonic_ns();
    if (limit == SetupGuard::no_limit || since_ns == 0) {
        since_ns = now;
    }
    if (limit == SetupGuard::no_limit) return;
    if (now - since_ns <= limit) return;
    make_all_safe();
    print_text("hal: the machine has not ended for ");
    print_seconds(limit);
    print_text(
        ": a thread does not end, or gets no CPU time; outputs set to their safe values; the "
        "process ends\n");
    end_process(1);
}

/// The guard's thread. Prints which component has not returned from a call of setup: after 2 s, or
/// as much later as the call has announced, and once for each call. While the process ends it
/// prints this again, and 13 s later it sets the outputs to their safe values and ends the process.
void watch(const SetupGuard::Flags& flags) noexcept {
    release_unused_stack();
    constexpr std::int64_t announce_after_ns = 2'000'000'000;
    constexpr std::int64_t end_after_ns = 13'000'000'000;
    const SetupCallNow& call = SetupCall::now;
    std::int64_t named_ns = 0;
    std::int64_t announced_ns = 0;
    std::int64_t ending_ns = 0;
    std::int64_t outside_ns = 0;
    while (!flags.over.load()) {
        const timespec nap{0, ending_ns == 0 ? 100'000'000 : 20'000'000};
        nanosleep(&nap, nullptr);
        if (ending_ns == 0 && flags.ending.load()) {
            ending_ns = monotonic_ns();
            named_ns = 0;
        }
        const std::int64_t since = call.since_ns.load(std::memory_order_acquire);
        if (since == 0) {
            limit_end(flags, outside_ns);
            continue;
        }
        outside_ns = 0;
        const std::int64_t waited = monotonic_ns() - std::max(ending_ns, since);

        const std::int64_t expected = call.expected_ns.load();
        const std::int64_t name_after_ns = announce_after_ns + expected;
        if (expected > announce_after_ns && waited >= announce_after_ns && announced_ns != since) {
            announced_ns = since;
            print_announced(call, expected);
        }
        const bool ends = ending_ns != 0 && waited > name_after_ns + end_after_ns;
        if (!ends && (waited < name_after_ns || named_ns == since)) continue;
        named_ns = since;
        if (ends) {
            make_all_safe();
        }
        print_name(call);
        print_text(" has not returned from ");
        print_text(call.what);
        print_text(" for ");
        print_seconds(ends ? name_after_ns + end_after_ns : name_after_ns);
        if (ends) {
            print_text("; outputs set to their safe values; the process ends\n");
            end_process(1);
        } else if (ending_ns != 0) {
            print_text("; the machine ends when it returns, at the latest in 13 s\n");
        } else {
            print_text("; all commands wait for it\n");
        }
    }
}

}  // namespace

SetupGuard::SetupGuard() {
    std::thread([flags = flags_] { watch(*flags); }).detach();
}

}  // namespace hal
