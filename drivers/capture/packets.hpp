// SPDX-License-Identifier: MIT
// The container formats of captures, pcapng and pcap, independent of the packets in them. [setup]
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "link/record_file.hpp"

namespace hal::replay {

/// LINKTYPE_* of the tcpdump group's registry
inline constexpr std::uint16_t link_ethernet = 1;
inline constexpr std::uint16_t link_can = 227;
inline constexpr std::uint16_t link_cooked = 113;

/// A packet of a capture.
struct Packet {
    std::uint16_t link = 0;
    std::int64_t time_ns = 0;
    std::string_view bytes;     ///< as captured
    std::size_t length = 0;     ///< on the wire
};

/// Returns true when the first bytes are those of a capture. [any]
bool is_capture(std::string_view file);
/// Calls `take` for each packet in the order of the file, up to the first damaged or truncated one.
/// Returns the problem, or "".
std::string each_packet(std::string_view file, const std::function<void(const Packet&)>& take);

/// Reads a whole file of at most 1 GiB. On failure returns nullopt and sets `problem`.
std::optional<std::string> read_file(const std::string& name, std::string& problem);

/// Writes a pcapng file with one interface and times in nanoseconds.
class PacketWriter {
public:
    /// Creates the file; error() is 0 on success.
    PacketWriter(const std::string& file, std::uint16_t link, std::string_view interface);
    PacketWriter(const PacketWriter&) = delete;
    PacketWriter& operator=(const PacketWriter&) = delete;
    bool write(std::int64_t time_ns, std::string_view bytes);
    bool flush() { return file_.flush(); }
    int error() const { return file_.error(); }

private:
    bool put_block(std::uint32_t type, const std::string& body);
    RecordFile file_;
};

}  // namespace hal::replay
