// SPDX-License-Identifier: MIT
// The processing unit of an emulated controller: how it executes datagrams (ETG.1000.4, clause
// 5.4), with the rules of the working counter.
#pragma once

#include <cstdint>
#include <span>

#include "ethercat/esc/fmmus.hpp"
#include "ethercat/wire/frames.hpp"

namespace hal::ethercat::esc {

/// What datagrams read and write. [realtime]
class DatagramMemory {
public:
    virtual ~DatagramMemory() = default;
    /// Returns whether the access was accepted, and counts in the working counter.
    virtual bool read(std::uint32_t address, std::span<std::uint8_t> to) noexcept = 0;
    /// `mask`: the bits to write, or nullptr for all.
    virtual bool write(std::uint32_t address, std::span<const std::uint8_t> from,
                       const std::uint8_t* mask) noexcept = 0;
    virtual std::uint16_t station_address() const noexcept = 0;
    /// Returns whether the alias addresses the slave as well.
    virtual bool has_alias(std::uint16_t address) const noexcept = 0;
};

/// What the unit is able to do.
struct UnitSettings {
    bool lrw = true;
    bool read_write = true;  ///< APRW, FPRW and BRW
    /// FMMUs write single bits anywhere, otherwise only at 0F00h-0F03h
    bool bit_writes = true;
};

/// The unit.
class ProcessingUnit {
public:
    /// Both must outlive it. [setup]
    ProcessingUnit(DatagramMemory& memory, const Fmmus& fmmus) noexcept
        : memory_(memory), fmmus_(fmmus) {}
    void configure(const UnitSettings& settings) noexcept { settings_ = settings; }  ///< [setup]

    /// What a datagram did.
    struct Effect {
        bool touched = false;  ///< it addressed this slave
        bool process_data = false;  ///< an FMMU took part
    };
    /// Executes a datagram. [realtime]
    Effect execute(const DatagramView&) noexcept;

private:
    void physical(const DatagramView&, bool reads, bool writes, bool broadcast) noexcept;
    void logical(const DatagramView&, bool reads, bool writes) noexcept;
    bool read_logical(const Fmmus::Unit&, const DatagramView&) noexcept;
    bool write_logical(const Fmmus::Unit&, const DatagramView&, const std::uint8_t* data) noexcept;

    DatagramMemory& memory_;
    const Fmmus& fmmus_;
    UnitSettings settings_;
    Effect effect_;
};

}  // namespace hal::ethercat::esc
