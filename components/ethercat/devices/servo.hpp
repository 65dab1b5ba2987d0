// SPDX-License-Identifier: MIT
// A servo drive of 1..8 axes after CiA 402 (IEC 61800-7-201): state machine, modes PP, PV, HM, CSP,
// CSV, CST, and a simple motor.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <vector>

#include "cia402/drive_profile.hpp"
#include "ethercat/devices/io_devices.hpp"

namespace hal::ethercat::devices {

/// One axis: positions in increments, velocities in increments/s, torques in 0.1 % of the rated
/// torque.
class ServoAxis {
public:
    ServoAxis(Dictionary&, unsigned axis);  ///< [setup]
    void power_on() noexcept;  ///< [realtime]
    void step(Step&) noexcept;  ///< [realtime]

    /// of the motor. [any]
    double position() const noexcept { return shown_position_.load(std::memory_order_relaxed); }
    /// [any]
    double velocity() const noexcept { return shown_velocity_.load(std::memory_order_relaxed); }
    /// [any]
    std::uint16_t statusword() const noexcept {
        return shown_status_.load(std::memory_order_relaxed);
    }
    /// Raises a fault with this error code (603Fh) at the next step. [any]
    void fail(std::uint16_t code) noexcept {
        fault_request_.store(code, std::memory_order_relaxed);
    }
    /// Sets 60FDh. [any]
    void set_inputs(std::uint32_t bits) noexcept { inputs_.store(bits, std::memory_order_relaxed); }
    /// Returns 60FEh:1. [any]
    std::uint32_t outputs() const noexcept { return outputs_.load(std::memory_order_relaxed); }

private:
    using DriveState = canopen::cia402::State;
    void walk(const Step&) noexcept;
    void fault(std::uint16_t code, Step&) noexcept;
    double wanted_velocity(double dt, bool operational) noexcept;
    /// Velocity that reaches a position with the profile's limits.
    double toward(double target, double dt) noexcept;
    double homing_velocity(double dt) noexcept;
    void move(double velocity, double dt) noexcept;
    std::uint16_t status_bits() const noexcept;

    struct Data {
        std::uint8_t *control, *status, *mode, *mode_display, *position, *velocity, *torque,
            *target_position, *target_velocity, *target_torque, *velocity_offset, *position_offset,
            *error_code, *following_error, *following_window, *profile_velocity,
            *profile_acceleration, *profile_deceleration, *quick_deceleration, *max_velocity,
            *low_limit, *high_limit, *homing_method, *homing_speed, *home_offset, *digital_in,
            *digital_out, *torque_limit, *demand, *modes;
    } d_{};
    DriveState state_{};
    std::uint16_t control_ = 0;
    std::int8_t mode_ = 0;
    double position_ = 0;
    double velocity_ = 0;
    double demand_ = 0;
    double goal_ = 0;
    double offset_ = 0;
    double torque_ = 0;
    bool acknowledged_ = false;
    bool moving_to_goal_ = false;
    bool homed_ = false;
    bool homing_ = false;

    bool following_fault_ = false;
    bool limited_ = false;
    bool reached_ = false;
    double home_at_ = 0;
    std::atomic<double> shown_position_{0};
    std::atomic<double> shown_velocity_{0};
    std::atomic<std::uint16_t> shown_status_{0};
    std::atomic<std::uint16_t> fault_request_{0};
    std::atomic<std::uint32_t> inputs_{0};
    std::atomic<std::uint32_t> outputs_{0};
};

class Servo : public Behaviour {
public:
    Servo(std::shared_ptr<Dictionary>, unsigned axes);  ///< [setup]
    void power_on() noexcept override;
    void step(Step&) noexcept override;
    ServoAxis& axis(unsigned n) noexcept { return *axes_[n]; }
    unsigned axes() const noexcept { return static_cast<unsigned>(axes_.size()); }

private:
    std::shared_ptr<Dictionary> dictionary_;
    std::vector<std::unique_ptr<ServoAxis>> axes_;
};

/// Makes a servo drive of `axes` 1..8: 1600h + 10h * axis with 6040 6060 607A 60FF 6071, 1A00h +
/// 10h * axis with 6041 6061 6064 606C 6077.
Parts make_servo(const DeviceOptions&);  ///< [setup]

}  // namespace hal::ethercat::devices
