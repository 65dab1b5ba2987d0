// SPDX-License-Identifier: MIT
#include "lss_slave.hpp"

namespace hal::canopen {

void LssSlave::answer(std::uint8_t command, std::uint32_t value) noexcept {
    answer_ = make_frame(lss_slave_to_master, 8);
    answer_.data[0] = command;
    store(answer_.data.data() + 1, value);
    waiting_answer_ = !out_.push(answer_);
}

void LssSlave::select(unsigned part, std::uint32_t value) noexcept {
    if (configuring_) return;
    if (part == 0) {
        selected_ = 0;
    }
    selected_ = selected_ == part && identity_[part] == value ? static_cast<std::uint8_t>(part + 1)
                                                              : std::uint8_t{0};
    if (selected_ != 4) return;
    selected_ = 0;
    configuring_ = true;
    answer(0x44);
}

void LssSlave::identify(unsigned step, std::uint32_t value) noexcept {
    // Vendor and product exactly, revision and serial number between a low and a high bound.
    const bool fits = step == 0   ? identity_[0] == value
                      : step == 1 ? identity_[1] == value
                      : step == 2 ? identity_[2] >= value
                      : step == 3 ? identity_[2] <= value
                      : step == 4 ? identity_[3] >= value
                                  : identity_[3] <= value;
    if (step == 0) {
        identified_ = 0;
    }
    identified_ =
        identified_ == step && fits ? static_cast<std::uint8_t>(step + 1) : std::uint8_t{0};
    if (identified_ == 6) {
        identified_ = 0;
        answer(0x4f);
    }
}

void LssSlave::fastscan(const Frame& f) noexcept {
    const auto number = load<std::uint32_t>(f.data.data() + 1);
    const auto bit = f.data[5];
    const auto part = f.data[6];
    const auto next = f.data[7];
    if (configuring_ || active_id_ != unconfigured || pending_id_ != unconfigured) return;
    if (bit == 0x80) {
        scan_part_ = 0;
        return answer(0x4f);
    }
    if (bit > 31 || part > 3 || next > 3 || part != scan_part_) return;
    if (((number ^ identity_[part]) >> bit) != 0) return;
    if (bit == 0) {
        scan_part_ = next;
        if (next < part) {
            configuring_ = true;
        }
    }
    answer(0x4f);
}

void LssSlave::configure_bit_timing(const Frame& f) noexcept {
    const auto rate = f.data[1] == 0 ? lss_bit_rate(f.data[2]) : 0;
    const bool known = rate != 0 && events_.on_lss_bit_rate(rate);
    if (known) {
        pending_rate_ = rate;
    }
    answer(0x13, known ? 0 : 1);
}

bool LssSlave::handle(const Frame& f) noexcept {
    if (f.id != lss_master_to_slave || f.extended || f.remote) return false;
    if (f.length != 8) return true;
    const auto command = f.data[0];
    const auto value = load<std::uint32_t>(f.data.data() + 1);
    if (command == 0x04) {
        if (configuring_ && f.data[1] == 0 && active_id_ == unconfigured &&
            pending_id_ != unconfigured) {
            wants_reset_ = true;
        }
        configuring_ = f.data[1] == 1;
        return true;
    }
    if (command >= 0x40 && command <= 0x43) {
        select(command - 0x40U, value);
        return true;
    }
    if (command >= 0x46 && command <= 0x4b) {
        identify(command - 0x46U, value);
        return true;
    }
    if (command == 0x4c) {
        if (active_id_ == unconfigured && pending_id_ == unconfigured) {
            answer(0x50);
        }
        return true;
    }
    if (command == 0x51) {
        fastscan(f);
        return true;
    }
    if (!configuring_) return true;
    if (command >= 0x5a && command <= 0x5d) {
        answer(command, identity_[command - 0x5aU]);
        return true;
    }
    switch (command) {
    case 0x11: {
        const auto id = f.data[1];
        const bool good = (id >= 1 && id <= 127) || id == unconfigured;
        if (good) {
            pending_id_ = id;
        }
        answer(command, good ? 0 : 1);
        break;
    }
    case 0x13: configure_bit_timing(f); break;
    case 0x15:
        if (pending_rate_ != 0) {
            events_.on_lss_activate(pending_rate_,
                                    load<std::uint16_t>(f.data.data() + 1) * millisecond);
        }
        break;
    case 0x17: answer(command, events_.on_lss_store(pending_id_, pending_rate_) ? 0 : 2); break;
    case 0x5e: answer(command, active_id_); break;
    default: break;
    }
    return true;
}

}  // namespace hal::canopen
