// SPDX-License-Identifier: MIT
#include "smart_serial.hpp"

#include <algorithm>
#include <bit>

#include "mesa/lbp16/bytes.hpp"

namespace hal::mesa::smart_serial {

namespace {

constexpr std::size_t max_name = 48;
constexpr std::size_t record_head = 14;
constexpr std::size_t mode_head = 4;

void append(std::vector<std::uint8_t>& bytes, const std::string& text) {
    bytes.insert(bytes.end(), text.begin(), text.end());
    bytes.push_back(0);
}
template <class T>
void append_number(std::vector<std::uint8_t>& bytes, T value) {
    const std::size_t at = bytes.size();
    bytes.resize(at + sizeof value);
    store(bytes.data() + at, value);
}

/// Takes a terminated text off the front of the bytes.
std::optional<std::string> take_text(std::span<const std::uint8_t>& bytes) {
    const std::size_t limit = std::min(bytes.size(), max_name + 1);
    const auto end = std::find(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(limit),
                               std::uint8_t{0});
    const auto length = static_cast<std::size_t>(end - bytes.begin());
    if (length == limit) return {};
    std::string text(bytes.begin(), end);
    bytes = bytes.subspan(length + 1);
    return text;
}

}  // namespace

std::vector<std::uint8_t> encode(const Record& record) {
    std::vector<std::uint8_t> bytes{Record::mark, record.bits,
                                    static_cast<std::uint8_t>(record.type),
                                    static_cast<std::uint8_t>(record.direction)};
    append_number(bytes, std::bit_cast<std::uint32_t>(record.min));
    append_number(bytes, std::bit_cast<std::uint32_t>(record.max));
    append_number(bytes, record.address);
    append(bytes, record.unit);
    append(bytes, record.name);
    return bytes;
}

std::vector<std::uint8_t> encode(const ModeRecord& record) {
    std::vector<std::uint8_t> bytes{ModeRecord::mark, record.index, record.type, 0};
    append(bytes, record.name);
    return bytes;
}

std::optional<Record> decode_record(std::span<const std::uint8_t> bytes) {
    if (bytes.size() < record_head || bytes[0] != Record::mark) return {};
    Record record;
    record.bits = bytes[1];
    record.type = static_cast<RecordType>(bytes[2]);
    record.direction = static_cast<Direction>(bytes[3]);
    record.min = std::bit_cast<float>(load<std::uint32_t>(bytes.data() + 4));
    record.max = std::bit_cast<float>(load<std::uint32_t>(bytes.data() + 8));
    record.address = load<std::uint16_t>(bytes.data() + 12);
    bytes = bytes.subspan(record_head);
    auto unit = take_text(bytes);
    if (!unit) return {};
    auto name = take_text(bytes);
    if (!name) return {};
    record.unit = std::move(*unit);
    record.name = std::move(*name);
    return record;
}

std::optional<ModeRecord> decode_mode(std::span<const std::uint8_t> bytes) {
    if (bytes.size() < mode_head || bytes[0] != ModeRecord::mark) return {};
    ModeRecord record;
    record.index = bytes[1];
    record.type = bytes[2];
    bytes = bytes.subspan(mode_head);
    auto name = take_text(bytes);
    if (!name) return {};
    record.name = std::move(*name);
    return record;
}

std::uint64_t take_bits(std::span<const std::uint32_t> words, unsigned offset,
                        unsigned count) noexcept {
    std::uint64_t value = 0;
    for (unsigned n = 0; n < count; ++n) {
        const unsigned bit = offset + n;
        if (bit / 32 >= words.size()) break;
        value |= std::uint64_t{words[bit / 32] >> bit % 32 & 1U} << n;
    }
    return value;
}

void put_bits(std::span<std::uint32_t> words, unsigned offset, unsigned count,
              std::uint64_t value) noexcept {
    for (unsigned n = 0; n < count; ++n) {
        const unsigned bit = offset + n;
        if (bit / 32 >= words.size()) break;
        const std::uint32_t mask = 1U << bit % 32;
        std::uint32_t& word = words[bit / 32];
        word = (value >> n & 1U) != 0 ? word | mask : word & ~mask;
    }
}

}  // namespace hal::mesa::smart_serial
