// SPDX-License-Identifier: MIT
#include "jr3.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <utility>

namespace hal::canopen {

namespace {
constexpr Time silence = 10 * millisecond;             // without a packet: no sensor
constexpr Time max_at_once = 100 * millisecond;  // bits of the line older than this are lost
constexpr double overload_over_below = 0.95;  // of the limit
constexpr std::int16_t supply_low = 22937;
constexpr std::int16_t supply_high = 26214;  // 70 % and 80 %; nominal 75 %

template <class T>
T rounded(double value) noexcept {
    constexpr double low = std::numeric_limits<T>::min();
    constexpr double high = std::numeric_limits<T>::max();
    return std::isnan(value) ? T{0} : static_cast<T>(std::llround(std::clamp(value, low, high)));
}
}  // namespace

Jr3::Jr3(Jr3Settings settings)
    : settings_(std::move(settings)), calibration_(settings_.calibration) {
    if (!settings_.calibration.invert(inverse_)) {
        throw std::invalid_argument("singular decoupling matrix in the calibration");
    }
    settings_.calibration.write(sensor_memory_);
    sensor_.set_memory(sensor_memory_);
}

void Jr3::attach(Device& device) {
    Program::attach(device);
    auto& dictionary = device.dictionary();
    inputs_.attach(device, 6);
    for (std::uint8_t sub = 1; sub <= 6; ++sub) {
        dictionary.bind(0x2103, sub, limits_[sub - 1U]);
    }
    dictionary.bind(0x2200, 0, supply_raw_);
    dictionary.bind(0x2201, 0, status_);

    dictionary.bind(0x2202, 0, counter_);
    dictionary.stream(0x2104, 0, memory_stream_);
    watch(0x2203);
    watch(0x2204);
}

void Jr3::on_reset(bool application) noexcept {
    if (!application) return;
    decoder_.reset();
    status_ = jr3_status::no_signal | jr3_status::not_calibrated;
    calibrated_ = false;
    heard_ = last_;
    inputs_.reset();
}

// The sensor.

void Jr3::drive_sensor() noexcept {
    const auto raw = settings_.calibration.raw(applied_, inverse_);
    for (unsigned n = 0; n < 6; ++n) {
        int off = 0;
        const bool saturated = raw[n] == 32767 || raw[n] == -32768;
        if (noise_ != 0 && !saturated) {  // xorshift
            random_ ^= random_ << 13;
            random_ ^= random_ >> 17;
            random_ ^= random_ << 5;
            off = static_cast<int>(random_ % (2 * noise_ + 1)) - static_cast<int>(noise_);
        }
        sensor_.set(jr3::first_force + n,
                    static_cast<std::int16_t>(std::clamp(raw[n] + off, -32768, 32767)));
    }
    sensor_.set(jr3::supply_address, rounded<std::int16_t>(supply_ * 32768.0));
}

void Jr3::sample(Time now) noexcept {
    if (!started_) {
        started_ = true;
        last_ = heard_ = began_ = now;
    }
    const Time passed = std::clamp<Time>(now - last_, 0, max_at_once);
    last_ = now;
    clocks_ += static_cast<double>(passed) * 1e-9 * jr3::clock_hz;
    const auto due = static_cast<unsigned>(clocks_);
    clocks_ -= due;
    const std::size_t recorded = settings_.recording.size() * 8;
    if (recorded == 0) {
        drive_sensor();
    }
    for (unsigned n = 0; n < due; ++n) {
        bool line;
        if (recorded == 0) {
            line = sensor_.next();
        } else {
            line = (settings_.recording[recorded_bit_ / 8] >> (7 - recorded_bit_ % 8) & 1) != 0;
            if (++recorded_bit_ == recorded) {
                recorded_bit_ = 0;
            }
        }
        if (decoder_.take(line && cable_)) {
            take(decoder_.packet());
        }
    }
}

void Jr3::take(const jr3::Packet& p) noexcept {
    heard_ = last_;
    if (p.address == jr3::supply_address) {
        supply_raw_ = p.value;
    } else if (p.address < jr3::calibration_address) {
        raw_[p.address - jr3::first_force] = p.value;
    } else if (p.address == jr3::calibration_address &&
               memory_reader_.take(static_cast<std::uint16_t>(p.value))) {
        calibrated_ = calibration_.read(memory_reader_.memory());
        alarm(jr3_status::not_calibrated, !calibrated_, jr3_error::calibration, 0);
        if (calibrated_) {
            show_calibration();
        }
    }
}

// The node.

void Jr3::show_calibration() noexcept {
    auto& dictionary = device_->dictionary();
    for (unsigned n = 0; n < 36; ++n) {
        dictionary.set(0x2100, static_cast<std::uint8_t>(n + 1),
                       static_cast<float>(calibration_.matrix[n / 6][n % 6]));
    }
    for (unsigned n = 0; n < 6; ++n) {
        dictionary.set(0x2101, static_cast<std::uint8_t>(n + 1),
                       static_cast<float>(calibration_.full_scale[n]));
        dictionary.set(0x2102, static_cast<std::uint8_t>(n + 1),
                       static_cast<float>(calibration_.overload[n]));
    }
    dictionary.set(0x2105, 0, calibration_.serial);
}

void Jr3::alarm(std::uint8_t bit, bool on, std::uint16_t code, std::uint8_t about) noexcept {
    const bool was = device_->emcy().active(code);
    status_ = static_cast<std::uint8_t>(on ? status_ | bit : status_ & ~bit);
    if (on && !was) {
        device_->emcy().raise(code, bit == jr3_status::supply ? error_voltage : error_profile,
                              {about});
    } else if (!on && was) {
        device_->emcy().clear(code);
    }
}

void Jr3::supervise(Time now) noexcept {
    const bool silent = now - heard_ >= silence;
    alarm(jr3_status::no_signal, silent, jr3_error::no_signal, 0);
    if (silent || decoder_.packets() < 2 * jr3::addresses) return;
    alarm(jr3_status::supply, supply_raw_ < supply_low || supply_raw_ > supply_high,
          jr3_error::supply, 0);
    std::uint8_t over = 0;
    bool saturated = false;
    const double until = (status_ & jr3_status::overload) != 0 ? overload_over_below : 1.0;
    for (unsigned n = 0; n < 6; ++n) {
        const bool full = raw_[n] == 32767 || raw_[n] == -32768;
        saturated = saturated || full;
        if (full || std::abs(field_[n]) > static_cast<double>(limits_[n]) * until) {
            over = static_cast<std::uint8_t>(over | 1U << n);
        }
    }
    status_ = static_cast<std::uint8_t>(saturated ? status_ | jr3_status::saturated
                                                  : status_ & ~jr3_status::saturated);
    alarm(jr3_status::overload, over != 0, jr3_error::overload, over);
}

void Jr3::publish() noexcept {
    field_ = calibration_.wrench(raw_);
    const bool silent = (status_ & jr3_status::no_signal) != 0;
    for (unsigned n = 0; n < 6; ++n) {
        const bool over = raw_[n] == 32767 || raw_[n] == -32768 ||
                          std::abs(field_[n]) > static_cast<double>(limits_[n]);
        unsigned status = 0;
        if (silent) {
            status |= AnalogInputs::not_valid;
        }
        if (over) {
            status |= field_[n] > 0 ? AnalogInputs::too_high : AnalogInputs::too_low;
        }
        inputs_.sample(n, field_[n], raw_[n], static_cast<std::uint8_t>(status), last_);
    }
    ++counter_;
}

/// Triggers the PDO of the forces or torques when one of its three values has moved by more than
/// its delta or passed a limit.
void Jr3::trigger_changes() noexcept {
    for (unsigned group = 0; group < 2; ++group) {
        bool changed = status_ != sent_status_;
        for (unsigned n = group * 3; n < group * 3 + 3; ++n) {
            changed = changed || inputs_.changed(n);
        }
        if (!changed) continue;
        for (unsigned n = group * 3; n < group * 3 + 3; ++n) {
            inputs_.mark_sent(n);
        }
        device_->pdos().trigger(group * 2 + 1);
        device_->pdos().trigger(group * 2 + 2);
    }
    sent_status_ = status_;
}

void Jr3::step(Time now) noexcept {
    sample(now);
    publish();
    supervise(now);
    trigger_changes();
    const auto state = device_->state();
    led_ = state == NmtState::operational ||
           (state == NmtState::pre_operational && (now - began_) / (200 * millisecond) % 2 == 0);
}

Abort Jr3::reading(Entry& e) noexcept {
    if (e.index == 0x2203) {
        store(e.data, decoder_.packets());
    } else if (e.index == 0x2204) {
        store(e.data, decoder_.errors());
    }
    return Abort::none;
}

Abort Jr3::Memory::open_read(Entry&, std::uint32_t& size) noexcept {
    if (!node_.calibrated_) return Abort::no_data;
    size = jr3::memory_size;
    return Abort::none;
}

Abort Jr3::Memory::read(Entry&, std::uint32_t offset, std::span<std::uint8_t> buffer) noexcept {
    const auto memory = node_.memory_reader_.memory();
    if (offset > memory.size() || buffer.size() > memory.size() - offset)
        return Abort::local_control;
    std::copy_n(memory.begin() + offset, buffer.size(), buffer.begin());
    return Abort::none;
}

// The simulated environment, by name.

bool Jr3::set(std::string_view name, double value) {
    constexpr std::string_view names[] = {"fx", "fy", "fz", "mx", "my", "mz"};
    for (unsigned n = 0; n < 6; ++n) {
        if (name == names[n]) {
            applied_[n] = value;
            return true;
        }
    }
    if (name == "supply") {
        set_supply(value);
        return true;
    }
    if (name == "noise") {
        set_noise(value >= 0 && value < 10000 ? static_cast<unsigned>(value) : 0);
        return true;
    }
    if (name == "cable") {
        set_cable(value != 0.0);
        return true;
    }
    return false;
}

std::vector<std::string> Jr3::settable() const {
    return {"fx", "fy", "fz", "mx", "my", "mz", "supply", "noise", "cable"};
}

std::string Jr3::news() const {
    constexpr std::pair<std::uint8_t, const char*> words[] = {
        {jr3_status::no_signal, "no signal"},
        {jr3_status::supply, "supply voltage wrong"},
        {jr3_status::overload, "overload"}};
    std::string text = calibrated_ ? "calibrated" : "not calibrated yet";
    for (const auto& [bit, word] : words) {
        if ((status_ & bit) != 0) {
            text += std::string(", ") + word;
        }
    }
    return text;
}

std::string Jr3::summary() const {
    char text[160];
    std::snprintf(
        text, sizeof text, ", F %.2f %.2f %.2f N, M %.3f %.3f %.3f N*m, %u packets, %u errors",
        field_[0], field_[1], field_[2], field_[3], field_[4], field_[5],
        static_cast<unsigned>(decoder_.packets()), static_cast<unsigned>(decoder_.errors()));
    return news() + text;
}

}  // namespace hal::canopen
