// SPDX-License-Identifier: MIT
// The base of the component of a bus: what a station does in each cycle before it knows its
// protocol.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

#include "hal/component.hpp"
#include "hal/discipline.hpp"
#include "hal/function_pair.hpp"
#include "hal/lasting_fault.hpp"
#include "hal/naming.hpp"

namespace hal::bus {

/// What receive() does in a cycle.
enum class Turn : std::uint8_t {
    exchanges,  ///< continues
    restarts,   ///< begins anew after an interruption
    returns,    ///< begins anew after cycles offline
    leaves,     ///< goes offline: transmit() is missing, nothing may be sent
    offline,    ///< stays offline
};
/// Returns true while the bus is to be shown as offline. [any]
constexpr bool is_offline(Turn turn) noexcept {
    return turn == Turn::leaves || turn == Turn::offline;
}
/// Returns true in the cycle in which the station begins anew. [any]
constexpr bool begins_anew(Turn turn) noexcept {
    return turn == Turn::restarts || turn == Turn::returns;
}

/// Two functions in one thread, of which neither works without the other; a thread whose clock may
/// follow the bus; faults that last. A component derives from it and declares its functions.
class BusComponent : public hal::Component {
protected:
    static constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

    /// Returns the full name of a function of an instance. [setup]
    using FullName = std::string (*)(const std::string& instance, const char* function);

    /// `fallback` names the instance for a host that does not. [setup]
    BusComponent(const hal_host* host, const char* fallback, const char* receive = "receive",
                 const char* transmit = "transmit", FullName full_name = dotted)
        : Component(host),
          name_(hal::own_name(fallback)),
          functions_(full_name(name_, receive), full_name(name_, transmit)) {}
    static std::string dotted(const std::string& instance, const char* function) {
        return instance + "." + function;
    }

    /// Called in start(), when the links are open. [setup]
    void begin_cycles() {
        faults_ = hal::extension<hal_faults>("hal.faults/1");
        functions_.start(faults_, this);
        interrupted_.store(false, std::memory_order_relaxed);
        offline_ = false;
        discipline_.lose();
    }
    /// Called first in receive(). Returns what this cycle does. `paired` is false for an instance
    /// with one function. [realtime]
    Turn receive_turn(hal::Cycle cycle, bool paired = true) noexcept {
        const bool was_offline = std::exchange(offline_, paired && !functions_.receive(cycle));
        if (offline_) return was_offline ? Turn::offline : Turn::leaves;
        const bool interrupted = interrupted_.exchange(false, std::memory_order_acquire);
        if (was_offline) return Turn::returns;
        return interrupted ? Turn::restarts : Turn::exchanges;
    }
    /// The next cycle of receive() begins anew. [any]
    void interrupt() noexcept { interrupted_.store(true, std::memory_order_release); }
    /// Returns true from interrupt() to the next cycle of receive(). [any]
    bool interrupted() const noexcept { return interrupted_.load(std::memory_order_acquire); }

    /// Moves the clock of all threads towards a reference, once it was claimed in start(); see
    /// Discipline. [realtime]
    void follow_reference(std::int64_t error_ns, std::int64_t period_ns) noexcept {
        clock_.step(discipline_.follow(error_ns, period_ns, clock_.limit_ns()));
    }

    /// Raises a fault at this moment. [realtime]
    void raise(const char* reason, double detail = not_a_number) noexcept {
        if (faults_ != nullptr) {
            faults_->raise(faults_, this, reason, detail);
        }
    }
    /// Raises a fault that lasts until end(). [realtime]
    void begin(hal::LastingFault& fault, const char* reason,
               double detail = not_a_number) noexcept {
        fault.begin(faults_, this, reason, detail);
    }
    void begin(hal::LastingFault& fault, const std::string& reason,
               double detail = not_a_number) noexcept {
        begin(fault, reason.c_str(), detail);
    }
    /// [realtime]
    void end(hal::LastingFault& fault) noexcept { fault.end(faults_, this); }
    /// Raises the fault of input pins that are not finite, and ends it: the bus carries their last
    /// valid values. Called in each cycle. [realtime]
    void record_invalid_inputs(bool invalid) noexcept {
        if (invalid && !invalid_fault_.lasts()) {
            begin(invalid_fault_,
                  "an input pin is NaN or infinite; the bus carries its last valid value");
        } else if (!invalid && invalid_fault_.lasts()) {
            end(invalid_fault_);
        }
    }

    const std::string name_;
    hal::FunctionPair functions_;
    hal::DisciplinedClock clock_;
    hal::Discipline discipline_;
    const hal_faults* faults_ = nullptr;

private:
    hal::LastingFault invalid_fault_;
    bool offline_ = false;
    std::atomic<bool> interrupted_{false};  // written by any thread
};

}  // namespace hal::bus
