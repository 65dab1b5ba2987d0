// SPDX-License-Identifier: MIT
// The memory in which the values of a bus meet the cycle. It has no pointers, so that the master
// may be in another process (the guardian) that maps the same memory.
//
// Every member has one writer: `engine` is the thread or process with the line, `cycle` the
// real-time thread. All are lock-free atomics; a value is one of them, so that it never tears.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "bus/guardian/cycle_counter.hpp"
#include "bus/guardian/start_state.hpp"
#include "bus/guardian/stop_requests.hpp"
#include "modbus/config/plan.hpp"

namespace hal::modbus {

/// What happened on a bus; the rows of event_texts.hpp are in this order.
enum class Event : std::uint8_t {
    slave_online,
    slave_offline,
    slave_corrupt,  ///< answers with wrong check sequences
    exception,  ///< value: the code
    line_lost,
    line_open,
    stopping,  ///< value: the StopReason
    stop_acknowledged,  ///< value: ns since the stop
    stop_unconfirmed,
    guardian_lost,
    previous_stop,  ///< value: what the guardian of the previous run did
    slave_rejects,  ///< a telegram, as often in a row as a silent slave is asked
    slave_accepts,  ///< all telegrams again
    guardian_stalls,
    guardian_runs,  ///< again
    guardian_killed,  ///< at the end of the component; value: ns that it had
    stop_broadcast,  ///< value: ns from the stop to the end of the frame
    stop_unfinished,  ///< at the end of the component; value: ns that the master had
    value_changes,  ///< between all answers, and is not accepted; value: its index in the plan
    values_accepted,  ///< all of the slave again
};

using bus::StopReason;

struct EventRecord {
    Event event = Event::slave_online;
    std::uint32_t slave = 0;
    std::uint32_t telegram = 0;
    std::int64_t value = 0;
};

/// The phase of the engine.
enum class Phase : std::uint32_t { starting, running, stopping, stopped, ended };

/// A cache line of each writer: a slave that is not exchanged costs the cycle nothing.
struct SlaveImage {
    // written by the engine
    alignas(64) std::atomic<std::uint32_t> online{0};
    std::atomic<std::uint32_t> stopped{0};  ///< the stop telegrams are acknowledged
    std::atomic<std::uint32_t> stop_pending{0};  ///< they are requested and not acknowledged
    std::atomic<std::uint32_t> timeouts{0};
    std::atomic<std::uint32_t> errors{0};  ///< corrupt answers
    std::atomic<std::uint32_t> exceptions{0};
    // written by the cycle
    alignas(64) std::atomic<std::uint32_t> command{0};  ///< DriveCommand
    std::atomic<std::uint64_t> speed{0};  ///< double, rpm
};

/// Written by the engine.
struct TelegramImage {
    std::atomic<std::int64_t> stamp{0};
    std::atomic<std::uint32_t> rejected{0};
    std::atomic<std::uint32_t> failures{0};
};

/// Command of a drive: direction, and bit 2 for a reset.
enum DriveCommand : std::uint32_t {
    drive_stop = 0,
    drive_forward = 1,
    drive_reverse = 2,
    drive_reset = 4
};

struct ImageHeader {
    static constexpr std::size_t event_capacity = 256;
    static constexpr std::size_t slave_words = 4;  ///< a bit of each slave

    // written by the cycle
    bus::CycleCounter cycles;
    std::atomic<std::uint32_t> outputs_valid{0};  ///< the cycle has written all outputs
    std::atomic<std::uint32_t> event_tail{0};
    // written by any thread of the runtime
    bus::StopRequests requests;
    // written by the engine; each cycle reads this line
    alignas(64) std::atomic<std::uint32_t> phase{0};
    std::atomic<std::uint32_t> event_head{0};
    std::atomic<std::uint64_t> turns{0};  ///< of the guardian; it waits for at most 5 ms in each
    std::atomic<std::uint64_t> telegrams{0};  ///< answered
    std::atomic<std::int64_t> busy_ns{0};
    /// Slaves of which a pin may change: set by the engine, cleared by the cycle.
    std::array<std::atomic<std::uint64_t>, slave_words> changed{};
    // written by the engine
    alignas(64) std::atomic<std::uint32_t> events_lost{0};
    std::atomic<std::uint32_t> stops_followed{0};  ///< of StopRequests::Request::count
    std::atomic<std::uint32_t> line_open{0};
    std::atomic<std::uint32_t> broadcasts{0};  ///< broadcast stops
    bus::StartState start;
    std::array<EventRecord, event_capacity> events{};
};
static_assert(ImageHeader::slave_words * 64 >= max_unit, "a bus has a slave of each address");
static_assert(std::atomic<std::uint64_t>::is_always_lock_free &&
              std::atomic<std::int64_t>::is_always_lock_free);

/// A view of the memory. Copies see the same memory.
class Image {
public:
    Image() = default;
    /// Returns the bytes that a plan needs. [setup]
    static std::size_t size_of(const Bus& bus, const Plan& plan) {
        return offset_values(bus.slaves.size(), plan.telegrams.size()) +
               plan.values.size() *
                   (sizeof(std::atomic<std::uint64_t>) + sizeof(std::atomic<std::int64_t>));
    }
    /// `memory` has size_of() bytes at a multiple of 64. `fresh`: it is initialised. [setup]
    Image(void* memory, const Bus& bus, const Plan& plan, bool fresh);

