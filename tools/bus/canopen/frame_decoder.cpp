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

DecodedFrame nmt(const Frame& f) {
    if (f.remote || f.length != 2) {
        return {FrameKind::nmt, "NMT with a wrong length: it has 2 bytes"};
    }
    const char* what = nullptr;
    switch (static_cast<canopen::NmtCommand>(f.data[0])) {
    case canopen::NmtCommand::start: what = "start"; break;
    case canopen::NmtCommand::stop: what = "stop"; break;
    case canopen::NmtCommand::enter_pre_operational: what = "enter pre-operational"; break;
    case canopen::NmtCommand::reset_node: what = "reset node"; break;
    case canopen::NmtCommand::reset_communication: what = "reset communication"; break;
    }
    const std::string command = what ? what : fmt::format("unknown command 0x{:02X}", f.data[0]);
    return {FrameKind::nmt,
            fmt::format("NMT {}: {}", command,
                        f.data[1] == 0 ? "all nodes" : fmt::format("node {}", f.data[1]))};
}

DecodedFrame emergency(unsigned node, const Frame& f) {
    if (f.remote || f.length != 8) {
        return {FrameKind::emergency,
                fmt::format("EMCY of node {} with a wrong length: it has 8 bytes", node)};
    }
    const auto code = static_cast<std::uint16_t>(number(f, 0, 2));
    return {FrameKind::emergency,
            fmt::format("EMCY of node {}: {} (0x{:04X}), error register 0x{:02X}", node,
                        canopen::emergency_text(code), code, f.data[2])};
}

DecodedFrame time_stamp(const Frame& f) {
    if (f.remote || f.length != 6) {
        return {FrameKind::time, "TIME with a wrong length: it has 6 bytes"};
    }
    const std::uint32_t ms = number(f, 0, 4) & 0x0fffffff;
    constexpr std::time_t from_1970_to_1984 = 5113;  // days
    const std::time_t seconds =
        (from_1970_to_1984 + static_cast<std::time_t>(number(f, 4, 2))) * 86400 + ms / 1000;
    return {FrameKind::time,
            fmt::format("TIME {:%Y-%m-%d %H:%M:%S}.{:03}", fmt::gmtime(seconds), ms % 1000)};
}

DecodedFrame pdo(unsigned function, unsigned node, const Frame& f) {
    const bool transmit = function % 2 == 1;  // 180h, 280h …: from the node
    return {FrameKind::pdo, fmt::format("{}{}PDO{} of node {}", f.remote ? "request for " : "",
                                        transmit ? 'T' : 'R', (function - 1) / 2, node)};
}

DecodedFrame heartbeat(unsigned node, const Frame& f) {
    if (f.remote) {
        return {FrameKind::heartbeat, fmt::format("node guarding: asks node {}", node)};
    }
    if (f.length != 1) {
        return {FrameKind::heartbeat,
                fmt::format("heartbeat of node {} with a wrong length: it has 1 byte", node)};
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
    if (f.remote || f.length != 8) {
        return {FrameKind::lss, who + "wrong length: it has 8 bytes"};
    }
    for (const LssCommand& c : lss_commands) {
        if (c.code != f.data[0]) continue;
        const bool valued = c.bytes > 0 && !(master && c.code >= 0x5a);
        return {FrameKind::lss,
                who + c.text + (valued ? fmt::format(" 0x{:X}", number(f, 1, c.bytes)) : "")};
    }
    return {FrameKind::lss, who + fmt::format("unknown command 0x{:02X}", f.data[0])};
}

}  // namespace

DecodedFrame FrameDecoder::request(unsigned node, const Frame& f) {
    const std::string who = fmt::format("SDO to node {}: ", node);
    const auto sdo = [&](const std::string& text) {
        return DecodedFrame{FrameKind::sdo, who + text};
    };
    if (f.remote || f.length != 8) return sdo("wrong length: it has 8 bytes");
    Blocks& blocks = blocks_[node];
    const unsigned command = f.data[0] >> 5;
    if (blocks.down && f.data[0] != 0x80) {
        if ((f.data[0] & 0x80) != 0) {
            blocks.down = false;
        }
        return sdo(block_segment(f));
    }
    switch (command) {
    case 0: return sdo("write " + segment(f));
    case 1: return sdo("write " + initiated(f));
    case 2: return sdo("read " + object(f));
    case 3: return sdo("read next segment");
    case 4: blocks = {}; return sdo(abort_text(f));
    case 5:
        switch (f.data[0] & 3) {
        case 0: return sdo(fmt::format("read {} in blocks of {}", object(f), f.data[4]));
        case 1: return sdo("block read done");
        case 2:
            return sdo(
                fmt::format("block received up to segment {}, next has {}", f.data[1], f.data[2]));
        default: blocks.up = true; return sdo("start block upload");
        }
    case 6:
        if ((f.data[0] & 1) == 0) {
            return sdo("write " + object(f) + " in blocks" +
                       ((f.data[0] & 2) != 0 ? fmt::format(", {} bytes", number(f, 4, 4)) : ""));
        }
        return sdo(fmt::format("block write done, CRC 0x{:04X}", number(f, 1, 2)));
    default: return sdo(fmt::format("unknown command 0x{:02X}", f.data[0]));
    }
}

