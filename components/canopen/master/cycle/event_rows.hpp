// SPDX-License-Identifier: MIT
// The events of a network in one wording: the lines that are printed, and the texts of those that
// are faults. What happens to a node is printed as `sentence()` of `node_status.hpp`, which has its
// objects and values; its faults are here.
#pragma once

#include "bus/events/event_rows.hpp"
#include "link/can.hpp"

namespace hal::canopen {

/// Events of the bus and of the network.
enum class BusEvent : std::uint8_t {
    active,
    warning,
    passive,
    bus_off,
    down,
    waiting,
    operational,
    operational_again,
    emergency,
    is_master,
    on_standby,
    foreign_nmt,
    foreign_sync,
    foreign_time,
    foreign_rpdo,
    foreign_sdo,
    foreign_id,
    own_id,
    sync_missing,
    sync_loop,
    sync_unequal,
    sync_unlocked,
    sync_between_cycles,
    sync_overrun,
};
inline constexpr bus::EventRow<BusEvent> bus_event_rows[] = {
    {BusEvent::active, bus::Effect::ends, "the bus is active again"},
    {BusEvent::warning, bus::Effect::ends,
     "the bus is warning: many frames fail; check the cable, its termination, the bit rate, and "
     "that a node is there"},
    {BusEvent::passive, bus::Effect::ends,
     "the bus is passive: most frames fail; check the cable, its termination, the bit rate, and "
     "that a node is there"},
    {BusEvent::bus_off, bus::Effect::raises, "bus off: too many errors; the master retries"},
    {BusEvent::down, bus::Effect::raises,
     "bus down: the interface is off or was removed; the master retries"},
    {BusEvent::waiting, bus::Effect::none,
     "waits for the bus: its interface is off, or its slots may not be used yet"},
    {BusEvent::operational, bus::Effect::none,
     "the network is operational: {operational} of {nodes} nodes, after {s}"},
    {BusEvent::operational_again, bus::Effect::none,
     "the network is operational again: {operational} of {nodes} nodes"},
    {BusEvent::emergency, bus::Effect::none,
     "{node}: emergency {code} ({meaning}), error register {register}"},
    {BusEvent::is_master, bus::Effect::none, "is the NMT master now"},
    {BusEvent::on_standby, bus::Effect::none,
     "{node} is the NMT master; this one is ready to take over"},
    {BusEvent::foreign_nmt, bus::Effect::none,
     "another NMT master is on the bus: it commands '{command}' to {node}{frames}"},
    {BusEvent::foreign_sync, bus::Effect::raises,
     "another device also produces SYNC[ {x}{frames}]; nodes act on both[; clear bit 30 of its "
     "1005h]"},
    {BusEvent::foreign_time, bus::Effect::none,
     "another device also produces TIME (100h){frames}; clear bit 30 of its 1012h"},
    {BusEvent::foreign_rpdo, bus::Effect::raises,
     "another device also sends RPDO {x} of a node of this master[, {pdo}{frames}]; the node "
     "follows both"},
    {BusEvent::foreign_sdo, bus::Effect::none,
     "another SDO client uses the channel of {node} ({x}){frames}; transfers of both may be "
     "aborted"},
    {BusEvent::foreign_id, bus::Effect::none,
     "another device sends {x}, an identifier of this master{frames}"},
    {BusEvent::own_id, bus::Effect::raises,
     "duplicate node ID {own}: another device has the node ID of the master; change one: node-id "
     "in {section}, or masternodeid="},
    {BusEvent::sync_missing, bus::Effect::raises,
     "followed SYNC missing for {s}; threads run on their own clock until it returns"},
    {BusEvent::sync_loop, bus::Effect::raises,
     "SYNC feedback loop: this machine produces the SYNC its own threads follow; write clock = own "
     "in the configuration"},
    {BusEvent::sync_unequal, bus::Effect::raises,
     "cannot follow the SYNC: its period is not a multiple of the thread's; change the thread's "
     "period, or write clock = own"},
    {BusEvent::sync_unlocked, bus::Effect::raises,
     "cycles not synchronised to the SYNC for {s}; compare the period of its producer with sync, "
     "and look for jitter: at most 1000 ppm can be followed"},
    {BusEvent::sync_between_cycles, bus::Effect::raises,
     "the SYNC period is not a multiple of the thread's period; SYNCs are up to half a period "
     "early or late"},
    {BusEvent::sync_overrun, bus::Effect::raises,
     "SYNC overrun: frames of the last SYNC were still queued when the next was due; to see what "
     "fits: hal canopen plan"},
};
static_assert(bus::in_order(bus_event_rows));

/// Returns the event of a new state of the bus; `had`: the bus was active, now or earlier. [any]
constexpr BusEvent bus_event(can::State state, bool had) noexcept {
    switch (state) {
    case can::State::active: return BusEvent::active;
    case can::State::warning: return BusEvent::warning;
    case can::State::passive: return BusEvent::passive;
    case can::State::bus_off: return BusEvent::bus_off;
    case can::State::down: return had ? BusEvent::down : BusEvent::waiting;
    }
    return BusEvent::active;
}

/// Faults of a node.
enum class NodeFault : std::uint8_t {
    no_heartbeat,
    no_guarding,
    guard_toggle,
    rebooted,
    reset,
    left_operational,
    commanded,
    not_started,
    duplicate_id,
    suspected_id,
};
inline constexpr std::string_view outputs_are_safe = "; outputs set to safe values";
inline constexpr bus::EventRow<NodeFault> node_fault_rows[] = {
    {NodeFault::no_heartbeat, bus::Effect::raises,
     "{node}: no heartbeat for {s} (timeout {timeout})", outputs_are_safe},
    {NodeFault::no_guarding, bus::Effect::raises, "{node}: no answer to node guarding for {s}",
     outputs_are_safe},
    {NodeFault::guard_toggle, bus::Effect::raises,
     "{node}: the toggle bit of its guarding answers does not change", outputs_are_safe},
    {NodeFault::rebooted, bus::Effect::raises,
     "{node}: rebooted without a command from this master", outputs_are_safe},
    {NodeFault::reset, bus::Effect::raises,
     "{node}: rebooted after an NMT reset from another device", outputs_are_safe},
    {NodeFault::left_operational, bus::Effect::raises,
     "{node}: left the operational state without a command from this master", outputs_are_safe},
    {NodeFault::commanded, bus::Effect::raises,
     "{node}: left the operational state after an NMT command from another device",
     outputs_are_safe},
    {NodeFault::not_started, bus::Effect::raises,
     "{node}: did not become operational after the start command", outputs_are_safe},
    {NodeFault::duplicate_id, bus::Effect::raises, "{node}: duplicate node ID, two devices answer",
     outputs_are_safe},
    {NodeFault::suspected_id, bus::Effect::raises,
     "{node}: more heartbeats than configured, two devices may have this node ID"},
};
static_assert(bus::in_order(node_fault_rows));

/// The fault of a node that was not booted.
enum class BootFault : std::uint8_t { failed };
inline constexpr bus::EventRow<BootFault> boot_fault_rows[] = {
    {BootFault::failed, bus::Effect::raises, "{node}: boot failed: {result} (result {letter})"},
};
static_assert(bus::in_order(boot_fault_rows));

/// Faults of a TPDO of a node.
enum class PdoFault : std::uint8_t { late, too_short };
inline constexpr bus::EventRow<PdoFault> pdo_fault_rows[] = {
    {PdoFault::late, bus::Effect::raises, "{pdo} not received or too short for {s}"},
    {PdoFault::too_short, bus::Effect::raises,
     "{pdo} has {value} bytes, its mapped objects need {bytes}; pins keep their values; to see the "
     "mapping of the node: hal can pdo show"},
};
static_assert(bus::in_order(pdo_fault_rows));

}  // namespace hal::canopen
