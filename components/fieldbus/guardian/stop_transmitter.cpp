// SPDX-License-Identifier: MIT
#include "fieldbus/guardian/stop_transmitter.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace hal::guardian {

namespace {

/// How long the echoes of a round may take, before its frames are sent again.
constexpr std::int64_t echo_ns = 100'000'000;
/// How often received frames are looked for.
constexpr std::int64_t poll_ns = 1'000'000;

std::uint32_t bits(std::size_t count) noexcept {
    return count == 0 ? 0 : ~std::uint32_t{0} >> (32 - count);
}

bool is_confirmation(const can::Frame& received, const can::Frame& expected) noexcept {
    return !received.own && received.id == expected.id && received.extended == expected.extended &&
           received.length >= expected.length &&
           std::memcmp(received.data.data(), expected.data.data(), expected.length) == 0;
}

}  // namespace

StopTransmitter::StopTransmitter(StopFrames frames, StopSchedule schedule)
    : frames_(std::move(frames)), schedule_(schedule) {
    static_assert(max_frames <= 32);
}

std::string StopTransmitter::open(const std::string& address) {
    if (!frames_.ethernet.empty()) {
        auto opened = ethernet::open(address);
        ethernet_ = std::move(opened.port);
        return opened.problem;
    }
    const bool has_fd = std::any_of(frames_.can.begin(), frames_.can.end(),
                                    [](const can::Frame& frame) { return frame.fd; });
    auto opened = can::open(address, {.fd = has_fd, .own_frames = true});
    if (!opened) return opened.problem;
    can_ = std::move(opened.link);
    const can::Description& link = can_->description();
    if (has_fd && !link.fd) {
        return address + " has no CAN FD, and a stop frame is one (##)";
    }
    has_echo_ = link.in_memory || link.transport == "SocketCAN";
    std::vector<can::Filter> filters;
    for (const auto* list : {&frames_.can, &frames_.confirmations}) {
        for (const can::Frame& frame : *list) {
            filters.push_back({.id = frame.id,
                               .mask = frame.extended ? 0x1fffffffU : 0x7ffU,
                               .extended = frame.extended});
        }
    }
    can_->set_filters(filters);  // a driver with fewer passes all frames
    return {};
}

void StopTransmitter::begin(std::int64_t now_ns) noexcept {
    receive(now_ns);
    outcome_ = Outcome::sending;
    begun_ns_ = now_ns;
    rounds_sent_ = 0;
    missing_confirmations_ = bits(frames_.confirmations.size());
    send_round(now_ns);
}

std::int64_t StopTransmitter::work(std::int64_t now_ns) noexcept {
    receive(now_ns);
    if (is_over()) return now_ns + echo_ns;
    const std::int64_t next = round_ns_ + (in_round_ ? echo_ns : schedule_.every_ns);
    if (now_ns >= next) {
        if (in_round_) {
            outcome_ = Outcome::delayed;
        }
        send_round(now_ns);
        receive(now_ns);
    }
    return now_ns + poll_ns;
}

const char* StopTransmitter::link_state() const noexcept {
    if (ethernet_) return ethernet_->statistics().up ? "up" : "down";
    return can_ ? can::to_string(can_->state()) : "down";
}

int StopTransmitter::descriptor() const noexcept {
    if (ethernet_) return ethernet_->descriptor();
    return can_ ? can_->descriptor() : -1;
}

void StopTransmitter::send_round(std::int64_t now_ns) noexcept {
    if (rounds_sent_ >= schedule_.rounds) {
        // the last round had its time for the confirmations
        outcome_ = Outcome::unconfirmed;
        return;
    }
    round_ns_ = now_ns;
    const bool is_taken = ethernet_ ? send_ethernet(now_ns) : send_can(now_ns);
    in_round_ = is_taken;
    if (!is_taken) {
        outcome_ = Outcome::delayed;
    } else if (missing_echoes_ == 0) {
        end_round(now_ns);
    }
}

bool StopTransmitter::send_can(std::int64_t now_ns) noexcept {
    if (!can_) return false;
    missing_echoes_ = has_echo_ ? bits(frames_.can.size()) : 0;
    bool is_taken = true;
    for (const can::Frame& frame : frames_.can) {
        is_taken = can_->send(frame, now_ns) == can::Sent::queued && is_taken;
    }
    can_->flush(now_ns);
    return is_taken;
}

bool StopTransmitter::send_ethernet(std::int64_t now_ns) noexcept {
    bool is_taken = ethernet_->statistics().up;
    for (const std::vector<std::uint8_t>& frame : frames_.ethernet) {
        is_taken = ethernet_->send(frame, {}, now_ns) == ethernet::Sent::queued && is_taken;
    }
    return is_taken;
}

void StopTransmitter::receive(std::int64_t now_ns) noexcept {
    if (ethernet_) {
        while (ethernet_->receive(now_ns)) {
        }
        return;
    }
    if (!can_) return;
    std::size_t count = buffer_.size();
    while (count == buffer_.size()) {
        count = can_->receive(buffer_, now_ns);
        for (std::size_t n = 0; n < count; ++n) {
            accept(buffer_[n]);
        }
    }
    if (in_round_ && missing_echoes_ == 0) {
        end_round(now_ns);
    } else if (!is_over() && rounds_sent_ != 0 && is_confirmed() &&
               !frames_.confirmations.empty()) {
        outcome_ = Outcome::confirmed;
    }
}

void StopTransmitter::accept(const can::Frame& frame) noexcept {
    for (std::size_t n = 0; frame.own && n < frames_.can.size(); ++n) {
        const std::uint32_t bit = std::uint32_t{1} << n;
        if ((missing_echoes_ & bit) == 0 || !frame.same(frames_.can[n])) continue;
        missing_echoes_ &= ~bit;
        return;
    }
    const bool is_early = rounds_sent_ == 0 && missing_echoes_ != 0;  // sent before the stop frames
    for (std::size_t n = 0; !is_early && n < frames_.confirmations.size(); ++n) {
        if (is_confirmation(frame, frames_.confirmations[n])) {
            missing_confirmations_ &= ~(std::uint32_t{1} << n);
        }
    }
}

void StopTransmitter::end_round(std::int64_t now_ns) noexcept {
    in_round_ = false;
    ++rounds_sent_;
    last_sent_ns_ = now_ns;
    outcome_ = Outcome::sending;
    if (frames_.confirmations.empty()) {
        if (rounds_sent_ == schedule_.rounds) {
            outcome_ = Outcome::sent;
        }
    } else if (is_confirmed()) {
        outcome_ = Outcome::confirmed;
    }
}

}  // namespace hal::guardian
