// SPDX-License-Identifier: MIT
// Captures of a CAN bus: link type 227 (CAN frames, identifier big-endian) or 113 (the same after a
// 16-byte header of the interface).
#include "link/capture.hpp"

#include <algorithm>
#include <cstring>

#include "capture/packets.hpp"

namespace hal::can {

namespace {

using namespace hal::replay;

/// Parses one packet. Returns false when it is not a CAN frame.
bool parse_packet(std::string_view packet, unsigned link, Frame& f) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(packet[i]); };
    f = {};
    bool flexible = false;
    if (link == link_cooked) {
        if (packet.size() < 24) return false;
        const unsigned protocol = byte(14) << 8U | byte(15);
        if (protocol != 0x000c && protocol != 0x000d) return false;
        flexible = protocol == 0x000d;
        packet.remove_prefix(16);
    } else if (link != link_can || packet.size() < 8) {
        return false;
    } else {
        flexible = packet.size() > 16 || (byte(5) & 4) != 0 || byte(4) > 8;
    }
    const std::uint32_t id =
        std::uint32_t{byte(0)} << 24 | byte(1) << 16U | byte(2) << 8U | byte(3);
    f.fd = flexible;
    f.error = (id & 0x20000000U) != 0;
    f.extended = !f.error && (id & 0x80000000U) != 0;
    f.remote = !f.error && (id & 0x40000000U) != 0;
    f.id = id & (f.extended || f.error ? 0x1fffffffU : 0x7ffU);
    f.length = byte(4);
    f.bit_rate_switch = flexible && (byte(5) & 1) != 0;
    f.error_state = flexible && (byte(5) & 2) != 0;
    if (f.length > 64 || (!f.remote && packet.size() < 8U + f.length)) return false;
    if (!f.remote && f.length != 0) {
        std::memcpy(f.data.data(), packet.data() + 8, f.length);
    }
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
