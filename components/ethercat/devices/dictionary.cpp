// SPDX-License-Identifier: MIT
#include "ethercat/devices/dictionary.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "cia301/values.hpp"
#include "ethercat/devices/bits.hpp"

namespace hal::ethercat::devices {
namespace {

/// Returns the bit of an access right in a state; `right` is coe::access::read_preop or
/// write_preop.
std::uint16_t in_state(std::uint16_t right, State state) noexcept {
    switch (state) {
    case State::op: return static_cast<std::uint16_t>(right << 2);
    case State::safeop: return static_cast<std::uint16_t>(right << 1);
    default: return right;
    }
}

/// The access rights of a service, and the reply when an entry never has them.
struct Service {
    std::uint16_t right;
    std::uint16_t right_in_preop;
    coe::Abort refusal;
};
constexpr Service read_service{coe::access::read, coe::access::read_preop, coe::Abort::write_only};
constexpr Service write_service{coe::access::write, coe::access::write_preop,
                                coe::Abort::read_only};

/// Returns why a service cannot access an entry in a state; none: it can.
coe::Abort check_access(const DictionaryEntry* e, const Service& service, State state) noexcept {
    if (e == nullptr) return coe::Abort::no_sub;
    if ((e->access & service.right) == 0) return service.refusal;
    const bool is_allowed = (e->access & in_state(service.right_in_preop, state)) != 0;
    return is_allowed ? coe::Abort::none : coe::Abort::device_state;
}

/// Returns the bits of a basic type; 0 for texts and unknown types.
std::uint16_t bits_of(std::uint16_t type) noexcept {
    return static_cast<std::uint16_t>(cia301::bits_of(static_cast<cia301::Type>(type)));
}

/// Formats an address: "0x6099:1".
std::string text_of(std::uint16_t index, std::uint8_t sub) {
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "0x%04X:%u", unsigned{index}, unsigned{sub});
    return text.data();
}

}  // namespace

DictionaryEntry& Dictionary::add(DictionaryObject& o, std::uint8_t sub, std::string name,
                                 std::uint16_t type, std::size_t bits, std::uint16_t access) {
    DictionaryEntry e;
    e.sub = sub;
    e.type = type;
    e.bits = static_cast<std::uint16_t>(bits);
    e.access = access;

    e.name = std::move(name);
    e.offset = static_cast<std::uint32_t>(memory_.size());
    memory_.resize(memory_.size() + (e.bytes() + 7) / 8 * 8);
    o.entries.push_back(std::move(e));
    return o.entries.back();
}

void Dictionary::variable(std::uint16_t index, std::string name, std::uint16_t type,
                          std::uint16_t access, std::uint64_t initial) {
    DictionaryObject& o = objects_.emplace_back();
    o.index = index;
    o.type = type;
    o.code = coe::ObjectCode::variable;
    o.name = name;
    const auto& e = add(o, 0, std::move(name), type, bits_of(type), access);
    std::memcpy(memory_.data() + e.offset, &initial, e.bytes());
}

void Dictionary::text(std::uint16_t index, std::string name, std::string_view initial,
                      std::uint16_t access) {
    DictionaryObject& o = objects_.emplace_back();
    o.index = index;
    o.type = coe::type::visible_string;
    o.code = coe::ObjectCode::variable;

    o.name = name;
    const auto& e =
        add(o, 0, std::move(name), coe::type::visible_string, initial.size() * 8, access);
    std::memcpy(memory_.data() + e.offset, initial.data(), initial.size());
}

void Dictionary::bytes(std::uint16_t index, std::string name, std::size_t bytes,
                       std::uint16_t access) {
    DictionaryObject& o = objects_.emplace_back();
    o.index = index;
    o.type = coe::type::octet_string;
    o.code = coe::ObjectCode::variable;

    o.name = name;
    add(o, 0, std::move(name), coe::type::octet_string, bytes * 8, access);
}

void Dictionary::record(std::uint16_t index, std::string name, std::uint8_t count,
                        coe::ObjectCode code, std::uint16_t sub0_access, std::uint16_t type) {
    DictionaryObject& o = objects_.emplace_back();
    o.index = index;
    o.type = type;
    o.code = code;
    o.name = std::move(name);
    const auto& e = add(o, 0, "Number of entries", coe::type::u8, 8, sub0_access);
    memory_[e.offset] = count;
}

void Dictionary::sub(std::uint8_t sub, std::string name, std::uint16_t type, std::uint16_t access,
                     std::uint64_t initial) {
    const auto& e = add(objects_.back(), sub, std::move(name), type, bits_of(type), access);
    std::memcpy(memory_.data() + e.offset, &initial, e.bytes());
    if (objects_.back().type == 0) {
        objects_.back().type = type;
    }
}

