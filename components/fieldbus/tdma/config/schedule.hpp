// SPDX-License-Identifier: MIT
// The schedule of a segment as its configuration file says it: RTnet's tdma.conf blocks, and a few keys more. All of it [setup].
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fieldbus/tdma/station/station_setup.hpp"

namespace hal::tdma::config {

/// Lines and columns from 1, columns in characters; offset and length in bytes of the file.
struct Place {
    std::uint32_t line = 0, column = 0, offset = 0, length = 0;
};

enum class Severity : std::uint8_t { note, warning, error };

/// What a message is about; the program has a page on each.
enum class Topic : std::uint8_t {
    line,      ///< a line or key that means nothing
    value,     ///< a value that cannot be
    schedule,  ///< slots that cannot work
};
const char* code_of(Topic);  ///< "tdma-line", …: the diagnostic's code

struct Message {
    Severity    severity = Severity::error;
    Topic       topic = Topic::line;
    Place       at;
    std::string sentence;  ///< no final stop; names quoted '…'
    std::string label{};
    std::string help{};
};

using Ip = std::array<std::uint8_t, 4>;

struct SlotEntry {
    SlotSetup setup;
    bool      sized = false;  ///< by the file; else the size is what fits before the next frame of anybody
    Place     at;
};

struct StationEntry {
    Role                   role = Role::slave;
    std::string            name;  ///< of the file, or master, backup-1, slave-1 …
    std::optional<Ip>      ip;
    std::optional<Address> mac;
    std::vector<SlotEntry> slots;
    Time                   backup_offset = 0;
    Time                   phase = -1, lead = -1;  ///< -1: not given
    std::string            stage_2;  ///< a file that RTcfg sends to it
    Place                  at;       ///< of the block's first line
    Place                  backup_at{};
};

struct Schedule {
    Time                      cycle = 0;
    std::uint32_t             speed = 100;        ///< Mbit/s
    Time                      guard = 10'000;     ///< between the end of a frame and the next, for the jitter of both
    Time                      forward = 2'000;    ///< in the switch; 0: there is none
    std::uint32_t             lost = 4;           ///< cycles without a sync until the outputs are safe
    std::uint32_t             rounds = 100;
    std::uint16_t             heartbeat_ms = 1000;///< of RTcfg
    std::vector<StationEntry> stations;           ///< as in the file

    Time wire(std::size_t length) const;  ///< how long a frame without check sequence occupies the line
    Time path(std::size_t length) const;  ///< from the moment it leaves to its arrival: two lines and a switch
    const StationEntry* master() const;
};

struct Reading {
    Schedule             schedule;
    std::vector<Message> messages;  ///< in order of place
    bool                 good() const;
};

/// Messages kept of one file; one more is, so that who prints them knows of it.
constexpr std::size_t most_messages = 100;

/// Reads and judges it.
Reading read(std::string_view text);
/// Judges it: every way in which it cannot work, with the arithmetic and what to change. read() has done so.
void judge(const Schedule&, std::vector<Message>&);

/// What station `index` has to be told.
StationSetup setup_of(const Schedule&, std::size_t index);
/// By name, IP ("10.0.0.2") or MAC address; nothing: there is none.
std::optional<std::size_t> find(const Schedule&, std::string_view which);
/// The names of all, for a help text: "master, x, y".
std::string names(const Schedule&);

/// The part of a file that one station needs, complete in itself: what RTcfg's stage 1 carries.
std::string block_of(const Schedule&, std::size_t index);

/// The bytes of a file, or false and the reason in `bytes`.
bool read_from_disk(const std::string& path, std::string& bytes);
/// "file:12:7: error: sentence; help" of each error, a line each, for those without a renderer.
std::string to_string(const Reading&, const std::string& path);

std::string to_string(const Ip&);
std::optional<Ip> parse_ip(std::string_view);
std::string microseconds(Time);  ///< "12.5 us"

}  // namespace hal::tdma::config
