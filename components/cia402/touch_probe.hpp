// SPDX-License-Identifier: MIT
// The master's side of a touch probe of CiA 402 (60B8h to 60BDh): it arms the probe of the drive,
// and knows when the drive has latched a position. It knows no bus.
#pragma once

#include <cstdint>
#include <optional>

namespace hal::cia402 {

/// A probe of a drive. All functions are called by one thread, in its cycle. [realtime]
///
///     off ---- enable ----> releasing ---- drive shows it off ----> armed ---- edge ----> latched
///      ^                        ^                                     |                      |
///      |                        +------- other settings --------------+----------------------+
///      +------------------ enable FALSE, or the drive is lost (from any state)
class TouchProbe {
public:
    /// Commands of the user.
    struct Command {
        bool enable = false;  ///< a rising edge arms, false releases
        bool falling = false;  ///< latches at the falling edge of the input
        bool continuous = false;  ///< latches at each edge; else at the first one
        bool index = false;  ///< latches at the index pulse of the encoder instead of an input

        bool operator==(const Command&) const = default;
    };
    /// What the drive reports of this probe.
    struct Feedback {
        bool operational = true;  ///< the drive sends process data
        std::uint8_t status = 0;  ///< its byte of 60B9h
        std::int32_t rising = 0;  ///< position of the rising edge: 60BAh or 60BCh
        std::int32_t falling = 0;  ///< of the falling edge: 60BBh or 60BDh
    };

    /// Takes the feedback of a cycle. An edge is reported one cycle after the drive first shows it,
    /// because status and position may come with two PDOs.
    void observe(const Feedback&) noexcept;
    /// Returns the byte of 60B8h of this probe.
    std::uint8_t act(const Command&) noexcept;

    /// Returns whether the drive waits for an edge, or has latched it.
    bool armed() const noexcept { return armed_; }
    /// Returns whether a position was latched since the probe was armed.
    bool latched() const noexcept { return state_ == State::latched; }
    /// Returns the position that was latched last, in the units of the drive; nullopt: none yet.
    std::optional<std::int32_t> position() const noexcept { return position_; }

private:
    enum class State : std::uint8_t { off, releasing, armed, stored, latched };

    State state_ = State::off;
    Command command_;  ///< which the probe is armed with
    Feedback feedback_;
    bool armed_ = false;
    std::optional<std::int32_t> position_;
};

}  // namespace hal::cia402
