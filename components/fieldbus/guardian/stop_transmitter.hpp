// SPDX-License-Identifier: MIT
// Sends the stop frames of a link, and sees what became of them.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "fieldbus/guardian/stop_frames.hpp"
#include "link/can.hpp"
#include "link/ethernet.hpp"

namespace hal::guardian {

/// What became of the frames of the last stop.
enum class Outcome : std::uint8_t {
    none,         ///< nothing had to be stopped by now
    sending,      ///< not yet known
    sent,         ///< as often as was asked for
    confirmed,    ///< and all confirmations have been received
    unconfirmed,  ///< but not all confirmations have been received
    delayed,      ///< the last attempt has failed; the frames are tried again
};

/// Why the last attempt to send a round has failed. The texts of to_string() are in this order.
enum class Failure : std::uint8_t { none, full, bus_off, down, rejected, unacknowledged };
/// Returns the text of a failure, for a message. [any]
const char* to_string(Failure) noexcept;

/// How the frames are sent.
struct StopSchedule {
    std::uint32_t rounds = 3;            ///< how often all frames are sent
    std::int64_t every_ns = 10'000'000;  ///< from one round to the next

    /// Returns how long all rounds take, with the time for the confirmations of the last one, on a
    /// link that accepts them at once.
    constexpr std::int64_t duration_ns() const noexcept { return rounds * every_ns; }
};
/// The longest schedule.
inline constexpr std::int64_t max_duration_ns = 60'000'000'000;

/// Sends all frames in their order, `rounds` times. On a link with an echo (can::Description) a
/// frame counts as sent when its echo has been received; on other links when the driver has
/// accepted it. With confirmations a round is repeated until all of them have been received, and at
/// most `rounds` times.
///
/// An attempt at a round fails when the link rejects a frame or is lost, or when the round is not
/// complete after 0.1 s. It is made again until it succeeds, so no round is ever left out. What this link
/// still has in its queue is discarded first. The frames of other programs may wait in the queue of
/// the interface, and are not ours to discard. So the frames of a second attempt are sent twice
/// where the interface has priorities: urgently, ahead of what waits, and behind it, because an old
/// command that follows a stop frame would undo it. The round is complete when both were on the bus.
///
/// All functions but open() are [realtime], and belong to one thread at a time. Times are those of
/// the link: of CLOCK_MONOTONIC, or of the runtime.
class StopTransmitter {
public:
    StopTransmitter(StopFrames frames, StopSchedule schedule);

    /// Opens the link. Returns the problem, or "": also that of a link that will never send the
    /// frames. [setup]
    std::string open(const std::string& address);
    /// Uses a CAN link that was opened with Options::own_frames. Returns the problem, or "". [setup]
    std::string attach(std::unique_ptr<can::Link> link);
    /// Begins a stop; one that is not over begins again.
    void begin(std::int64_t now_ns) noexcept;
    /// Does what is due. Returns when it has to be called again at the latest.
    std::int64_t work(std::int64_t now_ns) noexcept;

    Outcome outcome() const noexcept { return outcome_; }
    /// Returns true when nothing more will be sent for the last stop.
    bool is_over() const noexcept {
        return outcome_ != Outcome::sending && outcome_ != Outcome::delayed;
    }
    std::uint32_t rounds_sent() const noexcept { return rounds_sent_; }
    /// Returns the time from begin() to the end of the last complete round.
    std::int64_t elapsed_ns() const noexcept { return last_sent_ns_ - begun_ns_; }
    /// Returns a bit for each frame that was not sent in the last attempt, and why.
    std::uint32_t unsent() const noexcept { return unsent_; }
    Failure failure() const noexcept { return failure_; }
    /// Returns whether a frame that counts as sent has been on the bus; else the driver has
    /// accepted it.
    bool sees_bus() const noexcept { return sees_bus_; }
    /// Returns whether the link would accept a frame now, as far as it knows. [any]
    bool is_ready() const noexcept;
    const StopSchedule& schedule() const noexcept { return schedule_; }
    /// Returns the frames as they were declared. [any]
    const StopFrames& frames() const noexcept { return frames_; }
    /// Returns a descriptor that polls readable when a frame may have arrived, or -1.
    int descriptor() const noexcept;
    /// Returns how long the destructor may wait, ns. [setup]
    std::int64_t closing_ns() const noexcept { return can_ ? can_->closing_ns() : 0; }

private:
    std::string open_can(const std::string& address);
    std::string open_ethernet(const std::string& address);
    void begin_attempt(std::int64_t now_ns) noexcept;
    void send_can(std::int64_t now_ns) noexcept;
    void queue_can(std::int64_t now_ns) noexcept;
    void send_ethernet(std::int64_t now_ns) noexcept;
    void leave_out(std::size_t frame, Failure why) noexcept;
    void follow_attempt(std::int64_t now_ns) noexcept;
    std::uint32_t missing_frames() const noexcept;
    Failure failure_of_link() const noexcept;
    void fail(std::uint32_t missing, Failure why) noexcept;
    void receive(std::int64_t now_ns) noexcept;
    void accept(const can::Frame& frame) noexcept;
    void end_round(std::int64_t now_ns) noexcept;
    bool is_confirmed() const noexcept { return missing_confirmations_ == 0; }

    const StopFrames frames_;
    const StopSchedule schedule_;
    std::unique_ptr<can::Link> can_;
    std::unique_ptr<ethernet::Port> ethernet_;
    bool sees_bus_ = false;
    bool is_in_memory_ = false;  // the queue of the link is that of the bus

    Outcome outcome_ = Outcome::none;
    Failure failure_ = Failure::none;
    std::uint32_t unsent_ = 0;  // of the last attempt that has failed
    std::int64_t begun_ns_ = 0;
    std::int64_t attempt_ns_ = 0;  // begin of the last attempt
    std::int64_t last_sent_ns_ = 0;  // end of the last complete round
    std::uint32_t rounds_sent_ = 0;

    std::uint32_t late_attempts_ = 0;  // at this round
    bool in_attempt_ = false;  // it may still succeed
    std::uint64_t dropped_ = 0;  // by the link, before the attempt
    std::array<std::uint8_t, max_frames> missing_echoes_{};  // of each frame
    std::uint32_t missing_confirmations_ = 0;  // a bit for each
    std::array<can::Frame, 16> buffer_;
};

/// Returns what "sent" means on a link, for a message: StopTransmitter::sees_bus().
constexpr const char* sent_text(bool sees_bus) noexcept {
    return sees_bus ? "sent" : "handed to the driver";
}

/// Appends the frames that were not sent, and why: `201#0000 and 1 more: the interface is down`.
void append_unsent(std::string& text, const StopFrames& frames, std::uint32_t unsent, Failure why);

}  // namespace hal::guardian
