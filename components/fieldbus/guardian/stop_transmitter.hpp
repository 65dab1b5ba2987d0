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
enum class Outcome : std::uint32_t {
    none,         ///< nothing had to be stopped by now
    sending,      ///< not yet known
    sent,         ///< as often as was asked for
    confirmed,    ///< and all confirmations have been received
    unconfirmed,  ///< but not all confirmations have been received
    delayed,      ///< the link does not take them; they are tried again
};

/// How the frames are sent.
struct StopSchedule {
    std::uint32_t rounds = 3;              ///< how often all frames are sent
    std::int64_t every_ns = 10'000'000;    ///< from one round to the next
};

/// Sends all frames in their order, `rounds` times. A CAN frame counts as sent when its echo has
/// been received, so another node has acknowledged it (SocketCAN and buses in memory); on other
/// links, when the driver has taken it. With confirmations a round is repeated until all of them
/// have been received, and at most `rounds` times.
///
/// All functions but open() are [realtime], and belong to one thread at a time. Times are those of
/// the link: of CLOCK_MONOTONIC, or of the runtime.
class StopTransmitter {
public:
    StopTransmitter(StopFrames frames, StopSchedule schedule);

    /// Opens the link. Returns the problem, or "". [setup]
    std::string open(const std::string& address);
    /// Begins a stop; one that is not over begins again.
    void begin(std::int64_t now_ns) noexcept;
    /// Does what is due. Returns when it has to be called again at the latest.
    std::int64_t work(std::int64_t now_ns) noexcept;
    /// The stop is over: nothing more is sent.
    void release() noexcept { outcome_ = Outcome::none; }

    Outcome outcome() const noexcept { return outcome_; }
    /// Returns true when nothing more will be sent for the last stop.
    bool is_over() const noexcept {
        return outcome_ != Outcome::sending && outcome_ != Outcome::delayed;
    }
    std::uint32_t rounds_sent() const noexcept { return rounds_sent_; }
    /// Returns the time from begin() to the end of the last complete round.
    std::int64_t elapsed_ns() const noexcept { return last_sent_ns_ - begun_ns_; }
    /// Returns the state of the link, for a message: "bus off", "down" … [any]
    const char* link_state() const noexcept;
    /// Returns a descriptor that polls readable when a frame may have arrived, or -1.
    int descriptor() const noexcept;
    /// Returns how long the destructor may wait, ns. [setup]
    std::int64_t closing_ns() const noexcept { return can_ ? can_->closing_ns() : 0; }

private:
    void send_round(std::int64_t now_ns) noexcept;
    bool send_can(std::int64_t now_ns) noexcept;
    bool send_ethernet(std::int64_t now_ns) noexcept;
    void receive(std::int64_t now_ns) noexcept;
    void accept(const can::Frame& frame) noexcept;
    void end_round(std::int64_t now_ns) noexcept;
    bool is_confirmed() const noexcept { return missing_confirmations_ == 0; }

    const StopFrames frames_;
    const StopSchedule schedule_;
    std::unique_ptr<can::Link> can_;
    std::unique_ptr<ethernet::Port> ethernet_;
    bool has_echo_ = false;

    Outcome outcome_ = Outcome::none;
    std::int64_t begun_ns_ = 0;
    std::int64_t round_ns_ = 0;       // begin of the last round
    std::int64_t last_sent_ns_ = 0;   // end of the last complete round
    bool in_round_ = false;           // echoes are missing
    std::uint32_t rounds_sent_ = 0;
    std::uint32_t missing_echoes_ = 0;          // a bit for each frame
    std::uint32_t missing_confirmations_ = 0;   // a bit for each confirmation
    std::array<can::Frame, 16> buffer_;
};

}  // namespace hal::guardian