    ImageHeader& header() const noexcept { return *header_; }
    SlaveImage& slave(std::size_t n) const noexcept { return slaves_[n]; }
    /// When the last answer of a telegram arrived, in ns; 0: never. Of a read: when its oldest
    /// value was accepted.
    std::atomic<std::int64_t>& stamp(std::size_t telegram) const noexcept {
        return telegrams_[telegram].stamp;
    }
    /// Whether the slave rejects a telegram: what it reads is as old as that of an offline slave.
    std::atomic<std::uint32_t>& rejected(std::size_t telegram) const noexcept {
        return telegrams_[telegram].rejected;
    }
    /// How often a telegram has failed in a row: no answer, a corrupt one, or an exception.
    std::atomic<std::uint32_t>& failures(std::size_t telegram) const noexcept {
        return telegrams_[telegram].failures;
    }
    /// The bits of a value: a double when it is scaled or a float, else a whole number.
    std::atomic<std::uint64_t>& value(std::size_t n) const noexcept { return values_[n]; }
    /// When a value that is read was accepted, in ns; 0: never.
    std::atomic<std::int64_t>& value_stamp(std::size_t n) const noexcept {
        return value_stamps_[n];
    }

    /// Queues an event; the engine calls it. A full queue counts it.
    void tell(const EventRecord& event) const noexcept {
        const std::uint32_t head = header_->event_head.load(std::memory_order_relaxed);
        if (head - header_->event_tail.load(std::memory_order_acquire) >=
            ImageHeader::event_capacity) {
            header_->events_lost.fetch_add(1, std::memory_order_relaxed);
            return;
        }
        header_->events[head % ImageHeader::event_capacity] = event;
        header_->event_head.store(head + 1, std::memory_order_release);
    }
    /// Takes the oldest event; the cycle calls it. [realtime]
    bool pop(EventRecord& event) const noexcept {
        const std::uint32_t tail = header_->event_tail.load(std::memory_order_relaxed);
        if (tail == header_->event_head.load(std::memory_order_acquire)) return false;
        event = header_->events[tail % ImageHeader::event_capacity];
        header_->event_tail.store(tail + 1, std::memory_order_release);
        return true;
    }
    /// The cycle looks at the slave again; called behind the changes that it is to see. [any]
    void touch(std::size_t slave) const noexcept {
        header_->changed[slave / 64].fetch_or(std::uint64_t{1} << slave % 64,
                                              std::memory_order_release);
    }
    /// Returns the slaves of word `n` that were touched, and forgets them; the cycle calls it.
    /// [realtime]
    std::uint64_t take_changed(std::size_t n) const noexcept {
        if (header_->changed[n].load(std::memory_order_relaxed) == 0) return 0;
        return header_->changed[n].exchange(0, std::memory_order_acquire);
    }
    /// Requests a stop. [any]
    void stop(StopReason reason) const noexcept { header_->requests.request(reason); }
    /// Returns whether the last requested stop is over. [any]
    bool has_stopped() const noexcept {
        return header_->stops_followed.load(std::memory_order_acquire) ==
                   header_->requests.newest().count &&
               header_->phase.load(std::memory_order_acquire) ==
                   static_cast<std::uint32_t>(Phase::stopped);
    }

private:
    static std::size_t offset_telegrams(std::size_t slaves) {
        return sizeof(ImageHeader) + slaves * sizeof(SlaveImage);
    }
    static std::size_t offset_values(std::size_t slaves, std::size_t telegrams) {
        return offset_telegrams(slaves) + telegrams * sizeof(TelegramImage);
    }

    ImageHeader* header_ = nullptr;
    SlaveImage* slaves_ = nullptr;
    TelegramImage* telegrams_ = nullptr;
    std::atomic<std::uint64_t>* values_ = nullptr;
    std::atomic<std::int64_t>* value_stamps_ = nullptr;
};

}  // namespace hal::modbus
