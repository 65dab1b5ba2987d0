// SPDX-License-Identifier: MIT
#include "slave.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <utility>

#include "text/quoting.hpp"

namespace hal::modbus {

namespace {

Pdu exception(std::uint8_t function, std::uint8_t code) {
    Pdu pdu;
    pdu.add8(function | exception_flag);
    pdu.add8(code);
    return pdu;
}

Pdu echo(std::span<const std::uint8_t> request) {
    Pdu pdu;
    for (const std::uint8_t byte : request.first(5)) {
        pdu.add8(byte);
    }
    return pdu;
}

/// Returns the numbers that the registers of a value can have, in its unit; 53 of 64 bits.
std::pair<double, double> range_of(const Value& v) {
    if (v.is_bit() || v.mask != 0) return {0.0, 1.0};
    double min = 0.0;
    double max = 0.0;
    if (bus::is_real(v.type)) {
        max = v.type == bus::ValueType::f32 ? std::numeric_limits<float>::max()
                                            : std::numeric_limits<double>::max();
        min = -max;
    } else {
        const int bits = std::min(16 * static_cast<int>(v.size()), 53);
        max = std::ldexp(1.0, bits - (bus::is_signed(v.type) ? 1 : 0)) - 1.0;
        min = bus::is_signed(v.type) ? -max - 1.0 : 0.0;
    }
    const double one = min * v.scale + v.offset;
    const double other = max * v.scale + v.offset;
    return {std::min(one, other), std::max(one, other)};
}

/// Returns a bound of a range with as few digits as it needs to be accepted; whole ones with all.
template <class IsWithin>
std::string bound_text(double bound, IsWithin is_within) {
    constexpr double exact = 9007199254740992.0;  // 2^53
    char text[32];
    std::snprintf(text, sizeof text, "%.10g", bound);
    const bool is_whole = std::trunc(bound) == bound && std::fabs(bound) < exact;
    if (is_whole || !is_within(std::strtod(text, nullptr))) {
        std::snprintf(text, sizeof text, "%.17g", bound);
    }
    return text;
}

}  // namespace

EmulatedSlave::EmulatedSlave(const Slave& config) : config_(config) {
    for (const Value& value : config.values) {
        create(value.table, value.address, value.size());
    }
    for (const Write& write : config.stop) {
        create(write.table, write.address, 1);
    }
    if (!config.drive) return;
    const Drive& d = *config.drive;
    for (const auto* list : {&d.forward, &d.reverse, &d.stop, &d.reset}) {
        for (const Write& write : *list) {
            create(write.table, write.address, d.one_telegram ? 32 : 1);
        }
    }
    create(d.speed.table, d.speed.address, d.one_telegram ? 16 : 1);
    drive_.emplace();
    drive_->max_speed_rpm = d.max_speed_rpm;
}

void EmulatedSlave::create(Table table, unsigned address, unsigned count) {
    for (unsigned n = 0; n < count; ++n) {
        registers_.try_emplace(key(table, address + n), std::uint16_t{0});
    }
}

std::optional<std::uint16_t> EmulatedSlave::get(Table table, std::uint16_t address) const {
    const auto at = registers_.find(key(table, address));
    if (at == registers_.end()) return std::nullopt;
    return at->second;
}

bool EmulatedSlave::set(std::string_view name, double value) {
    for (const Value& one : config_.values) {
        if (one.name == name && one.purpose == Purpose::pin) {
            put(one, value);
            return true;
        }
    }
    return false;
}

std::string EmulatedSlave::problem_of(std::string_view name, double value) const {
    const auto v = std::find_if(config_.values.begin(), config_.values.end(),
                                [&](const Value& one) { return one.name == name; });
    if (v == config_.values.end()) return "unknown value; " + settable_values();
    if (v->is_output) return "the master writes it; " + settable_values();
    if (v->purpose != Purpose::pin) {
        return "the model of the drive writes it; " + settable_values();
    }
    const auto [min, max] = range_of(*v);
    if (value >= min && value <= max) return {};
    const auto is_within = [&](double number) { return number >= min && number <= max; };
    return "out of range; write " + bound_text(min, is_within) + ".." + bound_text(max, is_within);
}

std::string EmulatedSlave::settable_values() const {
    std::string names;
    for (const Value& v : config_.values) {
        if (!v.is_output && v.purpose == Purpose::pin) {
            append_item(names, v.name);
        }
    }
    return names.empty() ? "this slave has no value that can be set"
                         : "values that can be set are " + names;
}

/// Stores a number in the registers of a value; numbers of 64 bits keep 53 of them.
void EmulatedSlave::put(const Value& v, double number) {
    if (std::isnan(number)) return;  // the register keeps its value
    if (v.mask != 0 && !is_bits(v.table)) {
        std::uint16_t& word = registers_[key(v.table, v.address)];
        const auto lowest = static_cast<std::uint16_t>(v.mask & (~v.mask + 1U));
        const auto cleared = static_cast<std::uint16_t>(word & ~v.mask);
        word = number != 0 ? static_cast<std::uint16_t>(cleared | lowest) : cleared;
        return;
    }
    const double counts = (number - v.offset) / v.scale;
    if (is_bits(v.table)) {
        const auto bits = static_cast<std::uint32_t>(std::clamp(std::round(counts), 0.0, 65535.0));
        const std::uint32_t pattern = v.mask > 1 && number != 0 ? v.mask & (~v.mask + 1U) : bits;
        for (unsigned n = 0; n < v.size(); ++n) {
            registers_[key(v.table, v.address + n)] = static_cast<std::uint16_t>(pattern >> n & 1U);
        }
        return;
    }
    std::uint64_t bits = 0;
    if (v.type == bus::ValueType::f32) {
        bits = std::bit_cast<std::uint32_t>(static_cast<float>(counts));
    } else if (v.type == bus::ValueType::f64) {
        bits = std::bit_cast<std::uint64_t>(counts);
    } else {
        constexpr double exact = 9007199254740992.0;  // 2^53: a double has all whole numbers below
        const int width = 16 * static_cast<int>(v.size()) - (bus::is_signed(v.type) ? 1 : 0);
        const double limit = std::min(std::ldexp(1.0, width) - 1, exact);
        const double low = bus::is_signed(v.type) ? -limit - 1 : 0.0;
        bits = static_cast<std::uint64_t>(
            static_cast<std::int64_t>(std::clamp(std::round(counts), low, limit)));
    }
    for (unsigned n = 0; n < v.size(); ++n) {
        const bool low_first = v.order == Order::cdab || v.order == Order::dcba;
        const unsigned shift = low_first ? n : v.size() - 1U - n;
        auto word = static_cast<std::uint16_t>(bits >> 16 * shift);
        if (v.order == Order::badc || v.order == Order::dcba) {
            word = static_cast<std::uint16_t>(word << 8 | word >> 8);
        }
        registers_[key(v.table, v.address + n)] = word;
    }
}

void EmulatedSlave::advance(std::int64_t now_ns) {
    if (!drive_) return;
    drive_->advance(now_ns);
    for (const Value& v : config_.values) {
        switch (v.purpose) {
        case Purpose::pin: break;
        case Purpose::speed: put(v, std::fabs(drive_->speed_rpm)); break;
        case Purpose::load: put(v, drive_->load_percent); break;
        case Purpose::running: put(v, drive_->direction != 0 ? 1 : 0); break;
        case Purpose::fault: put(v, drive_->is_tripped ? 1 : 0); break;
        }
    }
}

Pdu EmulatedSlave::answer(std::span<const std::uint8_t> request) {
    if (is_huanyang()) return answer_huanyang(request);
    if (request.size() < 5) return exception(request.empty() ? 0 : request[0], 3);
    switch (request[0]) {
    case 0x01: return read(request, Table::coil);
    case 0x02: return read(request, Table::discrete);
    case 0x03: return read(request, Table::holding);
    case 0x04: return read(request, Table::input);
    case 0x05: return write_one(request, Table::coil);
    case 0x06: return write_one(request, Table::holding);
    case 0x0f: return write_many(request, Table::coil);
    case 0x10: return write_many(request, Table::holding);
    default: return exception(request[0], 1);
    }
}

Pdu EmulatedSlave::read(std::span<const std::uint8_t> request, Table table) {
    const unsigned address = word_at(request, 1);
    const unsigned count = word_at(request, 3);
    const unsigned max = is_bits(table) ? max_read_bits : max_read_registers;
    if (count == 0 || count > max || request.size() != 5) return exception(request[0], 3);
    // a device has its registers in blocks: a gap of a few belongs to the block
    if (!registers_.contains(key(table, address)) ||
        !registers_.contains(key(table, address + count - 1))) {
        return exception(request[0], 2);
    }
    Pdu pdu;
    pdu.add8(request[0]);
    pdu.add8(is_bits(table) ? (count + 7) / 8 : count * 2);
    unsigned eight = 0;
    for (unsigned n = 0; n < count; ++n) {
        const auto at = registers_.find(key(table, address + n));
        const unsigned value = at == registers_.end() ? 0U : at->second;
        if (!is_bits(table)) {
            pdu.add16(value);
            continue;
        }
        eight |= (value & 1U) << n % 8;
        if (n % 8 == 7 || n + 1 == count) {
            pdu.add8(eight);
            eight = 0;
        }
    }
    return pdu;
}

Pdu EmulatedSlave::write_one(std::span<const std::uint8_t> request, Table table) {
    const unsigned address = word_at(request, 1);
    unsigned value = word_at(request, 3);
    if (request.size() != 5) return exception(request[0], 3);
    if (!registers_.contains(key(table, address))) return exception(request[0], 2);
    if (table == Table::coil) {
        if (value != 0 && value != 0xff00) return exception(request[0], 3);
        value = value != 0 ? 1 : 0;
    }
    written(table, address, value);
    return echo(request);
}

Pdu EmulatedSlave::write_many(std::span<const std::uint8_t> request, Table table) {
    const unsigned address = word_at(request, 1);
    const unsigned count = word_at(request, 3);
    const bool bits = is_bits(table);
    const std::size_t bytes = bits ? (count + 7) / 8 : count * 2U;
    const unsigned max = bits ? max_write_bits : max_write_registers;
    if (count == 0 || count > max || request.size() != 6 + bytes || request[5] != bytes) {
        return exception(request[0], 3);
    }
    for (unsigned n = 0; n < count; ++n) {
        if (!registers_.contains(key(table, address + n))) return exception(request[0], 2);
    }
    if (bits && config_.drive && config_.drive->one_telegram && count == 32) {
        const unsigned command = request[6] | request[7] << 8U;
        const unsigned reference = request[8] | request[9] << 8U;
        drive_->set_point_rpm =
            drive_->max_speed_rpm * reference / std::max<unsigned>(1, config_.drive->speed.value);
        written(table, address, command);
    }
    for (unsigned n = 0; n < count; ++n) {
        if (bits) {
            registers_[key(table, address + n)] = request[6 + n / 8] >> n % 8 & 1U;
        } else {
            written(table, address + n, word_at(request, 6 + 2 * n));
        }
    }
    return echo(request);
}

/// Function 03 commands, 05 sets the frequency, 04 reads by an index.
Pdu EmulatedSlave::answer_huanyang(std::span<const std::uint8_t> request) {
    Pdu pdu;
    if (request.size() < 3 || request.size() != request[1] + 2U) return pdu;
    if (request[0] == 0x03) {
        written(Table::huanyang, 0x03, request[2]);
        // run and running; reverse sets bits 2 and 5 as well (bit 1 is the jog)
        const unsigned running = drive_->direction > 0 ? 0x09 : 0x2d;
        const std::uint8_t status[] = {
            static_cast<std::uint8_t>(drive_->direction == 0 ? 0 : running)};
        return huanyang_request(0x03, status);
    }
    if (request[0] == 0x05 && request.size() == 4) {
        written(Table::huanyang, 0x05, word_at(request, 2));
        return huanyang_request(0x05, request.subspan(2));
    }
    if (request[0] == 0x04) {
        const std::uint16_t value = get(Table::huanyang, request[2]).value_or(0);
        const std::uint8_t data[] = {request[2], static_cast<std::uint8_t>(value >> 8),
                                     static_cast<std::uint8_t>(value)};
        return huanyang_request(0x04, data);
    }
    return pdu;
}

bool EmulatedSlave::holds(const Write& write) const {
    const auto at = registers_.find(key(write.table, write.address));
    return at != registers_.end() && at->second == write.value;
}

/// A command is given when one of its writes arrives and the others hold.
void EmulatedSlave::follow(const std::vector<Write>& writes, const Write& last, int direction,
                           bool& matched) {
    const auto same = [&](const Write& w) {
        return w.table == last.table && w.address == last.address && w.value == last.value;
    };
    if (matched || std::none_of(writes.begin(), writes.end(), same)) return;
    const auto is_given = [&](const Write& w) { return same(w) || holds(w); };
    if (!std::all_of(writes.begin(), writes.end(), is_given)) return;
    drive_->direction = direction;
    matched = true;
}

void EmulatedSlave::written(Table table, unsigned address, unsigned value) {
    registers_[key(table, address)] = static_cast<std::uint16_t>(value);
    if (!drive_) return;
    const Drive& d = *config_.drive;
    const Write last{table, static_cast<std::uint16_t>(address), static_cast<std::uint16_t>(value)};
    bool matched = false;
    follow(d.stop, last, 0, matched);
    follow(d.forward, last, 1, matched);
    follow(d.reverse, last, -1, matched);
    if (!matched) {
        const int before = drive_->direction;
        follow(d.reset, last, before, matched);
        if (matched) {
            drive_->is_tripped = false;
        }
    }
    if (!d.one_telegram && table == d.speed.table && address == d.speed.address) {
        drive_->set_point_rpm = d.max_speed_rpm * value / std::max<unsigned>(1, d.speed.value);
    }
}

}  // namespace hal::modbus
