// SPDX-License-Identifier: MIT
// What a master is to do: its slaves, their process data, start-up writes, clocks. Made by config/
// or by a program; read by the engine.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ethercat/wire/eoe.hpp"
#include "ethercat/wire/revision_rule.hpp"
#include "ethercat/wire/states.hpp"

namespace hal::ethercat::master {

/// A value of the process image that the user sees as a pin.
enum class Type : std::uint8_t { bit, u8, u16, u32, u64, s8, s16, s32, s64, real32, real64 };

/// An object, or a part of it, mapped to a PDO. Index 0: a gap.
struct Entry {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    std::uint16_t bits = 0;
    std::string name;              ///< of its pin; empty: no pin
    Type type = Type::u32;
    double scale = 1.0;
    double offset = 0.0;  ///< pin = raw * scale + offset, if `scaled`
    bool scaled = false;           ///< the pin is a float
    bool is_signed = false;
    /// a further part of the object of the entry before it: in the mapping both are one
    bool part = false;
    /// an output that the master copies from an input: its pin shows what is sent
    bool copied = false;
    /// number of the sample in the cycle, of an entry that is oversampled
    std::optional<std::uint16_t> sample;

    /// Returns the name of its pin: NAME, or NAME-07 for sample 7. [setup]
    std::string pin_name() const {
        if (!sample) return name;
        return name + (*sample < 10 ? "-0" : "-") + std::to_string(*sample);
    }
};

struct Pdo {
    std::uint16_t index = 0;       ///< 1600h… or 1A00h…
    std::vector<Entry> entries;
    bool write_mapping = false;    ///< the mapping is written in PRE-OP if it differs

    /// Returns how many objects the mapping has. [any]
    std::size_t mapped() const noexcept {
        std::size_t count = 0;
        for (const Entry& e : entries) {
            count += e.part ? 0 : 1;
        }
        return count;
    }
    /// Returns the word of object `n` of the mapping: index, sub-index, bits. [any]
    std::uint32_t mapping(std::size_t n) const noexcept {
        std::uint32_t word = 0;
        for (const Entry& e : entries) {
            if (!e.part && n-- == 0) {
                word = static_cast<std::uint32_t>(e.index) << 16 |
                       static_cast<std::uint32_t>(e.sub) << 8 | (e.bits & 0xffU);
            } else if (word != 0 && !e.part) {
                break;
            } else if (word != 0) {
                word += e.bits;
            }
        }
        return word;
    }
};

/// A sync manager with process data.
struct SyncManager {
    std::uint8_t number = 2;
    bool output = false;           ///< the master writes
    std::uint16_t start = 0;       ///< physical address; 0: as the slave's SII has it
    std::uint8_t control = 0;      ///< 0: 64h for outputs, 20h for inputs
    bool watchdog = true;          ///< outputs: triggers the watchdog
    std::vector<Pdo> pdos;
    /// 1C10h + number is written in PRE-OP if it differs
    bool write_assignment = false;
    /// assignment 0, mappings, assignment; false: mappings first (some slaves accept only this)
    bool assignment_first = true;
};

/// A value written at a state transition.
struct StartupWrite {
    /// aoe: an object by AoE
    enum class Protocol : std::uint8_t { coe, soe, reg, aoe } protocol = Protocol::coe;
    State before = State::safeop;  ///< written before this state is requested
    std::uint16_t index = 0;  ///< object, IDN or register
    std::uint8_t sub = 0;  ///< sub-index, or the drive number of SoE
    bool complete = false;  ///< complete access
    std::vector<std::uint8_t> data;
    std::uint16_t port = 0;  ///< AoE: of the target
    std::uint32_t line = 0;  ///< of the configuration, for messages
};

struct Dc {
    /// 0980h and 0981h: 0300h SYNC0, 0700h SYNC0 and SYNC1; 0: clock only
    std::uint16_t assign_activate = 0;
    std::int64_t sync0_cycle_ns = 0;  ///< 0: the master's cycle
    /// from a pulse of SYNC0 to the one of SYNC1 (09A4h); after it, the next SYNC0 counts
    std::int64_t sync1_cycle_ns = 0;
    std::int64_t sync0_shift_ns = 0;
    std::int64_t sync1_shift_ns = 0;
};

struct Watchdog {
    std::optional<std::uint16_t> divider;  ///< 0400h
    std::optional<std::uint16_t> intervals;  ///< 0420h
};

/// How a slave is recognised. Set values must match.
struct Identity {
    std::uint32_t vendor = 0;
    std::uint32_t product = 0;
    std::optional<std::uint32_t> revision, serial;
    RevisionRule revision_rule = RevisionRule::equal;  ///< how a found revision compares to it
    std::optional<std::uint16_t> alias;  ///< the slave is found by it, wherever it is
    std::optional<std::uint16_t> device_id;  ///< explicit device identification
};

struct Timeouts {  ///< ms, defaults of ETG.2000
    std::uint32_t to_preop = 3000;
    std::uint32_t to_safeop_op = 10000;
    std::uint32_t to_init = 5000;
    std::uint32_t op_to_safeop = 200;

