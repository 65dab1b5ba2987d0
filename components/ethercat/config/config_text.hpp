// SPDX-License-Identifier: MIT
// The text of a `.ethercat` file: sections and keys, and how values are written. Everything here is
// [setup].
#pragma once

#include <deque>
#include <map>
#include <optional>

#include "ethercat/config/config.hpp"
#include "text/characters.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal::ethercat::config {

using text::list_of;
using text::Word;
using text::words_of;
using Report = text::Messages<Topic>;

struct Line {
    Word key, value;  ///< key: lower case, dashes; value: as written
    bool used = false;
};
struct Section {
    std::vector<Word> words;  ///< of its header
    Span at;
    std::deque<Line> lines;
};

/// Splits a configuration into its sections.
std::vector<Section> split(std::string_view text, Report&);

/// An object address, hexadecimal as in 6040 or 60FE:1, with or without 0x.
struct Address {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    bool has_sub = false;
};
std::optional<Address> address(std::string_view text);
/// Formats an address as the configuration writes it: "6040:0".
std::string address_text(std::uint16_t index, unsigned sub);

/// A data type by its short name.
struct TypeWord {
    const char* word;
    const char* esi;  ///< its name in ETG.2000
    master::Type type;
    std::uint8_t bits;
};
/// Returns nullptr for an unknown word. Accepts "u16", "UINT" and the like.
const TypeWord* type_named(std::string_view word);
inline constexpr const char* type_words =
    "bit, u8, u16, u32, u64, s8, s16, s32, s64, real32 or real64";
/// Returns the type for a value of this many bits.
master::Type type_of(unsigned bits, bool is_signed);
constexpr bool is_signed(master::Type t) { return t >= master::Type::s8 && t <= master::Type::s64; }
constexpr bool is_real(master::Type t) { return t >= master::Type::real32; }

/// Returns the bytes of a value, little endian, or sets `problem`.
std::optional<std::vector<std::uint8_t>> value_bytes(std::string_view value, const TypeWord& type,
                                                     std::string& problem);

/// The keys that apply to one slave or bus; a later section overrides an earlier one.
class Keys {
public:
    explicit Keys(Report& report) : report_(report) {}
    void take(Section&);
    Line* find(const std::string& key);
    std::vector<Line*> all() const;  ///< in order of place
    void take_text(const char* key, std::string& to);
    void take_flag(const char* key, bool& to);
    bool take_time(const char* key, std::int64_t& to, std::int64_t least, std::int64_t most);
    bool take_number(const char* key, std::uint64_t& to, std::uint64_t least, std::uint64_t most);
    void reject(const Line&, const std::string& instead);
    Report& report() { return report_; }

private:
    Report& report_;
    std::map<std::string, Line*> lines_;
};

/// Parses a time with a unit and optional sign: 250us, -10us.
std::optional<std::int64_t> signed_duration(std::string_view);

/// Reads the keys of a slave.
class Descriptions;
struct SlaveInput {
    Keys& keys;
    Descriptions& descriptions;
    Bus& bus;
    master::Slave& slave;
    SlaveInfo& info;
};
void read_slave(SlaveInput);

/// Reads `eoe` of a slave: the settings of its IP stack and the interface of the host.
void read_eoe(SlaveInput);
/// Reads `eoe-switch` of a bus.
void read_eoe_switch(Keys&, Bus&);
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
    const ReadFile& read_;
    std::string folder_;
    std::map<std::string, std::optional<esi::File>> known_;
};

/// Checks the rules between the slaves of a bus: names and positions.
void check_bus(const Bus&, Report&);

/// Reads LinuxCNC's format.
Reading read_lcec(std::string_view xml, const std::string& path, const ReadFile&);

}  // namespace hal::ethercat::config
