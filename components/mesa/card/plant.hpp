// SPDX-License-Identifier: MIT
// The machine behind an emulated card: motors, switches, spindles.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mesa/card/card_config.hpp"

namespace hal::mesa {

/// What an encoder saw while some time passed.
struct EncoderMotion {
    unsigned encoder = 0;
    std::int64_t from = 0, to = 0;
    std::int64_t index_every = 0;
    double newest_edge = 1.0;  ///< when it was, as a share of the time that passed
};

/// Moves with the steps and outputs of a card. It knows no register. [realtime], except the
/// constructor.
class Plant {
public:
    /// `config` outlives it. [setup]
    explicit Plant(const CardConfig& config);

    /// Steps that reached the motors behind a step generator.
    void step(unsigned stepgen, std::int64_t steps) noexcept;
    /// The command of a spindle: -1..1.
    void drive(std::size_t spindle, double command) noexcept {
        spindles_[spindle].command = command;
    }
    /// Lets time pass.
    void advance(double seconds) noexcept;
    /// What the encoders saw in the last advance().
    std::span<const EncoderMotion> encoders() const noexcept { return encoders_; }

    /// Returns the motor behind a step generator that has an index for it: one without an encoder.
    /// [any]
    std::optional<std::size_t> indexed_motor(unsigned stepgen) const noexcept;
    std::int64_t steps(std::size_t motor) const noexcept { return motors_[motor].steps; }
    /// Returns the step at which a switch changes between two positions of its motor; nothing: it
    /// does not.
    std::optional<std::int64_t> step_of_change(std::size_t switch_index, std::int64_t from,
                                               std::int64_t to) const noexcept;
    /// Returns the first step between two positions at which the index of a motor, a step wide,
    /// becomes `level`.
    std::optional<std::int64_t> step_of_index(std::size_t motor, std::int64_t from, std::int64_t to,
                                              bool level) const noexcept;
    bool has_encoder(unsigned encoder) const noexcept;
    bool is_closed(std::size_t switch_index) const noexcept;
    /// Position in units of length.
    double position(std::size_t motor) const noexcept;
    /// Steps that a mechanical stop has swallowed.
    std::uint64_t lost_steps(std::size_t motor) const noexcept { return motors_[motor].lost; }
    double rpm(std::size_t spindle) const noexcept { return spindles_[spindle].rpm; }

private:
    struct Motor {
        std::int64_t steps = 0, min = 0, max = 0;
        std::uint64_t lost = 0;
    };
    struct Spindle {
        double command = 0.0;
        double rpm = 0.0;
        double turns = 0.0;
    };
    /// An encoder and where it was.
    struct Feedback {
        bool is_spindle = false;
        std::size_t part = 0;
        double edges_per_unit = 1.0;
        double edges = 0.0;
    };
    bool is_closed_at(const SwitchConfig& one, double position) const noexcept;
    double unit_of(const Feedback& feedback) const noexcept;

    const CardConfig& config_;
    std::vector<Motor> motors_;
    std::vector<Spindle> spindles_;
    std::vector<Feedback> feedbacks_;
    std::vector<EncoderMotion> encoders_;  ///< of each feedback
};

}  // namespace hal::mesa
