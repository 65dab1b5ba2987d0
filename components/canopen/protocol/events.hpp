// SPDX-License-Identifier: MIT
// What a device tells its application. Override what is of interest.
#pragma once

#include <array>
#include <cstdint>

#include "numbers.hpp"

namespace hal::canopen {

struct Emergency {
    std::uint16_t code = 0;        ///< 0: an error is gone
    std::uint8_t error_register = 0;
    std::array<std::uint8_t, 5> manufacturer{};
    Time time = 0;
};

struct TimeOfDay {
    std::uint32_t milliseconds = 0;  ///< since midnight, 28 bits
    std::uint16_t days = 0;          ///< since 1984-01-01
};

/// What error control noticed of another node.
enum class NodeEvent : std::uint8_t {
    boot_up,   ///< it was (re)started
    alive,     ///< its first heartbeat, or the first one after it was lost
    changed,   ///< its state is another one
    lost,      ///< no heartbeat, or no answer to guarding, for the time agreed on
};

/// All calls come from poll() or handle(). [realtime]
class Events {
public:
    virtual ~Events() = default;
    virtual void on_state(NmtState) noexcept {}
    /// A reset was commanded; values are those of power-on again. `application`: of the whole device, not only of communication.
    virtual void on_reset(bool application) noexcept { (void)application; }
    /// A SYNC came or was produced. Synchronous RPDOs are in the dictionary; synchronous TPDOs are sampled when this returns.
    virtual void on_sync(std::uint8_t counter, Time) noexcept { (void)counter; }
    virtual void on_sync_lost(Time) noexcept {}
    virtual void on_time(const TimeOfDay&, Time) noexcept {}
    /// All values of the RPDO are in the dictionary. Numbers count from 1.
    virtual void on_rpdo(unsigned number, Time) noexcept { (void)number; }
    /// It did not come within its event timer.
    virtual void on_rpdo_late(unsigned number, Time) noexcept { (void)number; }
    /// It came with fewer bytes than are mapped and was not processed. Told once, until one of the right length has come.
    virtual void on_rpdo_short(unsigned number, unsigned bytes, Time) noexcept { (void)number, (void)bytes; }
    virtual void on_node(std::uint8_t node, NodeEvent, NmtState, Time) noexcept { (void)node; }
    virtual void on_emergency(std::uint8_t node, const Emergency&) noexcept { (void)node; }
    /// A communication error after which outputs belong in their safe state: heartbeat or guarding lost, bus off.
    virtual void on_communication_error(Time) noexcept {}
    /// Life guarding: the master is silent, or back.
    virtual void on_life_guarding(bool lost, Time) noexcept { (void)lost; }
    /// Another node uses our id.
    virtual void on_id_collision(Time) noexcept {}
    /// 1010h: the objects of that sub-index were made the power-on values; put them where they outlast power.
    virtual Abort on_store(std::uint8_t sub) noexcept { return (void)sub, Abort::none; }
    /// 1011h: forget what was stored. The defaults hold after the next reset.
    virtual Abort on_restore(std::uint8_t sub) noexcept { return (void)sub, Abort::none; }
    /// LSS: keep node id and bit rate (0: unchanged). False: it could not be stored.
    virtual bool on_lss_store(std::uint8_t node_id, std::uint32_t bit_rate) noexcept { return (void)node_id, (void)bit_rate, true; }
    /// LSS: whether that bit rate can be used here.
    virtual bool on_lss_bit_rate(std::uint32_t bit_rate) noexcept { return (void)bit_rate, false; }
    /// LSS: change to that bit rate; nothing is sent for `delay` before and after.
    virtual void on_lss_activate(std::uint32_t bit_rate, Time delay) noexcept { (void)bit_rate, (void)delay; }
};

}  // namespace hal::canopen
