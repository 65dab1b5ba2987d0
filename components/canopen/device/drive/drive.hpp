// SPDX-License-Identifier: MIT
// A drive of CiA 402 with up to eight axes on one node, each with a simulated motor behind it. It
// needs a bus, a clock and a thread of the caller:
//
//     DriveSettings settings;                          // [setup]
//     settings.axes = 2;
//     Drive drive(settings, {.node_id = 5});
//     drive.start(now);
//     each cycle, of 1 ms or so:
//         while (link.receive(frame, now)) drive.device().handle(frame, now);
//         drive.step(now);
//         drive.device().poll(now);
//         for (const Frame* f; (f = drive.device().out().front()) && link.send(*f, now) == Sent::queued;) drive.device().out().drop();
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "canopen/protocol/device.hpp"
#include "cia402/drive_profile.hpp"

namespace hal::canopen::cia402 {

/// The motor, its load, and the switches along its travel. Places along the travel are in encoder
/// increments; 0 is index pulse 0. A switch or mark whose first place is not below its second does
/// not exist. Impossible values, such as an inertia of 0, are replaced by the smallest possible
/// ones.
struct MotorSettings {
    double inertia = 5e-5;  ///< of rotor and load, at the motor shaft, kg·m²
    double viscous_friction = 1e-5;  ///< N·m·s/rad
    double coulomb_friction = 0.005;  ///< N·m
    double rated_torque = 0.3;  ///< N·m, continuous
    double peak_torque = 0.9;  ///< N·m, short-term
    double rated_current = 3.0;  ///< A, at the rated torque
    double thermal_time_constant = 10;  ///< s, of the winding, for the over-current fault
    double current_loop_time = 0.0005;  ///< s, time constant of the closed current loop
    double rated_voltage = 48;  ///< V, of the DC link; the drive works at 70..130 % of it
    double highest_speed = 6000;  ///< r/min
    std::uint32_t resolution = 4096;  ///< encoder increments per revolution
    /// one per revolution, where the increments are a multiple of the resolution
    bool index_pulse = true;
    double start = 0;  ///< place at power-on, where the encoder counts 0
    double negative_limit = -204800;
    double positive_limit = 204800;  ///< limit switches are active beyond
    double negative_stop = -208896;
    double positive_stop = 208896;  ///< mechanical stops
    /// the home switch is active in [from, to)
    double home_from = 20480;
    double home_to = 24576;
    /// touch probes 1 and 2
    std::array<double, 2> probe_from{30000, 40000}, probe_to{30100, 40100};
    double brake_torque = 0;  ///< N·m, holding torque; 0: no brake
    double brake_release = 0.02;
    double brake_engage = 0.02;  ///< s

    /// Removes limit switches and stops: a wheel. Returns itself. [setup]
    MotorSettings& endless() {
        negative_limit = negative_stop = -std::numeric_limits<double>::infinity();
        positive_limit = positive_stop = std::numeric_limits<double>::infinity();
        return *this;
    }
};

/// Gains of the position and velocity loops. The drive feeds forward motor model and set-points, so
/// the loops act on errors only.
struct LoopSettings {
    double position = 60;  ///< velocity demanded per position error, 1/s
    double velocity = 250;  ///< acceleration demanded per velocity error, 1/s
    double integral = 40;  ///< 1/s, of the velocity error on top
    double feed_forward = 1;  ///< fraction of the acceleration torque that is fed forward
};

/// Settings of one axis.
struct AxisSettings {
    MotorSettings motor{};
    LoopSettings loop{};
};

/// Settings of the node.
struct DriveSettings {
    unsigned axes = 1;  ///< 1–8
    std::array<AxisSettings, most_axes> axis{};
    std::uint32_t vendor = 0;
    std::uint32_t product = 0x402;
    std::uint32_t revision = 0x00010000;
    std::uint32_t serial = 1;
    std::string name = "Halcyon drive";
    std::uint16_t heartbeat_ms = 0;  ///< 1017h
    /// optional objects to omit, such as 1016h or 6007h
    std::vector<std::uint16_t> without{};
};

/// Returns the object dictionary: communication objects, the objects of CiA 402 for each axis, and
/// the PDOs of each axis. RPDO 1 carries the controlword, RPDOs 2 to 7 the controlword and mode,
/// target position, target velocity, target torque, vl target velocity, digital outputs; TPDOs 1 to
/// 7 the corresponding actual values. PDOs 1 to 4 of the first axis have their predefined
/// identifiers, the others are off until a master assigns identifiers. [setup]
Description drive_description(const DriveSettings&);

/// Status of an axis as seen from the machine, not from the bus.
struct AxisStatus {
    State state = State::not_ready_to_switch_on;
    Mode mode = Mode::none;
    bool homed = false;  ///< since power-on
    bool brake_closed = false;
    std::uint16_t error_code = 0;  ///< 603Fh
    std::uint32_t inputs = 0;  ///< 60FDh
    std::uint32_t outputs = 0;  ///< 60FEh:1 under its mask
    double place = 0;  ///< along the travel, encoder increments, not rounded
    double speed = 0;  ///< r/min
    double torque = 0;  ///< N·m of the motor
    double current = 0;  ///< A
};

class DriveAxis;

/// The node. All functions are called by one thread.
class Drive final : private Events {
public:
    /// Creates the drive. `also` receives the events of the device after the drive. [setup]
    explicit Drive(const DriveSettings&, const DeviceSettings& = {}, Events* also = nullptr);
    /// Creates it with a description derived from drive_description() by adding objects. [setup]
    Drive(const Description&, const DriveSettings&, const DeviceSettings&, Events* also = nullptr);
    ~Drive() override;
    Drive(const Drive&) = delete;
    Drive& operator=(const Drive&) = delete;

