// SPDX-License-Identifier: MIT
// The order of the calls on a bus or on queues in memory, in the journal of the program that uses
// them. They are executed again, with the calls in the order of then.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include <sched.h>

#include "link/call_journal.hpp"

namespace hal::link {

/// Lets one journaled call at a time use a bus. Its links share it.
class CallOrder {
public:
    /// Returns that of the bus behind an address, `sim:NAME/STATION?option`. Buses of different
    /// `kind` are different ones. [setup]
    static std::shared_ptr<CallOrder> of(std::string_view kind, std::string_view address) {
        static std::mutex mutex;
        static std::map<std::string, std::weak_ptr<CallOrder>> all;
        const std::string name =
            std::string(kind) + ":" + std::string(address.substr(0, address.find_first_of("/?")));
        const std::lock_guard lock(mutex);
        std::shared_ptr<CallOrder> order = all[name].lock();
        if (!order) {
            order = std::make_shared<CallOrder>();
            all[name] = order;
        }
        return order;
    }

private:
    friend class OrderedCall;
    std::atomic_flag busy_;
    // A thread has spun in vain: the one that has the bus does not run. Cleared when it goes on.
    std::atomic<bool> stalled_{false};
};

/// One call. Without a journal, and within another such call of the same thread, it is not ordered.
///
///   1. thread A sets busy_   2. A takes ticket n   3. A uses the bus   4. A clears busy_
///   5. thread B finds busy_ set between 1 and 4, and spins
///   6. A stalls: B gives up after a bounded time. It does not use the bus, and notes that
class OrderedCall {
public:
    enum class Wait : std::uint8_t {
        bounded,  ///< a cycle: is_made() may be false
        made,  ///< setup, and what a simulation does seldom: waits as long as it takes
    };
    OrderedCall(CallOrder& order, Wait wait) noexcept : order_(order) {
        const JournalMode mode = journal_mode();
        if (depth == 0 && mode != JournalMode::none) {
            begin(mode, wait);
        }
        ++depth;  // behind begin(): in a re-execution another cycle runs while this one waits
    }
    ~OrderedCall() {
        --depth;
        if (is_held_) {
            order_.stalled_.store(false, std::memory_order_relaxed);
            order_.busy_.clear(std::memory_order_release);
        }
    }
    OrderedCall(const OrderedCall&) = delete;

    /// Returns false when another thread has the bus.
    bool is_made() const noexcept { return is_made_; }

private:
    void begin(JournalMode mode, Wait wait) noexcept {
        if (mode == JournalMode::records) {
            is_held_ = acquire(wait);
        }
        if (wait == Wait::bounded) {
            is_made_ = is_held_;
            JournaledCall call;
            call.number(is_made_);
        }
        if (is_made_ && hal_journal_order) {
            hal_journal_order();
        }
    }
    bool acquire(Wait wait) noexcept {
        constexpr unsigned max_spins = 1000;  // some 20 us
        for (unsigned spins = 0; order_.busy_.test_and_set(std::memory_order_acquire); ++spins) {
            if (spins < max_spins && !order_.stalled_.load(std::memory_order_relaxed)) {
#if defined(__x86_64__)
                __builtin_ia32_pause();
#endif
            } else if (wait == Wait::bounded) {
                order_.stalled_.store(true, std::memory_order_relaxed);
                return false;
            } else {
                sched_yield();
            }
        }
        return true;
    }

    // initial-exec: the first access in a cycle must not allocate
    [[gnu::tls_model("initial-exec")]] inline static thread_local unsigned depth = 0;
    CallOrder& order_;
    bool is_held_ = false;
    bool is_made_ = true;
};

/// Returns what `read` returns: in the order of the calls, or, while another thread has the bus, as
/// a recorded value that `exchange(call, value)` exchanges. [realtime]
template <class Read, class Exchange>
auto ordered_value(CallOrder& order, Read read, Exchange exchange) noexcept {
    const OrderedCall call(order, OrderedCall::Wait::bounded);
    auto value = read();
    if (!call.is_made()) {
        JournaledCall recorded;
        exchange(recorded, value);
    }
    return value;
}

}  // namespace hal::link
