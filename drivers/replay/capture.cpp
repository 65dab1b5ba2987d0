// SPDX-License-Identifier: MIT
// pcapng and pcap with link type 227 (CAN frames, identifier big-endian) or 113 (the same behind a 16-byte header of any interface).
#include "link/capture.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>

namespace hal::can {

namespace {

constexpr std::uint32_t section = 0x0a0d0d0a, interface_block = 1, packet_block = 6, byte_order = 0x1a2b3c4d;
constexpr std::size_t largest_file = std::size_t{1} << 30;
constexpr std::uint16_t link_can = 227, link_cooked = 113;

class Bytes {
public:
    explicit Bytes(std::string_view all) : all_(all) {}
    bool swapped = false;
    std::uint32_t number(std::size_t at, unsigned width) const {
        std::uint32_t v = 0;
        for (unsigned i = 0; i < width; ++i)
            v |= std::uint32_t{static_cast<unsigned char>(at + i < all_.size() ? all_[at + i] : 0)} << 8 * (swapped ? width - 1 - i : i);
        return v;
    }
    std::string_view part(std::size_t at, std::size_t size) const { return at <= all_.size() ? all_.substr(at, size) : std::string_view{}; }

private:
    std::string_view all_;
};

/// One packet; false when it is no CAN frame.
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
    const std::uint32_t id = std::uint32_t{byte(0)} << 24 | byte(1) << 16U | byte(2) << 8U | byte(3);
    f.fd = flexible;
    f.error = (id & 0x20000000U) != 0;
    f.extended = !f.error && (id & 0x80000000U) != 0;
    f.remote = !f.error && (id & 0x40000000U) != 0;
    f.id = id & (f.extended || f.error ? 0x1fffffffU : 0x7ffU);
    f.length = byte(4);
    f.bit_rate_switch = flexible && (byte(5) & 1) != 0;
    f.error_state = flexible && (byte(5) & 2) != 0;
    if (f.length > 64 || (!f.remote && packet.size() < 8U + f.length)) return false;
    if (!f.remote && f.length != 0) std::memcpy(f.data.data(), packet.data() + 8, f.length);
    return f.error ? f.length <= 8 : f.valid();
}

std::string cut_off(std::size_t at) { return "damaged or cut off at byte " + std::to_string(at); }

void parse_pcapng(std::string_view all, Capture& capture) {
    struct Interface {
        unsigned link;
        double tick_ns;
    };
    std::vector<Interface> interfaces;
    Bytes in(all);
    for (std::size_t at = 0; at < all.size();) {
        if (all.size() - at < 12) return void(capture.problem = cut_off(at));
        if (in.number(at, 4) == section) {  // reads the same both ways round
            in.swapped = false;
            in.swapped = in.number(at + 8, 4) != byte_order;
            if (in.number(at + 8, 4) != byte_order) return void(capture.problem = cut_off(at));
            interfaces.clear();
        }
        const auto type = in.number(at, 4);
        const std::size_t size = in.number(at + 4, 4);
        if (size < 12 || size % 4 != 0 || size > all.size() - at) return void(capture.problem = cut_off(at));
        const std::size_t end = at + size - 4;
        if (type == interface_block && size >= 20 && interfaces.size() < 1024) {
            Interface i{in.number(at + 8, 2), 1000.0};
            for (std::size_t o = at + 16; o + 4 <= end;) {
                const auto code = in.number(o, 2), length = in.number(o + 2, 2);
                if (code == 0) break;
                if (code == 9 && length >= 1) {  // time resolution: a negative power of 10, or of 2
                    const auto r = in.number(o + 4, 1);
                    i.tick_ns = 1e9;
                    for (unsigned k = 0; k < (r & 127U); ++k) i.tick_ns /= (r & 128U) != 0 ? 2.0 : 10.0;
                }
                o += 4 + (length + 3U) / 4 * 4;
            }
            interfaces.push_back(i);
        } else if (type == packet_block && size >= 32) {
            const auto number = in.number(at + 8, 4), held = in.number(at + 20, 4);
            if (number >= interfaces.size() || held > size - 32) return void(capture.problem = cut_off(at));
            const auto ticks = std::uint64_t{in.number(at + 12, 4)} << 32 | in.number(at + 16, 4);
            const auto tick = interfaces[number].tick_ns;
            Frame f;
            if (parse_packet(in.part(at + 28, held), interfaces[number].link, f)) {
                const double rough = static_cast<double>(ticks) * tick;
                const bool whole = tick == 1.0 || tick == 1000.0;  // exact where a double is not
                const auto exact = ticks * (tick == 1.0 ? 1U : 1000U);
                f.time_ns = rough >= 9e18 ? 0 : whole ? static_cast<std::int64_t>(exact) : static_cast<std::int64_t>(rough);
                capture.frames.push_back(f);
            }
        }
        at += size;
    }
}

void parse_pcap(std::string_view all, Capture& capture) {
    Bytes in(all);
    if (in.number(0, 4) != 0xa1b2c3d4 && in.number(0, 4) != 0xa1b23c4d) in.swapped = true;
    const std::int64_t unit = in.number(0, 4) == 0xa1b23c4d ? 1 : 1000;
    const unsigned link = in.number(20, 4) & 0xffffU;
    for (std::size_t at = 24; at < all.size();) {
        const std::size_t held = in.number(at + 8, 4);
        if (all.size() - at < 16 || held > all.size() - at - 16) return void(capture.problem = cut_off(at));
        Frame f;
        if (parse_packet(in.part(at + 16, held), link, f)) {
            f.time_ns = in.number(at, 4) * 1'000'000'000LL + in.number(at + 4, 4) * unit;
            capture.frames.push_back(f);
        }
        at += 16 + held;
    }
}

class FileRecorder : public Recorder {
public:
    explicit FileRecorder(std::FILE* file) : file_(file) {}
    ~FileRecorder() override { std::fclose(file_); }
    bool flush() override { return std::fflush(file_) == 0; }

protected:
    bool put(std::string_view text) { return std::fwrite(text.data(), 1, text.size(), file_) == text.size(); }

private:
    std::FILE* file_;
};

class LogRecorder final : public FileRecorder {
public:
    LogRecorder(std::FILE* file, std::string_view channel) : FileRecorder(file), channel_(channel) {}
    bool write(const Frame& f) override { return put(log_line(f, channel_) + "\n"); }

private:
    std::string channel_;
};

class PcapngRecorder final : public FileRecorder {
public:
    PcapngRecorder(std::FILE* file, std::string_view channel) : FileRecorder(file) {
        std::string s;
        add(s, byte_order, 4), add(s, 1, 2), add(s, 0, 2), add(s, 0xffffffff, 4), add(s, 0xffffffff, 4);
        put_block(section, s);
        s.clear();
        add(s, link_can, 2), add(s, 0, 2), add(s, 0, 4);
        channel = channel.substr(0, 255);
        add(s, 2, 2), add(s, static_cast<std::uint32_t>(channel.size()), 2), s += channel, pad(s);
        add(s, 9, 2), add(s, 1, 2), s += '\x09', pad(s);  // nanoseconds
        add(s, 0, 4);
        put_block(interface_block, s);
    }
    bool write(const Frame& f) override {
        const auto time = static_cast<std::uint64_t>(f.time_ns > 0 ? f.time_ns : 0);
        const auto size = static_cast<std::uint32_t>(8 + f.bytes().size());
        std::string s;
        add(s, 0, 4), add(s, static_cast<std::uint32_t>(time >> 32), 4), add(s, static_cast<std::uint32_t>(time), 4);
        add(s, size, 4), add(s, size, 4);
        const auto id = f.id | (f.extended ? 0x80000000U : 0U) | (f.remote ? 0x40000000U : 0U) | (f.error ? 0x20000000U : 0U);
        for (int shift = 24; shift >= 0; shift -= 8) s += static_cast<char>(id >> shift & 0xff);
        s += static_cast<char>(f.length);
        s += static_cast<char>((f.bit_rate_switch ? 1 : 0) | (f.error_state ? 2 : 0) | (f.fd ? 4 : 0));
        s += std::string(2, '\0');
        for (const auto b : f.bytes()) s += static_cast<char>(b);
        pad(s);
        return put_block(packet_block, s);
    }

private:
    static void add(std::string& s, std::uint32_t v, unsigned width) {
        for (; width > 0; --width, v >>= 8) s += static_cast<char>(v & 0xff);
    }
    static void pad(std::string& s) { s.resize((s.size() + 3) / 4 * 4); }
    bool put_block(std::uint32_t type, const std::string& body) {
        std::string s;
        add(s, type, 4), add(s, static_cast<std::uint32_t>(body.size() + 12), 4);
        s += body;
        add(s, static_cast<std::uint32_t>(body.size() + 12), 4);
        return put(s);
    }
};

}  // namespace

