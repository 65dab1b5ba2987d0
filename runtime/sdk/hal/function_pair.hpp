// SPDX-License-Identifier: MIT
// The two functions of a bus, `receive` and `transmit`: one without the other is a fault.
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <string>
#include <utility>

#include "hal/component.hpp"
#include "hal/function_monitor.hpp"
#include "hal/lasting_fault.hpp"

namespace hal {

/// Monitors that both functions of an instance run, in the same thread. Each function calls its
/// member below first in every cycle. A function that misses the other one for `tolerated_cycles`
/// of the slower one raises a fault, once; the fault ends when the other one runs again. A single
/// missing cycle is not a fault: functions are moved with `delf` and `addf` while the machine runs.
///
/// Members with the suffix `_` are written by the function named in their comment only; what the
/// other function reads is atomic, so the functions may be in two threads.
class FunctionPair {
public:
    /// cycles without the other function until the fault is raised
    static constexpr unsigned tolerated_cycles = FunctionMonitor::tolerated_cycles;

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
        receives_.restart();
        transmits_.restart();
        exchanges_.restart();
        receive_is_missing_ = transmit_is_missing_ = false;
        apart_ = 0;
    }

    /// First in receive(). Returns false while nothing is sent: transmit() has not passed for
    /// `tolerated_cycles`. The bus is then shown as offline. [realtime]
    bool receive(Cycle cycle) noexcept {
        receives_.ran(cycle.period_ns());
        receiver_.store(thread_of(cycle), std::memory_order_relaxed);
        transmit_is_missing_ = transmits_.is_missing(cycle.period_ns());
        report(unsent_fault_, transmit_is_missing_, no_transmit_);
        return !exchanges_.is_missing(cycle.period_ns());
    }

    /// First in transmit(). Returns false when nothing may be sent: receive() has not run since the
    /// last cycle, or runs in another thread. Outputs must not move without their inputs, and slots
    /// are unknown without them. [realtime]
    bool transmit(Cycle cycle) noexcept {
        transmits_.ran(cycle.period_ns());
        receive_is_missing_ = receives_.is_missing(cycle.period_ns());
        report(unreceived_fault_, receive_is_missing_, no_receive_);
        const bool together = receiver_.load(std::memory_order_relaxed) == thread_of(cycle);
        if (together) {
            apart_ = 0;
        } else if (apart_ < tolerated_cycles) {
            ++apart_;
        }
        report(apart_fault_, apart_ >= tolerated_cycles && !receive_is_missing_, apart_text_);
        if (receives_.is_late() || apart_ > tolerated_apart) return false;
        exchanges_.ran(cycle.period_ns());
        return true;
    }

    /// Returns true while receive() has not run for `tolerated_cycles`: outputs are to be made
    /// safe. Only for transmit(). [realtime]
    bool receive_is_missing() const noexcept { return receive_is_missing_; }

    /// Returns true while receive() has not run since the last cycle. Only for transmit(). [realtime]
    bool receive_is_late() const noexcept { return receives_.is_late(); }

    /// Returns true while transmit() has not run for `tolerated_cycles`. Only for receive().
    /// [realtime]
    bool transmit_is_missing() const noexcept { return transmit_is_missing_; }

private:
    /// transmit() runs before receive() in the first cycle, or the thread was replaced
    static constexpr unsigned tolerated_apart = 2;

    /// Identifies the thread: the host gives all functions of a thread the same hal_cycle, and each
    /// thread another one.
    static const void* thread_of(Cycle cycle) noexcept {
        return std::bit_cast<const hal_cycle*>(cycle);
    }

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
    FunctionMonitor receives_;  ///< transmit() monitors receive()
    FunctionMonitor transmits_;  ///< receive() monitors transmit()
    FunctionMonitor exchanges_;  ///< receive() monitors the cycles of transmit() that passed
    std::atomic<const void*> receiver_{};  ///< its thread; written by receive()
    bool transmit_is_missing_ = false;  ///< of receive()
    bool receive_is_missing_ = false;  ///< of transmit()
    unsigned apart_ = 0;  ///< of transmit()
    LastingFault unsent_fault_;  ///< of receive()
    LastingFault unreceived_fault_, apart_fault_;  ///< of transmit()
};

}  // namespace hal
