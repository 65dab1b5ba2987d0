// SPDX-License-Identifier: MIT
// Electronic data sheets (EDS) and device configuration files (DCF) of CiA 306: what a file says, as plain data.
//
// Reading never throws and never stops at a defect: every defect is a message with its line, the rest is read. Nothing is lost: keys
// and sections that are not known are kept, comment lines too. `write` gives a file that reads back equal.
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

enum class ObjectType : std::uint8_t { null = 0, domain = 2, deftype = 5, defstruct = 6, var = 7, array = 8, record = 9 };
enum class Access : std::uint8_t { ro, wo, rw, rwr, rww, constant };
enum class Category : std::uint8_t { mandatory, optional, manufacturer };

std::string_view name_of(ObjectType type);
std::string_view name_of(Access access);

/// Keys no field stands for, in file order, and comment lines (an empty key).
using Extras = std::vector<std::pair<std::string, std::string>>;

/// One value the device has: a sub-index of an object, or the whole of a VAR or DOMAIN (sub-index 0).
struct Entry {
    std::uint8_t  sub = 0;
    std::string   name;
    std::string   denotation;           ///< DCF: what the user calls it
    ObjectType    type = ObjectType::var;
    std::uint16_t data_type = 0;      ///< 0: not given
    Access        access = Access::rw;
    bool          pdo_mapping = false;
    std::string   default_value;        ///< as written, `$NODEID` and all; see `encode`
    std::string   low_limit, high_limit;
    std::string   parameter_value;      ///< DCF: the value to configure
    std::string   upload_file, download_file;  ///< DCF, of domains
    std::uint32_t flags = 0;          ///< ObjFlags: bit 0 is refused by scan and restore, bit 1 has an effect on writing
    Extras        extras = {};
    Place         at = {};

    bool operator==(const Entry&) const = default;
    bool readable() const { return access != Access::wo; }
    bool writable() const { return access != Access::ro && access != Access::constant; }
};

struct Object {
    std::uint16_t              index = 0;
    std::string                name;
    std::string                denotation;
    ObjectType                 type = ObjectType::var;
    Category                   category = Category::optional;
    std::uint16_t              data_type = 0;      ///< of a DEFSTRUCT, RECORD or ARRAY, where a file gives it
    unsigned                   compact = 0;             ///< CompactSubObj: its entries 1..compact were described once
    std::uint32_t              flags = 0;
    std::vector<std::uint16_t> links = {};  ///< [xxxxObjectLinks]
    std::vector<Entry>         entries = {};  ///< by sub-index, ascending; one of a VAR
    Extras                     extras = {};
    Place                      at = {};

    bool         operator==(const Object&) const = default;
    bool         single() const { return type != ObjectType::array && type != ObjectType::record && type != ObjectType::defstruct; }
    const Entry* find(std::uint8_t sub) const;
    Entry*       find(std::uint8_t sub);
};

struct FileInfo {
    std::string  file_name, eds_version, description;
    std::string  creation_time, creation_date, created_by, modification_time, modification_date, modified_by;
    std::uint8_t version = 0, revision = 0;
    std::string  last_eds;             ///< DCF: the EDS it was made from
    Extras       extras = {};

    bool operator==(const FileInfo&) const = default;
};

inline constexpr std::array<unsigned, 9> baud_rates{10, 20, 50, 100, 125, 250, 500, 800, 1000};  ///< kbit/s; CiA 306 has no 100

struct DeviceInfo {
    std::string                         vendor_name, product_name, order_code;
    std::optional<std::uint32_t>        vendor_number, product_number, revision_number;
    std::array<bool, baud_rates.size()> supports = {};  ///< in the order of baud_rates
    bool                                boot_up_master = false, boot_up_slave = false;
    std::uint8_t                        granularity = 0;     ///< of mapping, in bits; 0: mapping is fixed
    bool                                dynamic_channels = false, group_messaging = false, lss = false;
    std::uint8_t  compact_pdo = 0;     ///< bit n-1: sub-index n of the communication parameters that are not described one by one
    std::uint16_t rx_pdos = 0, tx_pdos = 0;
    Place         rx_pdos_at = {1, 1, 0, 0}, tx_pdos_at = {1, 1, 0, 0};  ///< the beginning, where the file does not say them
    Extras        extras = {};

