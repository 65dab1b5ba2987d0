// SPDX-License-Identifier: MIT
// The two containers of captures, pcapng and pcap, whatever their packets are. [setup]
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "link/record_file.hpp"

namespace hal::replay {

inline constexpr std::uint16_t link_ethernet = 1, link_can = 227, link_cooked = 113;  ///< LINKTYPE_* of the tcpdump group's registry

struct Packet {
    std::uint16_t link = 0;
    std::int64_t time_ns = 0;
    std::string_view bytes;     ///< those the capture holds
    std::size_t length = 0;     ///< it had, on the wire
};

/// Whether the first bytes are those of such a file. [any]
bool is_capture(std::string_view file);
/// Calls `take` for each packet of a capture, in the file's order. What is wrong (what is cut off or damaged ends it), or nothing.
std::string each_packet(std::string_view file, const std::function<void(const Packet&)>& take);

/// A whole file, up to a GiB; nothing, and `problem`, when it cannot be had.
std::optional<std::string> read_file(const std::string& name, std::string& problem);

/// Writes a pcapng file with one interface and times in nanoseconds.
class PacketWriter {
public:
    /// error() of the file tells whether it could be made.
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
