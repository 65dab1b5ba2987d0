// SPDX-License-Identifier: MIT
#pragma once

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// The position of a drive, extended to 64 bits, under LinuxCNC's names of an encoder of a drive:
///
///     pos-enc = extended position * scale       pos-abs = the same from raw-home
///     pos     = the same from the reference, which an index or pos-reset moves
///
/// Not a channel of its own: a drive has one, and gives it the position of each cycle.
class PositionEncoder {
public:
    PositionEncoder(const ChannelPlan& plan, const std::string& name, unsigned bits)
        : shift_(64 - bits),
          raw_(plan.component, plan.reads, plan.pin(name + "-raw").c_str(),
               "position of the slave"),
          extended_low_(plan.component, plan.reads, plan.pin(name + "-ext-lo").c_str(),
                        "extended position, low 32 bits"),
          extended_high_(plan.component, plan.reads, plan.pin(name + "-ext-hi").c_str(),
                         "extended position, high 32 bits"),
          reference_low_(plan.component, plan.reads, plan.pin(name + "-ref-lo").c_str(),
                         "reference of pos, low 32 bits"),
          reference_high_(plan.component, plan.reads, plan.pin(name + "-ref-hi").c_str(),
                          "reference of pos, high 32 bits"),
          index_enable_(plan.component, plan.reads, plan.pin(name + "-index-ena").c_str(),
                        "moves the reference to the next turn; FALSE again afterwards"),
          reset_(plan.component, plan.reads, plan.pin(name + "-pos-reset").c_str(),
                 "moves the reference to this position"),
          pos_encoder_(plan.component, plan.reads, plan.pin(name + "-pos-enc").c_str(),
                       "position of the encoder"),
          pos_absolute_(plan.component, plan.reads, plan.pin(name + "-pos-abs").c_str(),
                        "position from raw-home"),
          pos_(plan.component, plan.reads, plan.pin(name + "-pos").c_str(),
               "position from the reference"),
          below_home_(plan.component, plan.reads, plan.pin(name + "-on-home-neg").c_str(),
                      "at raw-home or below"),
          above_home_(plan.component, plan.reads, plan.pin(name + "-on-home-pos").c_str(),
                      "at raw-home or above"),
          home_(plan.component, plan.reads, plan.pin(name + "-raw-home").c_str(),
                "position of the slave at the home switch"),
          bits_(plan.component, plan.reads, plan.pin(name + "-raw-bits").c_str(),
                "bits of the position", {.initial = bits}),
          turn_scale_(plan.component, plan.reads, plan.pin(name + "-pprev-scale").c_str(),
                      "turns of one step", {.initial = 1.0}) {}

    /// Extends a position of the slave. `steps_per_turn` of 0: unknown, the scale is that of a
    /// step. [realtime]
    void update(std::uint64_t raw, std::uint64_t steps_per_turn, double scale) noexcept {
        if (steps_per_turn != steps_per_turn_) {
            steps_per_turn_ = steps_per_turn;
            side_ = 0;
        }
        if (steps_per_turn != 0) {
            turn_scale_ = 1.0 / static_cast<double>(steps_per_turn);
        }
        const double step = steps_per_turn == 0 ? scale : turn_scale_.get() * scale;
        if (!initialised_) {
            last_ = extended_low_;
        }
        std::int64_t position = joined(extended_high_, extended_low_);
        position += difference(raw, last_);
        last_ = raw;
        raw_ = static_cast<std::int32_t>(raw);
        extended_high_ = high(position);
        extended_low_ = low(position);
        pos_encoder_ = static_cast<double>(position) * step;

        position += difference(0, home_);
        pos_absolute_ = static_cast<double>(position) * step;
        below_home_ = position <= 0;
        above_home_ = position >= 0;
        follow_index(position);
        if (!initialised_ || reset_) {
            refer_to(position);
            initialised_ = true;
        }
        pos_ = static_cast<double>(position - joined(reference_high_, reference_low_)) * step;
    }

private:
    static std::int64_t joined(std::uint32_t high, std::uint32_t low) noexcept {
        return static_cast<std::int64_t>(static_cast<std::uint64_t>(high) << 32 | low);
    }
    static std::uint32_t low(std::int64_t value) noexcept {
        return static_cast<std::uint32_t>(value);
    }
    static std::uint32_t high(std::int64_t value) noexcept {
        return static_cast<std::uint32_t>(static_cast<std::uint64_t>(value) >> 32);
    }
    std::int64_t difference(std::uint64_t a, std::uint64_t b) const noexcept {
        return static_cast<std::int64_t>((a - b) << shift_) >> shift_;
    }
    void refer_to(std::int64_t position) noexcept {
        reference_high_ = high(position);
        reference_low_ = low(position);
    }
    /// Moves the reference to the beginning of a turn when the position passes it.
    void follow_index(std::int64_t position) noexcept {
        if (!index_enable_) {
            side_ = 0;
            return;
        }
        const bool has_turns = steps_per_turn_ >= 4 && steps_per_turn_ <= 0xffffffff;
        if (!has_turns) {
            index_enable_ = false;
            refer_to(position);
            return;
        }
        const auto turn = static_cast<std::int64_t>(steps_per_turn_);
        std::int64_t rest = (position % turn + turn) % turn;
        if (rest > turn / 2) {
            rest -= turn;
        }
        const int side = rest >= 0 ? 1 : -1;
        const bool near_mark = std::abs(rest) <= turn / 4;
        if (side_ != 0 && side != side_ && near_mark) {
            index_enable_ = false;
            refer_to(position - rest);
        }
        side_ = side;
    }

    const unsigned shift_;
    Out<std::int32_t> raw_;
    Io<std::uint32_t> extended_low_, extended_high_;
    Out<std::uint32_t> reference_low_, reference_high_;
    Io<bool> index_enable_;
    In<bool> reset_;
    Out<double> pos_encoder_, pos_absolute_, pos_;
    Out<bool> below_home_, above_home_;
    Param<std::uint32_t> home_;
    Out<std::uint32_t> bits_;
    Out<double> turn_scale_;
    std::uint64_t steps_per_turn_ = 0;
    std::uint64_t last_ = 0;
    int side_ = 0;
    bool initialised_ = false;
};

}  // namespace hal::ethercat
