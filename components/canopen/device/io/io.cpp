// SPDX-License-Identifier: MIT
#include "io.hpp"

#include <algorithm>
#include <cmath>

#include "text/numbers.hpp"

namespace hal::canopen {

namespace {
std::int16_t counts_of(double value) noexcept {
    return std::isnan(value)
               ? std::int16_t{0}
               : static_cast<std::int16_t>(std::lround(std::clamp(value, -32768.0, 32767.0)));
}
constexpr std::int32_t justified(std::int16_t counts) noexcept {
    return std::int32_t{counts} * 65536;
}
}  // namespace

Io::Io(const IoSettings& settings) : settings_(settings) {}

/// Binds the values of an object to `image`, `each` bytes apart, and keeps them.
void Io::lay(std::uint16_t index, void* image, std::size_t each) {
    for (auto& e : device_->dictionary().object(index)) {
        if (e.sub == 0 && device_->dictionary().object(index).size() > 1) continue;
        auto* place = static_cast<std::uint8_t*>(image) + each * (e.sub == 0 ? 0 : e.sub - 1U);
        std::copy_n(e.data, e.size, place);
        e.data = place;
    }
}

void Io::attach(Device& device) {
    Program::attach(device);
    const std::pair<std::uint16_t, Block*> blocks[] = {
        {0x6000, &inputs_},      {0x6002, &input_polarity_},  {0x6003, &filter_},
        {0x6006, &any_change_},  {0x6007, &rising_},          {0x6008, &falling_},
        {0x6200, &outputs_},     {0x6202, &output_polarity_}, {0x6206, &error_mode_},
        {0x6207, &error_value_}, {0x6208, &output_mask_},
    };
    for (const auto& [index, block] : blocks) {
        lay(index, block->data(), 1);
    }
    lay(0x6100, inputs_.data(), 2);
    lay(0x6120, inputs_.data(), 4);
    lay(0x6300, outputs_.data(), 2);
    lay(0x6320, outputs_.data(), 4);
    lay(0x6005, &interrupts_on_, 1);
    lay(0x6423, &analog_interrupts_on_, 1);

    lay(0x2000, &filter_ms_, 2);
    lay(0x6401, analog_in_.data(), 2);
    lay(0x6411, analog_out_.data(), 2);
    lay(0x6421, triggers_.data(), 1);
    lay(0x6443, analog_error_mode_.data(), 1);
    lay(0x6424, upper_.data(), 4);
    lay(0x6425, lower_.data(), 4);

    lay(0x6444, error_analog_.data(), 4);
    lay(0x6426, delta_.data(), 4);
    lay(0x6427, negative_delta_.data(), 4);

    lay(0x6428, positive_delta_.data(), 4);
    for (const int index : {0x6020, 0x6220, 0x6200, 0x6202, 0x6208, 0x6300, 0x6320, 0x6400, 0x6402,
                            0x6403, 0x6410, 0x6411, 0x6412, 0x6413, 0x6422, 0x6445}) {
        watch(static_cast<std::uint16_t>(index));
    }
    drive_outputs();
}

void Io::on_reset(bool application) noexcept {
    if (!application) return;
    safe_ = false;
    filtered_ = terminals_in_;
    interrupted_ = 0;
    drive_outputs();
}

// Inputs.

void Io::set_input(unsigned n, bool on) noexcept {
    if (n >= settings_.digital_inputs) return;
    const auto bit = static_cast<std::uint8_t>(1U << n % 8);
    auto& block = terminals_in_[n / 8];
    block = static_cast<std::uint8_t>(on ? block | bit : block & ~bit);
}

void Io::set_analog_input(unsigned n, double fraction) noexcept {
    if (n < settings_.analog_inputs) {
        analog_terminals_[n] = counts_of(fraction * 32767.0);
    }
}

void Io::sample(Time now) noexcept {
    sample_digital(now);
    sample_analog();
}

void Io::trigger(std::uint16_t index, std::size_t sub) noexcept {
    if (const auto* e = device_->dictionary().find(index, static_cast<std::uint8_t>(sub));
        e != nullptr) {
        device_->pdos().trigger(*e);
    }
}

void Io::sample_digital(Time now) noexcept {
    const Time filter_time = filter_ms_ * millisecond;
    for (unsigned block = 0; block < (settings_.digital_inputs + 7) / 8; ++block) {
        const auto differs = static_cast<std::uint8_t>(terminals_in_[block] ^ filtered_[block]);
        auto taken = static_cast<std::uint8_t>(differs & ~filter_[block]);
        for (unsigned bit = 0; bit < 8 && (filter_[block] != 0); ++bit) {
            auto& since = differs_since_[block * 8 + bit];
            if ((differs >> bit & 1) == 0) {
                since = now;  // unchanged so far
            } else if ((filter_[block] >> bit & 1) != 0 && now - since >= filter_time) {
                taken = static_cast<std::uint8_t>(taken | 1U << bit);
            }
        }
        filtered_[block] ^= taken;
        const auto is = static_cast<std::uint8_t>(filtered_[block] ^ input_polarity_[block]);

        const auto was = inputs_[block];
        const auto changed = static_cast<std::uint8_t>(is ^ was);
        if (changed == 0) continue;
        inputs_[block] = is;
        const auto asks = static_cast<std::uint8_t>((changed & any_change_[block]) |
                                                    (changed & is & rising_[block]) |
                                                    (changed & was & falling_[block]));
        if (interrupts_on_ == 0 || asks == 0) continue;
        trigger(0x6000, block + 1);
        trigger(0x6100, block / 2 + 1);
        trigger(0x6120, block / 4 + 1);
        for (unsigned bit = 0; bit < 8; ++bit) {
            if ((asks >> bit & 1) != 0) {
                trigger(0x6020, block * 8 + bit + 1);
            }
        }
    }
}

/// Limits that are met send every change that no delta holds back; a delta alone needs no limit.
bool Io::interrupts(unsigned n, std::int32_t value) const noexcept {
    constexpr unsigned upper = 1, lower = 2, delta = 4, negative_delta = 8, positive_delta = 16;
    constexpr unsigned limits = upper | lower;
    constexpr unsigned deltas = delta | negative_delta | positive_delta;
    const unsigned selected = triggers_[n];
    const auto change = std::int64_t{value} - sent_[n];
    if (change == 0 || selected == 0) return false;
    unsigned met = 0;
    met |= value >= upper_[n] ? upper : 0;
    met |= value < lower_[n] ? lower : 0;
    met |= std::abs(change) > std::int64_t{delta_[n]} ? delta : 0;
    met |= -change > std::int64_t{negative_delta_[n]} ? negative_delta : 0;
    met |= change > std::int64_t{positive_delta_[n]} ? positive_delta : 0;
    met &= selected;
    const bool by_limit = (selected & limits) == 0 || (met & limits) != 0;
    const bool by_delta = (selected & deltas) == 0 || (met & deltas) != 0;
    return by_limit && by_delta;
}

void Io::sample_analog() noexcept {
    for (unsigned n = 0; n < settings_.analog_inputs; ++n) {
        analog_in_[n] = analog_terminals_[n];
        const auto value = justified(analog_in_[n]);
        if (analog_interrupts_on_ == 0 || !interrupts(n, value)) continue;
        sent_[n] = value;
        interrupted_ |= 1U << n;
        for (const std::uint16_t view : {std::uint16_t{0x6400}, std::uint16_t{0x6401},
                                         std::uint16_t{0x6402}, std::uint16_t{0x6403}}) {
            trigger(view, n + 1U);
        }
        trigger(0x6422, 1);
    }
}

Abort Io::reading(Entry& e) noexcept {
    if (e.sub == 0) return Abort::none;
    const unsigned n = e.sub - 1U;
    auto& dictionary = device_->dictionary();
    switch (e.index) {
    case 0x6020: *e.data = inputs_[n / 8] >> n % 8 & 1; break;
    case 0x6220: *e.data = outputs_[n / 8] >> n % 8 & 1; break;
    case 0x6400: *e.data = static_cast<std::uint8_t>(analog_in_[n] >> 8); break;
    case 0x6402: store(e.data, justified(analog_in_[n])); break;
    case 0x6403:
        store(e.data,
              static_cast<float>(analog_in_[n]) * dictionary.get<float>(0x642f, e.sub, 1.0F) +
                  dictionary.get<float>(0x642e, e.sub));
        break;
    case 0x6422:
        store(e.data, interrupted_);
        interrupted_ = 0;  // cleared by reading
        break;
    default: break;
    }
    return Abort::none;
}

// Outputs.

void Io::written(Entry& e) noexcept {
    if (e.sub == 0) return;
    const unsigned n = e.sub - 1U;
    auto& dictionary = device_->dictionary();
    if (e.index != 0x6202 && e.index != 0x6208 && e.index != 0x6445) {
        safe_ = false;
    }
    switch (e.index) {
    case 0x6220: {
        const auto bit = static_cast<std::uint8_t>(1U << n % 8);
        auto& block = outputs_[n / 8];
        block = static_cast<std::uint8_t>(*e.data != 0 ? block | bit : block & ~bit);
        return drive_outputs();
    }
    case 0x6410:
        analog_out_[n] = static_cast<std::int16_t>(static_cast<std::int8_t>(*e.data) * 256);
        break;
    case 0x6412:
        analog_out_[n] = static_cast<std::int16_t>(load<std::int32_t>(e.data) >> 16);
        break;
    case 0x6413:
        analog_out_[n] = counts_of(double{load<float>(e.data)} *
                                       double{dictionary.get<float>(0x6442, e.sub, 1.0F)} +
                                   double{dictionary.get<float>(0x6441, e.sub)});
        break;
    case 0x6445:
        error_analog_[n] = justified(counts_of(
            double{load<float>(e.data)} * double{dictionary.get<float>(0x6442, e.sub, 1.0F)} +
            double{dictionary.get<float>(0x6441, e.sub)}));
        return;
    case 0x6411: break;
    default: return drive_outputs();
    }
    if (auto* view = dictionary.find(0x6410, e.sub); view != nullptr) {
        *view->data = static_cast<std::uint8_t>(analog_out_[n] >> 8);
    }
    if (auto* view = dictionary.find(0x6412, e.sub); view != nullptr && view != &e) {
        store(view->data, justified(analog_out_[n]));
    }
}

void Io::drive_outputs() noexcept {
    for (unsigned block = 0; block < bytes; ++block) {
        const auto wanted = static_cast<std::uint8_t>(outputs_[block] ^ output_polarity_[block]);

        const auto mask = output_mask_[block];
        terminals_out_[block] =
            static_cast<std::uint8_t>((terminals_out_[block] & ~mask) | (wanted & mask));
    }
}

void Io::take_error_values() noexcept {
    for (unsigned block = 0; block < bytes; ++block) {
        outputs_[block] = static_cast<std::uint8_t>((outputs_[block] & ~error_mode_[block]) |
                                                    (error_value_[block] & error_mode_[block]));
    }
    drive_outputs();
    for (unsigned n = 0; n < settings_.analog_outputs; ++n) {
        if (analog_error_mode_[n] == 1) {
            analog_out_[n] = static_cast<std::int16_t>(error_analog_[n] >> 16);
        }
    }
    safe_ = true;
}

// The simulated environment, by name.

bool Io::set(std::string_view name, double value) {
    const auto place = [&](std::string_view before, unsigned count, unsigned& n) {
        if (!name.starts_with(before)) return false;
        return parse_whole(name.substr(before.size()), n) && n < count;
    };
    unsigned n = 0;
    if (place("in-", settings_.digital_inputs, n)) {
        set_input(n, value != 0.0);
        return true;
    }
    if (place("analog-in-", settings_.analog_inputs, n)) {
        set_analog_input(n, value / 10.0);
        return true;
    }
    return false;
}

std::vector<std::string> Io::settable() const {
    std::vector<std::string> names;
    for (unsigned n = 0; n < settings_.digital_inputs; ++n) {
        names.push_back("in-" + std::to_string(n));
    }
    for (unsigned n = 0; n < settings_.analog_inputs; ++n) {
        names.push_back("analog-in-" + std::to_string(n));
    }
    return names;
}

std::string Io::summary() const {
    std::string text = "outputs ";
    for (unsigned n = 0; n < settings_.digital_outputs; ++n) {
        text += output(n) ? '1' : '0';
    }
    if (settings_.digital_outputs == 0) {
        text += "none";
    }
    return text + (safe_ ? ", at their error values" : "");
}

}  // namespace hal::canopen
