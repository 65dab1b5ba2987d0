// SPDX-License-Identifier: MIT
// A servo drive of 1..8 axes after CiA 402 (IEC 61800-7-201): the simulated axes of
// `cia402/drive/`, bound to the object dictionary, the process data and the emergencies of a slave.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "cia402/drive/drive_axis.hpp"
#include "ethercat/devices/io_devices.hpp"

namespace hal::ethercat::devices {

/// An axis with its objects. [realtime] unless marked.
class ServoAxis final : private cia402::AxisBus {
public:
    /// Binds axis `number`, counted from 0, to its objects. [setup]
    ServoAxis(Dictionary&, unsigned number, const cia402::AxisSettings&);
    void power_on() noexcept;
    void power_off() noexcept;
    void rest(std::int64_t dt_ns) noexcept;
    bool moves() const noexcept {
        return axis_.moves() || load_torque_.load(std::memory_order_relaxed) != 0;
    }
    coe::Abort check(std::uint16_t index, std::span<const std::uint8_t> value) const noexcept;
    void written(std::uint16_t index, std::uint8_t sub) noexcept;
    void step(Step&) noexcept;
    /// Returns the bits of 1001h for the present faults.
    std::uint8_t error_register() const noexcept;

    // The machine around it. [any]
    double position() const noexcept { return shown_position_.load(std::memory_order_relaxed); }
    double velocity() const noexcept { return shown_velocity_.load(std::memory_order_relaxed); }
    /// Returns the torque of the motor, N·m.
    double torque() const noexcept { return shown_torque_.load(std::memory_order_relaxed); }
    std::uint16_t statusword() const noexcept {
        return shown_status_.load(std::memory_order_relaxed);
    }
    bool homed() const noexcept { return shown_homed_.load(std::memory_order_relaxed); }
    bool brake_closed() const noexcept { return shown_brake_.load(std::memory_order_relaxed); }
    /// Returns 60FEh:1 under its mask, 60FEh:2; 0 without valid outputs.
    std::uint32_t outputs() const noexcept { return outputs_.load(std::memory_order_relaxed); }
    double rated_voltage() const noexcept { return rated_voltage_; }
    /// Raises a fault with this error code (603Fh) at the next step.
    void fail(std::uint16_t code) noexcept {
        fault_request_.store(code, std::memory_order_relaxed);
    }
    /// Sets inputs of 60FDh, besides those of the switches along the travel.
    void set_inputs(std::uint32_t bits) noexcept { inputs_.store(bits, std::memory_order_relaxed); }
    /// Sets the external torque on the shaft, N·m.
    void set_load_torque(double torque) noexcept {
        load_torque_.store(torque, std::memory_order_relaxed);
    }
    /// Sets the voltage of the DC link, V.
    void set_dc_link(double volts) noexcept { dc_link_.store(volts, std::memory_order_relaxed); }
    /// Cuts or repairs the encoder cable.
    void set_encoder_broken(bool broken) noexcept {
        encoder_broken_.store(broken, std::memory_order_relaxed);
    }

private:
    void raise(std::uint16_t code, std::int32_t detail) noexcept override;
    void clear(std::uint16_t code) noexcept override;
    /// EtherCAT has no supervised nodes: the loss of the master is the end of valid outputs.
    bool master_alive() const noexcept override { return true; }

    void copy_surroundings() noexcept;
    void follow_sync_cycle(std::int64_t cycle_ns) noexcept;
    void set_sync_cycle(std::int64_t cycle_ns) noexcept;
    template <class Advance>
    static void in_steps(std::int64_t dt_ns, Advance) noexcept;
    void show(bool outputs_valid) noexcept;

    const unsigned number_;
    const double rated_voltage_;
    cia402::DriveAxis axis_;
    Emergencies pending_;  ///< since the last step
    std::uint8_t register_bits_ = 0;  ///< of the present faults
    unsigned faults_ = 0;
    bool outputs_valid_ = false;
    bool command_waits_ = false;  ///< a controlword was written while the outputs were not valid
    std::int64_t sync_cycle_ns_ = 0;  ///< that period_ and exponent_ are of
    std::uint8_t period_ = 0;  ///< 60C2h:1
    std::int8_t exponent_ = 0;  ///< 60C2h:2

    std::atomic<double> shown_position_{0};
    std::atomic<double> shown_velocity_{0};
    std::atomic<double> shown_torque_{0};
    std::atomic<std::uint16_t> shown_status_{0};
    std::atomic<bool> shown_homed_{false};
    std::atomic<bool> shown_brake_{false};
    std::atomic<std::uint32_t> outputs_{0};
    std::atomic<std::uint16_t> fault_request_{0};
    std::atomic<std::uint32_t> inputs_{0};
    std::atomic<double> load_torque_{0};
    std::atomic<double> dc_link_;
    std::atomic<bool> encoder_broken_{false};
};

class Servo : public Behaviour {
public:
    /// [setup]
    Servo(std::shared_ptr<Dictionary>, unsigned axes, const cia402::AxisSettings&);
    void power_on() noexcept override;
    void power_off() noexcept override;
    void rest(std::int64_t dt_ns) noexcept override;
    bool moves() const noexcept override;
    coe::Abort check(std::uint16_t index, std::uint8_t sub,
                     std::span<const std::uint8_t> value) noexcept override;
    void written(std::uint16_t index, std::uint8_t sub) noexcept override;
    void step(Step&) noexcept override;
    ServoAxis& axis(unsigned n) noexcept { return *axes_[n]; }
    unsigned axes() const noexcept { return static_cast<unsigned>(axes_.size()); }

private:
    /// Returns the axis of an object; nullptr for the objects of the device.
    ServoAxis* axis_with(std::uint16_t index) const noexcept;

    std::shared_ptr<Dictionary> dictionary_;
    std::uint8_t* error_register_;
    std::vector<std::unique_ptr<ServoAxis>> axes_;
};

/// Makes a servo drive of `axes` 1..8: 1600h + 10h * axis with 6040 6060 607A 60FF 6071, 1A00h +
/// 10h * axis with 6041 6061 6064 606C 6077.
Parts make_servo(const DeviceOptions&);  ///< [setup]

}  // namespace hal::ethercat::devices
