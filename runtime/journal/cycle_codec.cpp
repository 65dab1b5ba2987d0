// SPDX-License-Identifier: MIT
#include "journal/cycle_codec.hpp"

#include <utility>

namespace hal {
namespace {

void put_number(std::string& to, std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) {
        to += static_cast<char>(value | 0x80);
    }
    to += static_cast<char>(value);
}

// Small differences of either sign are small numbers: 0, -1, 1, -2, 2 are 0, 1, 2, 3, 4.
void put_difference(std::string& to, std::uint64_t value, std::uint64_t before) {
    const std::uint64_t by = value - before;
    const std::uint64_t sign = by >> 63 != 0 ? ~std::uint64_t{0} : 0;
    put_number(to, (by << 1) ^ sign);
}

void put_word(std::string& to, std::uint64_t value) {
    for (int i = 0; i < 8; ++i) {
        to += static_cast<char>(value >> (8 * i));
    }
}

std::uint64_t bits(std::int64_t value) { return static_cast<std::uint64_t>(value); }

std::uint64_t note_before(const std::vector<std::uint64_t>& notes, std::size_t at) {
    return at < notes.size() ? notes[at] : 0;
}

}  // namespace

void CycleEncoder::add(const CycleRecord& record, std::span<const std::uint64_t> notes) {
    put_number(bytes_, record.kind);
    put_difference(bytes_, record.lost, before_.lost);
    put_difference(bytes_, record.number, before_.number);
    put_difference(bytes_, bits(record.grid_ns), bits(before_.grid_ns));
    put_difference(bytes_, bits(record.due_ns), bits(before_.due_ns));
    put_difference(bytes_, bits(record.woke_ns), bits(record.due_ns));
    put_difference(bytes_, record.missed, before_.missed);
    put_difference(bytes_, record.epoch, before_.epoch);
    put_difference(bytes_, record.writes_before, before_.writes_before);
    put_difference(bytes_, record.writes_after, record.writes_before);
    put_difference(bytes_, record.observation, before_.observation);
    put_word(bytes_, record.checksum);
    put_number(bytes_, record.imports);
    put_number(bytes_, notes.size());
    put_number(bytes_, record.data);
    const std::span<const std::uint64_t> differing = notes.first(notes.size() - record.data);
    for (std::size_t i = 0; i < differing.size(); ++i) {
        put_difference(bytes_, differing[i], note_before(notes_before_, i));
    }
    for (const std::uint64_t word : notes.last(record.data)) {
        put_word(bytes_, word);
    }
    before_ = record;
    notes_before_.assign(differing.begin(), differing.end());
    ++records_;
}

std::string CycleEncoder::take() {
    before_ = {};
    notes_before_.clear();
    records_ = 0;
    return std::exchange(bytes_, {});
}

std::uint64_t CycleDecoder::number() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64 && at_ < bytes_.size(); shift += 7) {
        const auto byte = static_cast<unsigned char>(bytes_[at_++]);
        value |= std::uint64_t{byte & 0x7fu} << shift;
        if (byte < 0x80) return value;
    }
    damaged_ = true;
    return 0;
}

std::uint64_t CycleDecoder::difference(std::uint64_t before) {
    const std::uint64_t coded = number();
    const std::uint64_t sign = (coded & 1) != 0 ? ~std::uint64_t{0} : 0;
    return before + ((coded >> 1) ^ sign);
}

std::uint64_t CycleDecoder::word() {
    if (bytes_.size() - at_ < 8) {
        damaged_ = true;
        return 0;
    }
    std::uint64_t value = 0;
    for (unsigned i = 0; i < 8; ++i) {
        value |= std::uint64_t{static_cast<unsigned char>(bytes_[at_ + i])} << (8 * i);
    }
    at_ += 8;
    return value;
}

bool CycleDecoder::next(CycleRecord& record, std::vector<std::uint64_t>& notes) {
    if (damaged_ || at_ >= bytes_.size()) return false;
    const auto time = [this](std::int64_t before) {
        return static_cast<std::int64_t>(difference(bits(before)));
    };
    record.kind = number();
    record.lost = difference(before_.lost);
    record.number = difference(before_.number);
    record.grid_ns = time(before_.grid_ns);
    record.due_ns = time(before_.due_ns);
    record.woke_ns = time(record.due_ns);
    record.missed = difference(before_.missed);
    record.epoch = difference(before_.epoch);
    record.writes_before = difference(before_.writes_before);
    record.writes_after = difference(record.writes_before);
    record.observation = difference(before_.observation);
    record.checksum = word();
    record.imports = number();
    record.notes = number();
    record.data = number();
    // each note has a byte at least
    if (record.notes > CycleInputs::max_notes || record.notes > bytes_.size() - at_ ||
        record.data > record.notes || record.imports > record.notes - record.data ||
        record.kind > CycleRecord::service) {
        damaged_ = true;
    }
    if (damaged_) return false;
    notes.clear();
    for (std::uint64_t i = 0; i < record.notes - record.data; ++i) {
        notes.push_back(difference(note_before(notes_before_, i)));
    }
    before_ = record;
    notes_before_ = notes;
    for (std::uint64_t i = 0; i < record.data; ++i) {
        notes.push_back(word());
    }
    return !damaged_;
}

}  // namespace hal
