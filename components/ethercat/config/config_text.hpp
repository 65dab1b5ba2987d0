// SPDX-License-Identifier: MIT
// How values are written in a `.ethercat` file. Everything here is [setup].
#pragma once

#include <map>
#include <optional>

#include "bus/config/key_table.hpp"
#include "bus/config/old_forms.hpp"
#include "bus/config/section_file.hpp"
#include "ethercat/config/config.hpp"
#include "text/characters.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal::ethercat::config {

using bus::object_text;
using bus::ObjectAddress;
using bus::value_type_names;
using text::list_of;
using text::Word;
using text::words_of;
using Report = text::Messages<Topic>;

using bus::Keys;
using bus::Section;
using Line = bus::Entry;

/// Parses an object, as in 6040 or 60FE:1, and warns about a sub-index that earlier versions wrote
/// or read as hexadecimal.
std::optional<ObjectAddress> parse_address(const Word&, Report&);

/// A data type and its number of bits.
struct DataType {
    master::Type type = master::Type::u32;
    unsigned bits = 0;
};
/// Parses the type of a value, `u16` or as a description has it `UINT`, and warns about the name of
/// an earlier version.
std::optional<DataType> parse_type(const Word&, Report&);
/// Returns whether a word is the name of a type.
bool is_type(std::string_view word);
/// Returns the type of a value in a description (ESI), by its name if that has the same number of
/// bits.
master::Type described_type(const std::string& name, unsigned bits);
/// Returns the type for a value of this many bits.
master::Type type_of(unsigned bits, bool is_signed);
constexpr bool is_signed(master::Type t) { return t >= master::Type::s8 && t <= master::Type::s64; }
constexpr bool is_real(master::Type t) { return t >= master::Type::real32; }

/// Returns the bytes of a number of so many bits, little endian.
std::vector<std::uint8_t> little_endian(std::uint64_t value, unsigned bits);
/// Returns the bytes of a value, little endian, or sets `problem`.
std::optional<std::vector<std::uint8_t>> value_bytes(std::string_view value, DataType type,
                                                     std::string& problem);

/// Reads the keys of a slave.
class Descriptions;
struct SlaveInput {
    Keys& keys;
    Report& report;
    Descriptions& descriptions;
    Bus& bus;
    master::Slave& slave;
    SlaveInfo& info;
};
void read_slave(SlaveInput);

/// Reads `eoe` of a slave: the settings of its IP stack and the interface of the host.
void read_eoe(SlaveInput);
/// Reads `eoe-switch` of a bus. Returns false for an invalid value.
bool read_eoe_switch(Bus&, const Line&);
extern const char* const expected_eoe_switch;
/// Checks the rules between the slaves with EoE, and completes what they leave out.
void check_eoe(Bus&, Report&);

/// Device descriptions by their path, each read once.
class Descriptions {
public:
    Descriptions(const ReadFile& read, const std::string& path)
        : read_(read),
          folder_(path.find('/') == path.npos ? "" : path.substr(0, path.rfind('/') + 1)) {}
    /// Returns nullptr after reporting an error at the value that names the file.
    const esi::File* get(const Word& file, Report&);

private:
    std::optional<esi::File> read(const Word& file, Report&);

    const ReadFile& read_;
    std::string folder_;
    std::map<std::string, std::optional<esi::File>> known_;
};

/// Checks the rules between the slaves of a bus: names and positions.
void check_bus(const Bus&, Report&);

/// Reads LinuxCNC's format.
ReadResult read_lcec(std::string_view xml, const std::string& path, const ReadFile&,
                     const IsAssumed&);

}  // namespace hal::ethercat::config
