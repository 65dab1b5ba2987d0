// SPDX-License-Identifier: MIT
// Electronic data sheets (EDS) and device configuration files (DCF) of CiA 306 as plain data.
//
// The reader never throws and does not stop at a defect: it reports each defect with its line and
// reads the rest. It keeps unknown keys, unknown sections and comment lines; a file that
// `write_eds` writes reads back equal.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "eds_text.hpp"
#include "eds_types.hpp"

namespace hal::canopen::eds {

enum class ObjectType : std::uint8_t {
    null = 0,
    domain = 2,
    deftype = 5,
    defstruct = 6,
    var = 7,
    array = 8,
    record = 9
};
enum class Access : std::uint8_t { ro, wo, rw, rwr, rww, constant };
enum class Category : std::uint8_t { mandatory, optional, manufacturer };
/// Returns the category that an object has by its index (CiA 306-1).
constexpr Category category_of(std::uint16_t index) noexcept {
    if (index == 0x1000 || index == 0x1001 || index == 0x1018) return Category::mandatory;
    return index >= 0x2000 && index < 0x6000 ? Category::manufacturer : Category::optional;
}

std::string_view name_of(ObjectType type);
std::string_view name_of(Access access);

/// Unknown keys in file order, and comment lines (with an empty key).
using Extras = std::vector<std::pair<std::string, std::string>>;

/// One value of the device: a sub-index of an object, or a VAR or DOMAIN as a whole (sub-index 0).
struct Entry {
    std::uint8_t sub = 0;
    std::string name;
    std::string denotation;           ///< DCF: the name given by the user
    ObjectType type = ObjectType::var;
    std::uint16_t data_type = 0;      ///< 0: not specified
    Access access = Access::rw;
    bool pdo_mapping = false;
    std::string default_value;        ///< as written, including `$NODEID`; see `encode`
    std::string low_limit, high_limit;
    std::string parameter_value;      ///< DCF: the value to configure
    std::string upload_file, download_file;  ///< DCF, of domains
    /// ObjFlags: bit 0: excluded from scanning and restoring; bit 1: writing it has side effects
    std::uint32_t flags = 0;
    Extras extras = {};
    Span at = {};

    bool operator==(const Entry&) const = default;
    bool readable() const { return access != Access::wo; }
    bool writable() const { return access != Access::ro && access != Access::constant; }
};

struct Object {
    std::uint16_t index = 0;
    std::string name;
    std::string denotation;
    ObjectType type = ObjectType::var;
    Category category = Category::optional;
    std::uint16_t data_type = 0;  ///< of a DEFSTRUCT, RECORD or ARRAY, if given
    /// CompactSubObj: one description for entries 1..compact
    unsigned compact = 0;
    std::uint32_t flags = 0;
    std::vector<std::uint16_t> links = {};  ///< [xxxxObjectLinks]
    std::vector<Entry> entries = {};  ///< by sub-index, ascending; a VAR has one
    Extras extras = {};
    Span at = {};

    bool operator==(const Object&) const = default;
    bool single() const {
        return type != ObjectType::array && type != ObjectType::record &&
               type != ObjectType::defstruct;
    }
    const Entry* find(std::uint8_t sub) const;
    Entry* find(std::uint8_t sub);
};

struct FileInfo {
    std::string file_name, eds_version, description;
    std::string creation_time, creation_date, created_by, modification_time, modification_date,
        modified_by;
    std::uint8_t version = 0;
    std::uint8_t revision = 0;
    std::string last_eds;  ///< DCF: the EDS from which it was created
    Extras extras = {};

    bool operator==(const FileInfo&) const = default;
};

/// kbit/s; 100 is not in CiA 306
inline constexpr std::array<unsigned, 9> baud_rates{10, 20, 50, 100, 125, 250, 500, 800, 1000};

struct DeviceInfo {
    std::string vendor_name, product_name, order_code;
    std::optional<std::uint32_t> vendor_number, product_number, revision_number;
    std::array<bool, baud_rates.size()> supports = {};  ///< in the order of baud_rates
    bool boot_up_master = false;
    bool boot_up_slave = false;
    /// granularity of PDO mapping, bits; 0: the mapping is fixed
    std::uint8_t granularity = 0;
    bool dynamic_channels = false;
    bool group_messaging = false;
    bool lss = false;
    /// bit n-1: sub-index n exists in communication parameters that are not described individually
    std::uint8_t compact_pdo = 0;
    std::uint16_t rx_pdos = 0;
    std::uint16_t tx_pdos = 0;
    /// the begin of the file, if the keys are missing
    Span rx_pdos_at = {1, 1, 0, 0};
    Span tx_pdos_at = {1, 1, 0, 0};
    Extras extras = {};

