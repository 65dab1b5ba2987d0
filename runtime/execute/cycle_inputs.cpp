// SPDX-License-Identifier: MIT
#include "execute/cycle_inputs.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <stdexcept>

namespace hal {

CycleInputs::CycleInputs(std::size_t ring_words)
    : notes_(std::make_unique<std::uint64_t[]>(max_notes)),
      data_(std::make_unique<std::uint64_t[]>(max_notes)),
      mask_(std::bit_ceil(std::max(ring_words, head_words)) - 1),
      ring_(std::make_unique<std::uint64_t[]>(mask_ + 1)) {}

CycleInputs::CycleInputs(FunctionOrder* order)
    : notes_(std::make_unique<std::uint64_t[]>(max_notes)),
      data_(std::make_unique<std::uint64_t[]>(max_notes)),
      order_(order),
      mask_(0) {}

void CycleInputs::begin(CycleRecord::Kind kind, std::uint64_t number, std::int64_t grid_ns,
                        std::int64_t due_ns, std::int64_t woke_ns, std::uint64_t missed) noexcept {
    drop();
    last_call_ = 0;
    if (replays()) return;
    record_.kind = kind;
    record_.number = number;
    record_.grid_ns = grid_ns;
    record_.due_ns = due_ns;
    record_.woke_ns = woke_ns;
    record_.missed = missed;
    record_.epoch = 0;
    record_.observation = 0;
    record_.imports = 0;
}

void CycleInputs::took(std::uint64_t epoch, std::uint64_t writes) noexcept {
    if (replays()) return;
    record_.epoch = epoch;
    record_.writes_before = writes;
}

void CycleInputs::reads(std::uint64_t count) noexcept {
    if (!replays()) {
        record_.imports = count;
    }
}

void CycleInputs::end(std::uint64_t writes, std::uint64_t checksum) noexcept {
    const std::size_t data_words = (data_bytes_ + 7) / 8;
    if (replays()) {
        if (differing_link_) {
            match_ = Match::other_frames;
        } else if (count_ + record_.data != record_.notes || data_words != record_.data ||
                   asked_too_much_) {
            match_ = Match::other_reads;
        } else {
            match_ = checksum == record_.checksum ? Match::same : Match::other_values;
        }
        return;
    }
    record_.writes_after = writes;
    record_.checksum = checksum;
    record_.notes = count_ + data_words;
    record_.data = data_words;
    put_record();
    drop();
}

void CycleInputs::put(const void* bytes, std::size_t size) noexcept {
    constexpr std::size_t capacity = max_notes * sizeof(std::uint64_t);
    if (size <= capacity && data_bytes_ <= capacity - size) {
        std::memcpy(reinterpret_cast<char*>(data_.get()) + data_bytes_, bytes, size);
    }
    data_bytes_ = std::min(data_bytes_ + size, capacity + 1);  // then the record is dropped
}

bool CycleInputs::get(void* bytes, std::size_t size) noexcept {
    const std::size_t available = record_.data * sizeof(std::uint64_t);
    if (size > available || data_bytes_ > available - size) {
        asked_too_much_ = true;
        std::memset(bytes, 0, size);
        return false;
    }
    std::memcpy(bytes, reinterpret_cast<const char*>(data_.get()) + data_bytes_, size);
    data_bytes_ += size;
    return true;
}

// The first ticket of a cycle is a note, which is small as a difference to the cycle before. The
// others follow it closely.
void CycleInputs::order_call(std::uint64_t ticket) noexcept {
    constexpr std::uint8_t far = 255;
    const bool is_first = last_call_ == 0;
    if (is_first) {
        ticket = note(ticket);
    } else {
        const std::uint64_t between = ticket - last_call_;
        auto code = static_cast<std::uint8_t>(std::min<std::uint64_t>(between, far));
        if (replays()) {
            get(&code, sizeof code);
        } else {
            put(&code, sizeof code);
        }
        if (code == far) {
            ticket = note(ticket);
        } else {
            ticket = last_call_ + code;
        }
    }
    last_call_ = ticket + 1;
    if (replays() && order_) {
        order_->wait_for_call(ticket);
    }
}

void CycleInputs::put_record() noexcept {
    const std::size_t words = head_words + record_.notes;
    const std::size_t head = head_.load(std::memory_order_relaxed);
    const auto fits = [&] { return head + words - seen_tail_ <= mask_ + 1; };
    if (!fits()) {
        seen_tail_ = tail_.load(std::memory_order_acquire);
    }
    if (record_.notes > max_notes || !fits()) {
        record_.lost = lost_.load(std::memory_order_relaxed) + 1;
        lost_.store(record_.lost, std::memory_order_release);
        return;
    }
    const auto copy = [&](std::size_t to, const void* from, std::size_t count) noexcept {
        const std::size_t at = to & mask_;
        const std::size_t first = std::min(count, mask_ + 1 - at);
        std::memcpy(&ring_[at], from, first * sizeof(std::uint64_t));
        std::memcpy(&ring_[0], static_cast<const std::uint64_t*>(from) + first,
                    (count - first) * sizeof(std::uint64_t));
    };
    copy(head, &record_, head_words);
    copy(head + head_words, notes_.get(), count_);
    copy(head + head_words + count_, data_.get(), record_.data);
    head_.store(head + words, std::memory_order_release);
}

CycleRecord CycleInputs::record_at(const std::uint64_t* words) noexcept {
    CycleRecord record;
    std::memcpy(static_cast<void*>(&record), words, sizeof record);
    return record;
}

void CycleInputs::load(const CycleRecord& record, std::span<const std::uint64_t> notes) {
    if (notes.size() > max_notes || notes.size() != record.notes) {
        throw std::invalid_argument("invalid number of notes in a record of a cycle");
    }
    if (record.data > record.notes) {
        throw std::invalid_argument("invalid number of results in a record of a cycle");
    }
    record_ = record;
    const std::span<const std::uint64_t> data = notes.last(record.data);
    std::copy(notes.begin(), notes.end(), notes_.get());
    std::copy(data.begin(), data.end(), data_.get());
    drop();
    asked_too_much_ = false;
    differing_link_ = nullptr;
    match_ = Match::same;
}

}  // namespace hal
