// SPDX-License-Identifier: MIT
// What the master measured, for pins and tools. Written in the thread of the cycle.
#pragma once

#include <array>
#include <cstdint>

#include "ethercat/wire/states.hpp"

namespace hal::ethercat::master {

/// Working counter of a domain.
enum class WkcState : std::uint8_t {
    none,      ///< no slave processed the data
    part,      ///< some slaves did
    complete,
};

struct DomainStatus {
    WkcState state = WkcState::none;
    std::uint16_t wkc = 0;
    std::uint16_t expected = 0;  ///< of all datagrams, newest exchange
    std::uint16_t min = 0;              ///< smallest counter since the first complete exchange
    std::uint32_t changes = 0;            ///< of the state, since the first complete exchange
    std::uint32_t bad_cycles = 0;         ///< exchanges in a row that were not complete
    std::uint64_t exchanges = 0;
    std::uint64_t incomplete = 0;
    bool was_complete = false;            ///< an exchange was complete since the reset
    bool fresh = false;                   ///< exchanged in the newest cycle
    /// all its datagrams were answered with the expected counters
    bool ok = false;
};

struct BusStatus {
    /// lowest state of the configured slaves that are present
    State state = State::none;
    bool link = false;                ///< the primary port has a carrier
    bool scanned = false;             ///< the slaves are identified
    /// every slave that is not optional is in OP, or in its lower target, and the process data of
    /// all is exchanged
    bool operational = false;
    std::uint16_t responding = 0;  ///< slaves that answered the newest broadcast
    std::uint16_t expected = 0;  ///< slaves of the setup that are not optional
    std::uint16_t wkc = 0;
    std::uint16_t wkc_expected = 0;
    WkcState wkc_state = WkcState::none;
    std::uint64_t frames_sent = 0;
    std::uint64_t frames_received = 0;
    std::uint64_t lost = 0;  ///< frames that did not return in time
    std::uint64_t late = 0;  ///< frames that returned after their cycle
    std::uint64_t duplicates = 0;  ///< frames that returned twice
    std::uint64_t foreign = 0;  ///< EtherCAT frames of other programs, or damaged ones
    /// of these, those of another master: process data, settings, or from the far end of the line
    std::uint64_t foreign_control = 0;
    std::uint64_t send_failures = 0;  ///< frames that the port did not take

    bool dc_active = false;  ///< a reference clock is distributed
    /// every slave with a clock is within Setup::sync_window_ns
    bool dc_synchronised = false;
    std::uint64_t dc_time_ns = 0;  ///< newest time of the reference clock (since 2000-01-01)
    std::uint32_t dc_deviation_ns = 0;  ///< largest deviation of the slaves, UINT32_MAX: no data

    bool redundant = false;  ///< a backup port is used
    bool ring_broken = false;
    /// position of the last slave that the primary port reaches, -1: none, or no break
    std::int16_t break_after = -1;
};

struct PortErrors {
    std::uint64_t invalid_frames = 0;
    std::uint64_t rx_errors = 0;
    std::uint64_t forwarded = 0;
    std::uint64_t lost_links = 0;
};

struct SlaveStatus {
    State state = State::none;
    std::uint16_t al_code = 0;
    bool online = false;  ///< answers datagrams
    bool operational = false;  ///< in OP, and its process data is exchanged
    bool al_error = false;
    /// magnitude of 092Ch; UINT32_MAX: no data
    std::uint32_t dc_deviation_ns = UINT32_MAX;
    std::uint32_t losses = 0;  ///< how often it was lost
    std::array<PortErrors, 4> ports{};
};

}  // namespace hal::ethercat::master
