// SPDX-License-Identifier: MIT
#include "lss_master.hpp"

#include <algorithm>

namespace hal::canopen {

namespace {

/// Returns the most significant `bits` of a number.
std::uint32_t leading_bits(std::uint32_t number, unsigned bits) noexcept {
    if (bits == 0) return 0;
    if (bits == 32) return number;
    return number & ~(0xffffffffU >> bits);
}

}  // namespace

bool LssMaster::send(std::uint8_t command, std::uint32_t value) noexcept {
    Frame f = make_frame(lss_master_to_slave, 8);
    f.data[0] = command;
    store(f.data.data() + 1, value);
    return out_.push(f);
}

bool LssMaster::expect(std::uint8_t command, std::uint32_t value, Time now) noexcept {
    if (busy() || !send(command, value)) return false;
    expecting_ = true;
    expected_ = command;
    result_ = {};
    asked_ = now_ = now;
    return true;
}

bool LssMaster::switch_global(bool configuration) noexcept {
    return !busy() && send(0x04, configuration ? 1 : 0);
}
bool LssMaster::activate_bit_timing(std::uint16_t delay_ms) noexcept {
    return !busy() && send(0x15, delay_ms);
}
bool LssMaster::configure_node_id(std::uint8_t id, Time now) noexcept {
    return expect(0x11, id, now);
}
bool LssMaster::configure_bit_timing(std::uint8_t index, Time now) noexcept {
    return expect(0x13, std::uint32_t{index} << 8, now);
}
bool LssMaster::store_configuration(Time now) noexcept { return expect(0x17, 0, now); }
bool LssMaster::inquire(unsigned part, Time now) noexcept {
    return part <= 4 && expect(static_cast<std::uint8_t>(0x5a + part), 0, now);
}

bool LssMaster::select(const Identity& identity, Time now) noexcept {
    if (busy() || out_.space() < 4) return false;
    for (unsigned part = 0; part < 3; ++part) {
        send(static_cast<std::uint8_t>(0x40 + part), identity[part]);
    }
    expect(0x43, identity[3], now);
    expected_ = 0x44;
    return true;
}

bool LssMaster::identify(const Identity& low, const Identity& high, Time now) noexcept {
    if (busy() || out_.space() < 6) return false;
    const std::uint32_t values[] = {low[0], low[1], low[2], high[2], low[3], high[3]};
    for (unsigned step = 0; step < 5; ++step) {
        send(static_cast<std::uint8_t>(0x46 + step), values[step]);
    }
    expect(0x4b, values[5], now);
    expected_ = 0x4f;
    return true;
}

bool LssMaster::identify_unconfigured(Time now) noexcept {
    if (!expect(0x4c, 0, now)) return false;
    expected_ = 0x50;
    return true;
}

bool LssMaster::scan(Time now, const Identity& known,
                     const std::array<std::uint8_t, 4>& known_bits) noexcept {
    if (busy()) return false;
    known_ = known;
    known_bits_ = known_bits;
    result_ = {};
    now_ = now;
    channel_.start([&] { return fastscan(channel_); });
    return true;
}

/// CiA 305, fastscan: asks bit by bit whether a slave without node ID exists whose number continues
/// with 0; no response means 1. A contradiction means that a response was lost or late: the step is
/// repeated with a longer timeout.
Task<> LssMaster::fastscan(Channel& channel) noexcept {
    constexpr std::uint8_t reset = 0x80;
    unsigned repeat = 0;
    for (;; ++repeat) {
        const bool any = co_await ask(reset, 0, 0, repeat);
        if (any) break;
        if (repeat == settings_.repeats) co_return;
    }
    for (std::uint8_t part = 0; part < 4; ++part) {
        for (;; ++repeat) {
            const bool confirmed = co_await scan_part(channel, part, repeat);
            if (confirmed) break;
            if (repeat >= settings_.repeats) co_return;
        }
        repeat = 0;
    }
    result_.answered = true;
}

/// Finds one part of the identity. Returns true if a slave confirms it.
Task<bool> LssMaster::scan_part(Channel&, std::uint8_t part, unsigned repeat) noexcept {
    const unsigned given = std::min<unsigned>(known_bits_[part], 32);
    result_.identity[part] = leading_bits(known_[part], given);
    for (unsigned bit = 32 - given; bit-- > 0;) {
        const bool zero = co_await ask(static_cast<std::uint8_t>(bit), part, part, repeat);
        if (!zero) {
            result_.identity[part] |= 1U << bit;
        }
    }
    const auto next = static_cast<std::uint8_t>(part == 3 ? 0 : part + 1);
    const bool confirmed = co_await ask(0, part, next, repeat);
    co_return confirmed;
}

/// Asks all slaves; those whose number agrees down to `bit_checked` respond. `next` becomes their
/// part if they do. The timeout doubles with each repetition.
LssMaster::Question LssMaster::ask(std::uint8_t bit_checked, std::uint8_t part, std::uint8_t next,
                                   unsigned repeat) noexcept {
    frame_ = make_frame(lss_master_to_slave, 8);
    frame_.data[0] = 0x51;
    store(frame_.data.data() + 1, bit_checked == 0x80 ? 0U : result_.identity[part]);
    frame_.data[5] = bit_checked;
    frame_.data[6] = part;
    frame_.data[7] = next;
    unsent_ = !out_.push(frame_);
    heard_ = false;
    wait_ = settings_.scan_timeout << std::min(repeat, 5U);
    asked_ = now_;
    return {*this};
}

void LssMaster::handle(const Frame& f, Time now) noexcept {
    now_ = now;
    if (!busy() || f.length != 8) return;
    if (!expecting_) {
        // All matching slaves respond one after the other: the next request waits for the last of
        // them.
        if (f.data[0] == 0x4f && !unsent_ && !heard_) {
            heard_ = true;
            asked_ = now - wait_ + settings_.scan_timeout / 4;
        }
        return;
    }
    if (f.data[0] != expected_) return;
    result_.answered = true;
    if (expected_ == 0x11 || expected_ == 0x13 || expected_ == 0x17) {
        result_.error = f.data[1];
        result_.specific = f.data[2];
    } else if (expected_ >= 0x5a && expected_ <= 0x5d) {
        result_.value = load<std::uint32_t>(f.data.data() + 1);
    } else if (expected_ == 0x5e) {
        result_.value = f.data[1];
    }
    expecting_ = false;
}

void LssMaster::poll(Time now) noexcept {
    now_ = now;
    if (expecting_) {
        expecting_ = now - asked_ < settings_.timeout;
    } else if (channel_.busy()) {
        poll_scan(now);
    }
}

void LssMaster::poll_scan(Time now) noexcept {
    if (unsent_) {
        unsent_ = !out_.push(frame_);
        asked_ = now;
    } else if (now - asked_ >= wait_) {
        channel_.resume();
    }
}

}  // namespace hal::canopen
