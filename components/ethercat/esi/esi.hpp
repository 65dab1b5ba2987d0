// SPDX-License-Identifier: MIT
// Device descriptions in XML (ESI, ETG.2000): what a vendor states about a device.
//
//     const esi::File file = esi::read(text);
//     const esi::Match match = esi::look_up(file, {.product = 0x402});       // lookup.hpp
//     if (match.device != nullptr) image = esi::sii_image(*match.device);
//
// Everything here is [setup].
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ethercat/wire/mailbox.hpp"
#include "ethercat/wire/revision_rule.hpp"
#include "ethercat/wire/sii.hpp"
#include "text/config_text.hpp"

namespace hal::ethercat::esi {

/// The largest number of samples of a PDO in a cycle that is read.
inline constexpr unsigned max_samples = 1000;

enum class Topic : std::uint8_t { file, value };
using Message = text::Message<Topic>;

struct Entry {
    std::uint16_t index = 0;  ///< 0: a gap
    std::uint8_t sub = 0;
    std::uint16_t bits = 0;
    std::string name, type;   ///< data type, such as "UINT"
};

/// How many samples a PDO has in a cycle, if the device takes them at a multiple of the cycle
/// (ETG.2000, attributes OSFac, OSMin, OSMax, OSIndexInc of RxPdo and TxPdo).
struct Oversampling {
    unsigned min = 1;
    unsigned max = 0;  ///< below 2: the PDO has no samples
    std::uint16_t index_increment = 0;  ///< from the object of a sample to that of the next one

    explicit operator bool() const noexcept { return max > 1; }
};

struct Pdo {
    std::uint16_t index = 0;
    std::string name;
    std::optional<std::uint8_t> sync_manager;  ///< set: assigned by default
    Oversampling oversampling;  ///< the entries are those of one sample
    bool fixed = false;
    bool mandatory = false;
    /// PDOs that cannot be assigned together with this one
    std::vector<std::uint16_t> exclude;
    std::vector<Entry> entries;
    unsigned bits() const;
};

struct SyncManager {
    sii::SmType type{};
    std::uint16_t start = 0;
    std::uint16_t default_size = 0;
    std::uint16_t min_size = 0;
    std::uint16_t max_size = 0;
    std::uint8_t control = 0;
    std::uint8_t enable = 0;
};

/// A write at a transition.
struct InitCmd {
    enum class Protocol : std::uint8_t { coe, soe } protocol = Protocol::coe;
    std::vector<std::string> transitions;  ///< "IP", "PS", "SO", …
    std::uint16_t index = 0;               ///< object or IDN
    std::uint8_t sub = 0;                  ///< sub-index, or the drive number of SoE
    bool complete = false;
    std::vector<std::uint8_t> data;
    std::string comment;
};

struct OpMode {
    /// A PDO that the mode assigns.
    struct Assigned {
        std::uint8_t sync_manager = 0;
        std::uint16_t pdo = 0;
        unsigned samples = 0;  ///< OSFac; 0: the mode does not name a number of samples
    };

    std::string name, description;
    std::uint16_t assign_activate = 0;
    /// 0: the master's cycle times the factor; a negative factor -n divides it by n
    std::int64_t sync0_cycle_ns = 0;
    /// 0: the cycle of SYNC0 times the factor; a negative factor -n divides the master's cycle by n
    std::int64_t sync1_cycle_ns = 0;
    int sync0_factor = 1;
    int sync1_factor = 0;
    std::int64_t sync0_shift_ns = 0;
    std::int64_t sync1_shift_ns = 0;
    std::vector<Assigned> assigned;

    /// Returns the samples in a cycle of a PDO with samples; 0: the mode assigns none.
    unsigned samples() const noexcept;
};

/// One value of the object dictionary.
struct Value {
    std::uint8_t sub = 0;
    std::string name, type;
    unsigned bits = 0;
    std::vector<std::uint8_t> initial;  ///< as on the wire; may be empty
    bool readable = true;
    bool writable = false;
    bool rx_mappable = false;
    bool tx_mappable = false;
};
struct Object {
    enum class Code : std::uint8_t { variable = 7, array = 8, record = 9 } code = Code::variable;
    std::uint16_t index = 0;
    std::string name, type;
    std::vector<Value> values;  ///< by sub-index
    const Value* find(std::uint8_t sub) const;
};

struct Mailbox {
    std::uint16_t protocols = 0;  ///< bits of MailboxProtocol
    bool has(MailboxType type) const noexcept { return (protocols & bit_of(type)) != 0; }

