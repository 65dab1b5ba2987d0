// SPDX-License-Identifier: MIT
#include "analog_input.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace hal::canopen {

namespace {

constexpr std::uint32_t zero_command = 0x6f72657a;
constexpr std::uint32_t tare_command = 0x65726174;  // "zero", "tare"
constexpr std::uint8_t field_part = 0x00;
constexpr std::uint8_t fv1_part = 0x20;
constexpr std::uint8_t pv1_part = 0x21;
constexpr std::uint8_t fv2_part = 0x22;

constexpr std::uint8_t pv2_part = 0x23;
constexpr std::uint8_t offset_part = 0x24;
constexpr std::uint8_t factor_part = 0x26;

constexpr std::uint8_t scaling_offset_part = 0x27;
constexpr std::uint8_t process_part = 0x30;
constexpr std::uint8_t delta_part = 0x33;

constexpr std::uint8_t lower_part = 0x34;
constexpr std::uint8_t upper_part = 0x35;
constexpr std::uint8_t tare_part = 0x38;
constexpr std::uint8_t net_part = 0x40;
constexpr std::uint16_t sensor_type = 0x6110;
constexpr std::uint16_t mode = 0x6112;
constexpr std::uint16_t rate = 0x6114;
constexpr std::uint16_t autozero = 0x6125;

constexpr std::uint16_t unit = 0x6131;
constexpr std::uint16_t digits = 0x6132;
constexpr std::uint16_t autotare = 0x6139;
constexpr std::uint16_t status_index = 0x6150;
constexpr double powers[] = {1, 10, 100, 1e3, 1e4, 1e5, 1e6};

struct Part {
    const char* name;
    std::uint8_t part;
    bool written, whole;  ///< by SDO; in the families of whole numbers, too
};
constexpr Part parts[] = {
    {"field value", field_part, false, true},
    {"scaling 1 field value", fv1_part, true, true},
    {"scaling 1 process value", pv1_part, true, true},
    {"scaling 2 field value", fv2_part, true, true},
    {"scaling 2 process value", pv2_part, true, true},
    {"offset", offset_part, true, true},
    {"scaling factor", factor_part, true, false},
    {"scaling offset", scaling_offset_part, true, false},
    {"process value", process_part, false, true},
    {"interrupt delta", delta_part, true, true},
    {"interrupt lower limit", lower_part, true, true},
    {"interrupt upper limit", upper_part, true, true},
    {"tare zero", tare_part, true, true},
    {"net value", net_part, false, true},
};

struct Family {
    std::uint16_t base;
    Type type;
    const char* name;
};
constexpr Family families[] = {{0x6100, Type::real32, " float"},
                               {0x7100, Type::integer16, " 16-bit"},
                               {0x8100, Type::integer24, " 24-bit"},
                               {0x9100, Type::integer32, " 32-bit"}};

struct Common {
    const char* name;
    std::uint16_t index;
    Type type;
    Access access;
};
constexpr Common common[] = {
    {"AI sensor type", sensor_type, Type::unsigned16, Access::read_write},
    {"AI operating mode", mode, Type::unsigned8, Access::read_write},
    {"AI ADC sample rate", rate, Type::unsigned32, Access::read_write},
    {"AI autozero", autozero, Type::unsigned32, Access::write_only},
    {"AI physical unit process value", unit, Type::unsigned32, Access::read_write},
    {"AI decimal digits", digits, Type::unsigned8, Access::read_write},
    {"AI autotare", autotare, Type::unsigned32, Access::write_only},
    {"AI status", status_index, Type::unsigned8, Access::read_only},
};

double power(std::uint8_t n) noexcept { return powers[std::min<unsigned>(n, 6)]; }

std::int32_t cut(double value, unsigned bits) noexcept {
    const double max = static_cast<double>((std::int64_t{1} << (bits - 1)) - 1);
    return std::isnan(value)
               ? 0
               : static_cast<std::int32_t>(std::llround(std::clamp(value, -max - 1, max)));
}

/// Returns the initial value of an object that all channels have.
std::uint32_t initial_value(std::uint16_t index, const AnalogChannel& c) {
    switch (index) {
    case sensor_type: return c.sensor_type;
    case mode: return 1;
    case unit: return c.unit;
    case digits: return c.digits;
    default: return 0;
    }
}

/// Returns where a value is: -1 below the lower limit, 1 above the upper one, 0 between. Limits
/// that are equal are off.
std::int8_t zone_of(double value, double lower, double upper) noexcept {
    if (!(lower < upper)) return 0;
    if (value < lower) return -1;
    return value > upper ? std::int8_t{1} : std::int8_t{0};
}

}  // namespace

