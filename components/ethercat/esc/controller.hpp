// SPDX-License-Identifier: MIT
// An emulated EtherCAT slave controller (ESC): memory, registers, sync managers, FMMUs, EEPROM,
// watchdog and distributed clock. It executes the datagrams that pass it; its firmware is an
// Application.
//
// A controller works on the clock of its segment: times are ns, as in ethernet::Port. All functions
// of one line run on one thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "ethercat/esc/distributed_clock.hpp"
#include "ethercat/esc/eeprom.hpp"
#include "ethercat/esc/fmmus.hpp"
#include "ethercat/esc/frame_interest.hpp"
#include "ethercat/esc/pdi.hpp"
#include "ethercat/esc/ports.hpp"
#include "ethercat/esc/processing_unit.hpp"
#include "ethercat/esc/sync_managers.hpp"
#include "ethercat/wire/frames.hpp"

namespace hal::ethercat::esc {

namespace register_facts {
struct Range;
}

/// Properties of a controller. The defaults are those of a common one with two MII ports.
struct Settings {
    std::uint8_t type = 0x11;
    std::uint8_t revision = 0;
    std::uint16_t build = 0x0002;
    unsigned fmmus = 8;
    unsigned sync_managers = 8;  ///< at most 16
    unsigned ram_kb = 60;  ///< from 1000h on; at most 60
    std::array<PortKind, ports> port_kinds{PortKind::mii, PortKind::mii, PortKind::none,
                                           PortKind::none};
    bool dc = true;
    bool dc_64_bit = true;
    bool lrw = true;
    bool read_write = true;  ///< LRW; APRW, FPRW and BRW
    /// FMMUs write single bits anywhere, otherwise only at 0F00h-0F03h
    bool bit_writes = true;
    /// AL status follows AL control, whatever the SII has
    bool device_emulation = false;
    /// delay from port 0 through the processing unit
    std::int64_t processing_ns = 640;
    std::int64_t forwarding_ns = 600;  ///< delay of a frame between other ports
    double drift_ppm = 0;  ///< of the oscillator
    std::int64_t clock_start_ns = 0;  ///< local time at power-on
    /// busy time of a command; of the chip after a write
    std::int64_t eeprom_read_ns = 100'000;
    std::int64_t eeprom_write_ns = 4'000'000;
    bool eeprom_reads_8 = true;  ///< 8 bytes for each read, otherwise 4
};

class Controller final : public Pdi, private DatagramMemory {
public:
    /// `sii`: the EEPROM's content from word 0 on. `application` is not owned and may be nullptr.
    /// Starts without power. [setup]
    Controller(const Settings& settings, std::vector<std::uint8_t> sii, Application* application);

    void power_on(std::int64_t now_ns) noexcept;  ///< Starts with the reset values. [realtime]
    /// Stops; memory and configuration are lost. [realtime]
    void power_off() noexcept;
    bool powered() const noexcept { return powered_; }

    /// Keeps from now on in `interest` which frames concern this controller; it must outlive it.
    /// [setup]
    void show_interest(FrameInterest& interest) noexcept {
        interest = *interest_;
        interest_ = &interest;
    }

    // The line's side. [realtime]

    /// A frame on its way through the line.
    struct Frame {
        std::span<const DatagramView> datagrams;
        std::int64_t length_ns = 0;  ///< from its first to its last bit
        std::uint64_t number = 0;  ///< of the frame, from 1
    };
    /// Executes a frame whose first bit reaches the processing unit at `first_bit_ns`, and runs the
    /// application.
    void execute(const Frame& frame, std::int64_t first_bit_ns) noexcept;
    /// Notes that a frame reaches a port.
    void arrive(unsigned port, std::int64_t now_ns, std::uint64_t number) noexcept {
        dc_.arrive(port, now_ns, number);
    }
    /// Works what is due until `now_ns` without a frame: SYNC pulses, watchdog.
    void advance(std::int64_t now_ns) noexcept {
        if (now_ns >= due_ns_) {
            work_until(now_ns);
        }
    }
    bool destroys_foreign_frames() const noexcept { return (memory_[0x0100] & 1) != 0; }

    void set_link(unsigned port, bool up) noexcept;  ///< Takes a change of the link of a port.
    /// Returns whether frames leave at a port.
    bool is_open(unsigned port) const noexcept { return ports_.is_open(port); }
    /// Opens a port that closed by itself and waits for a frame (loop control 1).
    void frame_at_closed_port(unsigned port) noexcept;
    /// Returns the ports, which count their errors.
    Ports& error_counters() noexcept { return ports_; }

    // Faults and inputs. [realtime]