    bool repeat = false;
    bool sdo_info = false;
    bool pdo_assign = false;
    bool pdo_config = false;
    bool pdo_upload = false;

    bool complete_access = false;
    bool segmented_sdo = true;
    std::uint8_t soe_channels = 0;
};

struct Timeouts {  ///< ms
    std::uint32_t preop = 3000;
    std::uint32_t safeop_op = 10000;
    std::uint32_t back_to_init = 5000;
    std::uint32_t back_to_safeop = 200;

    std::uint32_t request = 100;
    std::uint32_t response = 2000;
};

struct Slot {
    std::string name;
    std::uint32_t default_module = 0;
    std::vector<std::uint32_t> modules;
};

struct Device {
    /// physics: Y MII, K EBUS, one letter per port
    std::string order, name, group, physics;
    std::uint32_t vendor = 0;
    std::uint32_t product = 0;
    std::uint32_t revision = 0;
    /// of the revisions for which the description is valid; nullopt: not given
    std::optional<RevisionRule> check_revision;
    std::uint32_t serial = 0;
    Timeouts timeouts;
    std::vector<sii::FmmuUse> fmmus;
    std::vector<SyncManager> sync_managers;
    std::vector<Pdo> rx, tx;
    std::optional<Mailbox> mailbox;
    std::vector<InitCmd> init_commands;
    /// the first is the default; empty: no distributed clocks
    std::vector<OpMode> op_modes;
    bool has_dc = false;
    std::vector<Object> objects;  ///< by index
    std::uint16_t profile = 0;  ///< 402 for a drive
    std::vector<Slot> slots;
    /// whether the module list is written to F030h; nullopt: not given
    std::optional<bool> download_modules;
    unsigned slot_pdo_increment = 1;
    unsigned slot_index_increment = 0;
    std::vector<std::uint8_t> eeprom;  ///< whole image, if the file has one
    std::vector<std::uint8_t> config_data, bootstrap;
    std::size_t eeprom_bytes = 0;
    std::vector<sii::OtherCategory> categories;
    text::Span at;

    const Object* find(std::uint16_t index) const;
    const Value* find(std::uint16_t index, std::uint8_t sub) const;
    const Pdo* find_pdo(std::uint16_t index) const;
};

/// A module of a modular device (ETG.5001).
struct Module {
    std::uint32_t ident = 0;
    std::string type, name;
    /// for slot 1; those of slot n have numbers higher by (n - 1) increments
    std::vector<Pdo> rx, tx;
    std::vector<InitCmd> init_commands;
    std::vector<bool> rx_depends, tx_depends;  ///< of each PDO: its indices depend on the slot
    std::vector<Object> objects;
};

struct File {
    std::vector<Device> devices;
    std::vector<Module> modules;
    std::vector<Message> messages;

    bool good() const { return text::good(messages); }
};

/// Reads a file. Accepts any bytes; what is invalid is left out and reported.
File read(std::string_view xml);

/// Returns a modular device with its modules in place, one for each slot from the first on; 0: an
/// empty slot. An unknown ident adds nothing.
Device with_modules(const File&, const Device&, const std::vector<std::uint32_t>& idents);

/// Returns the default modules of the slots; 0: an empty slot.
std::vector<std::uint32_t> default_modules(const Device&);
/// Returns the ident of the module with this type, name or ident, 0 for `-`; nullopt: unknown.
std::optional<std::uint32_t> find_module(const File&, std::string_view text);

/// Returns which entry of a PDO has more bits than its object in the dictionary, as a sentence;
/// empty: none.
std::string longer_entry(const Device&, const Pdo&);

/// Returns what the SII of the device contains.
sii::Contents sii_contents(const Device&);
/// Returns the EEPROM image of the device: that of the file if it has a whole one, else one made
/// from the description.
std::vector<std::uint8_t> sii_image(const Device&);

/// Parses a number of an ESI: decimal, `#x1f` or `0x1f`, with sign. Nothing for anything else.
std::optional<std::int64_t> number(std::string_view text);
/// Parses hexadecimal bytes; blanks and line ends are ignored. Nothing if there is an invalid digit
/// or half a byte.
std::optional<std::vector<std::uint8_t>> hex_bytes(std::string_view text);
/// Returns the length of a basic type: "UINT" 16, "BIT3" 3, "STRING(8)" 64; 0 for an unknown one.
unsigned type_bits(std::string_view type);

}  // namespace hal::ethercat::esi
