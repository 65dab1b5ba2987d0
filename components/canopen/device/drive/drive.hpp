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
#include "cia402/drive/axis_settings.hpp"

namespace hal::canopen {

/// Settings of the node.
struct DriveSettings {
    unsigned axes = 1;  ///< 1–8
    std::array<cia402::AxisSettings, cia402::max_axes> axis{};
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

class AxisBinding;

/// The node. All functions are called by one thread.
class Drive final : private DeviceEvents {
public:
    /// Creates the drive. `also` receives the events of the device after the drive. [setup]
    explicit Drive(const DriveSettings&, const DeviceSettings& = {}, DeviceEvents* also = nullptr);
    /// Creates it with a description derived from drive_description() by adding objects. [setup]
    Drive(const Description&, const DriveSettings&, const DeviceSettings&,
          DeviceEvents* also = nullptr);
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
    /// Handles the loss of the supply: the motors have no torque, and the brakes close. [realtime]
    void lose_power() noexcept;
    /// Advances the motors to `now` (ns) without supply. [realtime]
    void rest(Time now) noexcept;

    unsigned axes() const noexcept { return static_cast<unsigned>(axes_.size()); }
    /// Returns the status of an axis, counted from 0; this and the functions below ignore an axis
    /// that does not exist. [realtime]
    cia402::AxisStatus status(unsigned axis) const noexcept;
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
    template <class Advance>
    void advance_to(Time now, Advance) noexcept;
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
    std::vector<std::unique_ptr<AxisBinding>> axes_;
    DeviceEvents& also_;
    Device device_;
    Time last_ = 0;
};

}  // namespace hal::canopen
