// SPDX-License-Identifier: MIT
#include "ethercat/devices/process_data.hpp"

#include <algorithm>
#include <cstring>

#include "ethercat/devices/bits.hpp"

namespace hal::ethercat::devices {

void ProcessData::attach(Dictionary& dictionary, std::uint16_t assignment, bool output,
                         std::size_t max_bytes, const SampledPdos& sampled) {
    dictionary_ = &dictionary;
    sampled_ = &sampled;
    assignment_ = assignment;
    output_ = output;
    max_bytes_ = max_bytes;
    std::size_t entries = 0;
    for (const auto& o : dictionary.objects()) {
        if (is_pdo(o.index)) {
            entries += o.entries.size() * (sampled.contains(o.index) ? sampled.max_samples : 1);
        }
    }
    const auto* o = dictionary.find(assignment);
    const std::size_t max_copies = 8 * max_bytes;  // of a bit each
    copies_.resize(o == nullptr ? 0 : std::min(entries * o->entries.size(), max_copies));
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

void ProcessData::build(unsigned samples) noexcept {
    bits_ = 0;
    used_ = 0;
    has_samples_ = false;
    const auto* assignment = dictionary_->find(assignment_);
    if (assignment == nullptr) return;
    for (const auto& slot : assignment->entries) {
        if (slot.sub == 0 || slot.sub > dictionary_->count(*assignment)) continue;
        const auto* pdo = dictionary_->find(get<std::uint16_t>(dictionary_->data(slot)));
        if (pdo == nullptr) continue;
        if (!sampled_->contains(pdo->index)) {
            add(*pdo, every_sample);
            continue;
        }
        has_samples_ = true;
        for (unsigned n = 0; n < samples; ++n) {
            add(*pdo, static_cast<std::uint16_t>(n));
        }
    }
}

/// Appends the objects of a PDO, or of one of its samples.
void ProcessData::add(const DictionaryObject& pdo, std::uint16_t sample) noexcept {
    for (const auto& e : pdo.entries) {
        if (e.sub == 0 || e.sub > dictionary_->count(pdo)) continue;
        const auto mapping = coe::Mapping::of(get<std::uint32_t>(dictionary_->data(e)));
        const auto* entry =
            mapping.index != 0 ? dictionary_->find(mapping.index, mapping.sub) : nullptr;
        const bool is_mapped = entry != nullptr && (entry->access & mappable()) != 0;
        if (is_mapped && mapping.bits <= entry->bits && used_ < copies_.size()) {
            copies_[used_++] = {dictionary_->data(*entry), static_cast<std::uint32_t>(bits_),
                                mapping, sample};
        }
        bits_ += mapping.bits;
    }
}

void ProcessData::unpack(std::span<const std::uint8_t> from, unsigned sample) noexcept {
    for (std::size_t i = 0; i < used_; ++i) {
        if (copies_[i].belongs_to(sample) &&
            copies_[i].bit + copies_[i].object.bits <= from.size() * 8) {
            copy_bits(copies_[i].data, 0, from.data(), copies_[i].bit, copies_[i].object.bits);
        }
    }
}

void ProcessData::pack(std::span<std::uint8_t> to, unsigned sample) const noexcept {
    for (std::size_t i = 0; i < used_; ++i) {
        if (copies_[i].belongs_to(sample) &&
            copies_[i].bit + copies_[i].object.bits <= to.size() * 8) {
            copy_bits(to.data(), copies_[i].bit, copies_[i].data, 0, copies_[i].object.bits);
        }
    }
}

void ProcessData::clear() noexcept {
    for (std::size_t i = 0; i < used_; ++i) {
        std::memset(copies_[i].data, 0, (copies_[i].object.bits + 7) / 8);
    }
}

coe::Abort ProcessData::check(const DictionaryObject& o, const DictionaryEntry& e,
                              std::span<const std::uint8_t> value) const noexcept {
    if (o.index == assignment_) {
        return e.sub == 0 ? check_assigned(o, value[0]) : check_assigning(o, value);
    }
    if (is_pdo(o.index)) {
        return e.sub == 0 ? check_mapped(o, value[0]) : check_mapping(o, value);
    }
    return coe::Abort::none;
}

/// Checks the write of a PDO to the assignment.
coe::Abort ProcessData::check_assigning(const DictionaryObject& assignment,
                                        std::span<const std::uint8_t> value) const noexcept {
    if (dictionary_->count(assignment) != 0) return coe::Abort::sub0_not_zero;
    const auto index = get<std::uint16_t>(value.data());
    const bool exists = is_pdo(index) && dictionary_->find(index) != nullptr;
    return exists ? coe::Abort::none : coe::Abort::not_mappable;
}

/// Checks the number of PDOs of the assignment.
coe::Abort ProcessData::check_assigned(const DictionaryObject& assignment,
                                       unsigned count) const noexcept {
    if (count + 1 > assignment.entries.size()) return coe::Abort::too_high;
    std::size_t bits = 0;
    for (const auto& slot : assignment.entries) {
        if (slot.sub == 0 || slot.sub > count) continue;
        const auto* pdo = dictionary_->find(get<std::uint16_t>(dictionary_->data(slot)));
        if (pdo != nullptr) {
            bits += pdo_bits(*pdo, dictionary_->count(*pdo));
        }
    }
    return check_length(bits);
}

/// Checks the write of an object to the mapping of a PDO.
coe::Abort ProcessData::check_mapping(const DictionaryObject& pdo,
                                      std::span<const std::uint8_t> value) const noexcept {
    if (dictionary_->count(pdo) != 0) return coe::Abort::sub0_not_zero;
    const auto mapping = coe::Mapping::of(get<std::uint32_t>(value.data()));
    if (mapping.index == 0) return coe::Abort::none;  // a gap
    if (dictionary_->find(mapping.index) == nullptr) return coe::Abort::no_object;
    const auto* entry = dictionary_->find(mapping.index, mapping.sub);
    if (entry == nullptr) return coe::Abort::no_sub;
    const bool fits = (entry->access & mappable()) != 0 && entry->bits == mapping.bits;
    return fits ? coe::Abort::none : coe::Abort::not_mappable;
}

/// Checks the number of objects of a PDO.
coe::Abort ProcessData::check_mapped(const DictionaryObject& pdo, unsigned count) const noexcept {
    if (count + 1 > pdo.entries.size()) return coe::Abort::pdo_length;
    return check_length(pdo_bits(pdo, count));
}

coe::Abort ProcessData::check_length(std::size_t bits) const noexcept {
    return (bits + 7) / 8 > max_bytes_ ? coe::Abort::pdo_length : coe::Abort::none;
}

}  // namespace hal::ethercat::devices
