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

/// Vendor and product exactly, revision and serial number between a low and a high bound.
bool LssSlave::is_in_bound(unsigned step, std::uint32_t value) const noexcept {
    switch (step) {
    case 0: return identity_[0] == value;
    case 1: return identity_[1] == value;
    case 2: return identity_[2] >= value;
    case 3: return identity_[2] <= value;
    case 4: return identity_[3] >= value;
    default: return identity_[3] <= value;
    }
}

void LssSlave::identify(unsigned step, std::uint32_t value) noexcept {
    if (step == 0) {
        identified_ = 0;
    }
    const bool fits = is_in_bound(step, value);
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
    if (configuring_ || !is_unconfigured()) return;
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

/// Returns whether the slave has no node ID and was not given one.
bool LssSlave::is_unconfigured() const noexcept {
    return active_id_ == unconfigured && pending_id_ == unconfigured;
}

/// `mode`: 0 waiting, 1 configuration state.
void LssSlave::switch_global(std::uint8_t mode) noexcept {
    const bool got_its_first_id = active_id_ == unconfigured && pending_id_ != unconfigured;
    if (configuring_ && mode == 0 && got_its_first_id) {
        wants_reset_ = true;
    }
    configuring_ = mode == 1;
}

void LssSlave::configure_node_id(std::uint8_t id) noexcept {
    const bool good = (id >= 1 && id <= 127) || id == unconfigured;
    if (good) {
        pending_id_ = id;
    }
    answer(0x11, good ? 0 : 1);
}

void LssSlave::activate_bit_timing(std::uint16_t delay_ms) noexcept {
    if (pending_rate_ != 0) {
        events_.on_lss_activate(pending_rate_, delay_ms * millisecond);
    }
}

bool LssSlave::handle(const Frame& f) noexcept {
    if (f.id != lss_master_to_slave || f.extended || f.remote) return false;
    if (f.length == 8 && !handle_in_any_state(f) && configuring_) {
        handle_configuration(f);
    }
    return true;
}

/// The services that a slave executes in both LSS states. Returns false for another service.
bool LssSlave::handle_in_any_state(const Frame& f) noexcept {
    const auto command = f.data[0];
    const auto value = load<std::uint32_t>(f.data.data() + 1);
    if (command >= 0x40 && command <= 0x43) {
        select(command - 0x40U, value);
        return true;
    }
    if (command >= 0x46 && command <= 0x4b) {
        identify(command - 0x46U, value);
        return true;
    }
    switch (command) {
    case 0x04: switch_global(f.data[1]); return true;
    case 0x4c:
        if (is_unconfigured()) {
            answer(0x50);
        }
        return true;
    case 0x51: fastscan(f); return true;
    default: return false;
    }
}

/// The services of the LSS configuration state.
void LssSlave::handle_configuration(const Frame& f) noexcept {
    const auto command = f.data[0];
    switch (command) {
    case 0x11: return configure_node_id(f.data[1]);
    case 0x13: return configure_bit_timing(f);
    case 0x15: return activate_bit_timing(load<std::uint16_t>(f.data.data() + 1));
    case 0x17: return answer(0x17, events_.on_lss_store(pending_id_, pending_rate_) ? 0 : 2);
    case 0x5e: return answer(command, active_id_);
    default: break;
    }
    if (command >= 0x5a && command <= 0x5d) {
        answer(command, identity_[command - 0x5aU]);
    }
}

}  // namespace hal::canopen
