// SPDX-License-Identifier: MIT
// Builds a Design: dictionary and SII from one list of PDOs, so that both agree.
#pragma once

#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "ethercat/devices/firmware.hpp"

namespace hal::ethercat::devices {

/// Identity of all devices of this folder: a vendor ID that is assigned to nobody.
inline constexpr std::uint32_t vendor = 0x00ffffff;

struct PdoEntry {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    std::string name{};
};

/// Everything here is [setup].
class DesignBuilder {
public:
    DesignBuilder(std::string name, std::uint32_t product, std::uint32_t revision = 1);
    Dictionary& dictionary() noexcept { return *design_.dictionary; }
    Design& design() noexcept { return design_; }

    /// Adds the mailbox with CoE and its sync managers 0 and 1; `bytes` for both directions.
    void mailbox(std::size_t bytes, bool boot = false);
    /// Adds a further protocol of the mailbox.
    void service(std::unique_ptr<MailboxService>);
    /// Adds a PDO whose entries are in the dictionary already. Fixed PDOs cannot be mapped anew;
    /// others hold up to `max` entries.
    void pdo(bool output, std::uint16_t index, std::string name,
             const std::vector<PdoEntry>& entries, bool assigned = true, unsigned max = 0);
    /// Offers SYNC0, and SYNC1 with `sync1`.
    void dc(bool required, bool sync1 = true);
    /// Completes sync managers, assignment, SII; `max_*` are the largest process data, 0: as
    /// assigned.
    Design finish(std::uint16_t alias, std::uint32_t serial, std::size_t max_output_bytes = 0,
                  std::size_t max_input_bytes = 0);

private:
    void assignment(bool output, std::uint16_t sm);
    void empty_assignment(std::uint16_t sm);

    Design design_;
    std::size_t mailbox_bytes_ = 0;
};

}  // namespace hal::ethercat::devices
