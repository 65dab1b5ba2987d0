// SPDX-License-Identifier: MIT
// The schedule of a segment as read from its configuration file: the blocks of RTnet's tdma.conf
// and some more keys. Everything is [setup].
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fieldbus/tdma/station/station_setup.hpp"
#include "text/config_text.hpp"

namespace hal::tdma::config {

using hal::Severity;
using text::Span;

/// Subject of a message: its diagnostic code, with a page each (`hal explain`).
enum class Topic : std::uint8_t {
    line,      ///< an invalid line or key
    value,     ///< an invalid value
    schedule,  ///< a conflict between slots
};
const char* code_of(Topic);  ///< "tdma-line", …: the diagnostic's code

using Message = text::Message<Topic>;

using Ip = std::array<std::uint8_t, 4>;

struct SlotEntry {
    SlotSetup setup;
    /// its size is in the file; else it extends to the next frame on the segment
    bool sized = false;
    Span at;
};

struct StationEntry {
    Role role = Role::slave;
    std::string name;  ///< given, or master, backup-1, slave-1 …
    std::optional<Ip> ip;
    std::optional<Address> mac;
    std::vector<SlotEntry> slots;
    Time backup_offset = 0;
    Time phase = -1;
    Time lead = -1;  ///< -1: not given
    std::string stage_2;  ///< file that RTcfg sends to it in stage 2
    Span at;       ///< of the block's first line
    Span backup_at{};
};

struct Schedule {
    Time cycle = 0;
    std::uint32_t speed = 100;        ///< Mbit/s
    /// minimum gap between two frames, for the jitter of both
    Time guard = 10'000;
    Time forward = 2'000;    ///< delay of the switch; 0: no switch
    /// cycles without a sync until outputs go to their safe values
    std::uint32_t lost = 4;
    std::uint32_t rounds = 100;
    std::uint16_t heartbeat_ms = 1000;///< of RTcfg
    std::vector<StationEntry> stations;           ///< as in the file

    /// time that a frame (length without check sequence) occupies the line
    Time wire(std::size_t length) const;
    /// time from sending to reception: two lines and the switch
    Time path(std::size_t length) const;
    const StationEntry* master() const;
};

struct ReadResult {
    Schedule schedule;
    std::vector<Message> messages;  ///< in order of place
    bool good() const;
};

/// Reads and checks a schedule.
ReadResult read(std::string_view text);
/// Return the keys of a segment, and those of a station, as tables in Markdown.
std::string segment_reference();
std::string station_reference();
/// Checks a schedule and reports every conflict with its calculation and a fix. read() includes it.
void check(const Schedule&, text::Messages<Topic>&);

/// Returns the setup of station `index`.
StationSetup setup_of(const Schedule&, std::size_t index);
/// Finds a station by name, IP ("10.0.0.2") or MAC address.
std::optional<std::size_t> find(const Schedule&, std::string_view which);
/// Lists the names of all stations: "master, x, y".
std::string names(const Schedule&);

/// Returns the part of a file that one station needs, complete in itself: the payload of RTcfg
/// stage 1.
std::string block_of(const Schedule&, std::size_t index);

/// Reads a whole file. Returns false and sets `bytes` to the reason.
bool read_from_disk(const std::string& path, std::string& bytes);
/// Formats each error as "file:12:7: error: sentence; help", for hosts without a renderer.
std::string to_string(const ReadResult&, const std::string& path);

std::string to_string(const Ip&);
std::optional<Ip> parse_ip(std::string_view);
std::string microseconds(Time);  ///< "12.5 us"

}  // namespace hal::tdma::config