    /// Changes the deviation of the oscillator.
    void set_drift(double ppm, std::int64_t now_ns) noexcept;
    /// Adds `ns` to the local clock.
    void jump_clock(std::int64_t ns, std::int64_t now_ns) noexcept;
    void expire_watchdog() noexcept;  ///< Lets the process data watchdog expire now.
    Eeprom& eeprom() noexcept { return eeprom_; }
    DistributedClock& clock() noexcept { return dc_; }
    const Settings& settings() const noexcept { return settings_; }

    // Pdi
    std::optional<std::uint16_t> take_al_control() noexcept override;
    void set_al_status(std::uint16_t status, std::uint16_t code) noexcept override;
    std::uint16_t al_status() const noexcept override;
    Pdi::SyncManager sync_manager(unsigned number) const noexcept override {
        return sms_.settings(number);
    }
    std::size_t read_sync_manager(unsigned number, std::span<std::uint8_t> to) noexcept override;
    bool write_sync_manager(unsigned number, std::span<const std::uint8_t> from) noexcept override;
    void acknowledge_repeat(unsigned number) noexcept override { sms_.acknowledge_repeat(number); }
    bool watchdog_expired() const noexcept override;
    const Pdi::Sync& sync() const noexcept override { return dc_.sync(); }
    std::int64_t last_frame_ns() const noexcept override { return last_frame_ns_; }
    std::uint8_t* memory(std::uint16_t address) noexcept override { return &memory_[address]; }

private:
    static constexpr std::size_t max_writes = 128;
    static constexpr std::size_t max_written_bytes = 2048;
    struct RegisterWrite {
        std::uint16_t address, length, offset;
    };

    // DatagramMemory
    bool read(std::uint32_t address, std::span<std::uint8_t> to) noexcept override;
    bool write(std::uint32_t address, std::span<const std::uint8_t> from,
               const std::uint8_t* mask) noexcept override;
    std::uint16_t station_address() const noexcept override;
    bool has_alias(std::uint16_t address) const noexcept override;

    void commit(std::int64_t now_ns) noexcept;
    void reset_registers() noexcept;
    void read_registers(std::uint16_t address, std::span<std::uint8_t> to) noexcept;
    class WrittenRegisters;
    /// Does what a write to these registers means: keeps the bytes, clears counters, or passes them
    /// to the part of the controller that has the registers.
    void write_registers(std::uint16_t address, std::span<const std::uint8_t> from) noexcept;
    void write_clock(const WrittenRegisters&) noexcept;
    void write_controller(const WrittenRegisters&) noexcept;
    void keep_parts(const WrittenRegisters&, std::span<const register_facts::Range>) noexcept;
    void keep(const WrittenRegisters& part) noexcept;
    void latch_times(const WrittenRegisters& write) noexcept;
    void write_sync_managers(const WrittenRegisters& write) noexcept;
    void adjust_clock(const WrittenRegisters& write) noexcept;
    void keep_write(std::uint16_t address, std::span<const std::uint8_t> from) noexcept;
    void request_state(std::uint8_t low, std::uint8_t high) noexcept;
    void raise(std::uint32_t al_events) noexcept;
    void raise_ecat(std::uint16_t events) noexcept;
    void update_ports() noexcept;

    void work_until(std::int64_t now_ns) noexcept;
    void run_application(std::int64_t now_ns) noexcept;
    void find_due() noexcept;
    void update_interest() noexcept;
    void trigger_watchdog(std::int64_t now_ns) noexcept;

    Settings settings_;
    std::unique_ptr<std::uint8_t[]> memory_;
    Application* application_;
    Eeprom eeprom_;
    SyncManagers sms_;
    Fmmus fmmus_;
    DistributedClock dc_;
    Ports ports_;
    ProcessingUnit unit_;
    std::uint32_t ram_end_;
    FrameInterest own_interest_;
    FrameInterest* interest_ = &own_interest_;
    bool powered_ = false;
    bool emulates_ = false;
    bool control_pending_ = false;
    bool touched_ = false;
    std::int64_t now_ns_ = 0;  ///< of the frame being executed
    std::uint64_t frame_number_ = 0;
    std::int64_t due_ns_ = INT64_MAX;
    std::int64_t last_run_ns_ = INT64_MIN;
    std::int64_t last_frame_ns_ = INT64_MIN;

    std::int64_t watchdog_ns_ = INT64_MAX;

    std::array<RegisterWrite, max_writes> writes_;
    std::array<std::uint8_t, max_written_bytes> written_;
    std::size_t write_count_ = 0;
    std::size_t written_bytes_ = 0;
};

}  // namespace hal::ethercat::esc