DecodedFrame FrameDecoder::answer(unsigned node, const Frame& f) {
    const std::string who = fmt::format("SDO from node {}: ", node);
    const auto sdo = [&](const std::string& text) {
        return DecodedFrame{FrameKind::sdo, who + text};
    };
    if (f.remote || f.length != 8) return sdo("wrong length: it has 8 bytes");
    Blocks& blocks = blocks_[node];
    const unsigned command = f.data[0] >> 5;
    if (blocks.up && f.data[0] != 0x80) {
        if ((f.data[0] & 0x80) != 0) {
            blocks.up = false;
        }
        return sdo(block_segment(f));
    }
    switch (command) {
    case 0: return sdo("read " + segment(f));
    case 1: return sdo("segment written");
    case 2: return sdo("read " + initiated(f));
    case 3: return sdo("written " + object(f));
    case 4: blocks = {}; return sdo(abort_text(f));
    case 5:
        switch (f.data[0] & 3) {
        case 0:
            blocks.down = true;
            return sdo(fmt::format("ready for {} in blocks of {}", object(f), f.data[4]));
        case 1: return sdo("block write confirmed");
        default:
            return sdo(
                fmt::format("block received up to segment {}, next has {}", f.data[1], f.data[2]));
        }
    case 6:
        if ((f.data[0] & 1) == 0) {
            return sdo("has " + object(f) + " in blocks" +
                       ((f.data[0] & 2) != 0 ? fmt::format(", {} bytes", number(f, 4, 4)) : ""));
        }
        return sdo(fmt::format("blocks end, CRC 0x{:04X}", number(f, 1, 2)));
    default: return sdo(fmt::format("unknown command 0x{:02X}", f.data[0]));
    }
}

DecodedFrame FrameDecoder::decode(const Frame& f) {
    if (f.error) return {FrameKind::error, error_frame_text(f)};
    if (f.extended || f.fd) {
        return {};
    }
    const unsigned node = f.id & 0x7f;
    const unsigned function = f.id >> 7;
    if (f.id == 0x000) return nmt(f);
    if (f.id == 0x080) {
        return {FrameKind::sync, f.length == 1 ? fmt::format("SYNC {}", f.data[0]) : "SYNC"};
    }
    if (f.id == 0x100) return time_stamp(f);
    if (f.id == 0x001 && f.length == 0) {
        return {FrameKind::nmt, "global fail-safe command (EN 50325-5)"};
    }
    if (f.id > 0x100 && f.id <= 0x180) {
        return {FrameKind::pdo, service_name(f.id, false)};
    }
    if (f.id == 0x7e4 || f.id == 0x7e5) return lss(f.id == 0x7e5, f);
    if (node == 0) {
        return {};
    }
    if (function == 1) return emergency(node, f);
    if (function >= 3 && function <= 10) return pdo(function, node, f);
    if (function == 11) return answer(node, f);
    if (function == 12) return request(node, f);
    if (function == 14) return heartbeat(node, f);
    return {};
}

std::string service_name(std::uint32_t id, bool extended) {
    if (extended) return "";
    const unsigned node = id & 0x7f;
    const unsigned function = id >> 7;
    if (id == 0x000) return "NMT";
    if (id == 0x080) return "SYNC";
    if (id == 0x100) return "TIME";
    if (id == 0x001) return "global fail-safe command";
    if (id > 0x100 && id <= 0x180) {
        return fmt::format("SRDO {:03X}, {}", (id - 1) | 1, id % 2 == 1 ? "plain" : "inverted");
    }
    if (id == 0x7e4) return "LSS slave";
    if (id == 0x7e5) return "LSS master";
    if (node == 0) return "";
    if (function == 1) {
        return fmt::format("EMCY of node {}", node);
    }
    if (function >= 3 && function <= 10) {
        return fmt::format("{}PDO{} of node {}", function % 2 == 1 ? 'T' : 'R', (function - 1) / 2,
                           node);
    }
    if (function == 11) {
        return fmt::format("SDO from node {}", node);
    }
    if (function == 12) {
        return fmt::format("SDO to node {}", node);
    }
    if (function == 14) {
        return fmt::format("heartbeat of node {}", node);
    }
    return "";
}

}  // namespace hal::tools
