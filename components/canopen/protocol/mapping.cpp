// SPDX-License-Identifier: MIT
#include "mapping.hpp"

#include <algorithm>

namespace hal::canopen {

namespace {
constexpr std::uint16_t index_of(std::uint32_t entry) noexcept {
    return static_cast<std::uint16_t>(entry >> 16);
}
constexpr std::uint8_t sub_of(std::uint32_t entry) noexcept {
    return static_cast<std::uint8_t>(entry >> 8);
}
constexpr unsigned bits_in(std::uint32_t entry) noexcept { return entry & 0xff; }
constexpr bool is_dummy(std::uint32_t entry) noexcept {
    return index_of(entry) <= 0x1b && sub_of(entry) == 0 &&
           bits_of(static_cast<Type>(index_of(entry))) != 0;
}
}  // namespace

Mapping::Mapping(std::size_t capacity) : capacity_(std::min<std::size_t>(capacity, 64)) {
    items_.reserve(capacity_);
}

/// Returns whether `bits` bits of the object may be mapped.
static bool fits(const Entry& e, unsigned bits) noexcept {
    if (bits == 0 || bits > 64) return false;
    if (e.type == Type::boolean) return bits == 1 || bits == 8;
    if (e.bits == 0) return bits % 8 == 0 && bits / 8 <= e.capacity && e.type != Type::domain;
    // The low bits of an integer may be mapped; a REAL only completely.
    return bits == e.bits || (bits < e.bits && !is_real(e.type));
}

Abort Mapping::check(Dictionary& dictionary, std::uint32_t entry, bool received) noexcept {
    const auto bits = bits_in(entry);
    if (is_dummy(entry)) {
        if (!received) return Abort::not_mappable;
        return abort_if(bits != bits_of(static_cast<Type>(index_of(entry))), Abort::pdo_length);
    }
    Abort why;
    const Entry* e = dictionary.find(index_of(entry), sub_of(entry), why);
    if (e == nullptr) return why;
    const bool into_object = e->rpdo && writable(e->access);
    const bool from_object = e->tpdo && readable(e->access);
    if (!(received ? into_object : from_object)) return Abort::not_mappable;
    return abort_if(!fits(*e, bits), Abort::pdo_length);
}

Abort Mapping::build(Dictionary& dictionary, std::span<const std::uint32_t> entries,
                     bool received) noexcept {
    if (entries.size() > capacity_) return Abort::pdo_length;
    unsigned total = 0;
    for (const auto entry : entries) {
        if (const auto why = check(dictionary, entry, received); why != Abort::none) return why;
        total += bits_in(entry);
    }
    if (total > 64) return Abort::pdo_length;
    items_.clear();
    bits_ = 0;
    for (const auto entry : entries) {
        auto* e = is_dummy(entry) ? nullptr : dictionary.find(index_of(entry), sub_of(entry));
        items_.push_back(
            {e, static_cast<std::uint8_t>(bits_), static_cast<std::uint8_t>(bits_in(entry))});
        bits_ += bits_in(entry);
    }
    return Abort::none;
}

bool Mapping::maps(const Entry& e) const noexcept {
    return std::any_of(items_.begin(), items_.end(),
                       [&](const Item& item) { return item.entry == &e; });
}

std::uint64_t Mapping::pack() const noexcept {
    std::uint64_t frame = 0;
    for (const auto& item : items_) {
        if (item.entry == nullptr) continue;
        if (item.entry->handler != nullptr) {
            item.entry->handler->reading(*item.entry);
        }
        std::uint64_t value = 0;
        std::memcpy(&value, item.entry->data, std::min<std::size_t>(item.entry->size, 8));
        frame |= (value & ones(item.bits)) << item.first;
    }
    return frame;
}

void Mapping::unpack(std::uint64_t frame) const noexcept {
    for (const auto& item : items_) {
        if (item.entry == nullptr) continue;
        Entry& e = *item.entry;
        std::uint64_t value = frame >> item.first & ones(item.bits);
        if (is_signed(e.type) && item.bits < 64 && (value >> (item.bits - 1) & 1) != 0) {
            value |= ~ones(item.bits);
        }
        if (e.type == Type::boolean) {
            value = value != 0 ? 1 : 0;
        }
        if (e.bits == 0) {
            e.size = item.bits / 8U;
        }
        std::memcpy(e.data, &value, std::min<std::size_t>(e.size, 8));
    }
    for (const auto& item : items_) {
        if (item.entry != nullptr && item.entry->handler != nullptr) {
            item.entry->handler->written(*item.entry);
        }
    }
}

}  // namespace hal::canopen
