// SPDX-License-Identifier: MIT
// One axis of a drive: state machine, modes, position, velocity and torque loops, monitoring.
// Inside, positions are encoder increments counted from power-on, not rounded: the loops see the
// encoder as one that interpolates; the objects show whole numbers. drive_state.cpp has the state
// machine and faults, drive_modes.cpp, drive_profiles.cpp and drive_cyclic.cpp the modes,
// drive_servo.cpp the loops, drive_axis.cpp monitoring and the values of the objects.
#pragma once

#include <cmath>

#include "drive_homing.hpp"
#include "drive_objects.hpp"
#include "drive_plant.hpp"
#include "drive_trajectory.hpp"

namespace hal::canopen::cia402 {

/// Rounds to the next integer; clamps what is beyond any counter. [any]
inline std::int64_t whole(double value) noexcept {
    constexpr double most = 1LL << 52;
    if (value >= -most && value <= most) return std::llround(value);
    if (value > 0) return 1LL << 52;
    return -(1LL << 52);
}

/// Converts 1/min to 1/s. [any]
constexpr double per_second(double per_minute) noexcept { return per_minute / 60; }

/// The axis. [realtime] unless marked.
class DriveAxis final : public Handler {
public:
    /// Creates axis `number`, counted from 0. [setup]
    DriveAxis(unsigned number, const AxisSettings&);
    /// Binds its values to the object dictionary. [setup]
    void attach(Device&);
    /// Handles power-on and the reset of the application: the encoder counts from 0.
    void power_up() noexcept;
    /// Advances by `dt` s, at most 1 ms.
    void step(double dt) noexcept;
    /// Handles the loss of the master as configured in 6007h.
    void lose_connection() noexcept;

    AxisStatus status() const noexcept;
    void set_load_torque(double torque) noexcept { load_ = torque; }
    void set_inputs(std::uint32_t bits) noexcept { external_inputs_ = bits & 0xffff0000; }
    void set_dc_link(double volts) noexcept { dc_link_ = volts; }
    void set_encoder_broken(bool broken) noexcept { encoder_cut_ = broken; }

    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override;

private:
    enum class Control : std::uint8_t { off, position, velocity, torque };
    enum class Cause : std::uint8_t {
        over_current,
        over_voltage,
        under_voltage,
        over_temperature,
        position_sensor,
        over_speed,
        connection,
        following_error,
    };
    static constexpr unsigned causes = 8;
    enum class HomingPhase : std::uint8_t { idle, search, back, done, error };
    struct SetPoint {
        double target = 0;
        Profile::Limits limits{};
    };
    template <class T, unsigned room>
    struct Queue {
        std::array<T, room> items{};
        unsigned head = 0;
        unsigned count = 0;
        bool full(unsigned most = room) const noexcept { return count >= most; }
        void clear() noexcept { head = count = 0; }
        void push(const T& item) noexcept { items[(head + count++) % room] = item; }
        const T& front() const noexcept { return items[head]; }
        void pop() noexcept {
            head = (head + 1) % room;
            --count;
        }
    };

    // State machine.
    void take_controlword() noexcept;
    void go_on_with_state(double dt) noexcept;
    void enter(State) noexcept;
    void stop_then(Stop, State then) noexcept;
    bool torque_state() const noexcept;
    bool brake_closed() const noexcept;
    bool powered() const noexcept { return torque_state() || engage_left_ > 0; }
    void raise(Cause, std::int32_t detail = 0) noexcept;
    bool present(Cause) const noexcept;
    void try_reset() noexcept;
    void watch_causes() noexcept;

    // Motion.
    void read_units() noexcept;
    void select_mode() noexcept;
    void restart_mode() noexcept;
    void make_reference(double dt) noexcept;
    void follow() noexcept;
    void take(Control) noexcept;
    bool stop_step(Stop, double dt) noexcept;
    double stop_rate(Stop) const noexcept;
    bool standing() const noexcept;
    void mode_step(double dt) noexcept;
    void profile_position(double dt) noexcept;
    void accept_set_point() noexcept;
    void start_set_point(const SetPoint&) noexcept;
    void profile_velocity(double dt) noexcept;
    void vl_velocity(double dt) noexcept;
    void profile_torque(double dt) noexcept;
    void interpolated_position(double dt) noexcept;
    void cyclic_position(double dt) noexcept;
    void cyclic_velocity(double dt) noexcept;
    void cyclic_torque(double dt) noexcept;
    void homing(double dt) noexcept;
    void go_back_home() noexcept;
    void guard_limits(const Motion& before, double dt) noexcept;
    bool blocked(int direction) const noexcept;
    Range software_limits() const noexcept;  // encoder
    double within_limits(double target) noexcept;
    double absolute(std::int32_t target, double near) const noexcept;
    double nearest(std::int32_t target, double near) const noexcept;

