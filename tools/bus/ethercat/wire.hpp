// SPDX-License-Identifier: MIT
// Datagrams by position, without a master: no state and no address of a slave changes, and a
// running master goes on. Everything here is [setup]; everything has a timeout.
//
//     EthercatWire wire;
//     if (!wire.open(options)) return 1;                               // the reason is printed
//     const auto bytes = wire.read(0, registers::al_status, 6);
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bus/ethercat/access.hpp"
#include "bus/ethercat/datagram_exchange.hpp"
#include "bus/ethercat/sii_reader.hpp"
#include "ethercat/master/bus_slave.hpp"
#include "ethercat/wire/frames.hpp"
#include "ethercat/wire/sii.hpp"

namespace hal::tools {

class EthercatWire {
public:
    EthercatWire() : exchange_(access_), sii_(access_, exchange_) {}

    /// Opens the bus and reads the registers of the slaves. `alone`: see EthercatAccess. Returns
    /// false after printing the reason.
    bool open(const EthercatOptions&, bool alone = false);
    /// Reads the EEPROMs of all slaves, and with them their identities.
    void identify();
    const std::vector<std::string>& arguments() const { return access_.arguments(); }
    const std::string& address() const { return access_.address(); }
    std::size_t size() const { return slaves_.size(); }
    ethercat::master::BusSlave& slave(std::size_t position) { return slaves_[position]; }
    /// Returns the slave that --position names, or the only one; nullptr after printing the reason.
    ethercat::master::BusSlave* chosen(const EthercatPositionOptions&);
    /// Prints an error if there are arguments; returns whether there are none.
    bool without_arguments(const EthercatOptions&) const;

    std::optional<std::vector<std::uint8_t>> read(std::size_t position, std::uint16_t address,
                                                  std::uint16_t length);
    bool write(std::size_t position, std::uint16_t address, std::span<const std::uint8_t> bytes);
    bool write(std::size_t position, std::uint16_t address, std::uint16_t value);
    /// Sends datagrams together; see DatagramExchange.
    void run(std::span<WireDatagram> datagrams) { exchange_.run(datagrams); }
    void read_state(ethercat::master::BusSlave&);

    /// Reads the SII up to its end, or `length` bytes; nullopt: not readable.
    std::optional<std::vector<std::uint8_t>> sii(std::size_t position, std::size_t length = 0);
    bool write_sii(std::size_t position, std::uint32_t word, std::uint16_t value);
    /// Returns the contents of the SII, read once.
    const ethercat::sii::Contents& contents(std::size_t position);
    /// Returns the name in the SII, or the identity if there is none.
    std::string name(std::size_t position);
    std::int64_t now_ns() const { return access_.now_ns(); }
    void pass(std::int64_t ns) { access_.pass(ns); }

private:
    std::uint16_t count_slaves();
    void latch_receive_times();
    bool read_registers();
    void measure_line();
    void keep(std::size_t position, const SiiReader::Image& image);

    EthercatAccess access_;
    DatagramExchange exchange_;
    SiiReader sii_;
    std::vector<ethercat::master::BusSlave> slaves_;
    std::vector<std::optional<ethercat::sii::Contents>> contents_;
};

}  // namespace hal::tools
