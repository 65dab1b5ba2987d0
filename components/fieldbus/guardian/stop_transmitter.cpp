// SPDX-License-Identifier: MIT
#include "fieldbus/guardian/stop_transmitter.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <iterator>
#include <utility>

namespace hal::guardian {

namespace {

/// How long a round may take until its frames are on the bus, before it is attempted again: twice as
/// long each time, because what a slow bus has not sent still waits in the queue of the interface.
constexpr std::int64_t attempt_limit_ns = 100'000'000;
constexpr std::uint32_t max_doublings = 4;
/// When a round is attempted again at the latest.
constexpr std::int64_t retry_ns = 10'000'000;
/// How much of a declared frame a message has.
constexpr std::size_t max_text_bytes = 40;
/// How often received frames are looked for.
constexpr std::int64_t poll_ns = 1'000'000;

constexpr std::uint32_t bit(std::size_t n) noexcept { return std::uint32_t{1} << n; }

std::uint32_t bits(std::size_t count) noexcept {
    return count == 0 ? 0 : ~std::uint32_t{0} >> (32 - count);
}

bool is_confirmation(const can::Frame& received, const can::Frame& expected) noexcept {
    return !received.own && received.id == expected.id && received.extended == expected.extended &&
           received.length >= expected.length &&
           std::memcmp(received.data.data(), expected.data.data(), expected.length) == 0;
}

Failure failure_of(can::Sent sent) noexcept {
    switch (sent) {
    case can::Sent::queued: return Failure::none;
    case can::Sent::full: return Failure::full;
    case can::Sent::bus_off: return Failure::bus_off;
    case can::Sent::down: return Failure::down;
    case can::Sent::rejected: return Failure::rejected;
    }
    return Failure::rejected;
}

Failure failure_of(ethernet::Sent sent) noexcept {
    switch (sent) {
    case ethernet::Sent::queued: return Failure::none;
    case ethernet::Sent::full:
    case ethernet::Sent::late: return Failure::full;
    case ethernet::Sent::down: return Failure::down;
    case ethernet::Sent::rejected: return Failure::rejected;
    }
    return Failure::rejected;
}

}  // namespace

const char* to_string(Failure failure) noexcept {
    constexpr const char* texts[] = {"",
                                     "the transmit queue is full",
                                     "the controller is bus off",
                                     "the interface is down",
                                     "the driver rejects it",
                                     "no other node acknowledges it"};
    static_assert(std::size(texts) == static_cast<std::size_t>(Failure::unacknowledged) + 1);
    return texts[static_cast<std::size_t>(failure)];
}

void append_unsent(std::string& text, const StopFrames& frames, std::uint32_t unsent, Failure why) {
    const int count = std::popcount(unsent);
    const auto first = static_cast<std::size_t>(std::countr_zero(unsent));
    if (first < frames.texts.size()) {
        const std::string& frame = frames.texts[first];
        text.append(frame, 0, max_text_bytes);
        text += frame.size() > max_text_bytes ? "…" : "";
        if (count > 1) {
            text += " and " + std::to_string(count - 1) + " more";
        }
        text += ": ";
    }
    text += to_string(why);
}

StopTransmitter::StopTransmitter(StopFrames frames, StopSchedule schedule)
    : frames_(std::move(frames)), schedule_(schedule) {
    static_assert(max_frames <= 32);
}

std::string StopTransmitter::open(const std::string& address) {
    return frames_.ethernet.empty() ? open_can(address) : open_ethernet(address);
}

std::string StopTransmitter::open_can(const std::string& address) {
    const bool has_fd = std::any_of(frames_.can.begin(), frames_.can.end(),
                                    [](const can::Frame& frame) { return frame.fd; });
    auto opened = can::open(address, {.fd = has_fd, .own_frames = true});
    if (!opened) return opened.problem;
    return attach(std::move(opened.link));
}

std::string StopTransmitter::attach(std::unique_ptr<can::Link> opened) {
    const can::Description& link = opened->description();
    if (link.listen_only) {
        return link.address + " is listen-only, so no stop frame is sent; " +
               (link.interface.empty()
                    ? "remove `listen` from the address"
                    : "remove `listen` from the address, or type: sudo ip link set " +
                          link.interface + " type can listen-only off");
    }
    sees_bus_ = link.has_echo;
    is_in_memory_ = link.in_memory;
    std::vector<can::Filter> filters;
    for (const auto* list : {&frames_.can, &frames_.confirmations}) {
        for (const can::Frame& frame : *list) {
            filters.push_back({.id = frame.id,
                               .mask = frame.extended ? 0x1fffffffU : 0x7ffU,
                               .extended = frame.extended});
        }
    }
    opened->set_filters(filters);  // a driver with fewer passes all frames
    can_ = std::move(opened);
    return {};
}

std::string StopTransmitter::open_ethernet(const std::string& address) {
    auto opened = ethernet::open(address);
    if (!opened) return opened.problem;
    const std::size_t max_bytes = ethernet::header_bytes + opened.port->statistics().mtu;
    for (const std::vector<std::uint8_t>& frame : frames_.ethernet) {
        if (frame.size() <= max_bytes) continue;
        return "a stop frame has " + std::to_string(frame.size()) + " bytes, and " + address +
               " sends at most " + std::to_string(max_bytes) +
               "; write a shorter one, or raise the MTU of the interface";
    }
    sees_bus_ = opened.port->description().in_memory;
    ethernet_ = std::move(opened.port);
    return {};
}

void StopTransmitter::begin(std::int64_t now_ns) noexcept {
    receive(now_ns);
    outcome_ = Outcome::sending;
    failure_ = Failure::none;
    unsent_ = 0;
    late_attempts_ = 0;
    begun_ns_ = now_ns;
    last_sent_ns_ = now_ns;
    rounds_sent_ = 0;
    missing_confirmations_ = bits(frames_.confirmations.size());
    begin_attempt(now_ns);
}

std::int64_t StopTransmitter::work(std::int64_t now_ns) noexcept {
    receive(now_ns);
    if (is_over()) return now_ns + attempt_limit_ns;
    std::int64_t pause_ns = schedule_.every_ns;
    if (outcome_ == Outcome::delayed) {
        pause_ns = std::min(pause_ns, retry_ns);
    }
    if (!in_attempt_ && now_ns >= attempt_ns_ + pause_ns) {
        begin_attempt(now_ns);
        receive(now_ns);
    }
    return now_ns + poll_ns;
}

bool StopTransmitter::is_ready() const noexcept {
    if (ethernet_) return ethernet_->statistics().up;
    if (!can_) return false;
    const can::State state = can_->state();
    return state != can::State::down && state != can::State::bus_off;
}

int StopTransmitter::descriptor() const noexcept {
    if (ethernet_) return ethernet_->descriptor();
    return can_ ? can_->descriptor() : -1;
}

void StopTransmitter::begin_attempt(std::int64_t now_ns) noexcept {
    if (rounds_sent_ >= schedule_.rounds) {
        // the last round had its time for the confirmations
        outcome_ = Outcome::unconfirmed;
        return;
    }
    attempt_ns_ = now_ns;
    in_attempt_ = true;
    missing_echoes_.fill(0);
    if (ethernet_) {
        send_ethernet(now_ns);
    } else {
        send_can(now_ns);
    }
    follow_attempt(now_ns);
}

void StopTransmitter::send_can(std::int64_t now_ns) noexcept {
    can_->discard_queued();
    if (outcome_ == Outcome::delayed && can_->set_urgent(true)) {
        queue_can(now_ns);
        // what the interface has not accepted urgently has no echo
        const std::uint32_t queued = can_->statistics().queued;
        for (std::size_t n = frames_.can.size(); n-- > 0 && n + queued >= frames_.can.size();) {
            missing_echoes_[n] = 0;
        }
        can_->discard_queued();
        can_->set_urgent(false);
        in_attempt_ = true;
    }
    dropped_ = is_in_memory_ ? 0 : can_->statistics().dropped;
    queue_can(now_ns);
}

void StopTransmitter::queue_can(std::int64_t now_ns) noexcept {
    for (std::size_t n = 0; n < frames_.can.size(); ++n) {
        const Failure failure = failure_of(can_->send(frames_.can[n], now_ns));
        if (failure != Failure::none) {
            leave_out(n, failure);
        } else if (sees_bus_) {
            ++missing_echoes_[n];
        }
    }
    can_->flush(now_ns);
}

void StopTransmitter::send_ethernet(std::int64_t now_ns) noexcept {
    const bool is_up = ethernet_->statistics().up;
    for (std::size_t n = 0; n < frames_.ethernet.size(); ++n) {
        Failure failure = failure_of(ethernet_->send(frames_.ethernet[n], {}, now_ns));
        if (failure == Failure::none && !is_up) {
            failure = Failure::down;
        }
        if (failure != Failure::none) {
            leave_out(n, failure);
        }
    }
}

/// The link has not accepted a frame: the attempt fails, and the others are still sent.
void StopTransmitter::leave_out(std::size_t frame, Failure why) noexcept {
    const std::uint32_t before = in_attempt_ ? 0 : unsent_;
    fail(before | bit(frame), why);
}

/// Decides whether the attempt is complete, or has failed.
void StopTransmitter::follow_attempt(std::int64_t now_ns) noexcept {
    if (!in_attempt_) return;
    if (can_ && !is_in_memory_) {
        can_->flush(now_ns);  // what the interface did not accept at once
        if (can_->statistics().dropped != dropped_) {
            const std::uint32_t missing = missing_frames();
            const Failure link = failure_of_link();
            return fail(missing != 0 ? missing : bits(frames_.can.size()),
                        link != Failure::none ? link : Failure::rejected);
        }
    }
    const std::uint32_t missing = missing_frames();
    if (missing == 0) return end_round(now_ns);
    Failure why = failure_of_link();
    if (why == Failure::down || why == Failure::bus_off)
        return fail(missing, why);  // they are lost
    if (now_ns - attempt_ns_ < attempt_limit_ns << std::min(late_attempts_, max_doublings)) return;
    ++late_attempts_;
    if (why == Failure::none) {
        why = sees_bus_ ? Failure::unacknowledged : Failure::full;
    }
    fail(missing, why);
}

/// Returns a bit for each frame of the attempt that may not be sent yet.
std::uint32_t StopTransmitter::missing_frames() const noexcept {
    std::uint32_t missing = 0;
    for (std::size_t n = 0; n < frames_.can.size(); ++n) {
        if (missing_echoes_[n] != 0) {
            missing |= bit(n);
        }
    }
    if (!can_ || sees_bus_) return missing;
    const auto queued = std::min<std::size_t>(can_->statistics().queued, frames_.can.size());
    return bits(frames_.can.size()) & ~bits(frames_.can.size() - queued);
}

Failure StopTransmitter::failure_of_link() const noexcept {
    switch (can_->state()) {
    case can::State::down: return Failure::down;
    case can::State::bus_off: return Failure::bus_off;
    default: break;
    }
    const bool is_full = !is_in_memory_ && can_->statistics().queued != 0;
    return is_full ? Failure::full : Failure::none;
}

void StopTransmitter::fail(std::uint32_t missing, Failure why) noexcept {
    in_attempt_ = false;
    unsent_ = missing;
    failure_ = why;
    outcome_ = Outcome::delayed;
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
    follow_attempt(
        now_ns);  // a round that is complete counts before its confirmation ends the stop
    if (!is_over() && rounds_sent_ != 0 && is_confirmed() && !frames_.confirmations.empty()) {
        in_attempt_ = false;
        outcome_ = Outcome::confirmed;
    }
}

void StopTransmitter::accept(const can::Frame& frame) noexcept {
    for (std::size_t n = 0; frame.own && n < frames_.can.size(); ++n) {
        if (missing_echoes_[n] == 0 || !frame.same(frames_.can[n])) continue;
        --missing_echoes_[n];
        return;
    }
    // one that was sent before the stop frames confirms nothing
    const bool is_early = rounds_sent_ == 0 && (!in_attempt_ || missing_frames() != 0);
    for (std::size_t n = 0; !is_early && n < frames_.confirmations.size(); ++n) {
        if (is_confirmation(frame, frames_.confirmations[n])) {
            missing_confirmations_ &= ~bit(n);
        }
    }
}

void StopTransmitter::end_round(std::int64_t now_ns) noexcept {
    in_attempt_ = false;
    late_attempts_ = 0;
    ++rounds_sent_;
    last_sent_ns_ = now_ns;
    outcome_ = Outcome::sending;
    unsent_ = 0;
    failure_ = Failure::none;
    if (frames_.confirmations.empty()) {
        if (rounds_sent_ == schedule_.rounds) {
            outcome_ = Outcome::sent;
        }
    } else if (is_confirmed()) {
        outcome_ = Outcome::confirmed;
    }
}

}  // namespace hal::guardian
