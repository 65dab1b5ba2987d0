// SPDX-License-Identifier: MIT
// What a datagram means, in words: its register, the state or the mailbox message in it.
#pragma once

#include <string>

#include "ethercat/wire/frames.hpp"

namespace hal::tools {

/// Returns the slave or the logical address of a datagram: "slave 2", "station 0x1001", "all
/// slaves", "logical 0x00000000".
/// `passed`: it returned from the slaves, which count up a position. [any]
std::string datagram_address(const ethercat::DatagramView&, bool passed);

/// Returns "AL status: OP", "CoE SDO upload 0x6041:0" and the like; empty for process data and
/// memory of the slave. [any]
std::string datagram_text(const ethercat::DatagramView&);

}  // namespace hal::tools
