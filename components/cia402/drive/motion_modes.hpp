// SPDX-License-Identifier: MIT
// The modes of operation of an axis: what the reference of the drivetrain does in the next step, in
// an enabled drive and while it stops. The state machine (drive_axis.hpp) decides which of both.
//
//     step()            the selected mode, with halt, limit switches and software limits
//     step_stop()       a stop on a ramp of 605Ah..605Eh
//     restart()         forgets set-points; on every change of the state or of the mode
#pragma once

#include <array>

#include "cia402/drive/drivetrain.hpp"
#include "cia402/drive/homing_search.hpp"

namespace hal::cia402 {

/// The controlword and its rising edges since the modes last looked.
struct Controlword {
    std::uint16_t bits = 0;
    std::uint16_t edges = 0;

    bool has(std::uint16_t mask) const noexcept { return (bits & mask) != 0; }
    bool rose(std::uint16_t mask) const noexcept { return (edges & mask) != 0; }
    /// Accepts a new value. Returns the bits that rose with it. [realtime]
    std::uint16_t accept(std::uint16_t word) noexcept {
        const auto rising = static_cast<std::uint16_t>(word & ~bits);
        bits = word;
        edges |= rising;
        return rising;
    }
};

/// A queue of fixed capacity.
template <class T, unsigned capacity>
class FixedQueue {
public:
    unsigned size() const noexcept { return count_; }
    bool empty() const noexcept { return count_ == 0; }
    bool full(unsigned limit = capacity) const noexcept { return count_ >= limit; }
    void clear() noexcept { head_ = count_ = 0; }
    void push(const T& item) noexcept { items_[(head_ + count_++) % capacity] = item; }
    T pop() noexcept {
        const T item = items_[head_];
        head_ = (head_ + 1) % capacity;
        --count_;
        return item;
    }

private:
    std::array<T, capacity> items_{};
    unsigned head_ = 0;
    unsigned count_ = 0;
};

/// The modes. [realtime]
class MotionModes {
public:
    /// All must outlive it. [setup]
    MotionModes(Drivetrain& train, AxisValues& values, Controlword& control) noexcept
        : train_(train), values_(values), control_(control) {}

    void power_up() noexcept;
    /// Selects the mode of 6060h. Returns true when it changed; restart() is due then. An SDO with
    /// an unsupported mode is rejected; a PDO with one is ignored.
    bool select() noexcept;
    void restart() noexcept;

    /// Makes the reference of a step in the selected mode.
    void step(double dt) noexcept;
    /// Makes the reference of a step while the brake is still closed.
    void hold() noexcept;
    /// Starts the time of a stop.
    void begin_stop() noexcept { stop_time_ = still_time_ = 0; }
    /// Makes the reference of a step on a stop ramp. Returns true when the axis has stopped.
    bool step_stop(Stop, double dt) noexcept;
    /// Ends a stop, whatever follows.
    void end_stop() noexcept { stop_time_ = 0; }
    /// Stands, or stops on the quick-stop ramp.
    void stand(double dt) noexcept { ramp_to_zero(Stop::quick_stop, dt); }

    /// A set-point of mode `mode` was written.
    void set_point_written(Mode mode) noexcept { fresh_ = fresh_ || mode_ == mode; }
    void record_written() noexcept;
    void clear_records() noexcept;
    bool records_full() const noexcept { return records_.full(values_.buffer_size); }

    Mode mode() const noexcept { return mode_; }
    bool cyclic() const noexcept { return mode_ >= Mode::cyclic_position; }
    bool homed() const noexcept { return homed_; }
    bool record_lost() const noexcept { return record_lost_; }
    unsigned records() const noexcept { return records_.size(); }

    /// What the monitoring of the axis contributes to the bits of a mode.
    struct Monitored {
        bool following_error = false;
        bool speed_zero = false;
        bool slipping = false;
    };
    /// Returns the bits of the statusword that depend on the mode, in operation enabled.
    std::uint16_t status_bits(const Monitored&) const noexcept;

private:
    enum class HomingPhase : std::uint8_t { idle, search, back, done, error };
    struct SetPoint {
        double target = 0;
        Profile::Limits limits{};
    };

    Motion& motion() noexcept { return train_.reference.motion; }
    Motion& unsmoothed(bool position_matters) noexcept;
    double stop_rate(Stop) const noexcept;
    void ramp_to_zero(Stop, double dt) noexcept;
    void step_halted(double dt) noexcept;
    void leave_halt() noexcept;
    void step_mode(double dt) noexcept;

    // profile position
    void profile_position(double dt) noexcept;
    void accept_set_point() noexcept;
    double requested_target(bool immediately, bool pending) const noexcept;
    void pass_without_stop(const SetPoint& next) noexcept;
    void start_set_point(const SetPoint&) noexcept;
    void follow_set_points(double dt) noexcept;
    void watch_arrival(double dt) noexcept;
    // profile velocity, vl, profile torque
    void profile_velocity(double dt) noexcept;
    void vl_velocity(double dt) noexcept;
    double vl_request() noexcept;
    void profile_torque(double dt) noexcept;
    // set-points of the master
    void interpolated_position(double dt) noexcept;
    void follow_records(double dt) noexcept;
    bool accept_fresh() noexcept;
    void cyclic_position(double dt) noexcept;
    void cyclic_velocity(double dt) noexcept;
    void cyclic_torque(double dt) noexcept;
    // homing
    void homing(double dt) noexcept;
    bool can_home(double fast, double slow) noexcept;
    double search_velocity(double fast, double slow) noexcept;
    void found_home() noexcept;
    void go_back_home() noexcept;
    bool homing_moves() const noexcept {
        return homing_phase_ == HomingPhase::search || homing_phase_ == HomingPhase::back;
    }
    // limits
    void guard_limits(const Motion& before, double dt) noexcept;
    int limit_ahead(double rate) const noexcept;
    void begin_guard(int direction, const Motion& before) noexcept;

    Drivetrain& train_;
    AxisValues& values_;
    Controlword& control_;
    Mode mode_ = Mode::none;
    double requested_ = 0;  // its sign is the commanded direction
    bool reached_ = false;
    bool halted_ = false;
    double reached_time_ = 0;
    double stop_time_ = 0;  // since the demand is 0
    double still_time_ = 0;  // and since standstill

    Profile profile_;
    Smoother smoother_;  // of pp and pv
    Interpolator interpolator_;
    FixedQueue<SetPoint, 4> set_points_;
    SetPoint active_set_point_;
    double last_target_ = 0;
    bool active_ = false;
    bool acknowledged_ = false;

    FixedQueue<std::int32_t, interpolation_capacity> records_;
    bool record_lost_ = false;
    bool fresh_ = false;  // a set-point of a cyclic mode was written
    bool has_target_ = false;  // and another one before

    int guard_ = 0;  // direction in which a limit stops the motion
    Motion guarded_;

    HomingSearch search_;
    HomingPhase homing_phase_ = HomingPhase::idle;
    bool homed_ = false;
};

}  // namespace hal::cia402