    bool operator==(const DeviceInfo&) const = default;
};

/// DCF: the section [DeviceComissioning], as CiA 306 spells it.
struct Commissioning {
    std::uint8_t node_id = 0;
    std::string node_name, node_reference, network_name, network_reference;
    std::uint16_t baud_rate = 0;  ///< kbit/s
    std::uint32_t network = 0;
    bool manager = false;  ///< CANopenManager
    std::uint32_t lss_serial_number = 0;
    Extras extras = {};

    bool operator==(const Commissioning&) const = default;
};

/// Sub-indices that a module adds to an object ([MnSubExtxxxx]): `count` of them, or counts by
/// sub-index ranges in the extras.
struct SubExtension {
    Object object;  ///< one entry, the template of each new one
    std::string count, object_extend;

    bool operator==(const SubExtension&) const = default;
};

struct Module {
    unsigned number = 0;
    std::string product_name, order_code, version, revision;
    std::vector<Object> fixed = {};
    std::vector<SubExtension> extensions = {};
    std::vector<std::string> comments = {};
    Extras extras = {};

    bool operator==(const Module&) const = default;
};

/// A segment of [DynamicChannels]: objects that the program of a programmable device creates.
struct DynamicSegment {
    std::uint16_t type = 0;
    Access access = Access::rw;
    std::string range;  ///< "0xA080-0xA0BF"
    std::uint32_t image_offset = 0;  ///< PPOffset

    bool operator==(const DynamicSegment&) const = default;
};

struct OtherSection {
    std::string name;
    Extras entries;

    bool operator==(const OtherSection&) const = default;
};

struct DeviceDescription {
    FileInfo file;
    DeviceInfo device;
    /// present: the file is a DCF
    std::optional<Commissioning> commissioning;
    /// [DummyUsage]: data type, may be mapped
    std::vector<std::pair<std::uint16_t, bool>> dummies;
    std::vector<std::string> comments;
    /// by index, ascending
    std::vector<Object> objects;
    std::vector<Module> modules;
    /// DCF: numbers of modules, by slot
    std::vector<unsigned> connected_modules;
    std::vector<DynamicSegment> dynamic_channels;
    /// sections unknown to CiA 306
    std::vector<OtherSection> others;
    /// comment lines before the first section
    std::vector<std::string> preamble;

    bool operator==(const DeviceDescription&) const = default;
    const Object* find(std::uint16_t index) const;
    Object* find(std::uint16_t index);
    const Entry* find(std::uint16_t index, std::uint8_t sub) const;
    std::size_t entries() const;
    /// Returns the node ID of a DCF, else `otherwise`.
    unsigned node_id(unsigned otherwise = 0) const;
};

/// The result of reading a file.
struct ReadResult {
    /// nothing: the file was rejected; the last message is the reason
    std::optional<DeviceDescription> description;
    std::vector<Message> messages;  ///< in the order of the file
    /// the decoded text that the spans refer to
    std::string text;
    std::size_t count(Severity severity) const;
    /// Returns the problems that make values of the file unreliable (see `unreliable`).
    std::vector<Message> doubts() const;
};

/// Reads the bytes of an EDS or DCF file. [any, not real time]
ReadResult read_eds(std::string_view bytes);

/// Writes an EDS, or a DCF if there is a commissioning. UTF-8; lines end with CR LF, as in CiA 306.
std::string write_eds(const DeviceDescription& description);

/// Returns why the parameter values of a DCF are not for this node, as "it is for node 5, not for
/// node 7"; "" when they are, or when the file does not state it. `bit_rate` is in bit/s; 0:
/// unknown.
std::string misfit(const DeviceDescription& dcf, unsigned node_id, std::uint32_t bit_rate);

/// Returns the number of entries with a parameter value.
std::size_t parameter_values(const DeviceDescription& description);

/// Adds the objects of the connected modules.
void connect_modules(DeviceDescription& description, std::vector<Message>& messages);

/// Checks the rules between objects (mapping, limits, counts of PDOs). read_eds() includes it.
void check_objects(const DeviceDescription& description, std::vector<Message>& messages);

}  // namespace hal::canopen::eds
