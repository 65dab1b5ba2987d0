// SPDX-License-Identifier: MIT
#include "packets.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <vector>

#include <sys/stat.h>

namespace hal::replay {

namespace {

constexpr std::uint32_t section = 0x0a0d0d0a;
constexpr std::uint32_t interface_block = 1;
constexpr std::uint32_t packet_block = 6;

constexpr std::uint32_t byte_order = 0x1a2b3c4d;
constexpr std::size_t max_file_size = std::size_t{1} << 30;
using Take = std::function<void(const Packet&)>;

class Bytes {
public:
    explicit Bytes(std::string_view all) : all_(all) {}
    bool swapped = false;
    std::uint32_t number(std::size_t at, unsigned width) const {
        std::uint32_t v = 0;
        for (unsigned i = 0; i < width; ++i) {
            v |= std::uint32_t{static_cast<unsigned char>(at + i < all_.size() ? all_[at + i] : 0)}
                 << 8 * (swapped ? width - 1 - i : i);
        }
        return v;
    }
    std::string_view part(std::size_t at, std::size_t size) const {
        return at <= all_.size() ? all_.substr(at, size) : std::string_view{};
    }

private:
    std::string_view all_;
};

std::string cut_off(std::size_t at) { return "damaged or truncated at byte " + std::to_string(at); }

/// Converts ticks to ns: exact for ticks of 1 ns and 1 us, where a double is not. 0: out of range.
std::int64_t time_of(std::uint64_t ticks, double tick_ns) {
    const double time_ns = static_cast<double>(ticks) * tick_ns;
    if (time_ns >= 9e18) return 0;
    if (tick_ns == 1.0) return static_cast<std::int64_t>(ticks);
    if (tick_ns == 1000.0) return static_cast<std::int64_t>(ticks * 1000U);
    return static_cast<std::int64_t>(time_ns);
}

/// An interface of a pcapng file.
struct Interface {
    unsigned link;
    double tick_ns;  ///< of its timestamps
};

/// Reads an interface description block between `at` and `end`.
Interface interface_of(const Bytes& in, std::size_t at, std::size_t end) {
    constexpr unsigned time_resolution = 9;  // option if_tsresol
    Interface out{in.number(at + 8, 2), 1000.0};
    for (std::size_t option = at + 16; option + 4 <= end;) {
        const auto code = in.number(option, 2);
        const auto length = in.number(option + 2, 2);
        if (code == 0) break;
        if (code == time_resolution && length >= 1) {  // a negative power of 10, or of 2
            const auto r = in.number(option + 4, 1);
            out.tick_ns = 1e9;
            for (unsigned k = 0; k < (r & 127U); ++k) {
                out.tick_ns /= (r & 128U) != 0 ? 2.0 : 10.0;
            }
        }
        option += 4 + (length + 3U) / 4 * 4;
    }
    return out;
}

/// Passes the packets of a pcapng file to `take`, block by block. Returns where the file is
/// damaged, empty: nowhere.
std::string parse_pcapng(std::string_view all, const Take& take) {
    std::vector<Interface> interfaces;
    Bytes in(all);
    for (std::size_t at = 0; at < all.size();) {
        if (all.size() - at < 12) return cut_off(at);
        if (in.number(at, 4) == section) {  // the same in both byte orders
            in.swapped = false;
            in.swapped = in.number(at + 8, 4) != byte_order;
            if (in.number(at + 8, 4) != byte_order) return cut_off(at);
            interfaces.clear();
        }
        const auto type = in.number(at, 4);
        const std::size_t size = in.number(at + 4, 4);
        if (size < 12 || size % 4 != 0 || size > all.size() - at) return cut_off(at);
        const std::size_t end = at + size - 4;
        if (type == interface_block && size >= 20 && interfaces.size() < 1024) {
            interfaces.push_back(interface_of(in, at, end));
        } else if (type == packet_block && size >= 32) {
            const auto number = in.number(at + 8, 4);
            const auto held = in.number(at + 20, 4);
            if (number >= interfaces.size() || held > size - 32) return cut_off(at);
            const auto ticks = std::uint64_t{in.number(at + 12, 4)} << 32 | in.number(at + 16, 4);
            const auto tick = interfaces[number].tick_ns;
            take({static_cast<std::uint16_t>(interfaces[number].link), time_of(ticks, tick),
                  in.part(at + 28, held), in.number(at + 24, 4)});
        }
        at += size;
    }
    return {};
}

std::string parse_pcap(std::string_view all, const Take& take) {
    Bytes in(all);
    if (in.number(0, 4) != 0xa1b2c3d4 && in.number(0, 4) != 0xa1b23c4d) {
        in.swapped = true;
    }
    const std::int64_t unit = in.number(0, 4) == 0xa1b23c4d ? 1 : 1000;
    const unsigned link = in.number(20, 4) & 0xffffU;
    for (std::size_t at = 24; at < all.size();) {
        const std::size_t held = in.number(at + 8, 4);
        if (all.size() - at < 16 || held > all.size() - at - 16) return cut_off(at);
        const auto time = in.number(at, 4) * 1'000'000'000LL + in.number(at + 4, 4) * unit;
        take({static_cast<std::uint16_t>(link), time, in.part(at + 16, held),
              in.number(at + 12, 4)});
        at += 16 + held;
    }
    return {};
}

void add(std::string& s, std::uint32_t v, unsigned width) {
    for (; width > 0; --width, v >>= 8) {
        s += static_cast<char>(v & 0xff);
    }
}
void pad(std::string& s) { s.resize((s.size() + 3) / 4 * 4); }

}  // namespace

bool is_capture(std::string_view file) {
    const auto magic = Bytes(file).number(0, 4);
    if (file.size() >= 12 && magic == section) return true;
    return file.size() >= 24 && (magic == 0xa1b2c3d4 || magic == 0xd4c3b2a1 ||
                                 magic == 0xa1b23c4d || magic == 0x4d3cb2a1);
}

std::string each_packet(std::string_view file, const Take& take) {
    if (!is_capture(file)) return "neither pcapng nor pcap";
    return Bytes(file).number(0, 4) == section ? parse_pcapng(file, take) : parse_pcap(file, take);
}

std::optional<std::string> read_file(const std::string& name, std::string& problem) {
    struct stat about{};
    // opening a FIFO would block
    if (::stat(name.c_str(), &about) == 0 && !S_ISREG(about.st_mode)) {
        problem = "not a regular file";
        return std::nullopt;
    }
    std::ifstream in(name, std::ios::binary);
    std::string text;
    char part[65536];
    while (in && (in.read(part, sizeof part), in.gcount() > 0)) {
        text.append(part, static_cast<std::size_t>(in.gcount()));
        if (text.size() <= max_file_size) continue;
        problem = "larger than 1 GiB; split it with editcap or split";
        return std::nullopt;
    }
    if (in.is_open() && !in.bad()) return text;
    problem = "cannot read it: " + std::string(std::strerror(errno));
    return std::nullopt;
}

PacketWriter::PacketWriter(const std::string& file, std::uint16_t link, std::string_view interface)
    : file_(file) {
    std::string s;
    add(s, byte_order, 4);
    add(s, 1, 2);
    add(s, 0, 2);
    add(s, 0xffffffff, 4);
    add(s, 0xffffffff, 4);
    put_block(section, s);
    s.clear();
    add(s, link, 2);
    add(s, 0, 2);
    add(s, 0, 4);
    interface = interface.substr(0, 255);
    add(s, 2, 2);
    add(s, static_cast<std::uint32_t>(interface.size()), 2);
    s += interface;
    pad(s);
    add(s, 9, 2);
    add(s, 1, 2);
    s += '\x09';
    pad(s);  // nanoseconds
    add(s, 0, 4);
    put_block(interface_block, s);
}

bool PacketWriter::write(std::int64_t time_ns, std::string_view bytes) {
    const auto time = static_cast<std::uint64_t>(time_ns > 0 ? time_ns : 0);
    const auto size = static_cast<std::uint32_t>(bytes.size());
    std::string s;
    add(s, 0, 4);
    add(s, static_cast<std::uint32_t>(time >> 32), 4);

    add(s, static_cast<std::uint32_t>(time), 4);
    add(s, size, 4);
    add(s, size, 4);
    s += bytes;
    pad(s);
    return put_block(packet_block, s);
}
bool PacketWriter::put_block(std::uint32_t type, const std::string& body) {
    std::string s;
    add(s, type, 4);
    add(s, static_cast<std::uint32_t>(body.size() + 12), 4);
    s += body;
    add(s, static_cast<std::uint32_t>(body.size() + 12), 4);
    return file_.put(s);
}

}  // namespace hal::replay
