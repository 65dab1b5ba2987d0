// SPDX-License-Identifier: MIT
// The slave information interface (SII, ETG.1000.6 clause 5.4, ETG.2010): the image in a slave's
// EEPROM.
//
//     const sii::Contents slave = sii::parse(image);      // accepts any bytes; slave.problems lists what is invalid
//     image = sii::build(slave);                          // with the checksum
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hal::ethercat::sii {

/// Word addresses of the first 64 words.
inline constexpr std::uint16_t word_pdi_control = 0x00;
inline constexpr std::uint16_t word_alias = 0x04;
inline constexpr std::uint16_t word_checksum = 0x07;

inline constexpr std::uint16_t word_vendor = 0x08;
inline constexpr std::uint16_t word_product = 0x0a;
inline constexpr std::uint16_t word_revision = 0x0c;

inline constexpr std::uint16_t word_serial = 0x0e;
inline constexpr std::uint16_t word_boot_mailbox = 0x14;
inline constexpr std::uint16_t word_mailbox = 0x18;

inline constexpr std::uint16_t word_protocols = 0x1c;
inline constexpr std::uint16_t word_size = 0x3e;
inline constexpr std::uint16_t word_version = 0x3f;

inline constexpr std::uint16_t word_categories = 0x40;

/// Bits of the CoE details.
inline constexpr std::uint8_t coe_sdo = 0x01;
inline constexpr std::uint8_t coe_sdo_info = 0x02;
inline constexpr std::uint8_t coe_pdo_assign = 0x04;

inline constexpr std::uint8_t coe_pdo_config = 0x08;
inline constexpr std::uint8_t coe_upload_at_start = 0x10;

inline constexpr std::uint8_t coe_complete_access = 0x20;
/// Category numbers.
enum class Category : std::uint16_t {
    strings = 10,
    data_types = 20,
    general = 30,
    fmmu = 40,
    sync_manager = 41,
    tx_pdo = 50,
    rx_pdo = 51,
    dc = 60,
    end = 0xffff
};

struct Area {
    std::uint16_t start = 0;
    std::uint16_t size = 0;
    friend bool operator==(const Area&, const Area&) = default;
};
/// The mailboxes as the slave sees them: it receives what the master writes.
struct Mailboxes {
    Area receive, send;
    friend bool operator==(const Mailboxes&, const Mailboxes&) = default;
};

enum class SmType : std::uint8_t {
    unused = 0,
    mailbox_out = 1,
    mailbox_in = 2,
    outputs = 3,
    inputs = 4
};
struct SyncManager {
    std::uint16_t start = 0;
    std::uint16_t length = 0;
    std::uint8_t control = 0;
    std::uint8_t status = 0;
    std::uint8_t enable = 0;
    SmType type{};
};

enum class FmmuUse : std::uint8_t { unused = 0, outputs = 1, inputs = 2, mailbox_state = 3 };

struct Entry {
    std::uint16_t index = 0;  ///< 0: a gap
    std::uint8_t sub = 0;
    std::string name;
    std::uint8_t type = 0;  ///< number of a CoE basic type
    std::uint8_t bits = 0;
    std::uint16_t flags = 0;
};
struct Pdo {
    std::uint16_t index = 0;
    std::uint8_t sync_manager = 0xff;  ///< FFh: not assigned by default
    std::uint8_t sync = 0;
    std::string name;
    std::uint16_t flags = 0;
    std::vector<Entry> entries;
};
inline constexpr std::uint16_t pdo_mandatory = 0x0001;
inline constexpr std::uint16_t pdo_fixed = 0x0010;  ///< flags of a PDO

/// An operation mode of the distributed clocks.
struct DcMode {
    std::uint32_t sync0_cycle_ns = 0;  ///< 0: the master's cycle times sync0_factor
    std::int32_t sync0_shift_ns = 0;
    std::int32_t sync1_shift_ns = 0;
    std::int16_t sync1_factor = 0;
    std::int16_t sync0_factor = 0;
    std::uint16_t assign_activate = 0;
    std::string name, description;
};

struct General {
    std::string group, image, order, name;
    std::uint8_t coe_details = 0;
    bool foe = false;
    bool eoe = false;
    std::uint8_t soe_channels = 0;
    std::uint8_t ds402_channels = 0;
    std::uint8_t flags = 0;  ///< bit 0 SAFE-OP supported, bit 1 no LRW
    std::int16_t ebus_ma = 0;
    std::array<std::uint8_t, 4> ports{};  ///< 0 none, 1 MII, 3 EBUS

    bool no_lrw() const noexcept { return (flags & 2) != 0; }
};

/// A category of another type.
struct OtherCategory {
    std::uint16_t type = 0;
    std::vector<std::uint8_t> data;
};

/// The contents of an image.
struct Contents {
    std::array<std::uint16_t, 7> configuration{};  ///< words 0-6; word 4 is the alias
    std::uint32_t vendor = 0;
    std::uint32_t product = 0;
    std::uint32_t revision = 0;
    std::uint32_t serial = 0;
    std::uint16_t execution_delay = 0;
    std::array<std::int16_t, 2> port_delay{};
    Mailboxes boot, mailboxes;
    std::uint16_t protocols = 0;
    /// size of the EEPROM as the image states it
    std::size_t eeprom_bytes = 0;
    std::uint16_t version = 1;
    bool has_general = false;
    General general;
    std::vector<FmmuUse> fmmus;
    std::vector<SyncManager> sync_managers;
    std::vector<Pdo> tx, rx;  ///< inputs and outputs of the master
    std::vector<DcMode> dc;
    std::vector<OtherCategory> others;
    /// of a parsed image; 88A4h disables the test in the slave and counts as valid
    bool checksum_valid = false;
    /// what is invalid in a parsed image, one sentence each
    std::vector<std::string> problems;

    std::uint16_t alias() const noexcept { return configuration[4]; }
    bool has_mailbox() const noexcept {
        return mailboxes.receive.size != 0 && mailboxes.send.size != 0;
    }
};

/// Returns the checksum of the configuration area (words 0-6, at least 14 bytes): CRC-8, polynomial
/// 07h, initial value FFh. [any]
std::uint8_t checksum(std::span<const std::uint8_t> image) noexcept;

/// Returns how many bytes of the image have to be read to have all categories, or to know that more
/// are needed. Call it again with what was read then; the image is complete once the answer is not
/// above `read.size()`. At most 128 KiB. [realtime]
std::size_t bytes_needed(std::span<const std::uint8_t> read) noexcept;

/// Reads an image. Accepts any bytes: what is missing stays empty, what is invalid is reported in
/// `problems`. [setup]
Contents parse(std::span<const std::uint8_t> image);

/// Makes an image, with its checksum. It is as long as `eeprom_bytes`, or as it needs if that is 0
/// or too small; names are dropped first, from the last PDO on, to make it fit. [setup]
std::vector<std::uint8_t> build(const Contents&);

/// Returns the number of a CoE basic type: "BOOL" 1, "INT" 3, "BIT4" 33h; 0 for an unknown name.
/// [any]
std::uint8_t type_number(std::string_view name) noexcept;
/// Returns the name of a CoE basic type, "" for an unknown number. [any]
const char* type_name(std::uint8_t number) noexcept;

}  // namespace hal::ethercat::sii
