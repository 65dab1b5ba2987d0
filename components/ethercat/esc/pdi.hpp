// SPDX-License-Identifier: MIT
// What the firmware of an emulated slave sees of its EtherCAT slave controller (ESC): the process
// data interface.
//
//     class Blinker : public esc::Application {
//         void run(esc::Pdi& pdi, std::int64_t now_ns) noexcept override {
//             if (auto control = pdi.take_al_control()) pdi.set_al_status(*control & 0x0f, 0);   // no checks: goes to every state
//         }
//     };
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace hal::ethercat::esc {

/// The controller as its firmware sees it. The firmware works between frames; what it writes is
/// complete for the next frame.
class Pdi {
public:
    virtual ~Pdi() = default;

    /// Returns the requested AL control (0120h), once per write of the master. [realtime]
    virtual std::optional<std::uint16_t> take_al_control() noexcept = 0;
    /// Sets AL status (0130h) and its code (0134h). [realtime]
    virtual void set_al_status(std::uint16_t status, std::uint16_t code) noexcept = 0;
    /// Returns AL status as last set. [realtime]
    virtual std::uint16_t al_status() const noexcept = 0;

    /// Settings of a sync manager as the master wrote them.
    struct SyncManager {
        std::uint16_t start = 0;
        std::uint16_t length = 0;
        std::uint8_t control = 0;
        bool enabled = false;
        bool repeat_request = false;  ///< 0806h bit 1
    };
    /// Returns the settings of a sync manager. [realtime]
    virtual SyncManager sync_manager(unsigned number) const noexcept = 0;

    /// Reads what the master wrote: the newest complete buffer, or the message of a full mailbox,
    /// which is empty afterwards. Returns the number of bytes, 0 if there is nothing new.
    /// [realtime]
    virtual std::size_t read_sync_manager(unsigned number, std::span<std::uint8_t> to) noexcept = 0;
    /// Writes what the master reads: the next buffer, or the message of an empty mailbox. Returns
    /// false if the mailbox is full or the sync manager is disabled. [realtime]
    virtual bool write_sync_manager(unsigned number,
                                    std::span<const std::uint8_t> from) noexcept = 0;
    /// Confirms a repeat request of the master (0807h bit 1). [realtime]
    virtual void acknowledge_repeat(unsigned number) noexcept = 0;

    /// Returns whether the process data watchdog has expired (0440h). [realtime]
    virtual bool watchdog_expired() const noexcept = 0;

    /// State of the distributed clock unit.
    struct Sync {
        bool active = false;  ///< SYNC0 is generated (0981h bits 0 and 1)
        std::uint32_t sync0_cycle_ns = 0;
        std::uint32_t sync1_cycle_ns = 0;
        bool sync1_active = false;  ///< SYNC1 is generated (0981h bit 2)
        std::uint64_t pulses = 0;  ///< SYNC0 pulses so far
        std::uint64_t sync1_pulses = 0;  ///< SYNC1 pulses so far
        std::int64_t last_pulse_ns = 0;  ///< time of the newest SYNC0 pulse, on the clock of run()
        std::uint64_t last_pulse_dc_ns = 0;  ///< the same, system time
    };
    /// Returns the state of SYNC0 and SYNC1. [realtime]
    virtual const Sync& sync() const noexcept = 0;
    /// Returns when the newest process data frame passed. [realtime]
    virtual std::int64_t last_frame_ns() const noexcept = 0;
    /// Reads or writes a register or memory of the controller, without the rules of sync managers.
    /// [realtime]
    virtual std::uint8_t* memory(std::uint16_t address) noexcept = 0;
};

/// The firmware of an emulated slave.
class Application {
public:
    virtual ~Application() = default;
    /// Starts as after power-on: all volatile state is lost. [realtime]
    virtual void power_on(Pdi&) noexcept = 0;
    /// Handles the loss of power: outputs are off. [realtime]
    virtual void power_off() noexcept {}
    /// Lets time pass without power, for what moves by itself. [realtime]
    virtual void rest(std::int64_t /*now_ns*/) noexcept {}
    /// Works once; called at the end of each frame that concerns the slave, at every SYNC0 and
    /// SYNC1 pulse, when the watchdog expires, and at least every millisecond of traffic, in order
    /// of time. [realtime]
    virtual void run(Pdi&, std::int64_t now_ns) noexcept = 0;
    /// Returns whether time alone brings it further: then it runs at frames that do not concern the
    /// slave, too. [realtime]
    virtual bool waits() const noexcept { return true; }
};

}  // namespace hal::ethercat::esc
