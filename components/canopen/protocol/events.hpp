// SPDX-License-Identifier: MIT
// Notifications from a device to its application. Override those of interest.
#pragma once

#include <array>
#include <cstdint>

#include "numbers.hpp"

namespace hal::canopen {

/// The content of an EMCY frame (CiA 301).
struct Emergency {
    std::uint16_t code = 0;        ///< error code; 0: error reset
    std::uint8_t error_register = 0;             ///< object 1001h
    std::array<std::uint8_t, 5> manufacturer{};  ///< manufacturer-specific bytes 3 to 7
    Time time = 0;                               ///< when it was received; 0: none was
};

/// TIME_OF_DAY (CiA 301).
struct TimeOfDay {
    std::uint32_t milliseconds = 0;  ///< since midnight, 28 bits
    std::uint16_t days = 0;          ///< since 1984-01-01
};

/// What error control detected of another node.
enum class NodeEvent : std::uint8_t {
    boot_up,   ///< its boot-up message
    alive,     ///< its first heartbeat, or the first one after a timeout
    changed,   ///< its NMT state changed
    lost,      ///< heartbeat or node guarding timed out
};

/// All calls come from poll() or handle(). [realtime]
class DeviceEvents {
public:
    virtual ~DeviceEvents() = default;
    /// The NMT state of this node changed.
    virtual void on_state(NmtState) noexcept {}
    /// An NMT reset was executed; objects have their power-on values. `application`: reset node,
    /// else reset communication only.
    virtual void on_reset(bool application) noexcept { (void)application; }
    /// A SYNC was received or sent. Synchronous RPDOs are in the dictionary; synchronous TPDOs are
    /// sampled when this returns.
    virtual void on_sync(std::uint8_t counter, Time) noexcept { (void)counter; }
    /// No SYNC within its period 1006h.
    virtual void on_sync_lost(Time) noexcept {}
    /// A TIME message was received.
    virtual void on_time(const TimeOfDay&, Time) noexcept {}
    /// An RPDO was received and its values are in the dictionary. Numbers count from 1.
    virtual void on_rpdo(unsigned number, Time) noexcept { (void)number; }
    /// An RPDO timed out (its event timer, EMCY 8250h).
    virtual void on_rpdo_late(unsigned number, Time) noexcept { (void)number; }
    /// An RPDO was shorter than its mapping and was discarded (EMCY 8210h). Reported once until one
    /// of valid length arrives.
    virtual void on_rpdo_short(unsigned number, unsigned bytes, Time) noexcept {
        (void)number, (void)bytes;
    }
    /// Error control detected an event of another node.
    virtual void on_node(std::uint8_t node, NodeEvent, NmtState, Time) noexcept { (void)node; }
    /// Another node sent an emergency.
    virtual void on_emergency(std::uint8_t node, const Emergency&) noexcept { (void)node; }
    /// A communication error after which outputs must enter their safe state: heartbeat or guarding
    /// timeout, bus-off.
    virtual void on_communication_error(Time) noexcept {}
    /// Life guarding: the master timed out (`lost`), or recovered.
    virtual void on_life_guarding(bool lost, Time) noexcept { (void)lost; }
    /// Another node uses the node ID of this one.
    virtual void on_id_collision(Time) noexcept {}
    /// 1010h: the objects of this sub-index became the power-on values; store them in non-volatile
    /// memory. An abort code reports failure.
    virtual Abort on_store(std::uint8_t sub) noexcept { return (void)sub, Abort::none; }
    /// 1011h: discard the stored values; the defaults apply after the next reset. An abort code
    /// reports failure.
    virtual Abort on_restore(std::uint8_t sub) noexcept { return (void)sub, Abort::none; }
    /// LSS: store node ID and bit rate in bit/s (0: unchanged). Return false if they could not be
    /// stored.
    virtual bool on_lss_store(std::uint8_t node_id, std::uint32_t bit_rate) noexcept {
        return (void)node_id, (void)bit_rate, true;
    }
    /// LSS: return true if the device supports the bit rate, in bit/s.
    virtual bool on_lss_bit_rate(std::uint32_t bit_rate) noexcept { return (void)bit_rate, false; }
    /// LSS: change to the bit rate, in bit/s; send nothing for `delay` (ns) before and after the
    /// change.
    virtual void on_lss_activate(std::uint32_t bit_rate, Time delay) noexcept {
        (void)bit_rate, (void)delay;
    }
};

}  // namespace hal::canopen
