// SPDX-License-Identifier: MIT
// Requests and replies of LBP16, Mesa's protocol on UDP. A request is any number of commands, which
// the card executes in order; its reply is the data of all reads, one after the other, without a
// header. A request that reads nothing has no reply.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "mesa/lbp16/bytes.hpp"

namespace hal::mesa {

inline constexpr std::uint16_t udp_port = 27181;
/// The longest datagram in each direction that drivers make and a card has to accept.
inline constexpr std::size_t max_datagram = 1400;
/// Units in one command: seven bits, 0 is not used.
inline constexpr unsigned max_units = 127;

/// Memory spaces of a card.
enum class Space : std::uint8_t {
    hostmot2 = 0,  ///< registers of the firmware, 64 KiB
    ethernet_chip = 1,
    eeprom = 2,  ///< MAC, name, IP address
    flash = 3,
    timers = 4,  ///< from LBP16 version 3; has scratch registers
    unused = 5,
    status = 6,  ///< counters and errors of the communication
    card = 7,  ///< name and versions
};

/// Width of the units of a command; the value is the binary logarithm of the bytes.
enum class Unit : std::uint8_t { u8 = 0, u16 = 1, u32 = 2, u64 = 3 };

constexpr std::size_t bytes_of(Unit unit) noexcept {
    return std::size_t{1} << static_cast<unsigned>(unit);
}

/// One command. Its word is followed by `address` if `has_address`, and by data if `is_write`.
struct Command {
    bool is_write = false;
    bool has_address = true;  ///< false: continues at the last address of the space
    bool information = false;  ///< the information area of the space in place of its contents
    Space space = Space::hostmot2;
    Unit unit = Unit::u32;
    bool advances = true;  ///< false: all units have the same address, as for a FIFO
    std::uint8_t count = 1;
    std::uint16_t address = 0;

    constexpr std::size_t data_size() const noexcept { return count * bytes_of(unit); }
    constexpr std::size_t head_size() const noexcept { return has_address ? 4 : 2; }
    friend constexpr bool operator==(const Command&, const Command&) = default;
};

/// Returns the first word of a command: bit 15 write, 14 address, 13 information area, 12..10
/// space, 9..8 unit, 7 address advances, 6..0 count. [any]
constexpr std::uint16_t word_of(const Command& command) noexcept {
    unsigned word = command.count & 0x7fU;
    word |= command.is_write ? 0x8000U : 0U;
    word |= command.has_address ? 0x4000U : 0U;
    word |= command.information ? 0x2000U : 0U;
    word |= static_cast<unsigned>(command.space) << 10;
    word |= static_cast<unsigned>(command.unit) << 8;
    word |= command.advances ? 0x0080U : 0U;
    return static_cast<std::uint16_t>(word);
}
/// Inverse of word_of(); the address is 0. [any]
constexpr Command command_of(std::uint16_t word) noexcept {
    Command command;
    command.is_write = (word & 0x8000U) != 0;
    command.has_address = (word & 0x4000U) != 0;
    command.information = (word & 0x2000U) != 0;
    command.space = static_cast<Space>(word >> 10 & 7U);
    command.unit = static_cast<Unit>(word >> 8 & 3U);
    command.advances = (word & 0x0080U) != 0;
    command.count = static_cast<std::uint8_t>(word & 0x7fU);
    return command;
}

/// A request that is being put together, and where the data of its reads is in the reply. It is
/// made once; a cycle stores new numbers at the offsets of its writes. Not shared by threads.
class Request {
public:
    /// Appends a read of `count` units, in several commands where one cannot have so many. Returns
    /// the offset of the data in the reply, or nothing if request or reply would become too long;
    /// the request is then unchanged. [any]
    std::optional<std::size_t> read(Space space, std::uint16_t address, Unit unit,
                                    std::size_t count = 1, bool advances = true) noexcept;
    /// Appends a read of the information area of a space, 16 bytes. [any]
    std::optional<std::size_t> read_information(Space space) noexcept;
    /// Appends a write of the bytes of `data`. Returns the offset of the data in the request, or
    /// nothing if it would become too long or the data is not whole units; at most max_units. [any]
    std::optional<std::size_t> write(Space space, std::uint16_t address, Unit unit,
                                     std::span<const std::uint8_t> data,
                                     bool advances = true) noexcept;
    /// Appends a write of one 32-bit register of HostMot2. [any]
    std::optional<std::size_t> write32(std::uint16_t address, std::uint32_t value) noexcept;

    /// Appends the commands of another request. Returns false, and appends nothing, if request or
    /// reply would become too long. [any]
    bool append(const Request& other) noexcept;

    /// Stores a number at an offset that write() returned. [any]
    template <std::integral T>
    void set(std::size_t offset, T value) noexcept {
        if (offset + sizeof value <= size_) {
            store(bytes_.data() + offset, value);
        }
    }

    std::span<const std::uint8_t> bytes() const noexcept { return {bytes_.data(), size_}; }
    std::size_t size() const noexcept { return size_; }
    /// Length of the reply; 0: no reply.
    std::size_t reply_size() const noexcept { return reply_size_; }
    bool empty() const noexcept { return size_ == 0; }
    void clear() noexcept {
        size_ = 0;
        reply_size_ = 0;
    }

private:
    void put(const Command& command) noexcept;

    std::array<std::uint8_t, max_datagram> bytes_{};
    std::size_t size_ = 0;
    std::size_t reply_size_ = 0;
};

/// Reads the commands of a request, as a card does.
class RequestReader {
public:
    explicit RequestReader(std::span<const std::uint8_t> request) noexcept : rest_(request) {}
    enum class Next : std::uint8_t {
        command,
        end,
        malformed,  ///< ends inside a command; nothing more can be read
    };
    /// Reads the next command, and for a write its data, which is in the request. [any]
    Next next(Command& command, std::span<const std::uint8_t>& data) noexcept;

private:
    std::span<const std::uint8_t> rest_;
};

}  // namespace hal::mesa
