// SPDX-License-Identifier: MIT
// One axis of a simulated drive, without a bus: the state machine of CiA 402 and the faults, over a
// drivetrain and its modes of operation. A bus binds an object dictionary to values(), calls
// check() before and written() after a write of a master, and reports the faults (AxisBus).
//
//     DriveAxis axis(settings);                    // [setup]
//     axis.connect(bus);
//     axis.values().controlword = 6, axis.written(object::controlword, 0);
//     each cycle: axis.step(dt);
//
// The states, with the numbers of their transitions:
//
//     not ready ──1─► switch on disabled ──2─► ready ──3─► switched on ──4─► operation enabled
//                          ▲  ▲               ◄─6──        ◄──────5──           │ 11     ▲ 16
//                          │  └─ 7, 9, 10, 12 from the states right of it        ▼        │
//                          15                                           quick stop active ┘
//                          └─ fault ◄──14── fault reaction active ◄──13── any state
#pragma once

#include <optional>
#include <span>

#include "cia402/drive/axis_faults.hpp"
#include "cia402/drive/axis_monitor.hpp"
#include "cia402/drive/motion_modes.hpp"
#include "cia402/drive/touch_probes.hpp"

namespace hal::cia402 {

/// Whether an axis accepts a write.
enum class WriteCheck : std::uint8_t { accepted, invalid_value, wrong_state, buffer_full };

/// The axis. [realtime] unless marked.
class DriveAxis {
public:
    explicit DriveAxis(const AxisSettings&);  ///< [setup]
    DriveAxis(const DriveAxis&) = delete;
    DriveAxis& operator=(const DriveAxis&) = delete;

    /// The bus must outlive it. [setup]
    void connect(AxisBus& bus) noexcept { faults_.connect(bus); }
    /// Handles power-on and the reset of the application: the encoder counts from 0.
    void power_up() noexcept;
    /// Handles the loss of the drive's supply: the motor has no torque, and the brake closes.
    void power_down() noexcept;
    /// Advances by `dt` s, at most 1 ms.
    void step(double dt) noexcept;
    /// Advances the motor of a drive without supply by `dt` s, at most 1 ms.
    void coast(double dt) noexcept;
    /// Returns true when the motor moves, or has torque.
    bool moves() const noexcept { return powered() || train_.speed() != 0 || around_.load != 0; }
    /// Handles the loss of the master as configured in 6007h. Unless 6007h = 0 keeps the drive as it
    /// is, "ready to switch on" becomes "switch on disabled", and the controlword counts as 0.
    void lose_connection() noexcept;
    /// Raises a fault of the device with its code (603Fh), until the next reset.
    void fail(std::uint16_t code) noexcept;

    /// The values of the objects, to be bound to a dictionary.
    AxisValues& values() noexcept { return values_; }
    /// Checks a write to an object of the first axis; `value` is little-endian.
    WriteCheck check(std::uint16_t index, std::span<const std::uint8_t> value) const noexcept;
    /// Applies a value that was written to an object of the first axis.
    void written(std::uint16_t index, std::uint8_t sub) noexcept;

    AxisStatus status() const noexcept;
    void set_load_torque(double torque) noexcept { around_.load = torque; }
    /// Sets inputs of 60FDh, besides those of the switches along the travel.
    void set_inputs(std::uint32_t bits) noexcept { around_.inputs = bits; }
    void set_dc_link(double volts) noexcept { around_.dc_link = volts; }
    void set_encoder_broken(bool broken) noexcept { around_.encoder_cut = broken; }

private:
    /// A stop on a ramp, and the state after it; unknown: stays.
    struct Stopping {
        Stop ramp;
        State then;
    };

    /// Returns whether the axis supports a value of at most two bytes of an object.
    bool is_supported(std::uint16_t index, unsigned value) const noexcept;
    void accept_controlword() noexcept;
    void command_written() noexcept;
    void command_ready(Command) noexcept;
    void command_switched_on(Command) noexcept;
    void command_enabled(Command) noexcept;
    void command_quick_stop(Command) noexcept;
    void quick_stop() noexcept;
    void stay_enabled() noexcept;
    void abort_connection(AbortConnection) noexcept;
    void continue_transitions(double dt) noexcept;
    void enter(State) noexcept;
    void stop_then(Stop, State then) noexcept;
    void restart_modes() noexcept;
    bool torque_on() const noexcept;
    bool brake_closed() const noexcept;
    bool has_brake() const noexcept { return settings_.motor.brake_torque > 0; }
    bool powered() const noexcept { return torque_on() || engage_left_ > 0; }

    void watch_causes() noexcept;
    void raise(DriveFault, std::int32_t detail = 0) noexcept;
    void react(DriveFault) noexcept;

    void make_reference(double dt) noexcept;
    void continue_stop(double dt) noexcept;
    Disturbance disturbance() const noexcept;
    std::uint16_t mode_bits() const noexcept;
    bool has_warning() const noexcept;
    std::uint16_t statusword() const noexcept;
    void publish() noexcept;
    void publish_motion() noexcept;

    const AxisSettings settings_;
    AxisValues values_;
    Surroundings around_;
    Controlword control_;
    Drivetrain train_;
    MotionModes modes_;
    AxisMonitor monitor_;
    TouchProbes probes_;
    AxisFaults faults_;

    State state_ = State::not_ready_to_switch_on;
    bool enable_next_ = false;  // transition 3 was made by "enable operation"; 4 follows
    std::optional<Stopping> stopping_;
    double release_left_ = 0;  // s until the brake is open, and until it holds
    double engage_left_ = 0;
};

}  // namespace hal::cia402
