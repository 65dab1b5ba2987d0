// SPDX-License-Identifier: MIT
#include "dictionary.hpp"

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdio>

namespace hal::canopen {

namespace {

/// Stream of a domain without an application stream: the bytes lie in the dictionary.
class Memory final : public Stream {
public:
    Abort open_read(Entry& e, std::uint32_t& size) noexcept override {
        size = e.size;
        return Abort::none;
    }
    Abort read(Entry& e, std::uint32_t offset, std::span<std::uint8_t> buffer) noexcept override {
        // rewritten since the transfer began
        if (offset > e.size || buffer.size() > e.size - offset) return Abort::local_control;
        std::memcpy(buffer.data(), e.data + offset, buffer.size());
        return Abort::none;
    }
    Abort open_write(Entry& e, std::uint32_t size) noexcept override {
        if (size > e.capacity) return Abort::too_long;
        e.size = 0;
        return Abort::none;
    }
    Abort write(Entry& e, std::uint32_t offset,
                std::span<const std::uint8_t> bytes) noexcept override {
        if (offset > e.capacity || bytes.size() > e.capacity - offset) return Abort::too_long;
        if (!bytes.empty()) {
            std::memcpy(e.data + offset, bytes.data(), bytes.size());
        }
        e.size = offset + static_cast<std::uint32_t>(bytes.size());
        return Abort::none;
    }
    Abort close(Entry& e, bool writing, bool whole) noexcept override {
        if (writing && !whole) {
            e.size = 0;
        }
        return Abort::none;
    }
};
Memory own_memory;

namespace standard {
using enum Type;
/// The types of the sub-indices of an object: of the first ones, and of all others.
struct Layout {
    std::array<Type, 6> first;
    Type others;
};
constexpr Layout one_u8{{}, unsigned8};
constexpr Layout one_u16{{}, unsigned16};
constexpr Layout one_u32{{}, unsigned32};
constexpr Layout list_of_u32{{unsigned8}, unsigned32};
constexpr Layout sdo_parameter{{unsigned8, unsigned32, unsigned32}, unsigned8};
constexpr Layout pdo_communication{
    {unsigned8, unsigned32, unsigned8, unsigned16, unsigned8, unsigned16}, unsigned8};

/// The objects of this library whose type CiA 301 prescribes.
struct Row {
    std::uint16_t from, to;
    const Layout& layout;
};
constexpr Row rows[] = {
    {0x1000, 0x1000, one_u32},
    {0x1001, 0x1001, one_u8},
    {0x1002, 0x1002, one_u32},
    {0x1003, 0x1003, list_of_u32},
    {0x1005, 0x1007, one_u32},
    {0x100c, 0x100c, one_u16},
    {0x100d, 0x100d, one_u8},
    {0x1010, 0x1011, list_of_u32},
    {0x1012, 0x1012, one_u32},
    {0x1014, 0x1014, one_u32},
    {0x1015, 0x1015, one_u16},
    {0x1016, 0x1016, list_of_u32},
    {0x1017, 0x1017, one_u16},
    {0x1018, 0x1018, list_of_u32},
    {0x1019, 0x1019, one_u8},
    {0x1028, 0x1028, list_of_u32},
    {0x1029, 0x1029, one_u8},
    {0x1200, 0x12ff, sdo_parameter},
    {0x1400, 0x15ff, pdo_communication},
    {0x1600, 0x17ff, list_of_u32},
    {0x1800, 0x19ff, pdo_communication},
    {0x1a00, 0x1bff, list_of_u32},
    {0x1f80, 0x1f80, one_u32},
};

}  // namespace standard

/// Returns the type that CiA 301 prescribes for an object of this library; none: any type. A
/// description with another type is invalid.
Type standard_type(std::uint16_t index, std::uint8_t sub) noexcept {
    for (const auto& row : standard::rows) {
        if (index < row.from || index > row.to) continue;
        const auto& [first, others] = row.layout;
        return sub < first.size() && first[sub] != Type::none ? first[sub] : others;
    }
    return Type::none;
}

template <std::integral T>
Abort check_range(T value, T low, T high) noexcept {
    if (value > high) return Abort::too_high;
    return abort_if(value < low, Abort::too_low);
}

Abort check_range(const Entry& e, std::span<const std::uint8_t> bytes) noexcept {
    if (is_real(e.type)) {
        const double value = e.type == Type::real32 ? static_cast<double>(load<float>(bytes.data()))
                                                    : load<double>(bytes.data());
        // NaN is outside any range
        if (!(value <= std::bit_cast<double>(e.high))) return Abort::too_high;
        return abort_if(value < std::bit_cast<double>(e.low), Abort::too_low);
    }
    const auto value = cia301::integer_of(e.type, bytes);
    if (e.type == Type::unsigned64) {
        return check_range(static_cast<std::uint64_t>(value), static_cast<std::uint64_t>(e.low),
                           static_cast<std::uint64_t>(e.high));
    }
    return check_range(value, e.low, e.high);
}

}  // namespace

Dictionary::Dictionary(const Description& description, std::uint8_t node_id) : node_id_(node_id) {
    const auto key = [](const EntryDescription* e) {
        return std::uint32_t{e->index} << 8 | e->sub;
    };
    std::vector<const EntryDescription*> order;
    for (const auto& e : description.entries) {
        order.push_back(&e);
    }
    std::stable_sort(order.begin(), order.end(), [&](auto* a, auto* b) { return key(a) < key(b); });
    std::vector<const EntryDescription*> accepted;
    std::uint32_t total = 0;
    for (const auto* from : order) {
        if (!keys_.empty() && keys_.back() == key(from)) {
            report(*from, "duplicate description; the first one applies");
            continue;
        }
        const Entry e = make_entry(*from);
        if (e.type != Type::domain) {
            max_ = std::max<std::size_t>(max_, e.capacity);
        }
        keys_.push_back(key(from));
        accepted.push_back(from);
        entries_.push_back(e);
        images_.push_back({total, e.size, e.size});
        total += (e.capacity + 7U) & ~7U;
    }
    memory_.resize(total);
    for (std::size_t n = 0; n < entries_.size(); ++n) {
        Entry& e = entries_[n];
        e.data = memory_.data() + images_[n].offset;
        const auto& value = accepted[n]->value;
        if (!value.empty()) {
            std::memcpy(e.data, value.data(), std::min<std::size_t>(value.size(), e.capacity));
        }
    }
    defaults_ = power_on_ = memory_;
    for (auto& e : entries_) {
        apply_node_id(e);
    }
}

void Dictionary::report(const EntryDescription& e, const std::string& problem) {
    char address[40];
    std::snprintf(address, sizeof address, "object %04X sub-index %02X: ", e.index, e.sub);
    problems_.push_back(address + problem);
}

/// Returns the entry of a description, without its memory.
Entry Dictionary::make_entry(const EntryDescription& from) {
    Entry e;
    e.index = from.index;
    e.sub = from.sub;
    e.access = from.access;
    e.type = from.type;
    const auto standard = standard_type(e.index, e.sub);
    if (standard != Type::none && standard != e.type) {
        report(from, std::string("its type must be ") + to_string(standard));
        e.type = standard;
    }
    e.bits = static_cast<std::uint8_t>(bits_of(e.type));
    e.rpdo = from.rpdo;
    e.tpdo = from.tpdo;
    e.plus_node_id = from.plus_node_id;
    e.ranged = from.ranged && e.bits != 0;
    e.low = from.low;
    e.high = from.high;
    if (e.bits != 0) {
        e.capacity = e.size = bytes_of(e.type);
        if (!from.value.empty() && from.value.size() != e.size) {
            report(from, "the length of the value does not match its type");
        }
        return e;
    }
    e.size = static_cast<std::uint32_t>(from.value.size());
    e.capacity = std::max(from.capacity, e.size);
    if (e.type == Type::domain) {
        e.stream = &own_memory;
    }
    return e;
}

Entry* Dictionary::find(std::uint16_t index, std::uint8_t sub) noexcept {
    Abort why;
    return find(index, sub, why);
}

Entry* Dictionary::find(std::uint16_t index, std::uint8_t sub, Abort& why) noexcept {
    const auto wanted = std::uint32_t{index} << 8 | sub;
    const auto found = std::lower_bound(keys_.begin(), keys_.end(), wanted);
    if (found != keys_.end() && *found == wanted) {
        why = Abort::none;
        return &entries_[static_cast<std::size_t>(found - keys_.begin())];
    }
    const bool known = (found != keys_.end() && *found >> 8 == index) ||
                       (found != keys_.begin() && found[-1] >> 8 == index);
    why = known ? Abort::no_sub : Abort::no_object;
    return nullptr;
}

std::span<Entry> Dictionary::object(std::uint16_t index) noexcept {
    const auto first = std::lower_bound(keys_.begin(), keys_.end(), std::uint32_t{index} << 8);
    auto last = first;
    while (last != keys_.end() && *last >> 8 == index) {
        ++last;
    }
    return {entries_.data() + (first - keys_.begin()), static_cast<std::size_t>(last - first)};
}

Abort Dictionary::prepare_read(Entry& e) noexcept {
    if (!readable(e.access)) return Abort::write_only;
    return e.handler != nullptr ? e.handler->reading(e) : Abort::none;
}

Abort Dictionary::read(std::uint16_t index, std::uint8_t sub, std::span<std::uint8_t> buffer,
                       std::size_t& size) noexcept {
    size = 0;
    Abort why;
    Entry* e = find(index, sub, why);
    if (e == nullptr) return why;
    if (why = prepare_read(*e); why != Abort::none) return why;
    if (e->size > buffer.size()) return Abort::memory;
    size = e->size;
    if (size != 0) {
        std::memcpy(buffer.data(), e->data, size);
    }
    return Abort::none;
}

Abort Dictionary::check_length(const Entry& e, std::uint64_t size) noexcept {
    if (size > e.capacity) return Abort::too_long;
    return abort_if(e.bits != 0 && size < e.capacity, Abort::too_short);
}

Abort Dictionary::write(std::uint16_t index, std::uint8_t sub,
                        std::span<const std::uint8_t> value) noexcept {
    Abort why;
    Entry* e = find(index, sub, why);
    return e != nullptr ? write(*e, value) : why;
}

Abort Dictionary::write(Entry& e, std::span<const std::uint8_t> value) noexcept {
    if (!writable(e.access)) return Abort::read_only;
    if (const auto why = check_length(e, value.size()); why != Abort::none) return why;
    if (e.ranged) {
        if (const auto why = check_range(e, value); why != Abort::none) return why;
    }
    if (e.handler != nullptr) {
        if (const auto why = e.handler->writing(e, value); why != Abort::none) return why;
    }
    if (!value.empty()) {
        std::memcpy(e.data, value.data(), value.size());
    }
    e.size = static_cast<std::uint32_t>(value.size());
    if (e.handler != nullptr) {
        e.handler->written(e);
    }
    return Abort::none;
}

bool Dictionary::handle(std::uint16_t index, Handler& handler) noexcept {
    const auto all = object(index);
    for (auto& e : all) {
        e.handler = &handler;
    }
    return !all.empty();
}

bool Dictionary::stream(std::uint16_t index, std::uint8_t sub, Stream& stream) noexcept {
    Entry* e = find(index, sub);
    if (e == nullptr || e->type != Type::domain) return false;
    e->stream = &stream;
    return true;
}

void Dictionary::apply_node_id(Entry& e) noexcept {
    if (!e.plus_node_id || e.size == 0 || e.size > 4) return;
    std::uint32_t value = 0;
    std::memcpy(&value, e.data, e.size);
    value += node_id_ <= 127 ? node_id_ : 0;
    std::memcpy(e.data, &value, e.size);
}

void Dictionary::reset(std::uint16_t first, std::uint16_t last) noexcept {
    const auto begin = std::lower_bound(keys_.begin(), keys_.end(), std::uint32_t{first} << 8);
    for (auto n = static_cast<std::size_t>(begin - keys_.begin());
         n < entries_.size() && entries_[n].index <= last; ++n) {
        Entry& e = entries_[n];
        if (e.type == Type::domain) continue;
        e.size = images_[n].size;
        if (e.size != 0) {
            std::memcpy(e.data, power_on_.data() + images_[n].offset, e.size);
        }
        apply_node_id(e);
    }
}

void Dictionary::keep(std::uint16_t first, std::uint16_t last, bool to_defaults) noexcept {
    const auto begin = std::lower_bound(keys_.begin(), keys_.end(), std::uint32_t{first} << 8);
    for (auto n = static_cast<std::size_t>(begin - keys_.begin());
         n < entries_.size() && entries_[n].index <= last; ++n) {
        const Entry& e = entries_[n];
        if (e.type == Type::domain || !writable(e.access)) continue;
        images_[n].size = to_defaults ? images_[n].default_size : e.size;
        auto* stored = power_on_.data() + images_[n].offset;
        if (images_[n].size == 0) continue;
        std::memcpy(stored, to_defaults ? defaults_.data() + images_[n].offset : e.data,
                    images_[n].size);
        // stored without the node ID, which may be another at the next start
        if (!to_defaults && e.plus_node_id && e.size <= 4) {
            std::uint32_t value = 0;
            std::memcpy(&value, stored, e.size);
            value -= node_id_ <= 127 ? node_id_ : 0;
            std::memcpy(stored, &value, e.size);
        }
    }
}

}  // namespace hal::canopen