    double servo(double dt) noexcept;
    void monitor(double dt) noexcept;
    void watch_probes() noexcept;
    void watch_probe(unsigned n, unsigned function, unsigned before, std::uint8_t& status) noexcept;
    std::optional<double> probed(unsigned n, bool rising, bool index) const noexcept;
    void publish() noexcept;
    std::uint16_t mode_bits() const noexcept;

    // Units.
    double user(double encoder) const noexcept { return (encoder - origin_) / units_.position; }
    double encoder(double user) const noexcept { return origin_ + user * units_.position; }
    std::int32_t shown(double encoder) const noexcept;
    double highest_speed() const noexcept;  // increments/s
    double torque_of(double per_mille) const noexcept {
        return per_mille / 1000 * settings_.motor.rated_torque;
    }
    double acceleration(std::uint32_t wanted) const noexcept;
    double deceleration(std::uint32_t wanted) const noexcept;
    Profile::Limits profile_limits() const noexcept;
    double corner_time() const noexcept;
    Motion& unsmoothed(bool position_matters) noexcept;
    double period() const noexcept;
    double now_speed() const noexcept { return plant_.speed() * plant_.increments_per_radian(); }
    bool cyclic() const noexcept { return mode_ >= Mode::cyclic_position; }

    const unsigned number_;
    const AxisSettings settings_;
    Objects objects_;
    Device* device_ = nullptr;
    Plant plant_;
    double load_ = 0, dc_link_;
    std::uint32_t external_inputs_ = 0;
    std::uint32_t inputs_ = 0;
    std::uint32_t inputs_before_ = 0;
    bool encoder_cut_ = false;

    struct Units {
        // increments (per second) per unit, with the sign of 607Eh
        double position = 1;
        double velocity = 1;
        double speed = 1;
        double acceleration = 1;   // without
    } units_;
    double encoder_zero_ = 0;  // along the travel, where the encoder counts 0
    double measured_ = 0;      // encoder
    double origin_ = 0;        // encoder, where the user's position is 0

    State state_ = State::not_ready_to_switch_on;
    std::uint16_t control_ = 0;
    std::uint16_t edges_ = 0;
    // transition 3 was made by "enable operation"; 4 follows
    bool enable_next_ = false;
    bool stopping_ = false;
    Stop stop_ = Stop::disable;
    State after_stop_ = State::unknown;
    double stop_time_ = 0;
    double still_time_ = 0;  // since the demand is 0, and since standstill
    std::uint16_t faults_ = 0;              // a bit for each Cause
    double release_left_ = 0;
    double engage_left_ = 0;
    bool connected_ = true;

    Mode mode_ = Mode::none;
    Control loop_ = Control::off;
    Motion ref_;                            // at the end of this step
    double demand_before_ = 0;              // position at its beginning
    double torque_ref_ = 0;                 // N·m
    double wanted_ = 0;                     // its sign is the commanded direction
    double integral_ = 0;
    double velocity_wanted_ = 0;
    double torque_demand_ = 0;
    bool limited_ = false;
    bool saturated_ = false;

    Profile profile_;
    Smoother smoother_;                     // of pp and pv
    Interpolator interpolator_;
    Queue<SetPoint, 4> set_points_;
    SetPoint active_set_point_;
    Queue<std::int32_t, interpolation_room> records_;
    double last_target_ = 0;
    bool active_ = false;
    bool acknowledged_ = false;
    bool halted_ = false;
    bool has_target_ = false;

    bool fresh_ = false;
    bool reached_ = false;
    bool record_lost_ = false;
    int guard_ = 0;                         // direction in which a limit stops the motion
    Motion guarded_;
    double following_time_ = 0;
    double reached_time_ = 0;
    double speed_zero_time_ = 0;
    bool following_ = false;
    bool speed_zero_ = false;
    bool slipping_ = false;

    HomingSearch search_;
    HomingPhase homing_phase_ = HomingPhase::idle;
    bool homed_ = false;

    std::uint16_t probe_function_ = 0;
    std::array<std::uint8_t, 2> probe_waits_{};  // edges not found yet
};

}  // namespace hal::canopen::cia402
