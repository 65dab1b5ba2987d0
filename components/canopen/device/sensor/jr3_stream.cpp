// SPDX-License-Identifier: MIT
#include "jr3_stream.hpp"

#include "jr3_calibration.hpp"

namespace hal::canopen::jr3 {

namespace {
constexpr std::uint8_t shortest_pulse = start_clocks - 1;
constexpr std::uint8_t max_pulse = start_clocks + 2;

constexpr std::uint8_t min_gap = 2;
}  // namespace

void Decoder::lose(State next) noexcept {
    ++errors_;
    locked_ = false;
    state_ = next;
    count_ = 1;
}

bool Decoder::take(bool bit) noexcept {
    switch (state_) {
    case State::idle:
        if (bit) {
            state_ = State::pulse;
            count_ = 1;
        }
        return false;
    case State::pulse:
        if (bit) {
            if (++count_ > max_pulse) {
                lose(State::stuck);
            }
        } else if (count_ < shortest_pulse) {
            lose(State::idle);
        } else {
            state_ = State::data;
            count_ = 20;
            shift_ = 0;
        }
        return false;
    case State::stuck:
        if (!bit) {
            state_ = State::idle;
        }
        return false;
    case State::data:
        shift_ = shift_ << 1 | (bit ? 1U : 0U);
        if (--count_ == 0) {
            state_ = State::gap;
            count_ = min_gap;
        }
        return false;
    case State::gap:
        if (bit) {
            lose(State::pulse);
            return false;
        }
        if (--count_ != 0) return false;
        state_ = State::idle;
        break;
    }
    if (!locked_) {
        locked_ = true;
        return false;
    }
    ++packets_;
    packet_ = {static_cast<std::uint8_t>(shift_ >> 16), static_cast<std::int16_t>(shift_ & 0xffff)};
    return true;
}

bool Generator::next() noexcept {
    if (clock_ == 0) {
        auto value = static_cast<std::uint16_t>(values_[address_]);
        if (address_ == calibration_address && memory_ != nullptr) {
            value = static_cast<std::uint16_t>((index_ & 0xff) << 8 | memory_[index_]);
            index_ = (index_ + 1) % memory_size;
        }
        word_ = address_ << 16 | value;
        address_ = (address_ + 1) % addresses;
    }
    const unsigned at = clock_;
    clock_ = (clock_ + 1) % packet_clocks;
    if (at < start_clocks) return true;
    if (at <= start_clocks || at > start_clocks + 20) return false;
    return (word_ >> (start_clocks + 20 - at) & 1) != 0;
}

void Generator::fill(std::span<std::uint8_t> buffer) noexcept {
    for (auto& byte : buffer) {
        for (unsigned bit = 0; bit < 8; ++bit) {
            byte = static_cast<std::uint8_t>(byte << 1 | (next() ? 1 : 0));
        }
    }
}

bool MemoryReader::take(std::uint16_t word) noexcept {
    const auto address = static_cast<std::uint8_t>(word >> 8);

    const auto value = static_cast<std::uint8_t>(word);
    const bool begins = address == 0 && value == signature[0];
    if (address != (next_ & 0xff) || (next_ < signature.size() && value != signature[next_])) {
        next_ = 0;
        if (!begins) return false;
    }
    memory_[next_++] = value;
    if (next_ < memory_size) return false;
    next_ = 0;
    return true;
}

}  // namespace hal::canopen::jr3
