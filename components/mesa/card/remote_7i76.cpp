// SPDX-License-Identifier: MIT
#include "remote_7i76.hpp"

#include "mesa/hostmot2/smart_serial.hpp"
#include "mesa/lbp16/bytes.hpp"

namespace hal::mesa {

namespace {

constexpr std::size_t tables_at = 0x40;  ///< the values are before it
constexpr std::size_t memory_size = 0x400;
constexpr std::uint16_t revision_at = 0x20;
constexpr std::uint8_t revision = 14;

using Type = smart_serial::RecordType;
using smart_serial::Direction;

struct Row {
    const char* name;
    std::uint8_t bits;
    Type type;
    Direction direction;
    float max;
    std::uint16_t address;
};
constexpr Row process[] = {
    {"Output", 16, Type::bits, Direction::out, 1, 0x10},
    {"SpinOut", 8, Type::unsigned_number, Direction::out, 100, 0x12},
    {"SpinEna", 1, Type::boolean, Direction::out, 1, 0x13},
    {"SpinDir", 1, Type::boolean, Direction::out, 1, 0x14},
    {"", 6, Type::pad, Direction::out, 0, 0x15},
    {"Input", 32, Type::bits, Direction::in, 1, 0x18},
};
constexpr Row globals[] = {
    {"SwRevision", 8, Type::unsigned_number, Direction::in, 255, revision_at},
};

std::vector<std::uint8_t> record_of(const Row& row) {
    smart_serial::Record record;
    record.bits = row.bits;
    record.type = row.type;
    record.direction = row.direction;
    record.max = row.max;
    record.address = row.address;
    record.name = row.name;
    return smart_serial::encode(record);
}

}  // namespace

Remote7i76::Remote7i76(std::uint32_t serial_number) : serial_number_(serial_number) {
    memory_.resize(tables_at);
    memory_[revision_at] = revision;
    const auto add = [&](std::vector<std::uint16_t>& table, std::vector<std::uint8_t> bytes) {
        table.push_back(static_cast<std::uint16_t>(memory_.size()));
        append(std::move(bytes));
    };
    std::vector<std::uint16_t> process_table;
    for (const Row& row : process) {
        add(process_table, record_of(row));
    }
    std::vector<std::uint16_t> global_table;
    for (const Row& row : globals) {
        add(global_table, record_of(row));
    }
    add(global_table, smart_serial::encode(smart_serial::ModeRecord{0, 1, "Standard"}));
    const std::uint16_t process_at = append_table(process_table);
    const std::uint16_t globals_at = append_table(global_table);
    tables_ = process_at | std::uint32_t{globals_at} << 16;
    memory_.resize(memory_size);
}

void Remote7i76::append(std::vector<std::uint8_t> bytes) {
    memory_.insert(memory_.end(), bytes.begin(), bytes.end());
}

std::uint16_t Remote7i76::append_table(const std::vector<std::uint16_t>& addresses) {
    const auto at = static_cast<std::uint16_t>(memory_.size());
    for (const std::uint16_t address : addresses) {
        append({static_cast<std::uint8_t>(address), static_cast<std::uint8_t>(address >> 8)});
    }
    append({0, 0});
    return at;
}

void Remote7i76::serve(std::uint32_t request, std::span<std::uint32_t> user,
                       std::span<const std::uint32_t> written) noexcept {
    const std::uint32_t code = request >> 24 & ~8U;  // with and without bit 3
    const std::size_t address = request & 0xffffU;
    const std::size_t count = std::size_t{1} << (code & 3U);
    if (address + count > memory_.size()) return;
    if ((code & ~3U) == smart_serial::remote::read) {
        user[0] = 0;
        for (std::size_t n = 0; n < count; ++n) {
            const std::uint32_t byte = memory_[address + n];
            user[n / 4] = n % 4 == 0 ? byte : user[n / 4] | byte << 8 * (n % 4);
        }
    } else if ((code & ~3U) == smart_serial::remote::write) {
        for (std::size_t n = 0; n < count; ++n) {
            memory_[address + n] = static_cast<std::uint8_t>(written[n / 4] >> 8 * (n % 4));
        }
    }
}

void Remote7i76::exchange(std::span<std::uint32_t> in, std::span<const std::uint32_t> out,
                          std::int64_t now_ns) noexcept {
    outputs_ = static_cast<std::uint16_t>(smart_serial::take_bits(out, 0, 16));
    speed_ = static_cast<std::uint8_t>(smart_serial::take_bits(out, 16, 8));
    is_enabled_ = smart_serial::take_bits(out, 24, 1) != 0;
    is_reverse_ = smart_serial::take_bits(out, 25, 1) != 0;
    in[0] = inputs;
    exchanged_ns_ = now_ns;
}

void Remote7i76::watch(std::int64_t now_ns) noexcept {
    if (now_ns - exchanged_ns_ <= watchdog_ns) return;
    outputs_ = 0;
    is_enabled_ = false;
}

double Remote7i76::spindle() const noexcept { return is_enabled_ ? speed_ / 255.0 : 0.0; }

}  // namespace hal::mesa