void Dictionary::object(std::uint16_t index, std::string name, coe::ObjectCode code,
                        std::uint16_t type) {
    DictionaryObject& o = objects_.emplace_back();
    o.index = index;
    o.type = type;
    o.code = code;
    o.name = std::move(name);
}

void Dictionary::entry(std::uint8_t sub, std::string name, std::uint16_t type, std::uint16_t bits,
                       std::uint16_t access, std::span<const std::uint8_t> initial) {
    const auto& e = add(objects_.back(), sub, std::move(name), type, bits, access);
    std::copy_n(initial.begin(), std::min(initial.size(), e.bytes()), memory_.begin() + e.offset);
}

void Dictionary::limit(std::int64_t low, std::int64_t high) {
    auto& e = objects_.back().entries.back();
    e.limited = true;
    e.low = low;
    e.high = high;
}

void Dictionary::finish() {
    std::stable_sort(objects_.begin(), objects_.end(),
                     [](const auto& a, const auto& b) { return a.index < b.index; });
    initial_ = memory_;
}

void Dictionary::bind(std::uint16_t index, std::uint8_t sub, std::uint8_t* value,
                      std::size_t bytes) {
    const auto at = std::find_if(objects_.begin(), objects_.end(),
                                 [&](const DictionaryObject& o) { return o.index == index; });
    if (at != objects_.end()) {
        for (DictionaryEntry& e : at->entries) {
            if (e.sub == sub && e.bytes() == bytes) {
                e.bound = value;
                return;
            }
        }
    }
    throw std::logic_error("cannot bind a value of " + std::to_string(bytes) + " bytes to object " +
                           text_of(index, sub) +
                           ": no entry of this size; add one before finish()");
}

void Dictionary::power_on() noexcept {
    std::copy(initial_.begin(), initial_.end(), memory_.begin());
    for (const DictionaryObject& o : objects_) {
        for (const DictionaryEntry& e : o.entries) {
            if (e.bound != nullptr) {
                std::memcpy(e.bound, initial_.data() + e.offset, e.bytes());
            }
        }
    }
}

const DictionaryObject* Dictionary::find(std::uint16_t index) const noexcept {
    const auto at = std::lower_bound(objects_.begin(), objects_.end(), index,
                                     [](const auto& o, std::uint16_t i) { return o.index < i; });
    return at != objects_.end() && at->index == index ? &*at : nullptr;
}

const DictionaryEntry* Dictionary::find(std::uint16_t index, std::uint8_t sub) const noexcept {
    if (const auto* o = find(index)) {
        for (const auto& e : o->entries) {
            if (e.sub == sub) return &e;
        }
    }
    return nullptr;
}

std::uint8_t* Dictionary::at(std::uint16_t index, std::uint8_t sub) noexcept {
    const auto* e = find(index, sub);
    return e != nullptr ? data(*e) : nullptr;
}

coe::Abort Dictionary::read(std::uint16_t index, std::uint8_t sub, bool complete, State state,
                            std::span<std::uint8_t> to, std::size_t& length) const noexcept {
    length = 0;
    const auto* o = find(index);
    if (o == nullptr) return coe::Abort::no_object;
    if (complete && o->code != coe::ObjectCode::variable) {
        return read_complete(*o, sub, state, to, length);
    }
    const auto* e = find(index, sub);
    const coe::Abort refusal = check_access(e, read_service, state);
    if (refusal != coe::Abort::none) return refusal;
    if (e->bytes() > to.size()) return coe::Abort::memory;
    length = e->bytes();
    std::memcpy(to.data(), data(*e), length);
    return coe::Abort::none;
}

coe::Abort Dictionary::read_complete(const DictionaryObject& o, std::uint8_t sub, State state,
                                     std::span<std::uint8_t> to,
                                     std::size_t& length) const noexcept {
    if (sub > 1) return coe::Abort::no_complete_access;
    const std::uint16_t right = in_state(coe::access::read_preop, state);
    std::size_t bit = 0;
    for (const auto& e : o.entries) {
        if (e.sub < sub || e.sub > count(o)) continue;
        const std::size_t bits = e.sub == 0 ? 16 : e.bits;  // sub-index 0 is padded to 16 bits
        const std::size_t end = (bit + bits + 7) / 8;
        if (end > to.size()) return coe::Abort::memory;
        std::fill(to.begin() + static_cast<std::ptrdiff_t>((bit + 7) / 8),
                  to.begin() + static_cast<std::ptrdiff_t>(end), std::uint8_t{0});
        if ((e.access & right) != 0) {
            copy_bits(to.data(), bit, data(e), 0, e.bits);
        }
        bit += bits;
    }
    length = (bit + 7) / 8;
    return coe::Abort::none;
}

