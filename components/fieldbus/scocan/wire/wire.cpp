// SPDX-License-Identifier: MIT
#include "wire.hpp"

namespace hal::scocan {

namespace {

bool is_plain(const can::Frame& f, std::uint32_t id) noexcept {
    return f.id == id && f.is_standard_data();
}
bool is_of_node(const can::Frame& f) noexcept {
    return f.id >= node_id && f.id < node_id + max_nodes && is_plain(f, f.id);
}
std::uint8_t low(std::uint32_t value) noexcept { return static_cast<std::uint8_t>(value & 0xff); }

}  // namespace

can::Frame encode(const Sync& s) noexcept {
    if (!s.numbered) {
        return {sync_id, {}};
    }
    return {
        sync_id,
        {low(s.counter), low((s.mode & 15U) | (s.sender & 7U) << 4 | (s.pending ? 0x80U : 0U))}};
}

bool decode(const can::Frame& f, Sync& s) noexcept {
    if (!is_plain(f, sync_id) || (f.length != 0 && f.length != 2)) return false;
    s = {};
    if (f.length == 0) return true;
    if (f.data[0] >= counter_cycles) return false;
    s.numbered = true;
    s.counter = f.data[0];
    s.mode = f.data[1] & 15U;
    s.sender = f.data[1] >> 4 & 7U;
    s.pending = (f.data[1] & 0x80U) != 0;
    return true;
}

can::Frame announcement(std::uint32_t slot) noexcept { return {announce_id, {low(slot)}}; }

bool decode_announcement(const can::Frame& f, std::uint32_t& slot) noexcept {
    if (!is_plain(f, announce_id) || f.length != 1) return false;
    slot = f.data[0];
    return true;
}

can::Frame encode(const Request& r) noexcept {
    return {node_id + r.sender,
            {low(static_cast<std::uint32_t>(r.what)), r.mode, low(r.crc),
             low(static_cast<std::uint32_t>(r.crc) >> 8), r.at_counter}};
}

bool decode(const can::Frame& f, Request& r) noexcept {
    if (!is_of_node(f) || f.length != 5 || f.data[0] > 4 || f.data[4] >= counter_cycles) {
        return false;
    }
    if (f.data[1] >= (f.data[0] >= 3 ? max_nodes : max_modes)) return false;
    r = {f.id - node_id, static_cast<Request::What>(f.data[0]), f.data[1],
         static_cast<std::uint16_t>(f.data[2] | f.data[3] << 8), f.data[4]};
    return true;
}

can::Frame encode(const Answer& a) noexcept {
    return {node_id + a.node,
            {low(static_cast<std::uint32_t>(a.reason)), a.mode, low(a.crc),
             low(static_cast<std::uint32_t>(a.crc) >> 8)}};
}

bool decode(const can::Frame& f, Answer& a) noexcept {
    if (!is_of_node(f) || f.length != 4 || f.data[0] > 1 || f.data[1] >= max_modes) return false;
    a = {f.id - node_id, f.data[1], static_cast<Answer::Reason>(f.data[0]),
         static_cast<std::uint16_t>(f.data[2] | f.data[3] << 8)};
    return true;
}

}  // namespace hal::scocan