void add_analog_inputs(Description& d, std::span<const AnalogChannel> channels) {
    const auto count = static_cast<std::uint8_t>(channels.size());
    for (const auto& family : families) {
        for (const auto& part : parts) {
            if (!part.whole && family.type != Type::real32) continue;
            const auto index = static_cast<std::uint16_t>(family.base + part.part);
            d.objects[index] = std::string("AI ") + part.name + family.name;
            d.add(index, 0, Type::unsigned8, Access::constant, count, "Highest sub-index");
            const auto access = part.written ? Access::read_write : Access::read_only;
            const bool one =
                part.part == fv2_part || part.part == pv2_part || part.part == factor_part;
            for (std::uint8_t n = 1; n <= count; ++n) {
                const std::string& name = channels[n - 1U].name;
                const double initial = one ? 1.0 : 0.0;
                auto& e = family.type == Type::real32
                              ? d.add_real(index, n, family.type, access, initial, name)
                              : d.add(index, n, family.type, access, 0, name);
                e.tpdo = !part.written;
            }
        }
    }
    for (const auto& row : common) {
        d.objects[row.index] = row.name;
        d.add(row.index, 0, Type::unsigned8, Access::constant, count, "Highest sub-index");
        for (std::uint8_t n = 1; n <= count; ++n) {
            const auto& c = channels[n - 1U];
            const std::uint32_t value = initial_value(row.index, c);
            auto& e = d.add(row.index, n, row.type, row.access, value, c.name);
            if (row.index == digits) {
                e.limited(0, 6);
            }
            e.tpdo = row.index == status_index;
        }
    }
}

void AnalogInputs::attach(Device& device, unsigned channels) {
    channels_.assign(channels, {});
    auto& dictionary = device.dictionary();
    for (unsigned n = 0; n < channels; ++n) {
        auto& c = channels_[n];
        const auto sub = static_cast<std::uint8_t>(n + 1);
        for (const auto& part : parts) {
            dictionary.bind(static_cast<std::uint16_t>(0x6100 + part.part), sub,
                            *value(c, part.part));
        }
        dictionary.bind(mode, sub, c.mode);
        dictionary.bind(rate, sub, c.period_us);

        dictionary.bind(digits, sub, c.digits);
        dictionary.bind(status_index, sub, c.status);
    }
    for (const auto& family : families) {
        for (const auto& part : parts) {
            dictionary.handle(static_cast<std::uint16_t>(family.base + part.part), *this);
        }
    }
    for (const auto& row : common) {
        dictionary.handle(row.index, *this);
    }
}

float* AnalogInputs::value(Channel& c, std::uint8_t part) noexcept {
    struct Row {
        std::uint8_t part;
        float Channel::* value;
    };
    static constexpr Row rows[] = {
        {field_part, &Channel::field_shown}, {fv1_part, &Channel::fv1},
        {pv1_part, &Channel::pv1},           {fv2_part, &Channel::fv2},
        {pv2_part, &Channel::pv2},           {offset_part, &Channel::offset},
        {factor_part, &Channel::factor},     {scaling_offset_part, &Channel::scaling_offset},
        {process_part, &Channel::process},   {delta_part, &Channel::delta},
        {lower_part, &Channel::lower},       {upper_part, &Channel::upper},
        {tare_part, &Channel::tare},
    };
    const auto* const row = std::ranges::find(rows, part, &Row::part);
    return &(c.*(row != std::end(rows) ? row->value : &Channel::net_shown));
}

void AnalogInputs::reset() noexcept {
    for (auto& c : channels_) {
        c.sampled = c.changed = false;
        c.sent = 0;
        c.sent_zone = 0;
    }
}

double AnalogInputs::process(unsigned n) const noexcept {
    const auto& c = channels_[n];
    return c.field * double{c.factor} + double{c.scaling_offset} + double{c.offset};
}

