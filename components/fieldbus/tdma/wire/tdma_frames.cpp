// SPDX-License-Identifier: MIT
#include "tdma_frames.hpp"

#include <algorithm>

#include "big_endian.hpp"

namespace hal::tdma {

namespace {

constexpr std::size_t rtmac_at = ethernet::header_bytes;
constexpr std::size_t tdma_at = rtmac_at + rtmac_bytes;

constexpr std::size_t fields_at = tdma_at + 4;
constexpr std::uint16_t sync_id = 0x0000;
constexpr std::uint16_t request_id = 0x0010;
constexpr std::uint16_t reply_id = 0x0011;
constexpr std::uint16_t ping_id = 0x0020;

constexpr std::uint16_t echo_id = 0x0021;
constexpr std::uint8_t tunnelling = 0x01;

Frame begun(const Address& to, const Address& from, std::uint16_t id) noexcept {
    Frame frame{};
    std::copy(to.begin(), to.end(), frame.begin());
    std::copy(from.begin(), from.end(), frame.begin() + 6);
    put(frame, 12, rtmac_type);
    put(frame, rtmac_at, tdma_discipline);
    put(frame, rtmac_at + 2, rtmac_version);
    put(frame, tdma_at, tdma_version);
    put(frame, tdma_at + 2, id);
    return frame;
}

}  // namespace

Decoded decode(std::span<const std::uint8_t> frame) noexcept {
    Decoded d;
    const auto bad = [&d](Defect why) {
        d.defect = why;
        return d;
    };
    if (frame.size() < ethernet::header_bytes) return bad(Defect::cut);
    std::copy_n(frame.begin(), 6, d.to.begin());
    std::copy_n(frame.begin() + 6, 6, d.from.begin());
    if (get<std::uint16_t>(frame, 12) != rtmac_type) return bad(Defect::ethertype);
    if (frame.size() < tdma_at) return bad(Defect::cut);
    if (frame[rtmac_at + 2] != rtmac_version) return bad(Defect::version);
    const auto type = get<std::uint16_t>(frame, rtmac_at);
    if ((frame[rtmac_at + 3] & tunnelling) != 0) {
        d.kind = Kind::tunnelled;
        d.tunnelled = {type, frame.subspan(tdma_at)};
        return d;
    }
    if (type != tdma_discipline) return bad(Defect::discipline);
    if (frame.size() < fields_at) return bad(Defect::cut);
    if (get<std::uint16_t>(frame, tdma_at) != tdma_version) return bad(Defect::version);
    switch (get<std::uint16_t>(frame, tdma_at + 2)) {
    case sync_id:
        if (frame.size() < tdma_at + 24) return bad(Defect::cut);
        d.kind = Kind::sync;
        d.sync = {get<std::uint32_t>(frame, fields_at), get<Time>(frame, sync_stamp_at),
                  get<Time>(frame, fields_at + 12)};
        return d;
    case request_id:
        if (frame.size() < tdma_at + 24) return bad(Defect::cut);
        d.kind = Kind::request;
        d.request = {get<Time>(frame, request_stamp_at), get<std::uint32_t>(frame, fields_at + 8),
                     get<Time>(frame, fields_at + 12)};
        return d;
    case reply_id:
        if (frame.size() < tdma_at + 28) return bad(Defect::cut);
        d.kind = Kind::reply;
        d.reply = {get<Time>(frame, fields_at), get<Time>(frame, fields_at + 8),
                   get<Time>(frame, reply_stamp_at)};
        return d;
    case ping_id:
        if (frame.size() < tdma_at + 16) return bad(Defect::cut);
        d.kind = Kind::ping;
        d.ping = {get<Time>(frame, ping_stamp_at), get<std::uint32_t>(frame, fields_at + 8)};
        return d;
    case echo_id:
        if (frame.size() < tdma_at + 32) return bad(Defect::cut);
        d.kind = Kind::echo;
        d.echo = {get<Time>(frame, fields_at), get<Time>(frame, fields_at + 8),
                  get<Time>(frame, echo_stamp_at), get<std::uint32_t>(frame, fields_at + 24)};
        return d;
    default: return bad(Defect::frame_id);
    }
}

Frame encode(const Address& from, const Sync& s) noexcept {
    Frame frame = begun(ethernet::broadcast, from, sync_id);
    put(frame, fields_at, s.cycle);
    put(frame, sync_stamp_at, s.stamp);
    put(frame, fields_at + 12, s.scheduled);
    return frame;
}

Frame encode(const Address& to, const Address& from, const Request& r) noexcept {
    Frame frame = begun(to, from, request_id);
    put(frame, request_stamp_at, r.stamp);
    put(frame, fields_at + 8, r.reply_cycle);
    put(frame, fields_at + 12, r.reply_offset);
    return frame;
}

Frame encode(const Address& to, const Address& from, const Reply& r) noexcept {
    Frame frame = begun(to, from, reply_id);
    put(frame, fields_at, r.request_stamp);
    put(frame, fields_at + 8, r.received);
    put(frame, reply_stamp_at, r.stamp);
    return frame;
}

Frame encode(const Address& to, const Address& from, const Ping& p) noexcept {
    Frame frame = begun(to, from, ping_id);
    put(frame, ping_stamp_at, p.stamp);
    put(frame, fields_at + 8, p.number);
    return frame;
}

Frame encode(const Address& to, const Address& from, const Echo& e) noexcept {
    Frame frame = begun(to, from, echo_id);
    put(frame, fields_at, e.ping_stamp);
    put(frame, fields_at + 8, e.received);
    put(frame, echo_stamp_at, e.stamp);
    put(frame, fields_at + 24, e.number);
    return frame;
}

std::size_t tunnel(std::span<const std::uint8_t> frame, std::span<std::uint8_t> out) noexcept {
    const std::size_t length = frame.size() + rtmac_bytes;
    if (frame.size() < ethernet::header_bytes || length > out.size()) return 0;
    std::copy_n(frame.begin(), 12, out.begin());
    put(out, 12, rtmac_type);
    // the type moves into the RTmac header
    std::copy_n(frame.begin() + 12, 2, out.begin() + rtmac_at);
    out[rtmac_at + 2] = rtmac_version;
    out[rtmac_at + 3] = tunnelling;
    std::copy(frame.begin() + ethernet::header_bytes, frame.end(), out.begin() + tdma_at);
    return length;
}

std::size_t untunnel(std::span<const std::uint8_t> frame, std::span<std::uint8_t> out) noexcept {
    const Decoded d = decode(frame);
    if (d.kind != Kind::tunnelled) return 0;
    const std::size_t length = ethernet::header_bytes + d.tunnelled.payload.size();
    if (length > out.size()) return 0;
    std::copy_n(frame.begin(), 12, out.begin());
    put(out, 12, d.tunnelled.type);
    std::copy(d.tunnelled.payload.begin(), d.tunnelled.payload.end(),
              out.begin() + ethernet::header_bytes);
    return length;
}

}  // namespace hal::tdma
