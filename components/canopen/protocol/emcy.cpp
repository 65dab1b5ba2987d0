// SPDX-License-Identifier: MIT
#include "emcy.hpp"

#include <algorithm>

#include "cia402/error_words.hpp"

namespace hal::canopen {

const char* emergency_text(std::uint16_t code) noexcept { return cia402::error_class_word(code); }

Emcy::Emcy(Dictionary& dictionary, FrameQueue& out)
    : dictionary_(dictionary), out_(out), history_(dictionary.object(0x1003)) {
    for (const int index : {0x1003, 0x1014, 0x1015}) {
        dictionary.handle(static_cast<std::uint16_t>(index), *this);
    }
}

void Emcy::read_parameters() noexcept {
    cob_ = dictionary_.get<std::uint32_t>(0x1014, 0, cob_invalid);
    inhibit_ = Time{dictionary_.get<std::uint16_t>(0x1015, 0)} * 100 * microsecond;
}

void Emcy::reset(bool all) noexcept {
    read_parameters();
    count_ = 0;
    sent_once_ = false;
    if (all) {
        errors_count_ = 0;
    }
    update_register();
}

void Emcy::update_register() noexcept {
    std::uint8_t bits = 0;
    for (std::size_t n = 0; n < errors_count_; ++n) {
        bits |= errors_[n].bits;
    }
    if (errors_count_ != 0) {
        bits |= error_generic;
    }
    dictionary_.set<std::uint8_t>(0x1001, 0, bits);
}

bool Emcy::active(std::uint16_t code, std::uint8_t source) const noexcept {
    return std::any_of(errors_.begin(),
                       errors_.begin() + static_cast<std::ptrdiff_t>(errors_count_),
                       [&](const Active& a) { return a.code == code && a.source == source; });
}

void Emcy::raise(std::uint16_t code, std::uint8_t register_bits, const Bytes& manufacturer,
                 std::uint8_t source) noexcept {
    if (active(code, source) || errors_count_ == errors_.size()) return;
    errors_[errors_count_++] = {code, register_bits, source};
    update_register();
    if (history_.size() > 1) {  // the newest is at sub-index 1
        std::uint8_t& used = *history_[0].data;
        const auto capacity = history_.size() - 1;
        for (std::size_t n = std::min<std::size_t>(used, capacity - 1); n > 0; --n) {
            std::memcpy(history_[n + 1].data, history_[n].data, 4);
        }
        const std::uint32_t field =
            code | std::uint32_t{manufacturer[0]} << 16 | std::uint32_t{manufacturer[1]} << 24;
        store(history_[1].data, field);
        if (used < capacity) {
            ++used;
        }
    }
    queue(code, manufacturer);
}

void Emcy::clear(std::uint16_t code, std::uint8_t source) noexcept {
    for (std::size_t n = 0; n < errors_count_; ++n) {
        if (errors_[n].code != code || errors_[n].source != source) continue;
        std::copy(errors_.begin() + static_cast<std::ptrdiff_t>(n) + 1,
                  errors_.begin() + static_cast<std::ptrdiff_t>(errors_count_),
                  errors_.begin() + static_cast<std::ptrdiff_t>(n));
        --errors_count_;
        update_register();
        return queue(0, {});
    }
}

void Emcy::queue(std::uint16_t code, const Bytes& manufacturer) noexcept {
    if ((cob_ & cob_invalid) != 0) return;
    if (count_ == waiting_.size()) {
        ++lost_;
        return;
    }
    waiting_[(head_ + count_++) % waiting_.size()] = {code, error_register(), manufacturer, 0};
}

void Emcy::poll(Time now) noexcept {
    // "recovered from bus off" (CiA 301): sent after the recovery, not while the bus is off
    if (count_ == 0 || active(0x8140)) return;
    while (count_ != 0 && active_ && (!sent_once_ || now - sent_ >= inhibit_)) {
        const auto& e = waiting_[head_];
        Frame f = make_frame(cob_, 8);
        store(f.data.data(), e.code);
        f.data[2] = e.error_register;
        std::copy(e.manufacturer.begin(), e.manufacturer.end(), f.data.begin() + 3);
        if (!out_.push(f)) return;
        head_ = (head_ + 1) % waiting_.size();
        --count_;
        sent_ = now;
        sent_once_ = true;
    }
}

Abort Emcy::writing(Entry& e, std::span<const std::uint8_t> value) noexcept {
    const bool in_use = (cob_ & cob_invalid) == 0;
    if (e.index == 0x1003) return abort_if(value[0] != 0, Abort::value);
    if (e.index == 0x1015) return abort_if(in_use, Abort::device_state);
    const auto cob = load<std::uint32_t>(value.data());
    if ((cob & cob_flag30) != 0) return Abort::value;
    if ((cob & cob_invalid) != 0) return Abort::none;
    const bool moved = in_use && cob_ != cob;
    return abort_if(moved || is_reserved(cob), Abort::value);
}

void Emcy::written(Entry& e) noexcept {
    if (e.index != 0x1003) return read_parameters();
    for (std::size_t n = 1; n < history_.size(); ++n) {
        store(history_[n].data, std::uint32_t{0});
    }
}

EmcyConsumer::EmcyConsumer(Dictionary& dictionary) : dictionary_(dictionary) {
    dictionary.handle(0x1028, *this);
}

void EmcyConsumer::reset() noexcept {
    cobs_.fill(cob_invalid);
    highest_ = 0;
    for (const auto& e : dictionary_.object(0x1028)) {
        if (e.sub == 0 || e.sub > 127 || e.size != 4) continue;
        cobs_[e.sub] = load<std::uint32_t>(e.data);
        if ((cobs_[e.sub] & cob_invalid) == 0 && cob_id(cobs_[e.sub]) != 0) {
            highest_ = e.sub;
        }
    }
}

bool EmcyConsumer::handle(const Frame& f, Time now, DeviceEvents& events) noexcept {
    for (std::size_t node = 1; node <= highest_; ++node) {
        if ((cobs_[node] & cob_invalid) != 0 || cob_id(cobs_[node]) != f.id ||
            ((cobs_[node] & cob_extended) != 0) != f.extended) {
            continue;
        }
        if (f.remote || f.length < 3) return true;
        events.on_emergency(static_cast<std::uint8_t>(node), read(f, now));
        return true;
    }
    return false;
}

Emergency EmcyConsumer::read(const Frame& f, Time now) noexcept {
    Emergency e{load<std::uint16_t>(f.data.data()), f.data[2], {}, now};
    std::copy_n(f.data.begin() + 3, 5, e.manufacturer.begin());
    return e;
}

}  // namespace hal::canopen
