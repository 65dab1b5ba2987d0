// SPDX-License-Identifier: MIT
// What the machine is doing in a component outside of the cycle: its constructor, start, stop or
// destructor. It holds the session's lock meanwhile, so when the call does not return, nothing else
// can be reported.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <string>

#include <pthread.h>

#include "execute/core.hpp"
#include "machine/load/foreign_code.hpp"

namespace hal {

/// The names are whole as long as `since_ns` does not change.
struct SetupCallNow {
    char instance[128] = "", component[128] = "";
    std::atomic<const char*> what{""};
    std::atomic<const char*> why{""};
    std::atomic<std::int64_t> expected_ns{0};  ///< duration that the component has announced
    std::atomic<pthread_t> thread{};  ///< that makes the call
    std::atomic<std::uint64_t> number{0};  ///< of the call, counted from 1
    std::atomic<std::int64_t> since_ns{0};  ///< on the monotonic clock; 0: none
};

class SetupCall {
public:
    /// There is one at a time in a process: the session's lock is held.
    SetupCall(const std::string& instance, const std::string& component,
              const char* what) noexcept {
        copy(instance, now.instance);
        copy(component, now.component);
        now.what = what;
        now.expected_ns = 0;
        now.thread = pthread_self();
        now.number.fetch_add(1);
        now.since_ns.store(monotonic_ns(), std::memory_order_release);
    }
    ~SetupCall() {
        code_.over();
        now.since_ns.store(0, std::memory_order_release);
    }
    SetupCall(const SetupCall&) = delete;

    /// Notes that the present call may take `ns`, a minute at most. [setup]
    static void expect(std::int64_t ns, const char* why) noexcept {
        constexpr std::int64_t max_ns = 60'000'000'000;
        now.why = why;
        now.expected_ns = std::clamp<std::int64_t>(ns, 0, max_ns);
    }

    inline static SetupCallNow now;  ///< [any]
    /// Returns true if the calling thread is in such a call. async-signal-safe
    static bool is_mine() noexcept {
        return now.since_ns.load(std::memory_order_acquire) != 0 &&
               pthread_equal(now.thread.load(), pthread_self()) != 0;
    }

private:
    ForeignCode code_;
    static void copy(const std::string& from, char (&to)[128]) noexcept {
        const std::size_t size = from.size() < sizeof to ? from.size() : sizeof to - 1;
        std::memcpy(to, from.data(), size);
        to[size] = '\0';
    }
};

}  // namespace hal