void AnalogInputs::show(unsigned n) noexcept {
    auto& c = channels_[n];
    c.field_shown = static_cast<float>(c.field);
    c.process = static_cast<float>(process(n));
    c.net_shown = static_cast<float>(net(n));
}

void AnalogInputs::sample(unsigned n, double field, std::int32_t counts, std::uint8_t status,
                          Time now) noexcept {
    auto& c = channels_[n];
    if (c.mode == 0) {
        c.status = not_valid;
        return;
    }
    if (c.sampled && c.period_us != 0 && now - c.last < c.period_us * microsecond) return;
    c.sampled = true;
    c.last = now;
    c.field = field;
    c.counts = counts;
    c.status = status;
    show(n);
    const double value = process(n);
    const double delta = c.delta;
    c.zone = zone_of(value, double{c.lower}, double{c.upper});
    // Compared in units of the last displayed digit, so that noise below it is not a change.
    const double scale = power(c.digits);
    const double moved = std::abs(std::round(value * scale) - std::round(c.sent * scale));
    c.changed = c.changed || c.zone != c.sent_zone || moved > std::round(delta * scale);
}

void AnalogInputs::mark_sent(unsigned n) noexcept {
    auto& c = channels_[n];
    c.changed = false;
    c.sent = process(n);
    c.sent_zone = c.zone;
}

/// Returns a part of a channel in units of its last displayed digit; the field value in counts.
double AnalogInputs::displayed(unsigned n, std::uint8_t part) noexcept {
    auto& c = channels_[n];
    switch (part) {
    case field_part: return c.counts;
    case process_part: return process(n) * power(c.digits);
    case net_part: return net(n) * power(c.digits);
    default: return double{*value(c, part)} * power(c.digits);
    }
}

Abort AnalogInputs::reading(Entry& e) noexcept {
    const unsigned n = e.sub - 1U;
    if (e.sub == 0 || n >= channels_.size()) return Abort::none;
    if (e.index < 0x7000) {
        show(n);
        return Abort::none;
    }
    const std::int32_t whole = cut(displayed(n, static_cast<std::uint8_t>(e.index)), e.bits);
    std::memcpy(e.data, &whole, e.size);
    return Abort::none;
}

Abort AnalogInputs::writing(Entry& e, std::span<const std::uint8_t> value) noexcept {
    if (e.sub == 0) return Abort::none;
    if (e.index == autozero) {
        return load<std::uint32_t>(value.data()) == zero_command ? Abort::none
                                                                 : Abort::cannot_store;
    }
    if (e.index == autotare) {
        return load<std::uint32_t>(value.data()) == tare_command ? Abort::none
                                                                 : Abort::cannot_store;
    }
    if (e.index == mode) return value[0] <= 1 ? Abort::none : Abort::value;
    if (e.type == Type::real32 && !std::isfinite(load<float>(value.data()))) return Abort::value;
    // The most significant bit of all four types is the sign.
    if (static_cast<std::uint8_t>(e.index) == delta_part && (value.back() & 0x80) != 0) {
        return Abort::too_low;
    }
    return Abort::none;
}

void AnalogInputs::written(Entry& e) noexcept {
    const unsigned n = e.sub - 1U;
    if (e.sub == 0 || n >= channels_.size()) return;
    auto& c = channels_[n];
    if (e.index == autozero) return void(c.offset -= static_cast<float>(process(n)));
    if (e.index == autotare) return void(c.tare = static_cast<float>(process(n)));
    const auto part = static_cast<std::uint8_t>(e.index);
    if (e.index >= 0x7000) {
        std::int32_t whole = 0;
        std::memcpy(&whole, e.data, e.size);
        const unsigned unused = 32U - 8U * e.size;
        whole = static_cast<std::int32_t>(static_cast<std::uint32_t>(whole) << unused) >> unused;
        *value(c, part) = static_cast<float>(whole / power(c.digits));
    }
    if (part >= fv1_part && part <= pv2_part && c.fv1 != c.fv2) {  // the line through two points
        c.factor = (c.pv2 - c.pv1) / (c.fv2 - c.fv1);
        c.scaling_offset = c.pv1 - c.fv1 * c.factor;
    } else if (part == factor_part || part == scaling_offset_part) {
        c.pv1 = c.fv1 * c.factor + c.scaling_offset;
        c.pv2 = c.fv2 * c.factor + c.scaling_offset;
    }
}

}  // namespace hal::canopen
