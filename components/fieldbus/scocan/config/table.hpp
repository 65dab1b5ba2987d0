// SPDX-License-Identifier: MIT
// The table of a bus with time slots: one text file, `NAME.scocan`, that all nodes have. Its CRC is
// that of a normalised form, so that comments and blanks do not matter. Reading is [setup]; the
// functions marked [realtime] only look up.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "text/config_text.hpp"

namespace hal::scocan {

using Time = std::int64_t;  ///< ns
using text::Span;

/// Subject of a message: its diagnostic code, with a page each (`hal explain`).
enum class Topic : std::uint8_t {
    line,  ///< an invalid line or key
    value,  ///< an invalid value
    slots,  ///< a table that cannot work
};
const char* code_of(Topic);  ///< "scocan-line", …: the diagnostic's code

inline constexpr std::uint32_t sync_id = 0;
inline constexpr std::uint32_t announce_id = 1;
/// From here on the identifiers are reserved for the configuration.
inline constexpr std::uint32_t configuration_ids = 0x780;
/// Plus the number of a node: its requests and answers. Two nodes that send different data with the
/// same identifier at once disturb each other until both are off the bus (ISO 11898-1, bit error).
inline constexpr std::uint32_t node_id = 0x781;
inline constexpr std::uint32_t identifiers = 0x800;
/// Returns whether the discipline itself uses the identifier: 0x000..0x00F, 0x780..0x7FF.
/// [realtime]
constexpr bool is_reserved(std::uint32_t id) noexcept {
    return id < 0x10 || id >= configuration_ids;
}
inline constexpr std::size_t max_nodes = 126;
inline constexpr std::size_t max_slots = 256;
inline constexpr std::size_t max_modes = 16;

inline constexpr std::size_t counter_cycles = 64;
/// An error flag with its delimiter: bits that the bus is busy after a disturbed frame.
inline constexpr std::uint32_t error_bits = 20;
/// Longest SYNC: DLC 2 with all stuff bits and the intermission.
inline constexpr std::uint32_t sync_bits = 75;

enum class Role : std::uint8_t { node, sync, backup, monitor, bridge };
const char* to_string(Role);

struct Node {
    std::string name;
    /// type A: detects an idle slot itself; type B waits for the announcement
    bool senses = true;
    Role role = Role::node;
    std::uint32_t backup = 0;  ///< of a backup: 1, 2 …
    Span at{};
    friend bool operator==(const Node&, const Node&) = default;
};

enum class Kind : std::uint8_t { shared, priv, sync };
const char* to_string(Kind);

/// What a slot is used for, in every cycle or in some.
struct Use {
    Kind kind = Kind::shared;
    std::size_t node = 0;  ///< of a private slot
    std::vector<std::uint32_t> ids{};  ///< of a private slot; none: any identifier
    /// used in the cycles with counter % every == offset
    std::uint32_t every = 1;
    std::uint32_t offset = 0;
    Span at{};
    bool active(std::uint32_t counter) const noexcept { return counter % every == offset; }
    /// Returns whether a frame with this identifier belongs into the private slot. [realtime]
    bool carries(std::uint32_t id) const noexcept {
        return kind == Kind::priv &&
               (ids.empty() || std::find(ids.begin(), ids.end(), id) != ids.end());
    }
    friend bool operator==(const Use&, const Use&) = default;
};

struct Mode {
    std::string name;
    std::uint32_t number = 0;
    std::vector<std::vector<Use>> slots{};  ///< by slot; none: shared
    Span at{};
    friend bool operator==(const Mode&, const Mode&) = default;
};

/// Part of a message's data, little endian.
enum class FieldType : std::uint8_t { u8, s8, u16, s16, u32, s32, f32, f64 };
struct Field {
    std::string name;
    FieldType type = FieldType::u8;
    std::uint32_t at = 0;  ///< first byte
    friend bool operator==(const Field&, const Field&) = default;
};
std::uint32_t size_of(FieldType) noexcept;
const char* to_string(FieldType);

/// A message of the application.
struct Message {
    std::string name;
    std::uint32_t id = 0;
    std::uint32_t bytes = 0;
    std::size_t node = 0;  ///< its sender
    /// of a cyclic message, or the shortest interval of an event; 0: as often as its slot
    Time period = 0;
    bool event = false;
    Time deadline = 0;  ///< 0: the period
    Time jitter = 0;  ///< queueing jitter
    std::vector<Field> fields{};
    Span at{};
    friend bool operator==(const Message&, const Message&) = default;
};

struct Table {
    std::uint32_t bit_rate = 1'000'000;
    Time cycle = 10'000'000;
    std::uint32_t slots = 20;
    /// gap between two slots, for the clock errors of two nodes
    Time guard = 0;
    /// T_idle: a private slot without a frame by then is recycled
    Time idle = 0;
    std::uint32_t lost = 10;  ///< SYNCs lost until a node stops sending in private slots
    std::vector<Node> nodes;
    std::vector<Mode> modes;
    std::vector<Message> messages;
    std::uint16_t crc = 0;

