// SPDX-License-Identifier: MIT
// A drive of CiA 402 with up to eight axes on one node, each with a simulated motor behind it. It owns no bus, no clock, no thread:
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

/// The motor, its load, and what is mounted along the travel. Places along the travel are in encoder increments, 0 is index pulse 0.
/// A switch or mark of which the first place is not below the second does not exist. Values that cannot be, such as no inertia, become
/// the smallest that can.
struct MotorSettings {
    double inertia = 5e-5;               ///< of rotor and load, at the motor shaft, kg·m²
    double viscous_friction = 1e-5;      ///< N·m·s/rad
    double coulomb_friction = 0.005;     ///< N·m
    double rated_torque = 0.3;           ///< N·m, can be given for ever
    double peak_torque = 0.9;            ///< N·m, for a short time
    double rated_current = 3.0;          ///< A, at the rated torque
    double thermal_time_constant = 10;   ///< s, of the winding, for the over-current fault
    double current_loop_time = 0.0005;   ///< s, time constant of the closed current loop
    double rated_voltage = 48;           ///< V, of the DC link; from 70 % to 130 % of it the drive works
    double highest_speed = 6000;         ///< r/min
    std::uint32_t resolution = 4096;     ///< encoder increments per revolution
    bool index_pulse = true;             ///< one per revolution, where the increments are a multiple of the resolution
    double start = 0;                    ///< place at power-on, where the encoder begins to count from 0
    double negative_limit = -204800, positive_limit = 204800;  ///< limit switches act beyond
    double negative_stop = -208896, positive_stop = 208896;    ///< the load stands against a stop
    double home_from = 20480, home_to = 24576;                 ///< the home switch is active from … to before
    std::array<double, 2> probe_from{30000, 40000}, probe_to{30100, 40100};  ///< touch probes 1 and 2
    double brake_torque = 0;             ///< N·m the brake holds; 0: there is no brake
    double brake_release = 0.02, brake_engage = 0.02;  ///< s

    /// Neither limit switches nor stops: a wheel. [setup]
    MotorSettings& endless() {
        negative_limit = negative_stop = -std::numeric_limits<double>::infinity();
        positive_limit = positive_stop = std::numeric_limits<double>::infinity();
        return *this;
    }
};

/// Gains of the position and velocity loops. The drive feeds forward what it knows of motor and set-points, so they act on errors only.
struct LoopSettings {
    double position = 60;    ///< velocity demanded per position error, 1/s
    double velocity = 250;   ///< acceleration demanded per velocity error, 1/s
    double integral = 40;    ///< 1/s, of the velocity error on top
    double feed_forward = 1; ///< share of the acceleration's torque that is given ahead
};

struct AxisSettings {
    MotorSettings motor{};
    LoopSettings loop{};
};

struct DriveSettings {
    unsigned axes = 1;                          ///< 1–8
    std::array<AxisSettings, most_axes> axis{};
    std::uint32_t vendor = 0, product = 0x402, revision = 0x00010000, serial = 1;
    std::string name = "Halcyon drive";
    std::uint16_t heartbeat_ms = 0;             ///< 1017h
    std::vector<std::uint16_t> without{};       ///< optional objects this drive does not have, such as 1016h or 6007h
};

/// The object dictionary: communication, the objects of the profile for each axis, and the PDOs of each: RPDO 1–7 carry the controlword,
/// then with it mode, target position, target velocity, target torque, vl target velocity, digital outputs; TPDO 1–7 the same of
/// what is. PDO 1–4 of the first axis have their predefined identifiers, the others are off until a master gives them one. [setup]
Description drive_description(const DriveSettings&);

/// What there is to see of an axis from its side of the bus.
struct AxisStatus {
    State state = State::not_ready_to_switch_on;
    Mode mode = Mode::none;
    bool homed = false;            ///< since power-on
    bool brake_closed = false;
    std::uint16_t error_code = 0;  ///< 603Fh
    std::uint32_t inputs = 0;      ///< 60FDh
    std::uint32_t outputs = 0;     ///< 60FEh:1 under its mask
    double place = 0;              ///< along the travel, encoder increments, not rounded
    double speed = 0;              ///< r/min
    double torque = 0;             ///< N·m of the motor
    double current = 0;            ///< A
};

class DriveAxis;

class Drive final : private Events {
public:
    /// `also` is told what the device tells the drive. [setup]
    explicit Drive(const DriveSettings&, const DeviceSettings& = {}, Events* also = nullptr);
    /// With a description made from drive_description(), to which objects of one's own were added. [setup]
    Drive(const Description&, const DriveSettings&, const DeviceSettings&, Events* also = nullptr);
    ~Drive() override;
    Drive(const Drive&) = delete;
    Drive& operator=(const Drive&) = delete;

    Device& device() noexcept { return device_; }
    /// Power comes on. [realtime]
    void start(Time now) noexcept;
    /// Everything moves on to `now`; at least every 10 ms, better as often as set-points come. What is longer ago than 100 ms was a
    /// pause of the caller: the motor stood still meanwhile. [realtime]
    void step(Time now) noexcept;

    unsigned axes() const noexcept { return static_cast<unsigned>(axes_.size()); }
    /// Axes count from 0; of an axis that does not exist, nothing is known and nothing changes. [realtime]
    AxisStatus status(unsigned axis) const noexcept;
    /// Torque on the shaft from outside, N·m, positive in the positive direction. Object 2010h does the same in mN·m. [realtime]
    void set_load_torque(unsigned axis, double torque) noexcept;
    /// Inputs 16–31 of 60FDh, of which 16 and 17 are touch probes 1 and 2, with what is mounted along the travel. [realtime]
    void set_inputs(unsigned axis, std::uint32_t bits) noexcept;
    /// Voltage of the DC link, V. [realtime]
    void set_dc_link(unsigned axis, double volts) noexcept;
    /// The encoder's cable is cut, or mended. [realtime]
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

    std::vector<std::unique_ptr<DriveAxis>> axes_;  // their objects hold values of the dictionary: they go after the device
    Events& also_;
    Device device_;
    Time last_ = 0;
};

}  // namespace hal::canopen::cia402
