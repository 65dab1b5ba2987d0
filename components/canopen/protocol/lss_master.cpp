// SPDX-License-Identifier: MIT
#include "lss_master.hpp"

#include <algorithm>

namespace hal::canopen {

bool LssMaster::send(std::uint8_t command, std::uint32_t value) noexcept {
    Frame f = make_frame(lss_master_to_slave, 8);
    f.data[0] = command;
    store(f.data.data() + 1, value);
    return out_.push(f);
}

bool LssMaster::expect(std::uint8_t command, std::uint32_t value, Time now) noexcept {
    if (busy() || !send(command, value)) return false;
    job_ = Job::expect;
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

// Fastscan asks bit by bit whether a slave exists whose number continues with 0; no response means
// 1.

bool LssMaster::scan(Time now, const Identity& known,
                     const std::array<std::uint8_t, 4>& known_bits) noexcept {
    if (busy()) return false;
    known_ = known;
    known_bits_ = known_bits;
    result_ = {};
    part_ = 0;
    repeats_left_ = settings_.repeats;
    now_ = now;
    job_ = Job::scan_reset;
    send_scan(0x80, 0);
    return true;
}

void LssMaster::send_scan(std::uint8_t bit, std::uint8_t next) noexcept {
    frame_ = make_frame(lss_master_to_slave, 8);
    frame_.data[0] = 0x51;
    store(frame_.data.data() + 1, bit == 0x80 ? 0U : result_.identity[part_]);
    frame_.data[5] = bit;
    frame_.data[6] = part_;
    frame_.data[7] = next;
    unsent_ = !out_.push(frame_);
    heard_ = false;
    asked_ = now_;
}

void LssMaster::scan_part() noexcept {
    const auto given = std::min<unsigned>(known_bits_[part_], 32);
    result_.identity[part_] =
        given == 0 ? 0 : known_[part_] & (given == 32 ? 0xffffffffU : ~(0xffffffffU >> given));
    if (given == 32) {
        job_ = Job::scan_confirm;
        return send_scan(0, static_cast<std::uint8_t>(part_ == 3 ? 0 : part_ + 1));
    }
    job_ = Job::scan_bit;
    bit_ = static_cast<std::uint8_t>(31 - given);
    send_scan(bit_, part_);
}

/// Doubles with each repetition: the responses may have been late.
Time LssMaster::scan_wait() const noexcept {
    return settings_.scan_timeout << std::min(settings_.repeats - repeats_left_, 5U);
}

void LssMaster::scan_answer(bool yes) noexcept {
    switch (job_) {
    case Job::scan_reset:
        if (yes) return scan_part();
        if (repeats_left_ != 0) {
            --repeats_left_;
            return send_scan(0x80, 0);
        }
        job_ = Job::none;
        return;
    case Job::scan_bit:
        if (!yes) {
            result_.identity[part_] |= 1U << bit_;
        }
        if (bit_ != 0) return send_scan(--bit_, part_);
        job_ = Job::scan_confirm;
        return send_scan(0, static_cast<std::uint8_t>(part_ == 3 ? 0 : part_ + 1));
    case Job::scan_confirm:
        if (!yes) {  // a response was lost, or an earlier one was invalid
            if (repeats_left_ != 0) {
                --repeats_left_;
                return scan_part();
            }
            job_ = Job::none;
            return;
        }
        repeats_left_ = settings_.repeats;
        if (part_ == 3) {
            result_.answered = true;
            job_ = Job::none;
            return;
        }
        ++part_;
        return scan_part();
    default: return;
    }
}

void LssMaster::handle(const Frame& f, Time now) noexcept {
    now_ = now;
    if (!busy() || f.length != 8) return;
    if (job_ != Job::expect) {
        // All matching slaves respond one after the other: the next request waits for the last of
        // them.
        if (f.data[0] == 0x4f && !unsent_ && !heard_) {
            heard_ = true;
            asked_ = now - scan_wait() + settings_.scan_timeout / 4;
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
    job_ = Job::none;
}

void LssMaster::poll(Time now) noexcept {
    now_ = now;
    if (!busy()) return;
    if (job_ == Job::expect) {
        if (now - asked_ >= settings_.timeout) {
            job_ = Job::none;
        }
        return;
    }
    if (unsent_) {
        unsent_ = !out_.push(frame_);
        asked_ = now;
        return;
    }
    if (now - asked_ >= scan_wait()) {
        scan_answer(heard_);
    }
}

}  // namespace hal::canopen
