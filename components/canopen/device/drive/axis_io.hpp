// SPDX-License-Identifier: MIT
// An axis with its control loop closed over the bus: a node with a motor amplifier set by pulse
// width, two 16-bit encoder counters, four outputs and an input. Its states are those of CiA 402,
// reduced to stopped, ready, on and fault.
#pragma once

#include <memory>
#include <span>

#include "canopen/device/program.hpp"

namespace hal::canopen {

/// An external influence on a plant.
struct Influence {
    /// value and flag act continuously, a tap acts once
    enum Kind : std::uint8_t { value, flag, tap };
    const char *name, *doc, *unit;
    double initial;
    Kind kind;
};

/// The simulated machine behind the device. [realtime] unless marked.
class Plant {
public:
    virtual ~Plant() = default;
    /// Advances by `time_ns` with the amplifier at `duty`, -1..1 of its supply; with `on` false the
    /// motor carries no current.
    virtual void step(double duty, bool on, Time time_ns) noexcept = 0;
    virtual std::int64_t count() const noexcept = 0;  ///< of the encoder, four per line
    /// of the second encoder, four per line
    virtual std::int64_t second_count() const noexcept = 0;
    /// the contact at the digital input is closed
    virtual bool input() const noexcept = 0;
    virtual double current() const noexcept = 0;  ///< A, in the motor
    /// rad, true position of the motor or the arm
    virtual double position() const noexcept = 0;
    /// rad, true position of the screw's end or the pendulum
    virtual double second_position() const noexcept = 0;
    /// Returns the influences put() accepts, by index.
    virtual std::span<const Influence> influences() const noexcept = 0;
    /// Sets influence `n`; a value that is not a number is ignored.
    virtual void put(std::size_t n, double value) noexcept = 0;
};

/// Returns a plant, or nullptr for an unknown name. "axis": a motor, a screw and a slide, the
/// second encoder at the end of the screw. "furuta": the pendulum rig, the second encoder on the
/// pendulum, the contact under the base at the input. [setup]

std::unique_ptr<Plant> make_plant(std::string_view name);
inline constexpr const char* plant_names = "axis, furuta";

struct AxisIoSettings {
    std::uint32_t serial = 1;
    std::uint16_t heartbeat_ms = 0;
    bool input_stops = false;  ///< initial value of object 2111h
};
Description axis_io_description(const AxisIoSettings&);  // [setup]

class AxisIo final : public Program {
public:
    enum class State : std::uint8_t { stopped, ready, on, fault };

    AxisIo(const AxisIoSettings&, std::unique_ptr<Plant>);  // [setup]

    Description description() const override { return axis_io_description(settings_); }
    void attach(Device&) override;
    void step(Time now) noexcept override;
    bool set(std::string_view name, double value) override;
    std::vector<std::string> settable() const override;
    std::string summary() const override;
    std::string news() const override;

    void on_sync(std::uint8_t, Time now) noexcept override;
    void on_rpdo(unsigned, Time now) noexcept override { commanded_ = now; }
    void on_state(NmtState) noexcept override;
    void on_reset(bool application) noexcept override;
    void on_communication_error(Time) noexcept override { stop_for(0x8130); }
    void written(Entry&) noexcept override { take_controlword(); }

    // [realtime]
    State state() const noexcept;
    double duty() const noexcept;  ///< at the amplifier; 0 unless on
    void break_encoder(bool broken) noexcept;
    std::uint8_t outputs() const noexcept { return online() ? outputs_ & 15 : 0; }
    bool output(unsigned n) const noexcept { return (outputs() >> n & 1) != 0; }
    std::uint16_t error_code() const noexcept { return error_code_; }
    Plant& plant() noexcept { return *plant_; }
    const Plant& plant() const noexcept { return *plant_; }

private:
    // As bits 0 to 6 of the statusword have them.
    enum Walk : std::uint16_t {
        disabled = 0x0240,
        ready_to_switch_on = 0x0221,
        switched_on = 0x0233,
        enabled = 0x0237,
        failed = 0x0208
    };

    void take_controlword() noexcept;
    void sample(Time now) noexcept;
    void watch(Time now) noexcept;
    void stop_for(std::uint16_t code) noexcept;

    const AxisIoSettings settings_;
    const std::unique_ptr<Plant> plant_;
    std::uint16_t controlword_ = 0;
    std::uint16_t statusword_ = disabled;
    std::uint16_t error_code_ = 0;
    std::uint16_t control_before_ = 0;
    std::int16_t set_point_ = 0;
    std::int16_t count_ = 0;
    std::int16_t second_count_ = 0;
    std::int16_t current_ma_ = 0;
    std::uint8_t outputs_ = 0;
    std::uint8_t inputs_ = 0;
    std::uint8_t missed_syncs_ = 3;
    std::uint8_t input_stops_ = 0;
    std::int8_t mode_ = 4;
    std::int8_t mode_shown_ = 4;
    bool encoder_broken_ = false;
    bool stepped_once_ = false;
    Time stepped_ = 0;
    Time synced_ = 0;
    Time commanded_ = 0;
    std::int16_t broken_at_ = 0;
};
const char* to_string(AxisIo::State) noexcept;

}  // namespace hal::canopen