    std::uint32_t mailbox_request = 100;
    std::uint32_t mailbox_response = 2000;
};

struct Slave {
    std::string name;
    std::uint16_t position = 0;  ///< along the line, unless found by alias or device id
    Identity identity;
    std::vector<SyncManager> sync_managers;
    std::vector<StartupWrite> startup;
    std::optional<Dc> dc;
    Watchdog watchdog;
    Timeouts timeouts;
    bool optional = false;  ///< may be missing (hot connect)
    std::uint16_t domain = 0;  ///< index in Setup::domains
    /// a byte of the inputs is kept for the mailbox state (080Dh), which a free FMMU copies in each
    /// cycle
    bool mailbox_status = true;
    bool use_lrw = true;  ///< the SII's "no LRW" wins over true
    bool complete_access = false;  ///< for mapping and assignment
    unsigned entries_per_pdo = 0;  ///< limit; 0: none known
    unsigned oversampling = 1;  ///< samples in a cycle
    bool eoe = false;  ///< exchanges Ethernet frames with an interface of the host
    std::optional<eoe::Ip> eoe_ip;  ///< settings of its IP stack, written in PRE-OP
    State target = State::op;  ///< the state to bring it to
    std::uint32_t line = 0;  ///< of the configuration, for messages
};

struct Domain {
    std::string name = "default";
    unsigned every = 1;  ///< exchanged in every n-th cycle
};

enum class ClockLead : std::uint8_t {
    reference,  ///< the threads follow the reference clock
    thread,  ///< the reference clock follows the threads
    none,  ///< neither: the slaves follow the reference clock, which runs free
};

/// What happens to a slave in OP whose clock is beyond the window for Setup::dc_loss_ns.
enum class DcLoss : std::uint8_t {
    report,  ///< it stays in OP
    safeop,  ///< SAFE-OP, where its outputs are off, until its clock is in the window again
};

struct Setup {
    std::vector<Slave> slaves;
    std::vector<Domain> domains{Domain{}};
    std::int64_t cycle_ns = 1'000'000;
    ClockLead lead = ClockLead::reference;
    /// index of its Slave; not set: the first one with a 64-bit clock
    std::optional<std::uint16_t> reference_slave;
    /// 0: until the next cycle, and 2 ms or two cycles for what is not process data
    std::int64_t frame_timeout_ns = 0;
    /// slaves on the bus that the setup does not name are left in PRE-OP, without a fault
    bool accept_other_slaves = false;
    /// longest frame, from the destination address on, without check sequence
    std::size_t frame_bytes = 1514;
    std::uint16_t max_slaves = 0;  ///< capacity of the bus; 0: the slaves named here and 64 more
    DcLoss dc_loss = DcLoss::report;
    std::int64_t dc_loss_ns = 500'000'000;
    /// clock deviation below which a slave counts as synchronised
    std::int64_t sync_window_ns = 1000;
};

}  // namespace hal::ethercat::master
