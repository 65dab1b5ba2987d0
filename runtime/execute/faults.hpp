// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "hal/abi.h"
#include "hal/lasting_faults.h"
#include "hal/queue.hpp"

namespace hal {

/// One fault as the cycle records it: numbers only. The session formats the message.
struct FaultEvent {
    hal_fault_code code = HAL_FAULT_NONE;
    /// the model's number of a function (exception, budget) or pin (not finite)
    std::uint32_t subject = 0;
    std::uint64_t cycle = 0;
    std::int64_t time_ns = 0;
    double value = 0.0;             ///< budget: execution time, ns; component: its detail
    const char* reason = nullptr;   ///< component faults: a literal of the component
    const void* self = nullptr;     ///< component faults: the instance; not finite: the pin
    /// number of events of the same kind, including this one; 0: queued individually
    std::uint64_t repeats = 0;
    std::int64_t last_ns = 0;       ///< time of the last of them
    /// the repeats have different error numbers; `value` is the newest
    bool varied = false;

    /// Returns true if both are of the same kind: they differ in time and measured value only.
    /// [any]
    bool same(const FaultEvent& o) const noexcept {
        return similar(o) && varied == o.varied && (varied || !has_code() || value == o.value);
    }
    /// Returns true if both differ in time, measured value and error number only. [any]
    bool similar(const FaultEvent& o) const noexcept {
        return code == o.code && subject == o.subject && reason == o.reason && self == o.self;
    }
    /// Returns true if the detail is an error number, {x}, not a measured value. [any]
    bool has_code() const noexcept {
        if (reason == nullptr) return false;
        for (const char* c = reason; *c != '\0'; ++c) {
            if (c[0] == '{' && c[1] == 'x') return true;
        }
        return false;
    }
};

/// Lets a few faults per kind and second pass, then one per second with a count until there is a
/// quiet second, so that a storm of them neither fills the queue nor buries another fault. Faults
/// that differ in their error number are kinds of their own, up to a few in a second; further ones
/// are counted together.
class FaultLimiter {
public:
    static constexpr std::int64_t interval_ns = 1'000'000'000;
    static constexpr unsigned burst = 4;

    /// Calls `queue(event)` at once, or counts it. [realtime]
    template <class Queue>
    void raise(FaultEvent event, Queue&& queue) noexcept {
        event.varied = event.has_code() && is_one_of_many(event);
        Kind* place = kinds_.data();
        for (Kind& k : kinds_) {
            const bool same = k.used && k.first.same(event);
            if (same && (k.held != 0 || event.time_ns - k.since_ns < interval_ns)) {
                if (event.time_ns - k.since_ns >= interval_ns) {
                    release(k, queue);
                    k.since_ns = event.time_ns;
                }
                if (k.passed < burst && !event.varied) {
                    ++k.passed;
                    return queue(event);
                }
                if (k.held++ == 0) {
                    ++pending_;
                    k.first = event;
                }
                if (event.varied) {
                    k.first.value = event.value;
                }
                k.first.last_ns = event.time_ns;
                return;
            }
            if (same || !k.used) {
                place = &k;
                break;
            }
            if (k.since_ns < place->since_ns) {
                place = &k;
            }
        }
        release(*place, queue);
        *place = {event, event.time_ns, 0, 1, true};
        if (!event.varied) return queue(event);
        ++pending_;
        place->held = 1;
        place->first.last_ns = event.time_ns;
    }
    /// Queues the counts of past seconds. Called at the end of each cycle. [realtime]
    template <class Queue>
    void flush(std::int64_t now_ns, Queue&& queue) noexcept {
        if (pending_ == 0) [[likely]]
            return;
        for (Kind& k : kinds_) {
            if (k.held != 0 && now_ns - k.since_ns >= interval_ns) {
                release(k, queue);
                k.since_ns = now_ns;
            }
        }
    }
    /// Queues all counts and discards all kinds. [realtime]
    template <class Queue>
    void clear(Queue&& queue) noexcept {
        for (Kind& k : kinds_) {
            release(k, queue);
            k.used = false;
        }
    }

private:
    struct Kind {
        FaultEvent first{};       // that was counted
        std::int64_t since_ns = 0;  // when its second began
        std::uint64_t held = 0;      // that were counted since
        unsigned passed = 0;    // that were queued at once
        bool used = false;
    };
    /// Returns true if several others that differ in their error number only were raised within a
    /// second, but not this one.
    bool is_one_of_many(const FaultEvent& event) const noexcept {
        unsigned others = 0;
        for (const Kind& k : kinds_) {
            const bool counts = k.used && k.first.similar(event) &&
                                (k.held != 0 || event.time_ns - k.since_ns < interval_ns);
            if (!counts) continue;
            if (k.first.same(event)) return false;
            others += k.first.varied ? burst : 1;
        }
        return others >= burst;
    }
    template <class Queue>
    void release(Kind& k, Queue&& queue) noexcept {
        if (k.held == 0) return;
        k.first.repeats = k.held;
        queue(k.first);
        k.first.repeats = 0;
        k.held = 0;
        --pending_;
    }
    std::array<Kind, 16> kinds_{};
    std::size_t pending_ = 0;  // kinds with some that were counted
};

/// Fault state shared by all threads; the component `faults` and the session read it.
struct FaultBoard {
    FaultBoard() noexcept;
    FaultBoard(const FaultBoard&) = delete;

    /// given out as extension "hal.faults/1"; written with atomic builtins
    hal_lasting_faults shared{};
    /// Counts a fault; any thread may raise one. [realtime]
    void count(const FaultEvent& event, std::uint32_t thread) noexcept {
        __atomic_store_n(&shared.faults.last_code, static_cast<std::uint32_t>(event.code),
                         __ATOMIC_RELAXED);
        __atomic_store_n(&shared.faults.last_thread, thread, __ATOMIC_RELAXED);
        __atomic_store_n(&shared.faults.last_cycle, event.cycle, __ATOMIC_RELAXED);
        __atomic_fetch_add(&shared.faults.count, 1, __ATOMIC_RELEASE);
    }
    /// Acknowledges all counted faults except the newest of each condition that lasts. [any]
    void clear() noexcept;

    /// A condition begins: until end(), clear() does not acknowledge its newest fault, which is
    /// counted next. Does nothing when it lasts already. Of more than max_lasting conditions at a
    /// time, the newest are acknowledged as if they were over. [realtime]
    void begin(const void* owner, const void* key) noexcept;
    /// The condition is over. Does nothing when it does not last. [realtime]
    void end(const void* owner, const void* key) noexcept;
    /// All conditions are over whose owner is at first <= owner < last. [any]
    void end_all(const void* first, const void* last) noexcept;
    /// Counts a fault that was raised outside of a cycle, as in `stop`, where no thread has a
    /// record for it. [any]
    void count_outside_cycle() noexcept { outside_cycle.fetch_add(1, std::memory_order_relaxed); }
    /// [any]
    bool lasts(const void* owner, const void* key) const noexcept;

    static constexpr std::size_t max_lasting = 1024;
    /// A free one has no key and no owner. A thread that begins a condition takes the owner first,
    /// one that ends it the key.
    struct Lasting {
        std::atomic<const void*> owner{nullptr}, key{nullptr};
    };
    std::array<Lasting, max_lasting> lasting{};
    std::atomic<std::uint64_t> outside_cycle{0};  ///< never cleared
    std::atomic<std::size_t> lasting_end{0};  ///< those behind it were never used
};

}  // namespace hal
