// SPDX-License-Identifier: MIT
#include "ethercat/devices/process_data.hpp"

#include <algorithm>
#include <cstring>

#include "ethercat/devices/bits.hpp"

namespace hal::ethercat::devices {

void ProcessData::attach(Dictionary& dictionary, std::uint16_t assignment, bool output,
                         std::size_t most_bytes) {
    dictionary_ = &dictionary;
    assignment_ = assignment;
    output_ = output;
    most_bytes_ = most_bytes;
    std::size_t entries = 0;
    for (const auto& o : dictionary.objects()) {
        if (is_pdo(o.index)) {
            entries += o.entries.size();
        }
    }
    const auto* o = dictionary.find(assignment);
    copies_.resize(o == nullptr ? 0 : entries * o->entries.size());
}

bool ProcessData::is_pdo(std::uint16_t index) const noexcept {
    return output_ ? index >= coe::rx_pdo && index < coe::rx_pdo + 0x200
                   : index >= coe::tx_pdo && index < coe::tx_pdo + 0x200;
}

std::size_t ProcessData::pdo_bits(const DictionaryObject& pdo, unsigned entries) const noexcept {
    std::size_t bits = 0;
    for (const auto& e : pdo.entries) {
        if (e.sub != 0 && e.sub <= entries) {
            bits += coe::Mapping::of(get<std::uint32_t>(dictionary_->data(e))).bits;
        }
    }
    return bits;
}

void ProcessData::build() noexcept {
    bits_ = 0;
    used_ = 0;
    const auto* assignment = dictionary_->find(assignment_);
    if (assignment == nullptr) return;
    for (const auto& slot : assignment->entries) {
        if (slot.sub == 0 || slot.sub > dictionary_->count(*assignment)) continue;
        const auto* pdo = dictionary_->find(get<std::uint16_t>(dictionary_->data(slot)));
        if (pdo == nullptr) continue;
        for (const auto& e : pdo->entries) {
            if (e.sub == 0 || e.sub > dictionary_->count(*pdo)) continue;
            const auto mapping = coe::Mapping::of(get<std::uint32_t>(dictionary_->data(e)));
            const auto* entry =
                mapping.index != 0 ? dictionary_->find(mapping.index, mapping.sub) : nullptr;
            if (entry != nullptr && mapping.bits <= entry->bits && used_ < copies_.size()) {
                copies_[used_++] = {dictionary_->data(*entry), static_cast<std::uint32_t>(bits_),
                                    mapping.bits};
            }
            bits_ += mapping.bits;
        }
    }
}

void ProcessData::unpack(std::span<const std::uint8_t> from) noexcept {
    for (std::size_t i = 0; i < used_; ++i) {
        if (copies_[i].bit + copies_[i].bits <= from.size() * 8) {
            copy_bits(copies_[i].data, 0, from.data(), copies_[i].bit, copies_[i].bits);
        }
    }
}

void ProcessData::pack(std::span<std::uint8_t> to) const noexcept {
    for (std::size_t i = 0; i < used_; ++i) {
        if (copies_[i].bit + copies_[i].bits <= to.size() * 8) {
            copy_bits(to.data(), copies_[i].bit, copies_[i].data, 0, copies_[i].bits);
        }
    }
}

void ProcessData::clear() noexcept {
    for (std::size_t i = 0; i < used_; ++i) {
        std::memset(copies_[i].data, 0, (copies_[i].bits + 7) / 8);
    }
}

std::uint32_t ProcessData::check(const DictionaryObject& o, const DictionaryEntry& e,
                                 std::span<const std::uint8_t> value) const noexcept {
    const bool assignment = o.index == assignment_;
    if (!assignment && !is_pdo(o.index)) return 0;
    if (e.sub != 0) {
        if (dictionary_->count(o) != 0) return coe::abort::sub0_not_zero;
        if (assignment) {
            const auto index = get<std::uint16_t>(value.data());
            return is_pdo(index) && dictionary_->find(index) != nullptr ? 0
                                                                        : coe::abort::not_mappable;
        }
        const auto mapping = coe::Mapping::of(get<std::uint32_t>(value.data()));
        if (mapping.index == 0) {
            return 0;  // a gap
        }
        const auto* object = dictionary_->find(mapping.index);
        if (object == nullptr) return coe::abort::no_object;
        const auto* entry = dictionary_->find(mapping.index, mapping.sub);
        if (entry == nullptr) return coe::abort::no_sub;
        const std::uint16_t right = output_ ? coe::access::rx_mappable : coe::access::tx_mappable;
        return (entry->access & right) != 0 && entry->bits == mapping.bits
                   ? 0
                   : coe::abort::not_mappable;
    }
    const unsigned count = value[0];
    if (count + 1 > o.entries.size()) {
        return assignment ? coe::abort::too_high : coe::abort::pdo_too_long;
    }
    std::size_t bits = 0;
    if (!assignment) {
        bits = pdo_bits(o, count);
    } else {
        for (const auto& slot : o.entries) {
            if (slot.sub != 0 && slot.sub <= count) {
                if (const auto* pdo =
                        dictionary_->find(get<std::uint16_t>(dictionary_->data(slot)))) {
                    bits += pdo_bits(*pdo, dictionary_->count(*pdo));
                }
            }
        }
    }
    return (bits + 7) / 8 > most_bytes_ ? coe::abort::pdo_too_long : 0;
}

}  // namespace hal::ethercat::devices