    friend bool operator==(const Table&, const Table&) = default;

    Time slot() const noexcept { return cycle / slots; }
    /// time of that many bits, rounded up. [realtime]
    Time bits(std::uint32_t count) const noexcept;
    /// Time of the longest frame with that many bytes, with the intermission. [realtime]
    Time frame(std::uint32_t bytes) const noexcept;
    /// Latest start of the owner's frame behind the begin of its slot. [realtime]
    Time enabled() const noexcept { return idle - guard - bits(2); }
    /// Latest start of a frame in a slot, behind the slot's begin. [realtime]
    Time last_start(std::uint32_t bytes) const noexcept {
        return slot() - frame(bytes) - bits(error_bits) - guard;
    }
    /// Offset of the SYNC of backup k; 0: of the primary. [realtime]
    Time sync_offset(std::uint32_t backup) const noexcept {
        return backup * (bits(sync_bits + error_bits) + guard);
    }
    /// Guard time that is required `age` after the last SYNC, with clocks that agree within 4 ppm.
    /// [realtime]
    Time required_guard(Time age) const noexcept { return bits(3) + 300 + age * 4 / 1'000'000; }

    /// Returns the use of a slot in a cycle; nullptr: shared. [realtime]
    const Use* use(std::uint32_t mode, std::uint32_t slot, std::uint32_t counter) const noexcept;
    /// Returns whether the identifier is assigned to a private slot of the mode, and its use.
    /// [realtime]
    const Use* owner(std::uint32_t mode, std::uint32_t id) const noexcept;
    bool has_mode(std::uint32_t mode) const noexcept {
        return mode < max_modes && index_[mode] >= 0;
    }
    const Mode* mode(std::uint32_t number) const noexcept {
        return has_mode(number) ? &modes[static_cast<std::size_t>(index_[number])] : nullptr;
    }
    const Message* message(std::uint32_t id) const noexcept;
    std::optional<std::size_t> find(std::string_view node) const;
    std::size_t backups() const noexcept;
    void index();  ///< [setup] after a change of `modes`

private:
    std::array<int, max_modes> index_{};
    /// by mode and identifier: the first private slot that carries it; no_owner: none
    std::vector<std::uint16_t> owner_slots_;
};

using Report = text::Message<Topic>;

struct ReadResult {
    Table table;
    std::vector<Report> messages;  ///< in order of place
    bool good() const { return text::good(messages); }
};

/// Reads and checks a table.
ReadResult read(std::string_view text);
/// Return the keys of a table, and those of a message, as tables in Markdown.
std::string reference();
std::string message_reference();
/// Checks a table and reports every conflict with its calculation and a fix. read() includes it.
void check(const Table&, text::Messages<Topic>&);
/// Returns the normalised form of a table; reading it gives the same table.
std::string normalised(const Table&);
/// CRC-16/CCITT-FALSE.
std::uint16_t crc16(std::string_view) noexcept;

/// Lists the names of all nodes: "clock, ir, motor".
std::string names(const Table&);
std::string microseconds(Time);  ///< "12.5 us"
std::string id_text(std::uint32_t);  ///< "0x10A"

}  // namespace hal::scocan
