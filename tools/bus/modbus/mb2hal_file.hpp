// SPDX-License-Identifier: MIT
// The configuration file of LinuxCNC's mb2hal: [MB2HAL_INIT] and [TRANSACTION_00] … (LinuxCNC
// documentation, "MB2HAL"). Everything here is [setup].
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "modbus/config/plan.hpp"
#include "netlist/netlist.hpp"

namespace hal::tools {

/// A transaction: one telegram, and the pins of its elements.
struct Mb2halTransaction {
    std::string name;  ///< HAL_TX_NAME, or the number
    std::size_t link = 0;  ///< index in Mb2halFile::links
    std::uint8_t unit = 0;
    modbus::Table table = modbus::Table::none;
    bool is_output = false;
    bool is_single = false;  ///< functions 05 and 06, of one element
    std::uint16_t address = 0;
    std::vector<std::string> elements;  ///< names: "00", "01" … or those of PIN_NAMES
    double max_rate_hz = 0.0;  ///< 0: as often as the line allows
    std::int64_t timeout_ns = 500'000'000;
    std::int64_t delay_ns = 0;
    std::uint32_t line = 0;  ///< of its first key in the file
};

/// A serial line or a TCP connection.
struct Mb2halLink {
    std::string address;  ///< serial:/dev/ttyUSB0, tcp:10.0.0.5:502
    bool is_serial = false;
    line::Options line;
};

struct Mb2halFile {
    std::string module = "mb2hal";
    bool has_new_names = false;  ///< VERSION 1.1 and later: suffixes .bit, .float, .int
    std::vector<Mb2halLink> links;
    std::vector<Mb2halTransaction> transactions;
};

/// Reads a file. Errors and warnings go to `diagnostics`.
Mb2halFile read_mb2hal(Sources& sources, const std::string& path, Diagnostics& diagnostics);

/// The transactions of one link for the master: slaves by their numbers, a telegram for each
/// transaction.
struct Mb2halBus {
    modbus::Bus bus;
    modbus::Plan plan;
    std::vector<std::size_t> transactions;  ///< of each telegram: index in Mb2halFile
};
/// Adds the buses of all links to `buses`; their plans point into them.
void make_buses(const Mb2halFile& file, const std::string& path, std::deque<Mb2halBus>& buses);

}  // namespace hal::tools
