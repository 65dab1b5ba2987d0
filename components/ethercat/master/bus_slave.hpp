// SPDX-License-Identifier: MIT
// A slave as it was found on the bus: what it reported, where it sits, and the state it is in.
// Written by the tasks of the master, in the thread of the cycle.
#pragma once

#include <array>
#include <cstdint>

#include "ethercat/master/setup.hpp"

namespace hal::ethercat::master {

/// Mailbox of a slave as its SII describes it (words 14h-1Bh); sizes 0: none.
struct MailboxArea {
    std::uint16_t out_start = 0;
    std::uint16_t out_size = 0;  ///< sync manager 0, the master writes
    std::uint16_t in_start = 0;
    std::uint16_t in_size = 0;    ///< sync manager 1, the master reads
    bool usable() const noexcept { return out_size != 0 && in_size != 0; }  ///< [any]
};

/// Category 41 of the SII: a sync manager.
struct SiiSyncManager {
    std::uint16_t start = 0;
    std::uint16_t length = 0;
    /// type: 1 mailbox out, 2 mailbox in, 3 outputs, 4 inputs
    std::uint8_t control = 0;
    std::uint8_t enable = 0;
    std::uint8_t type = 0;
};

/// See the top of this file.
struct BusSlave {
    static constexpr std::uint16_t nowhere = 0xffff;
    static constexpr unsigned max_sync_managers = 8;

    std::uint16_t number = 0;              ///< in the list of the master
    std::uint16_t station = 0;             ///< station address (0010h)
    std::uint16_t position = nowhere;      ///< along the line; nowhere: not on the bus
    /// index in Setup::slaves; -1: not named there
    int configured = -1;
    bool present = false;                  ///< answers under its station address

    std::uint32_t vendor = 0;
    std::uint32_t product = 0;
    std::uint32_t revision = 0;
    std::uint32_t serial = 0;
    std::uint16_t alias = 0;
    /// explicit device identification (ETG.1020); 0: none, or nobody asked for it
    std::uint16_t device_id = 0;
    std::uint8_t fmmus = 0;
    std::uint8_t sync_managers = 0;
    std::uint8_t port_descriptor = 0;
    std::uint16_t features = 0;            ///< 0008h
    std::uint16_t dl_status = 0;           ///< 0110h
    MailboxArea mailbox, bootstrap;
    std::uint16_t protocols = 0;           ///< MailboxProtocols
    std::uint8_t coe_details = 0;          ///< byte 5 of the general category
    std::uint8_t sii_flags = 0;            ///< byte Bh of the general category
    unsigned sii_sync_managers = 0;
    std::array<SiiSyncManager, max_sync_managers> sii{};

    State state = State::none;             ///< as last read
    bool al_failed = false;                ///< bit 4 of AL status
    std::uint16_t al_code = 0;             ///< 0134h
    Timeouts timeouts;
    bool complete_access = false;          ///< complete access of CoE may be used

    // Of the mailbox clients.
    std::uint8_t mailbox_counter = 0;      ///< of the newest request, 1..7
    bool boot_mailbox = false;             ///< the bootstrap mailbox is in use
    /// 080Dh as the process image carries it in each cycle; nullptr: read it
    const std::uint8_t* mailbox_status = nullptr;

    // Of the topology.
    /// number of the slave before it in the tree; -1: the master
    int parent = -1;
    std::uint8_t parent_port = 0;
    std::uint8_t entry_port = 0;
    /// number of the slave at each port; -1: none, or the master at the entry port
    std::array<int, 4> neighbour{-1, -1, -1, -1};
    std::array<std::uint32_t, 4> receive_time{};   ///< 0900h-090Fh
    std::uint64_t local_time = 0;          ///< 0918h
    std::uint32_t delay_ns = 0;            ///< from the reference clock

    /// Returns the mailbox in use. [any]
    const MailboxArea& area() const noexcept { return boot_mailbox ? bootstrap : mailbox; }
    /// [any]
    bool has_dc() const noexcept { return (features & 0x0004) != 0; }
    /// [any]
    bool has_dc64() const noexcept { return (features & 0x0008) != 0; }
};

}  // namespace hal::ethercat::master
