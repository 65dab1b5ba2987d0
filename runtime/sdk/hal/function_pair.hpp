// SPDX-License-Identifier: MIT
// The two functions of a bus, `receive` and `transmit`: one without the other is a fault.
#pragma once

#include <pthread.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <utility>

#include "hal/function_monitor.hpp"
#include "hal/lasting_fault.hpp"

namespace hal {

/// Monitors that both functions of an instance run, in the same thread. Each function calls its
/// member below first in every cycle. A function that misses the other one for `tolerated_cycles`
/// of its own cycles raises a fault, once; the fault ends when the other one runs again. A single
/// missing cycle is not a fault: functions are moved with `delf` and `addf` while the machine runs.
///
/// Members with the suffix `_` are written by the function named in their comment only; what the
/// other function reads is atomic, so the functions may be in two threads.
class FunctionPair {
public:
    /// cycles without the other function until the fault is raised
    static constexpr unsigned tolerated_cycles = 100;

    /// The full names of both functions. [setup]
    FunctionPair(const std::string& receive, const std::string& transmit)
        : no_transmit_(missing(receive, transmit)),
          no_receive_(missing(transmit, receive)),
          apart_text_("'" + receive + "' and '" + transmit +
                      "' are in different threads; nothing is sent; type: delf " + transmit +
                      " THREAD, and add it to the thread of the other") {}

    /// Forgets all cycles. `record` may be nullptr; `self` is the instance. [setup]
    void start(const hal_faults* record, const void* self) noexcept {
        record_ = record;
        self_ = self;
        receiving_ = {};
        transmitting_ = {};
        exchanging_ = {};
        apart_ = 0;
    }

    /// First in receive(). Returns false while nothing is sent: transmit() has not passed for
    /// `tolerated_cycles`. The bus is then shown as offline. [realtime]
    bool receive() noexcept {
        receives_.fetch_add(1, std::memory_order_relaxed);
        receiver_.store(pthread_self(), std::memory_order_relaxed);
        const bool alone = receiving_.misses(transmits_) >= tolerated_cycles;
        report(unsent_fault_, alone, no_transmit_);
        return exchanging_.misses(exchanges_) <= tolerated_cycles;
    }

    /// First in transmit(). Returns false when nothing may be sent: receive() has not run since the
    /// last cycle, or runs in another thread. Outputs must not move without their inputs, and slots
    /// are unknown without them. [realtime]
    bool transmit() noexcept {
        transmits_.fetch_add(1, std::memory_order_relaxed);
        const unsigned missed = transmitting_.misses(receives_);
        report(unreceived_fault_, missed >= tolerated_cycles, no_receive_);
        const bool together = receiver_.load(std::memory_order_relaxed) == pthread_self();
        if (together) {
            apart_ = 0;
        } else if (apart_ < tolerated_cycles) {
            ++apart_;
        }
        report(apart_fault_, apart_ >= tolerated_cycles && missed < tolerated_cycles, apart_text_);
        if (missed > 0 || apart_ > tolerated_apart) return false;
        exchanges_.fetch_add(1, std::memory_order_relaxed);
        return true;
    }

    /// Returns true while receive() has not run for `tolerated_cycles` of transmit(): outputs are
    /// to be made safe. Only for transmit(). [realtime]
    bool receive_is_missing() const noexcept { return transmitting_.missed >= tolerated_cycles; }

    /// Returns true while transmit() has not run for `tolerated_cycles` of receive(). Only for
    /// receive(). [realtime]
    bool transmit_is_missing() const noexcept { return receiving_.missed >= tolerated_cycles; }

private:
    /// transmit() runs before receive() in the first cycle, or the thread was replaced
    static constexpr unsigned tolerated_apart = 2;

    /// Counts cycles in which a counter of the other function stays the same.
    struct Misses {
        std::uint64_t seen = 0;
        unsigned missed = 0;

        unsigned misses(const std::atomic<std::uint64_t>& counter) noexcept {
            const std::uint64_t now = counter.load(std::memory_order_relaxed);
            if (now != seen) {
                missed = 0;
            } else if (missed <= tolerated_cycles) {
                ++missed;
            }
            seen = now;
            return missed;
        }
    };

    static std::string missing(const std::string& running, const std::string& absent) {
        return missing_function_text(running, absent, "nothing is sent");
    }
    void report(LastingFault& fault, bool lasts, const std::string& reason) const noexcept {
        if (lasts && !fault.lasts()) {
            fault.begin(record_, self_, reason.c_str());
        } else if (!lasts && fault.lasts()) {
            fault.end(record_, self_);
        }
    }

    const std::string no_transmit_, no_receive_, apart_text_;
    const hal_faults* record_ = nullptr;
    const void* self_ = nullptr;
    /// written by the function of the name, read by the other one
    std::atomic<std::uint64_t> receives_{0}, transmits_{0};
    /// cycles of transmit() that passed; written by transmit()
    std::atomic<std::uint64_t> exchanges_{0};
    std::atomic<pthread_t> receiver_{};  ///< written by receive()
    Misses receiving_, exchanging_;  ///< of receive()
    Misses transmitting_;  ///< of transmit()
    unsigned apart_ = 0;  ///< of transmit()
    LastingFault unsent_fault_;  ///< of receive()
    LastingFault unreceived_fault_, apart_fault_;  ///< of transmit()
};

}  // namespace hal
