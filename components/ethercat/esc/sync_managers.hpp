// SPDX-License-Identifier: MIT
// The sync managers of an emulated controller: buffered (three buffers) or mailbox, as the master
// and the firmware access them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "ethercat/esc/pdi.hpp"

namespace hal::ethercat::esc {

/// [realtime]
class SyncManagers {
public:
    static constexpr unsigned max = 16;

    void connect(std::uint8_t* memory, unsigned count) noexcept {
        memory_ = memory;
        count_ = count;
    }
    void reset() noexcept;

    /// Takes a write of the master to 0800h-087Fh. Returns whether an activation changed.
    bool configure(std::uint16_t address, std::span<const std::uint8_t> data) noexcept;
    /// Updates the status bytes (0805h...) in a range before they are read.
    void show_status(std::uint16_t address, std::size_t length) noexcept;

    /// Reads memory for the master: the rules apply where a sync manager is enabled. Returns
    /// whether at least one byte was accepted.
    bool read(std::uint16_t address, std::span<std::uint8_t> to) noexcept;
    /// Writes memory for the master; `mask` holds the bits to change, nullptr: all.
    bool write(std::uint16_t address, std::span<const std::uint8_t> from,
               const std::uint8_t* mask) noexcept;

    /// What the end of a good frame did.
    struct Committed {
        std::uint32_t written = 0;
        std::uint32_t read = 0;  ///< a bit for each sync manager
        /// one of the written ones triggers the watchdog
        bool watchdog = false;
    };
    bool pending() const noexcept { return pending_; }
    Committed commit() noexcept;

    Pdi::SyncManager settings(unsigned number) const noexcept;
    std::size_t pdi_read(unsigned number, std::span<std::uint8_t> to) noexcept;
    bool pdi_write(unsigned number, std::span<const std::uint8_t> from) noexcept;
    void acknowledge_repeat(unsigned number) noexcept;
    /// Returns whether an enabled one has the watchdog bit.
    bool watched() const noexcept;

private:
    struct Unit {
        std::uint32_t start = 0;
        std::uint32_t length = 0;
        bool enabled = false;
        bool mailbox = false;
        bool ecat_writes = false;
        bool watchdog = false;
        /// closed: the last byte was accessed in this frame
        bool open = false;
        bool full = false;
        bool closed = false;
        bool fresh = false;
        bool read_event = false;
        std::uint8_t writer = 0;
        std::uint8_t latest = none;
        std::uint8_t reader = 0;
    };
    static constexpr std::uint8_t none = 3;

    const Unit* at(std::uint32_t address, std::uint32_t& until) const noexcept;
    bool read(Unit&, std::uint32_t offset, std::span<std::uint8_t> to) noexcept;
    bool write(Unit&, std::uint32_t offset, std::span<const std::uint8_t> from,
               const std::uint8_t* mask) noexcept;
    std::uint8_t* buffer(const Unit& u, unsigned number) noexcept {
        return memory_ + (u.length == 1 || u.mailbox ? u.start : u.start + number * u.length);
    }
    void activate(unsigned number, bool on) noexcept;

    std::uint8_t* memory_ = nullptr;
    unsigned count_ = 0;
    unsigned enabled_ = 0;  ///< enabled_: a bit for each
    bool pending_ = false;
    std::array<Unit, max> units_;
};

}  // namespace hal::ethercat::esc
