// SPDX-License-Identifier: MIT
// Sends datagrams and waits for their answers: as many in a frame as it holds, several frames under
// way, lost ones sent again. Everything here is [setup].
//
//     std::vector<WireDatagram> datagrams;
//     datagrams.push_back(read_datagram(0, registers::al_status, 6));
//     exchange.run(datagrams);
//     if (datagrams[0].accepted()) use(datagrams[0].data);
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bus/ethercat/access.hpp"
#include "ethercat/wire/frames.hpp"

namespace hal::tools {

/// A datagram and, after DatagramExchange::run(), its answer.
struct WireDatagram {
    ethercat::Command command{};
    std::uint32_t address = 0;  ///< as in ethercat::DatagramView
    std::vector<std::uint8_t> data;
    std::optional<std::uint16_t> working_counter{};  ///< nullopt: no answer

    /// Returns whether exactly one slave executed it.
    bool accepted() const { return working_counter == std::uint16_t{1}; }
};

/// Returns a datagram that reads `length` bytes of the slave at a position.
WireDatagram read_datagram(std::size_t position, std::uint16_t address, std::uint16_t length);
/// Returns a datagram that writes `bytes` to the slave at a position.
WireDatagram write_datagram(std::size_t position, std::uint16_t address,
                            std::span<const std::uint8_t> bytes);

class DatagramExchange {
public:
    explicit DatagramExchange(EthercatAccess& access) : access_(access) {}

    /// Sends all datagrams in their order and fills in the answers. One that is lost three times
    /// has no working counter.
    void run(std::span<WireDatagram> datagrams);

private:
    /// Datagrams of one frame: `count` from `first` on, all with the same index.
    struct Flight {
        std::size_t first = 0;
        std::size_t count = 0;
        std::uint8_t index = 0;
        bool arrived = false;
    };
    Flight send(std::span<WireDatagram> datagrams, std::size_t first);
    void receive(std::span<WireDatagram> datagrams, std::span<Flight> flights);

    EthercatAccess& access_;
    std::uint8_t index_ = 0;
};

}  // namespace hal::tools
