// SPDX-License-Identifier: MIT
#include "ethercat/wire/frames.hpp"

#include <algorithm>

namespace hal::ethercat {

const char* to_string(Command command) noexcept {
    static constexpr std::array<const char*, 15> names{"NOP",  "APRD", "APWR", "APRW", "FPRD",
                                                       "FPWR", "FPRW", "BRD",  "BWR",  "BRW",
                                                       "LRD",  "LWR",  "LRW",  "ARMW", "FRMW"};
    const auto number = static_cast<std::size_t>(command);
    return number < names.size() ? names[number] : "unknown";
}

FrameReader::FrameReader(std::span<std::uint8_t> frame) noexcept {
    constexpr std::uint16_t ipv4 = 0x0800;
    constexpr std::size_t ip_header_bytes = 20;
    constexpr std::size_t udp_header_bytes = 8;
    if (frame.size() < ethernet_header_bytes + ecat_header_bytes) return;
    const auto big_endian = [&](std::size_t at) {
        return static_cast<std::uint16_t>(frame[at] << 8 | frame[at + 1]);
    };
    std::size_t at = ethernet_header_bytes;
    if (big_endian(12) == ipv4) {
        if (frame.size() < at + ip_header_bytes + udp_header_bytes + ecat_header_bytes) return;
        if (frame[at] != 0x45 || frame[at + 9] != 17 ||
            big_endian(at + ip_header_bytes + 2) != ethertype) {
            return;
        }
        at += ip_header_bytes + udp_header_bytes;
    } else if (big_endian(12) != ethertype) {
        return;
    }
    const auto header = get<std::uint16_t>(&frame[at]);
    if (header >> 12 != static_cast<unsigned>(Protocol::datagrams)) return;
    at += ecat_header_bytes;
    const std::size_t length = header & 0x7ffU;
    malformed_ = length > frame.size() - at;
    at_ = frame.data() + at;
    end_ = at_ + std::min(length, frame.size() - at);
    valid_ = true;
}

std::optional<DatagramView> FrameReader::next() noexcept {
    if (!valid_ || !more_) return std::nullopt;
    const auto left = static_cast<std::size_t>(end_ - at_);
    if (left < datagram_header_bytes + wkc_bytes) {
        malformed_ = true;
        more_ = false;
        return std::nullopt;
    }
    DatagramView d;
    const auto flags = get<std::uint16_t>(at_ + 6);
    d.command = static_cast<Command>(at_[0]);
    d.index = at_[1];
    d.address = get<std::uint32_t>(at_ + 2);
    d.length = flags & 0x7ff;
    d.circulating = (flags & 0x4000) != 0;
    d.more = more_ = (flags & 0x8000) != 0;
    d.header = at_;
    d.data = at_ + datagram_header_bytes;
    if (left < datagram_header_bytes + d.length + wkc_bytes) {
        malformed_ = true;
        more_ = false;
        return std::nullopt;
    }
    at_ = d.data + d.length + wkc_bytes;
    return d;
}

FrameWriter::FrameWriter(std::span<std::uint8_t, max_frame_bytes> buffer,
                         const std::array<std::uint8_t, 6>& source, std::size_t max) noexcept
    : buffer_(buffer), max_(std::min(max, max_frame_bytes)) {
    std::fill_n(buffer_.begin(), 6, std::uint8_t{0xff});
    std::copy(source.begin(), source.end(), buffer_.begin() + 6);
    buffer_[12] = ethertype >> 8;
    buffer_[13] = ethertype & 0xff;
}

FrameWriter FrameWriter::behind(std::span<std::uint8_t, max_frame_bytes> buffer,
                                std::size_t max) noexcept {
    std::array<std::uint8_t, 6> source;
    std::copy_n(buffer.begin() + 6, source.size(), source.begin());
    FrameWriter writer(buffer, source, max);
    FrameReader written(buffer);
    while (const auto datagram = written.next()) {
        const std::uint8_t* const end = datagram->data + datagram->length + wkc_bytes;
        writer.used_ = static_cast<std::size_t>(end - buffer.data());
        writer.last_ = datagram->header;
    }
    return writer;
}

std::size_t FrameWriter::space() const noexcept {
    constexpr std::size_t overhead = datagram_header_bytes + wkc_bytes;
    return max_ > used_ + overhead ? max_ - used_ - overhead : 0;
}

std::uint8_t* FrameWriter::add(Command command, std::uint8_t index, std::uint32_t address,
                               std::uint16_t length) noexcept {
    if (length > space()) return nullptr;
    if (last_ != nullptr) {
        last_[7] |= 0x80;
    }
    last_ = buffer_.data() + used_;
    last_[0] = static_cast<std::uint8_t>(command);
    last_[1] = index;
    put(last_ + 2, address);
    put(last_ + 6, length);
    put<std::uint16_t>(last_ + 8, 0);
    std::uint8_t* data = last_ + datagram_header_bytes;
    std::fill_n(data, length + wkc_bytes, std::uint8_t{0});
    used_ += datagram_header_bytes + length + wkc_bytes;
    return data;
}

std::span<const std::uint8_t> FrameWriter::finish() noexcept {
    constexpr std::size_t smallest = 60;
    put(buffer_.data() + ethernet_header_bytes,
        static_cast<std::uint16_t>((used_ - ethernet_header_bytes - ecat_header_bytes) |
                                   static_cast<unsigned>(Protocol::datagrams) << 12));
    if (used_ < smallest) {
        std::fill(buffer_.data() + used_, buffer_.data() + smallest, std::uint8_t{0});
    }
    return {buffer_.data(), std::max(used_, smallest)};
}

}  // namespace hal::ethercat
