// SPDX-License-Identifier: MIT
// Captures of a CAN bus: link type 227 (CAN frames, identifier big-endian) or 113 (the same after a
// 16-byte header of the interface).
#include "link/capture.hpp"

#include <algorithm>
#include <optional>

#include "capture/packets.hpp"

namespace hal::can {

namespace {

using namespace hal::replay;

/// The part of a packet that is the CAN frame.
struct CanPart {
    std::string_view bytes;  // at least the 8 of the head
    bool flexible = false;  // a frame of CAN FD
};

/// Returns the part behind the header of the interface, whose protocol distinguishes CAN FD.
std::optional<CanPart> part_of_cooked(std::string_view packet) {
    constexpr unsigned classic = 0x000c;
    constexpr unsigned fd = 0x000d;
    constexpr std::size_t header = 16;
    if (packet.size() < header + 8) return std::nullopt;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(packet[i]); };
    const unsigned protocol = byte(14) << 8U | byte(15);
    if (protocol != classic && protocol != fd) return std::nullopt;
    return CanPart{packet.substr(header), protocol == fd};
}

/// Without that header, the flags and the length distinguish CAN FD.
std::optional<CanPart> part_of_plain(std::string_view packet) {
    if (packet.size() < 8) return std::nullopt;
    const bool marked = (static_cast<unsigned char>(packet[5]) & 4) != 0;
    const bool is_long = packet.size() > 16 || static_cast<unsigned char>(packet[4]) > 8;
    return CanPart{packet, marked || is_long};
}

std::optional<CanPart> can_part(std::string_view packet, unsigned link) {
    if (link == link_cooked) return part_of_cooked(packet);
    if (link == link_can) return part_of_plain(packet);
    return std::nullopt;
}

/// Copies the data of a frame with a valid length; a remote frame has none.
bool copy_data(std::string_view bytes, Frame& f) {
    if (f.length > 64) return false;
    if (f.remote) return true;
    if (bytes.size() < 8U + f.length) return false;
    std::copy_n(bytes.begin() + 8, f.length, f.data.begin());
    return true;
}

/// Parses one packet. Returns false when it is not a CAN frame.
bool parse_packet(std::string_view packet, unsigned link, Frame& f) {
    f = {};
    const std::optional<CanPart> part = can_part(packet, link);
    if (!part) return false;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(part->bytes[i]); };
    const std::uint32_t id =
        std::uint32_t{byte(0)} << 24 | byte(1) << 16U | byte(2) << 8U | byte(3);
    f.fd = part->flexible;
    f.error = (id & 0x20000000U) != 0;
    f.extended = !f.error && (id & 0x80000000U) != 0;
    f.remote = !f.error && (id & 0x40000000U) != 0;
    f.id = id & (f.extended || f.error ? 0x1fffffffU : 0x7ffU);
    f.length = byte(4);
    f.bit_rate_switch = f.fd && (byte(5) & 1) != 0;
    f.error_state = f.fd && (byte(5) & 2) != 0;
    if (!copy_data(part->bytes, f)) return false;
    return f.error ? f.length <= 8 : f.valid();
}

class LogRecorder final : public Recorder {
public:
    LogRecorder(const std::string& file, std::string_view channel)
        : file_(file), channel_(channel) {}
    bool write(const Frame& f) override { return file_.put(log_line(f, channel_) + "\n"); }
    bool flush() override { return file_.flush(); }
    int error() const { return file_.error(); }

private:
    RecordFile file_;
    std::string channel_;
};

class PcapngRecorder final : public Recorder {
public:
    PcapngRecorder(const std::string& file, std::string_view channel)
        : writer_(file, link_can, channel) {}
    bool write(const Frame& f) override {
        std::string s;
        const std::uint32_t flags = std::uint32_t{f.extended} << 31 |
                                    std::uint32_t{f.remote} << 30 | std::uint32_t{f.error} << 29;
        const std::uint32_t id = f.id | flags;
        for (int shift = 24; shift >= 0; shift -= 8) {
            s += static_cast<char>(id >> shift & 0xff);
        }
        s += static_cast<char>(f.length);
        s += static_cast<char>(int{f.bit_rate_switch} | int{f.error_state} << 1 | int{f.fd} << 2);
        s += std::string(2, '\0');
        for (const auto b : f.bytes()) {
            s += static_cast<char>(b);
        }
        return writer_.write(f.time_ns, s);
    }
    bool flush() override { return writer_.flush(); }
    int error() const { return writer_.error(); }

private:
    PacketWriter writer_;
};

}  // namespace

Capture parse_capture(std::string_view bytes) {
    Capture capture;
    if (is_capture(bytes)) {
        capture.problem = each_packet(bytes, [&](const Packet& packet) {
            Frame f;
            if (!parse_packet(packet.bytes, packet.link, f)) return;
            f.time_ns = packet.time_ns;
            capture.frames.push_back(f);
        });
    } else {
        capture.problem = parse_log(bytes, capture.frames);
    }
    std::stable_sort(capture.frames.begin(), capture.frames.end(),
                     [](const Frame& a, const Frame& b) { return a.time_ns < b.time_ns; });
    return capture;
}

Capture read_capture(const std::string& file) {
    Capture none;
    const auto text = read_file(file, none.problem);
    return text ? parse_capture(*text) : none;
}

namespace {

template <class Made>
std::unique_ptr<Recorder> made(const std::string& file, std::string_view channel,
                               std::string& problem) {
    auto recorder = std::make_unique<Made>(file, channel);
    if (recorder->error() == 0) return recorder;
    problem = "cannot write " + file + ": " + std::strerror(recorder->error());
    return nullptr;
}

}  // namespace

std::unique_ptr<Recorder> record(const std::string& file, std::string_view channel,
                                 std::string& problem) {
    if (file.ends_with(".pcapng")) return made<PcapngRecorder>(file, channel, problem);
    return made<LogRecorder>(file, channel, problem);
}

}  // namespace hal::can
