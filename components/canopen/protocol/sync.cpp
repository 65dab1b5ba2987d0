// SPDX-License-Identifier: MIT
#include "sync.hpp"

namespace hal::canopen {

Sync::Sync(Dictionary& dictionary, FrameQueue& out, Emcy& emcy)
    : dictionary_(dictionary), out_(out), emcy_(emcy) {
    for (const int index : {0x1005, 0x1006, 0x1007, 0x1019}) {
        dictionary.handle(static_cast<std::uint16_t>(index), *this);
    }
}

void Sync::reset() noexcept {
    const auto cob = dictionary_.get<std::uint32_t>(0x1005, 0, 0x80);
    const auto period = static_cast<Time>(dictionary_.get<std::uint32_t>(0x1006, 0)) * microsecond;
    const auto overflow = dictionary_.get<std::uint8_t>(0x1019, 0);
    const bool starts = ((cob ^ cob_) & cob_flag30) != 0 || period != period_;
    if (starts) {
        started_ = false;
    }
    if (starts || overflow != overflow_) {
        next_counter_ = 1;
    }
    cob_ = cob;
    period_ = period;
    overflow_ = overflow;
    window_ = static_cast<Time>(dictionary_.get<std::uint32_t>(0x1007, 0)) * microsecond;
}

void Sync::set_active(bool active) noexcept {
    if (active != active_) {
        started_ = seen_ = lost_reported_ = false;
        next_counter_ = 1;
    }
    active_ = active;
}

bool Sync::handle(const Frame& f, Time now) noexcept {
    if (!has_id(f, cob_) || f.remote || !active_) return false;
    const std::uint8_t expected = overflow_ != 0 ? 1 : 0;
    if (f.length != expected) {
        emcy_.raise(0x8240, error_communication, {f.length, expected});
    } else {
        emcy_.clear(0x8240);
    }
    counter_ = f.length >= 1 && expected == 1 ? f.data[0] : 0;
    last_ = now;
    seen_ = true;
    lost_reported_ = false;
    return true;
}

bool Sync::produce(Time now) noexcept {
    if (!producer() || !active_) return false;
    const bool counts = overflow_ != 0;
    Frame f = make_frame(cob_, counts ? 1 : 0);
    f.data[0] = next_counter_;
    if (!out_.push(f)) return false;
    counter_ = counts ? next_counter_ : 0;
    if (counts) {
        next_counter_ = static_cast<std::uint8_t>(next_counter_ % overflow_ + 1);
    }
    last_ = now;
    return true;
}

bool Sync::poll(Time now) noexcept {
    if (!producer() || !active_ || period_ == 0) return false;
    if (!started_) {
        started_ = true;
        next_ = now;
    }
    if (now < next_) return false;
    const auto behind = (now - next_) / period_;
    skipped_ += static_cast<std::uint64_t>(behind);
    next_ += (behind + 1) * period_;
    return produce(now);
}

bool Sync::lost(Time now) noexcept {
    if (!seen_ || lost_reported_ || producer() || !active_ || period_ == 0 ||
        now - last_ < period_ + period_ / 2) {
        return false;
    }
    lost_reported_ = true;
    return true;
}

Abort Sync::writing(Entry& e, std::span<const std::uint8_t> value) noexcept {
    if (e.index == 0x1005) {
        const auto cob = load<std::uint32_t>(value.data());
        const bool moved = producer() && differs_in_id(cob, cob_);
        return abort_if(moved || has_restricted_id(cob), Abort::value);
    }
    if (e.index != 0x1019) return Abort::none;
    if (value[0] == 1 || value[0] > 240) return Abort::value;
    return abort_if(period_ != 0, Abort::device_state);
}

TimeStamp::TimeStamp(Dictionary& dictionary, FrameQueue& out) : dictionary_(dictionary), out_(out) {
    dictionary.handle(0x1012, *this);
}

bool TimeStamp::handle(const Frame& f, TimeOfDay& time) noexcept {
    if ((cob_ & 0x80000000) == 0 || f.remote || !has_id(f, cob_) || f.length != 6) return false;
    time = {load<std::uint32_t>(f.data.data()) & 0x0fffffff,
            load<std::uint16_t>(f.data.data() + 4)};
    return true;
}

bool TimeStamp::produce(const TimeOfDay& time) noexcept {
    if ((cob_ & cob_flag30) == 0) return false;
    Frame f = make_frame(cob_, 6);
    store(f.data.data(), time.milliseconds & 0x0fffffff);
    store(f.data.data() + 4, time.days);
    return out_.push(f);
}

Abort TimeStamp::writing(Entry&, std::span<const std::uint8_t> value) noexcept {
    const auto cob = load<std::uint32_t>(value.data());
    const bool in_use = (cob_ & 0xc0000000) != 0;
    const bool moved = in_use && differs_in_id(cob, cob_);
    return abort_if(moved || has_restricted_id(cob), Abort::value);
}

}  // namespace hal::canopen
