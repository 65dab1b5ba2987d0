// SPDX-License-Identifier: MIT
// An EtherCAT master: brings the slaves of a setup to OP, exchanges their process data, watches
// them.
//
//     Master master(setup, port->address(), events, coe);                 // [setup]
//     master.attach(*port, nullptr);
//     auto target = master.data(0, 0);                                    // of the first sync manager of the first slave
//     ...
//     master.receive(cycle.start_ns());                                   // at the beginning of the cycle
//     put(target.data(), position);
//     master.transmit(cycle.start_ns());                                  // at its end
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "ethercat/master/bus_slave.hpp"
#include "ethercat/master/channel.hpp"
#include "ethercat/master/coe_access.hpp"
#include "ethercat/master/events.hpp"
#include "ethercat/master/setup.hpp"
#include "ethercat/master/status.hpp"
#include "link/ethernet.hpp"

namespace hal::ethercat::master {

struct Bus;

/// See the top of this file.
class Master {
public:
    /// `source` is the address frames leave with; `events` and `coe` must outlive the master.
    /// [setup]
    Master(Setup setup, const std::array<std::uint8_t, 6>& source, Events& events, CoeAccess& coe);
    ~Master();
    Master(const Master&) = delete;
    Master& operator=(const Master&) = delete;

    /// Uses these ports, which must outlive the master, and begins with the scan in the next cycle.
    /// `backup` closes a ring. [setup]
    void attach(ethernet::Port& primary, ethernet::Port* backup = nullptr);
    /// Adds a user of the wire besides the slaves' channels; before attach(). It must outlive the
    /// master. [setup]
    void add(Channel& channel);
    /// Sets what the system time of the clocks is at time 0 of the cycle's clock, ns since
    /// 2000-01-01; before attach(). [setup]
    void set_epoch(std::int64_t epoch_ns);

    /// Takes the answers of the previous cycle: inputs are fresh, tasks continue. `now_ns`: start
    /// of the cycle. [realtime]
    void receive(std::int64_t now_ns) noexcept;
    /// Sends process data and the datagrams of the tasks. [realtime]
    void transmit(std::int64_t now_ns) noexcept;

    /// Returns the process data of sync manager `n` of `Setup::slaves[slave].sync_managers`. The
    /// place stays the same. [any]
    std::span<std::uint8_t> data(std::size_t slave, std::size_t n) noexcept;
    /// Takes the slaves in OP to SAFE-OP, where their outputs are off, by frames that leave at
    /// once. Sends nothing while transmit() runs in another thread: call it again after that.
    /// Requires restart() before the next transmit(). [any], async-signal-safe
    void shut_down() noexcept;
    /// Starts every slave that belongs in OP again, after a time in which nothing was exchanged.
    /// None is operational until it has reached OP from INIT. [realtime]
    void restart() noexcept;
    /// Keeps slaves in SAFE-OP while false: their outputs are not valid yet. True at start.
    /// [realtime]
    void set_outputs_valid(bool valid) noexcept;
    /// Takes a slave that the setup does not name to BOOT, where it takes its firmware by FoE, or
    /// back to PRE-OP. The slave must be idle(). [realtime]
    void set_boot(const BusSlave& slave, bool boot) noexcept;
    /// Forgets all slaves and scans again. [realtime]
    void rescan() noexcept;

    const Setup& setup() const noexcept;  ///< [any]
    const BusStatus& status() const noexcept;  ///< [realtime]
    const DomainStatus& domain(std::size_t n) const noexcept;  ///< [realtime]
    /// Returns DomainStatus::incomplete of all domains. [realtime]
    std::uint64_t cycles_incomplete() const noexcept;
    /// Resets least counter and changes. [realtime]
    void reset_domain(std::size_t n) noexcept;
    /// Returns the status of `Setup::slaves[slave]`. [realtime]
    const SlaveStatus& slave_status(std::size_t slave) const noexcept;

    /// Error of this cycle's phase: positive when the cycle begins late on the grid of the
    /// reference clock, whose cycle times begin at multiples of Setup::cycle_ns; within half a
    /// cycle. Valid when `fresh`. [realtime]
    struct Phase {
        bool fresh = false;
        std::int64_t error_ns = 0;
    };
    Phase dc_phase() const noexcept;

    /// Returns when the first sample of the inputs of a slave was taken that samples several times
    /// in a cycle, on the clock of the cycle, ns; nullopt: without the time of the reference clock,
    /// or while the slave is not operational. The samples of a cycle are complete at the last of
    /// their pulses; those that are complete when the frame passes are in it. [realtime]
    std::optional<std::int64_t> first_sample_ns(std::size_t slave) const noexcept;

    // Slaves as found, for tools and mailbox clients.
    /// Returns the number of slaves on the bus after the scan. [realtime]
    std::size_t found() const noexcept;
    /// Returns the slave at a position below found(). [realtime]
    BusSlave& found(std::size_t position) noexcept;
    /// Returns the slave with this BusSlave::number; nullptr: not on the bus. [realtime]
    BusSlave* numbered(std::uint16_t number) noexcept;
    /// Returns the slave that is Setup::slaves[slave]; nullptr: missing. [realtime]
    BusSlave* slave(std::size_t slave) noexcept;
    /// Returns the channel of a slave. It belongs to the start-up while idle() is false. [realtime]
    Channel& channel(const BusSlave& slave) noexcept;
    /// Returns whether no start-up or check works on the slave. [realtime]
    bool idle(const BusSlave& slave) const noexcept;
    /// Returns the largest part of its memory for tasks that a channel has used so far, 0..1.
    /// [realtime]
    double max_task_share() const noexcept;

private:
    std::unique_ptr<Bus> bus_;
    ethernet::Port* primary_ = nullptr;
    ethernet::Port* backup_ = nullptr;
    std::uint64_t links_checked_ = 0;
    std::uint64_t resumed_ = 0;
    bool was_quiet_ = false;  ///< Bus::quiet in the previous cycle
    bool backup_up_ = true;
};

}  // namespace hal::ethercat::master