    Device& device() noexcept { return device_; }
    /// Powers on at `now` (ns). [realtime]
    void start(Time now) noexcept;
    /// Advances everything to `now` (ns). Call it at least every 10 ms, better as often as
    /// set-points arrive. After a gap of more than 100 ms the motor has not moved: the caller is
    /// taken to have been suspended. [realtime]
    void step(Time now) noexcept;

    unsigned axes() const noexcept { return static_cast<unsigned>(axes_.size()); }
    /// Returns the status of an axis, counted from 0; this and the functions below ignore an axis
    /// that does not exist. [realtime]
    AxisStatus status(unsigned axis) const noexcept;
    /// Sets the external torque on the shaft in N·m, positive in the positive direction. Object
    /// 2010h does the same in mN·m. [realtime]
    void set_load_torque(unsigned axis, double torque) noexcept;
    /// Sets inputs 16..31 of 60FDh; 16 and 17 are touch probes 1 and 2, in addition to those along
    /// the travel. [realtime]
    void set_inputs(unsigned axis, std::uint32_t bits) noexcept;
    /// Sets the voltage of the DC link in V. [realtime]
    void set_dc_link(unsigned axis, double volts) noexcept;
    /// Cuts or repairs the encoder cable. [realtime]
    void set_encoder_broken(unsigned axis, bool broken) noexcept;

private:
    void on_state(NmtState) noexcept override;
    void on_reset(bool application) noexcept override;
    void on_sync(std::uint8_t counter, Time) noexcept override;
    void on_sync_lost(Time) noexcept override;
    void on_time(const TimeOfDay&, Time) noexcept override;
    void on_rpdo(unsigned number, Time) noexcept override;
    void on_rpdo_late(unsigned number, Time) noexcept override;
    void on_rpdo_short(unsigned number, unsigned bytes, Time) noexcept override;
    void on_node(std::uint8_t node, NodeEvent, NmtState, Time) noexcept override;
    void on_emergency(std::uint8_t node, const Emergency&) noexcept override;
    void on_communication_error(Time) noexcept override;
    void on_life_guarding(bool lost, Time) noexcept override;
    void on_id_collision(Time) noexcept override;
    Abort on_store(std::uint8_t sub) noexcept override;
    Abort on_restore(std::uint8_t sub) noexcept override;
    bool on_lss_store(std::uint8_t node_id, std::uint32_t bit_rate) noexcept override;
    bool on_lss_bit_rate(std::uint32_t bit_rate) noexcept override;
    void on_lss_activate(std::uint32_t bit_rate, Time delay) noexcept override;

    // destroyed after the device: they hold the values of its dictionary
    std::vector<std::unique_ptr<DriveAxis>> axes_;
    Events& also_;
    Device device_;
    Time last_ = 0;
};

}  // namespace hal::canopen::cia402
