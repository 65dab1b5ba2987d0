// SPDX-License-Identifier: MIT
// Of a build without CANopen, bus/can/plain_frames.cpp takes the place of this file.
#include "bus/can/frame_decoder.hpp"

#include <fmt/chrono.h>
#include <fmt/core.h>

#include "bus/can/error_frame.hpp"
#include "canopen/protocol/emcy.hpp"
#include "canopen/protocol/numbers.hpp"

namespace hal::tools {

namespace {

using can::Frame;

std::uint32_t number(const Frame& f, unsigned from, unsigned bytes) {
    std::uint32_t value = 0;
    for (unsigned i = 0; i < bytes && from + i < f.length; ++i) {
        value |= std::uint32_t{f.data[from + i]} << 8 * i;
    }
    return value;
}

std::string object(const Frame& f) {
    return fmt::format("{:04X}:{:X}", number(f, 1, 2), f.data[3]);
}

std::string expedited(const Frame& f) {
    const bool sized = (f.data[0] & 1) != 0;
    const unsigned bytes = sized ? 4 - (f.data[0] >> 2 & 3U) : 4;
    const std::uint32_t value = number(f, 4, bytes);
    return fmt::format("{} = 0x{:0{}X}{}", object(f), value, 2 * bytes,
                       value > 9 ? fmt::format(" ({})", value) : "");
}

/// Initiate responses of downloads and uploads have the same flags in both directions.
std::string initiated(const Frame& f) {
    if ((f.data[0] & 2) != 0) return expedited(f);
    return object(f) + ((f.data[0] & 1) != 0
                            ? fmt::format(", {} bytes in segments", number(f, 4, 4))
                            : ", in segments");
}

std::string segment(const Frame& f) {
    return fmt::format("segment of {} byte{}{}", 7 - (f.data[0] >> 1 & 7U),
                       (f.data[0] >> 1 & 7U) == 6 ? "" : "s",
                       (f.data[0] & 1) != 0 ? ", the last" : "");
}

std::string abort_text(const Frame& f) {
    const std::uint32_t code = number(f, 4, 4);
    return fmt::format("abort {}: {} (0x{:08X})", object(f),
                       canopen::to_string(static_cast<canopen::Abort>(code)), code);
}

std::string block_segment(const Frame& f) {
    return fmt::format("block segment {}{}", f.data[0] & 0x7f,
                       (f.data[0] & 0x80) != 0 ? ", the last" : "");
}

bool is_data_of(const Frame& f, unsigned length) { return !f.remote && f.length == length; }

/// States why a frame is not a data frame of `length` bytes.
std::string wrong_form(const Frame& f, unsigned length) {
    if (f.remote) return "remote request; expected: a data frame";
    return fmt::format("wrong length; expected: {} byte{}", length, length == 1 ? "" : "s");
}

DecodedFrame nmt(const Frame& f) {
    if (!is_data_of(f, 2)) return {FrameKind::nmt, "NMT: " + wrong_form(f, 2)};
    const char* const known = canopen::to_string(static_cast<canopen::NmtCommand>(f.data[0]));
    const std::string command = known ? known : fmt::format("unknown command 0x{:02X}", f.data[0]);
    const std::string who = f.data[1] == 0 ? "all nodes" : fmt::format("node {}", f.data[1]);
    return {FrameKind::nmt, fmt::format("NMT {}: {}", command, who)};
}

DecodedFrame emergency(unsigned node, const Frame& f) {
    if (!is_data_of(f, 8)) {
        return {FrameKind::emergency, fmt::format("EMCY of node {}: {}", node, wrong_form(f, 8))};
    }
    const auto code = static_cast<std::uint16_t>(number(f, 0, 2));
    return {FrameKind::emergency,
            fmt::format("EMCY of node {}: {} (0x{:04X}), error register 0x{:02X}", node,
                        canopen::emergency_text(code), code, f.data[2])};
}

DecodedFrame time_stamp(const Frame& f) {
    if (!is_data_of(f, 6)) return {FrameKind::time, "TIME: " + wrong_form(f, 6)};
    const std::uint32_t ms = number(f, 0, 4) & 0x0fffffff;
    constexpr std::time_t from_1970_to_1984 = 5113;  // days
    const std::time_t seconds =
        (from_1970_to_1984 + static_cast<std::time_t>(number(f, 4, 2))) * 86400 + ms / 1000;
    return {FrameKind::time,
            fmt::format("TIME {:%Y-%m-%d %H:%M:%S}.{:03}", fmt::gmtime(seconds), ms % 1000)};
}

DecodedFrame heartbeat(unsigned node, const Frame& f) {
    if (f.remote) {
        return {FrameKind::heartbeat, fmt::format("node guarding: asks node {}", node)};
    }
    if (f.length != 1) {
        return {FrameKind::heartbeat,
                fmt::format("heartbeat of node {}: {}", node, wrong_form(f, 1))};
    }
    if (f.data[0] == 0) {
        return {FrameKind::heartbeat, fmt::format("boot-up of node {}", node)};
    }
    return {FrameKind::heartbeat,
            fmt::format("heartbeat of node {}: {}{}", node,
                        canopen::to_string(static_cast<canopen::NmtState>(f.data[0] & 0x7f)),
                        (f.data[0] & 0x80) != 0 ? ", toggle bit set" : "")};
}

struct LssCommand {
    std::uint8_t code;
    const char* text;
    unsigned bytes;  ///< of the number after it
};
constexpr LssCommand lss_commands[] = {
    {0x04, "switch all to state", 1},
    {0x11, "configure node ID", 1},
    {0x13, "configure bit timing", 2},
    {0x15, "activate bit timing, ms", 2},
    {0x17, "store configuration", 0},
    {0x40, "select vendor", 4},
    {0x41, "select product", 4},
    {0x42, "select revision", 4},
    {0x43, "select serial number", 4},
    {0x44, "selected", 0},
    {0x46, "identify vendor", 4},
    {0x47, "identify product", 4},
    {0x48, "identify revision from", 4},
    {0x49, "identify revision to", 4},
    {0x4a, "identify serial number from", 4},
    {0x4b, "identify serial number to", 4},
    {0x4c, "identify unconfigured slaves", 0},
    {0x4f, "identified", 0},
    {0x50, "unconfigured slave identified", 0},
    {0x51, "fastscan", 4},
    {0x5a, "inquire vendor", 4},
    {0x5b, "inquire product", 4},
    {0x5c, "inquire revision", 4},
    {0x5d, "inquire serial number", 4},
    {0x5e, "inquire node ID", 1},
};

DecodedFrame lss(bool master, const Frame& f) {
    const std::string who = master ? "LSS master: " : "LSS slave: ";
    if (!is_data_of(f, 8)) return {FrameKind::lss, who + wrong_form(f, 8)};
    for (const LssCommand& c : lss_commands) {
        if (c.code != f.data[0]) continue;
        const bool valued = c.bytes > 0 && !(master && c.code >= 0x5a);
        return {FrameKind::lss,
                who + c.text + (valued ? fmt::format(" 0x{:X}", number(f, 1, c.bytes)) : "")};
    }
    return {FrameKind::lss, who + fmt::format("unknown command 0x{:02X}", f.data[0])};
}

/// The services of the predefined connection set (CiA 301, clause 7.3.5), of LSS (CiA 305) and of
/// CANopen Safety (EN 50325-5).
enum class Service : std::uint8_t {
    nmt,
    fail_safe,
    sync,
    emergency,
    time,
    srdo,
    pdo,
    sdo_answer,
    sdo_request,
    heartbeat,
    lss_slave,
    lss_master
};

struct ServiceRow {
    std::uint32_t first, last;  ///< identifiers
    Service service;
    const char* name;
};
constexpr ServiceRow services[] = {
    {0x000, 0x000, Service::nmt, "NMT"},
    {0x001, 0x001, Service::fail_safe, "global fail-safe command"},
    {0x080, 0x080, Service::sync, "SYNC"},
    {0x081, 0x0ff, Service::emergency, "EMCY of node {node}"},
    {0x100, 0x100, Service::time, "TIME"},
    {0x101, 0x180, Service::srdo, "SRDO {srdo:03X}, {half}"},
    {0x181, 0x57f, Service::pdo, "{direction}PDO{pdo} of node {node}"},
    {0x581, 0x5ff, Service::sdo_answer, "SDO from node {node}"},
    {0x601, 0x67f, Service::sdo_request, "SDO to node {node}"},
    {0x701, 0x77f, Service::heartbeat, "heartbeat of node {node}"},
    {0x7e4, 0x7e4, Service::lss_slave, "LSS slave"},
    {0x7e5, 0x7e5, Service::lss_master, "LSS master"},
};

/// Returns the service of an 11-bit identifier; nullptr: none. A PDO has a node.
const ServiceRow* find_service(std::uint32_t id) {
    for (const ServiceRow& row : services) {
        if (id < row.first || id > row.last) continue;
        return row.service == Service::pdo && (id & 0x7f) == 0 ? nullptr : &row;
    }
    return nullptr;
}

std::string acknowledge_text(const Frame& f) {
    return fmt::format("block received up to segment {}, next has {}", f.data[1], f.data[2]);
}

/// Returns the size that starts a block transfer, if the frame has it.
std::string block_size_text(const Frame& f) {
    return (f.data[0] & 2) != 0 ? fmt::format(", {} bytes", number(f, 4, 4)) : "";
}

/// Decodes an SDO frame in one direction. `in_segments`: this side sends segments of a block
/// transfer; `text` decodes its other commands.
template <class Blocks>
DecodedFrame sdo(const std::string& who, const Frame& f, Blocks& blocks, bool Blocks::* in_segments,
                 std::string (*text)(const Frame&, Blocks&)) {
    const auto decoded = [&](const std::string& what) {
        return DecodedFrame{FrameKind::sdo, who + what};
    };
    if (!is_data_of(f, 8)) return decoded(wrong_form(f, 8));
    if (blocks.*in_segments && f.data[0] != 0x80) {
        blocks.*in_segments = (f.data[0] & 0x80) == 0;
        return decoded(block_segment(f));
    }
    if (f.data[0] >> 5 == 4) {
        blocks = {};
        return decoded(abort_text(f));
    }
    return decoded(text(f, blocks));
}

}  // namespace

std::string FrameDecoder::request_text(const Frame& f, Blocks& blocks) {
    const bool ends = (f.data[0] & 1) != 0;
    switch (f.data[0] >> 5) {
    case 0: return "write " + segment(f);
    case 1: return "write " + initiated(f);
    case 2: return "read " + object(f);
    case 3: return "read next segment";
    case 5:
        switch (f.data[0] & 3) {
        case 0: return fmt::format("read {} in blocks of {}", object(f), f.data[4]);
        case 1: return "block read done";
        case 2: return acknowledge_text(f);
        default: blocks.up = true; return "start block upload";
        }
    case 6:
        if (ends) return fmt::format("block write done, CRC 0x{:04X}", number(f, 1, 2));
        return fmt::format("write {} in blocks{}", object(f), block_size_text(f));
    default: return fmt::format("unknown command 0x{:02X}", f.data[0]);
    }
}

std::string FrameDecoder::answer_text(const Frame& f, Blocks& blocks) {
    const bool ends = (f.data[0] & 1) != 0;
    switch (f.data[0] >> 5) {
    case 0: return "read " + segment(f);
    case 1: return "segment written";
    case 2: return "read " + initiated(f);
    case 3: return "written " + object(f);
    case 5:
        switch (f.data[0] & 3) {
        case 0:
            blocks.down = true;
            return fmt::format("ready for {} in blocks of {}", object(f), f.data[4]);
        case 1: return "block write confirmed";
        default: return acknowledge_text(f);
        }
    case 6:
        if (ends) return fmt::format("blocks end, CRC 0x{:04X}", number(f, 1, 2));
        return fmt::format("has {} in blocks{}", object(f), block_size_text(f));
    default: return fmt::format("unknown command 0x{:02X}", f.data[0]);
    }
}

DecodedFrame FrameDecoder::request(unsigned node, const Frame& f) {
    return sdo(fmt::format("SDO to node {}: ", node), f, blocks_[node], &Blocks::down,
               request_text);
}

DecodedFrame FrameDecoder::answer(unsigned node, const Frame& f) {
    return sdo(fmt::format("SDO from node {}: ", node), f, blocks_[node], &Blocks::up, answer_text);
}

DecodedFrame FrameDecoder::decode(const Frame& f) {
    if (f.error) return {FrameKind::error, error_frame_text(f)};
    const ServiceRow* const row = f.is_standard() ? find_service(f.id) : nullptr;
    if (row == nullptr) return {};
    const unsigned node = f.id & 0x7f;
    switch (row->service) {
    case Service::nmt: return nmt(f);
    case Service::fail_safe:
        if (f.length != 0) return {};
        return {FrameKind::nmt, "global fail-safe command (EN 50325-5)"};
    case Service::sync:
        return {FrameKind::sync, f.length == 1 ? fmt::format("SYNC {}", f.data[0]) : "SYNC"};
    case Service::emergency: return emergency(node, f);
    case Service::time: return time_stamp(f);
    case Service::srdo: return {FrameKind::pdo, service_name(f.id, false)};
    case Service::pdo:
        return {FrameKind::pdo, (f.remote ? "request for " : "") + service_name(f.id, false)};
    case Service::sdo_answer: return answer(node, f);
    case Service::sdo_request: return request(node, f);
    case Service::heartbeat: return heartbeat(node, f);
    case Service::lss_slave: return lss(false, f);
    case Service::lss_master: return lss(true, f);
    }
    return {};
}

std::string service_name(std::uint32_t id, bool extended) {
    const ServiceRow* const row = extended ? nullptr : find_service(id);
    if (row == nullptr) return "";
    const unsigned function = id >> 7;
    const bool odd = function % 2 == 1;  // 180h, 280h …: from the node
    return fmt::format(fmt::runtime(row->name), fmt::arg("node", id & 0x7f),
                       fmt::arg("direction", odd ? 'T' : 'R'), fmt::arg("pdo", (function - 1) / 2),
                       fmt::arg("srdo", (id - 1) | 1),
                       fmt::arg("half", id % 2 == 1 ? "plain" : "inverted"));
}

}  // namespace hal::tools