coe::Abort Dictionary::check_write(std::uint16_t index, std::uint8_t sub, bool complete,
                                   State state, std::size_t bytes) const noexcept {
    const auto* o = find(index);
    if (o == nullptr) return coe::Abort::no_object;
    if (complete && o->code != coe::ObjectCode::variable) {
        return sub > 1 ? coe::Abort::no_complete_access : coe::Abort::none;
    }
    const auto* e = find(index, sub);
    const coe::Abort refusal = check_access(e, write_service, state);
    if (refusal != coe::Abort::none) return refusal;
    if (bytes > e->bytes()) return coe::Abort::too_long;
    if (bytes < e->bytes() && !e->text()) return coe::Abort::too_short;
    return coe::Abort::none;
}

coe::Abort Dictionary::write_entry(const DictionaryObject& o, const DictionaryEntry& e, State state,
                                   std::span<const std::uint8_t> from) noexcept {
    const auto access = check_write(o.index, e.sub, false, state, from.size());
    if (access != coe::Abort::none) return access;
    if (e.limited) {
        const auto value = cia301::integer_of(static_cast<cia301::Type>(e.type), from);
        if (value > e.high) return coe::Abort::too_high;
        if (value < e.low) return coe::Abort::too_low;
    }
    if (guard_ != nullptr) {
        const auto code = guard_->check(o, e, from);
        if (code != coe::Abort::none) return code;
    }
    std::memcpy(data(e), from.data(), from.size());
    if (from.size() < e.bytes()) {
        std::memset(data(e) + from.size(), 0, e.bytes() - from.size());
    }
    if (guard_ != nullptr) {
        guard_->written(o, e);
    }
    return coe::Abort::none;
}

coe::Abort Dictionary::write_complete(const DictionaryObject& o, std::uint8_t sub, State state,
                                      std::span<const std::uint8_t> from) noexcept {
    const auto& sub0 = o.entries.front();
    std::size_t bit = 0;
    std::uint8_t count_after = 0;
    const bool sets_count = sub == 0 && (sub0.access & coe::access::write) != 0;
    if (sub == 0) {
        if (from.size() < 2) return coe::Abort::too_short;
        count_after = from[0];
        bit = 16;
    }
    if (sets_count) {  // entries can be written only while the count is 0
        const std::uint8_t none = 0;
        const auto code = write_entry(o, sub0, state, {&none, 1});
        if (code != coe::Abort::none) return code;
    }
    for (const auto& e : o.entries) {
        if (e.sub == 0 || (sub == 0 && e.sub > count_after)) continue;
        if (bit == from.size() * 8) break;
        if (bit + e.bits > from.size() * 8) return coe::Abort::length;
        const auto code = write_part(o, e, state, from, bit);
        if (code != coe::Abort::none) return code;
        bit += e.bits;
    }
    if (bit < from.size() * 8 && from.size() * 8 - bit >= 8) return coe::Abort::too_long;
    return sets_count ? write_entry(o, sub0, state, {&count_after, 1}) : coe::Abort::none;
}

/// Writes the entry whose value starts at a bit of the data of complete access. Read-only entries
/// are left out; so are texts, which are not written this way.
coe::Abort Dictionary::write_part(const DictionaryObject& o, const DictionaryEntry& e, State state,
                                  std::span<const std::uint8_t> from, std::size_t bit) noexcept {
    std::uint8_t value[8] = {};
    if (e.bytes() > sizeof value || (e.access & coe::access::write) == 0) return coe::Abort::none;
    copy_bits(value, 0, from.data(), bit, e.bits);
    return write_entry(o, e, state, {value, e.bytes()});
}

coe::Abort Dictionary::write(std::uint16_t index, std::uint8_t sub, bool complete, State state,
                             std::span<const std::uint8_t> from) noexcept {
    const auto* o = find(index);
    if (o == nullptr) return coe::Abort::no_object;
    if (complete && o->code != coe::ObjectCode::variable) {
        return sub > 1 ? coe::Abort::no_complete_access : write_complete(*o, sub, state, from);
    }
    const auto* e = find(index, sub);
    return e == nullptr ? coe::Abort::no_sub : write_entry(*o, *e, state, from);
}

}  // namespace hal::ethercat::devices