Capture parse_capture(std::string_view bytes) {
    Capture capture;
    const Bytes in(bytes);
    const auto magic = in.number(0, 4);
    if (bytes.size() >= 12 && magic == section) {
        parse_pcapng(bytes, capture);
    } else if (bytes.size() >= 24 && (magic == 0xa1b2c3d4 || magic == 0xd4c3b2a1 || magic == 0xa1b23c4d || magic == 0x4d3cb2a1)) {
        parse_pcap(bytes, capture);
    } else {
        for (std::size_t at = 0, number = 1; at < bytes.size(); ++number) {
            const auto end = std::min(bytes.find('\n', at), bytes.size());
            const auto line = bytes.substr(at, end - at);
            at = end + 1;
            Frame f;
            if (parse_log_line(line, f)) capture.frames.push_back(f);
            else if (line.find_first_not_of(" \t\r") != line.npos && capture.problem.empty())
                capture.problem = "line " + std::to_string(number) + " is no frame; a line is `(1436509052.249713) can0 181#0102`";
        }
    }
    std::stable_sort(capture.frames.begin(), capture.frames.end(), [](const Frame& a, const Frame& b) { return a.time_ns < b.time_ns; });
    return capture;
}

Capture read_capture(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) return {{}, "it cannot be read: " + std::string(std::strerror(errno))};
    std::string text;
    char part[65536];
    while (in.read(part, sizeof part), in.gcount() > 0) {
        text.append(part, static_cast<std::size_t>(in.gcount()));
        if (text.size() > largest_file) return {{}, "it is larger than 1 GiB; cut it with `editcap` or `split`"};
    }
    if (in.bad()) return {{}, "it cannot be read: " + std::string(std::strerror(errno))};
    return parse_capture(text);
}

std::unique_ptr<Recorder> record(const std::string& file, std::string_view channel, std::string& problem) {
    std::FILE* out = std::fopen(file.c_str(), "wbe");
    if (out == nullptr) {
        problem = file + " cannot be written: " + std::strerror(errno);
        return nullptr;
    }
    if (file.ends_with(".pcapng")) return std::make_unique<PcapngRecorder>(out, channel);
    return std::make_unique<LogRecorder>(out, channel);
}

}  // namespace hal::can
