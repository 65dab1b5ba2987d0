// SPDX-License-Identifier: MIT
// The EEPROMs of slaves through the registers of their controllers (ETG.1000.4, clause 6.4), those
// of several slaves at the same time. Everything here is [setup].
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bus/ethercat/datagram_exchange.hpp"

namespace hal::tools {

class SiiReader {
public:
    using Image = std::optional<std::vector<std::uint8_t>>;

    SiiReader(EthercatAccess& access, DatagramExchange& exchange)
        : access_(access), exchange_(exchange) {}

    /// Reads `length` bytes of the SII of each position, or, if it is 0, up to its end. A slave
    /// whose EEPROM is not readable has no image.
    std::vector<Image> read(std::span<const std::size_t> positions, std::size_t length = 0);
    /// Writes one word. Returns whether the slave accepted it.
    bool write(std::size_t position, std::uint32_t word, std::uint16_t value);

private:
    /// One command to an EEPROM, with the registers 0502h to 050Fh behind it.
    struct Access {
        enum class Stage : std::uint8_t { start, poll, done, failed };
        std::size_t slave = 0;  ///< index in the list of positions
        std::size_t position = 0;
        std::uint16_t command = 0;
        std::uint32_t word = 0;
        Stage stage = Stage::start;
        std::vector<std::uint8_t> registers{};
    };
    void execute(std::vector<Access>& accesses);
    /// Moves an access on by its answer. Returns whether the EEPROM rejected the command, which is
    /// then given again after its error was cleared.
    static bool advance(Access& access, const WireDatagram& answer);
    void clear_errors(std::span<const std::size_t> positions);

    EthercatAccess& access_;
    DatagramExchange& exchange_;
};

}  // namespace hal::tools