    bool operator==(const DeviceInfo&) const = default;
};

/// DCF: [DeviceComissioning], in CiA's own spelling.
struct Commissioning {
    std::uint8_t  node_id = 0;
    std::string   node_name, node_reference, network_name, network_reference;
    std::uint16_t baud_rate = 0;      ///< kbit/s
    std::uint32_t network = 0;
    bool          manager = false;             ///< CANopenManager
    std::uint32_t lss_serial_number = 0;
    Extras        extras = {};

    bool operator==(const Commissioning&) const = default;
};

/// Objects a module adds to, as [MnSubExtxxxx] says: `count` of them, or counts by sub-index ranges in the extras.
struct SubExtension {
    Object      object;                    ///< one entry: what each new one is
    std::string count, object_extend;

    bool operator==(const SubExtension&) const = default;
};

struct Module {
    unsigned                  number = 0;
    std::string               product_name, order_code, version, revision;
    std::vector<Object>       fixed = {};
    std::vector<SubExtension> extensions = {};
    std::vector<std::string>  comments = {};
    Extras                    extras = {};

    bool operator==(const Module&) const = default;
};

/// A range of [DynamicChannels]: objects a programmable device makes as its program wants them.
struct DynamicSegment {
    std::uint16_t type = 0;
    Access        access = Access::rw;
    std::string   range;                ///< "0xA080-0xA0BF"
    std::uint32_t image_offset = 0;   ///< PPOffset

    bool operator==(const DynamicSegment&) const = default;
};

struct OtherSection {
    std::string name;
    Extras      entries;

    bool operator==(const OtherSection&) const = default;
};

struct DeviceDescription {
    FileInfo                                    file;
    DeviceInfo                                  device;
    std::optional<Commissioning>                commissioning;        ///< with it the file is a DCF
    std::vector<std::pair<std::uint16_t, bool>> dummies;  ///< [DummyUsage]: data type, may be mapped
    std::vector<std::string>                    comments;
    std::vector<Object>                         objects;                       ///< by index, ascending
    std::vector<Module>                         modules;
    std::vector<unsigned>                       connected_modules;           ///< DCF: numbers of modules, by slot
    std::vector<DynamicSegment>                 dynamic_channels;
    std::vector<OtherSection>                   others;                  ///< sections CiA 306 does not know
    std::vector<std::string>                    preamble;                 ///< comment lines before the first section

    bool          operator==(const DeviceDescription&) const = default;
    const Object* find(std::uint16_t index) const;
    Object*       find(std::uint16_t index);
    const Entry*  find(std::uint16_t index, std::uint8_t sub) const;
    std::size_t   entries() const;
    /// DCF: the node-id it was written for; else `otherwise`.
    unsigned node_id(unsigned otherwise = 0) const;
};

/// What came of a file.
struct Reading {
    std::optional<DeviceDescription> description;  ///< none: refused, and the last message says why
    std::vector<Message>             messages;                 ///< in order of place
    std::string                      text;                              ///< the decoded text the places point into
    std::size_t                      count(Severity severity) const;
};

/// Reads the bytes of an EDS or DCF file. [any, not real time]
Reading read_eds(std::string_view bytes);

/// The text of an EDS, or of a DCF when there is a commissioning. UTF-8, lines end with CR LF as CiA 306 has it.
std::string write_eds(const DeviceDescription& description);

/// Adds the objects of the connected modules: what the device with this set of modules really has.
void connect_modules(DeviceDescription& description, std::vector<Message>& messages);

/// The rules between objects (mapping, limits, counts of PDOs); read_eds has called it.
void check_objects(const DeviceDescription& description, std::vector<Message>& messages);

}  // namespace hal::canopen::eds
