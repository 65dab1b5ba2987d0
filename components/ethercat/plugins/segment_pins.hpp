// SPDX-License-Identifier: MIT
// Pins of emulated slaves: their faults and what their terminals show.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <string>

#include "ethercat/devices/io_devices.hpp"
#include "ethercat/devices/sampled_io.hpp"
#include "ethercat/devices/servo.hpp"
#include "ethercat/esc/line.hpp"
#include "hal/component.hpp"

namespace hal::ethercat {

/// Returns a time in s as ns, at most 60 s; 0 for what is not a time. [realtime]
inline std::int64_t nanoseconds(double seconds) noexcept {
    return std::isfinite(seconds) ? static_cast<std::int64_t>(std::clamp(seconds, 0.0, 60.0) * 1e9)
                                  : 0;
}

/// Pins of one emulated slave.
struct EmulatedSlavePins {
    EmulatedSlavePins(hal::Component& c, const hal::Function& f, const std::string& name)
        : power(c, f, (name + ".power").c_str(),
                "FALSE: the slave has no power; its settings and volatile objects are lost",
                {.initial = true}),
          cable(c, f, (name + ".cable").c_str(),
                "FALSE: the cable to the slave before it is broken", {.initial = true}),
          drift(c, f, (name + ".drift").c_str(), "error of its oscillator, at most 100000",
                {.unit = "ppm"}),
          clock_jump(c, f, (name + ".clock-jump").c_str(),
                     "a change to another number than 0 adds it to its clock, at most 10",
                     {.unit = "s"}),
          reject_state(c, f, (name + ".reject-state").c_str(),
                       "state that the slave rejects: 2 PRE-OP, 4 SAFE-OP, 8 OP; 0 none"),
          reject_code(c, f, (name + ".reject-code").c_str(),
                      "AL status code of that rejection, 1..65535", {.initial = 0x0012}),
          fail_code(c, f, (name + ".leave-op").c_str(),
                    "a change to another number than 0 drops from OP to SAFE-OP with this AL "
                    "status code"),
          mailbox_delay(c, f, (name + ".mailbox-delay").c_str(),
                        "minimum time to a mailbox answer, at most 60", {.unit = "s"}),
          eeprom_fail(
              c, f, (name + ".eeprom-fail").c_str(),
              "a change to another number than 0 makes so many accesses to its EEPROM fail"),
          eeprom_damaged(c, f, (name + ".eeprom-damaged").c_str(),
                         "TRUE: the checksum of its EEPROM is wrong at the next power-on"),
          wrong_identity(c, f, (name + ".wrong-identity").c_str(),
                         "TRUE: its EEPROM has another product code, the highest bit inverted"),
          expire_watchdog(c, f, (name + ".expire-watchdog").c_str(),
                          "a change to TRUE expires the watchdog of its outputs"),
          lose_every(c, f, (name + ".lose-every").c_str(),
                     "every n-th frame on the cable before it is lost; 0: none"),
          corrupt_every(c, f, (name + ".corrupt-every").c_str(),
                        "every n-th frame there arrives damaged; 0: none"),
          double_every(c, f, (name + ".double-every").c_str(),
                       "every n-th frame there arrives twice at the master; 0: none"),
          delay_every(c, f, (name + ".delay-every").c_str(),
                      "every n-th frame there is delayed by `delay`; 0: none"),
          delay(c, f, (name + ".delay").c_str(), "of these frames, at most 60",
                {.initial = 0.001, .unit = "s"}),
          state(c, f, (name + ".state").c_str(),
                "1 INIT, 2 PRE-OP, 3 BOOT, 4 SAFE-OP, 8 OP, 0 no power") {}

    /// Forgets what was posted; the line is new. [setup]
    void forget() noexcept {
        was_power = was_cable = true;
        was_damaged = was_wrong = false;
        was_drift = 0;
    }

    /// Posts what changed, except for disturbances of frames. [realtime]
    void post_changes(esc::Line& line, unsigned slave) noexcept {
        using Kind = esc::LineCommand::Kind;
        const auto toggle = [&](Kind kind, bool now, bool& was, bool on) {
            if (now != was && line.post({.kind = kind, .slave = slave, .port = 0, .on = on})) {
                was = now;
            }
        };
        toggle(Kind::power, power, was_power, power);
        toggle(Kind::cable, cable, was_cable, cable);
        toggle(Kind::checksum, eeprom_damaged, was_damaged, !eeprom_damaged);
        toggle(Kind::identity, wrong_identity, was_wrong, !wrong_identity);
        if (expire_watchdog && !was_expired) {
            line.post({.kind = Kind::watchdog, .slave = slave});
        }
        was_expired = expire_watchdog;
        const double wanted =
            std::isfinite(drift.get()) ? std::clamp(drift.get(), -max_drift, max_drift) : 0.0;
        if (wanted != was_drift &&
            line.post({.kind = Kind::drift, .slave = slave, .value = wanted})) {
            was_drift = wanted;
        }
        const double jump = std::isfinite(clock_jump.get())
                                ? std::clamp(clock_jump.get(), -max_jump, max_jump)
                                : 0.0;
        if (jump != was_jump &&
            (jump == 0 || line.post({.kind = Kind::jump, .slave = slave, .value = jump * 1e9}))) {
            was_jump = jump;
        }
        if (eeprom_fail != was_eeprom &&
            (eeprom_fail == 0 || line.post({.kind = Kind::eeprom,
                                            .slave = slave,
                                            .value = static_cast<double>(eeprom_fail)}))) {
            was_eeprom = eeprom_fail;
        }
    }

    /// Returns whether a pin that disturbs frames changed since the last call. [realtime]
    bool frames_changed() noexcept {
        const std::array<std::uint32_t, 4> now{lose_every, corrupt_every, double_every,
                                               delay_every};
        const std::int64_t delay_ns = nanoseconds(delay);
        const bool changed = now != was_frames || delay_ns != was_delay;
        was_frames = now;
        was_delay = delay_ns;
        return changed;
    }
    /// Posts the disturbances of its frames. Returns whether the line took them. [realtime]
    bool post_disturbances(esc::Line& line, unsigned slave) const noexcept {
        using esc::LineFault;
        constexpr std::array faults{LineFault::loss, LineFault::corruption, LineFault::duplicate,
                                    LineFault::delay};
        bool posted = true;
        for (std::size_t n = 0; n < faults.size(); ++n) {
            if (was_frames[n] != 0) {
                posted = posted && line.post({.kind = esc::LineCommand::Kind::disturb,
                                              .disturbance = {.fault = faults[n],
                                                              .slave = static_cast<int>(slave),
                                                              .port = 0,
                                                              .every = was_frames[n],
                                                              .delay_ns = was_delay}});
            }
        }
        return posted;
    }

    static constexpr double max_drift = 100'000;  ///< ppm
    static constexpr double max_jump = 10;        ///< s

    hal::In<bool> power, cable;
    hal::In<double> drift, clock_jump;
    hal::In<std::uint32_t> reject_state, reject_code, fail_code;
    hal::In<double> mailbox_delay;
    hal::In<std::uint32_t> eeprom_fail;
    hal::In<bool> eeprom_damaged, wrong_identity, expire_watchdog;
    hal::In<std::uint32_t> lose_every, corrupt_every, double_every, delay_every;
    hal::In<double> delay;
    hal::Out<std::uint32_t> state;

    // As last posted.
    bool was_power = true;
    bool was_cable = true;
    bool was_damaged = false;
    bool was_wrong = false;

    bool was_expired = false;
    double was_drift = 0;
    double was_jump = 0;
    std::uint32_t was_fail = 0;
    std::uint32_t was_eeprom = 0;
    std::array<std::uint32_t, 4> was_frames{};
    std::int64_t was_delay = 0;
};

/// Pins of one axis of a servo drive.
struct EmulatedAxisPins {
    EmulatedAxisPins(hal::Component& c, const hal::Function& f, const std::string& name,
                     devices::ServoAxis& its_axis)
        : axis(its_axis),
          position(c, f, (name + "position").c_str(), "position of the motor", {.unit = "counts"}),
          velocity(c, f, (name + "velocity").c_str(), "velocity of the motor",
                   {.unit = "counts/s"}),
          torque(c, f, (name + "torque").c_str(), "torque of the motor", {.unit = "N*m"}),
          statusword(c, f, (name + "statusword").c_str(), "6041h"),
          homed(c, f, (name + "homed").c_str(), "TRUE: homed since power-on"),
          brake(c, f, (name + "brake").c_str(), "TRUE: the brake is closed"),
          inputs(c, f, (name + "inputs").c_str(),
                 "digital inputs of the drive (60FDh), besides those of its travel"),
          error_code(
              c, f, (name + "fail").c_str(),
              "a change to another number than 0 raises a fault with this error code (603Fh)"),
          load_torque(c, f, (name + "load-torque").c_str(), "external torque on the shaft",
                      {.unit = "N*m"}),
          dc_link(c, f, (name + "dc-link").c_str(),
                  "DC link voltage; valid range 70..130 % of the rated voltage",
                  {.initial = its_axis.rated_voltage(), .unit = "V"}),
          encoder_broken(c, f, (name + "encoder-broken").c_str(),
                         "TRUE: the encoder cable is cut") {}

    /// Copies the pins to the axis and back. [realtime]
    void update() noexcept {
        position = axis.position();
        velocity = axis.velocity();
        torque = axis.torque();
        statusword = axis.statusword();
        homed = axis.homed();
        brake = axis.brake_closed();
        axis.set_inputs(inputs);
        axis.set_load_torque(std::isfinite(load_torque.get()) ? load_torque.get() : 0.0);
        axis.set_dc_link(std::isfinite(dc_link.get()) ? dc_link.get() : 0.0);
        axis.set_encoder_broken(encoder_broken);
        if (error_code != was_error && error_code != 0) {
            axis.fail(static_cast<std::uint16_t>(error_code));
        }
        was_error = error_code;
    }

    devices::ServoAxis& axis;
    hal::Out<double> position, velocity, torque;
    hal::Out<std::uint32_t> statusword;
    hal::Out<bool> homed, brake;
    hal::In<std::uint32_t> inputs, error_code;
    hal::In<double> load_torque, dc_link;
    hal::In<bool> encoder_broken;
    std::uint32_t was_error = 0;
};

/// Pins of an emulated device that takes several samples in a cycle.
struct SampledIoPins {
    SampledIoPins(hal::Component& c, const hal::Function& f, const std::string& name,
                  devices::SampledIo& its_io)
        : io(its_io),
          samples(c, f, (name + ".samples").c_str(),
                  "samples taken since power-on: one at each pulse of SYNC0") {
        for (std::size_t n = 0; n < io.inputs(); ++n) {
            const std::string number = (n < 10 ? "-0" : "-") + std::to_string(n);
            offset.emplace_back(c, f, (name + ".offset" + number).c_str(),
                                "value of the input, to which the sine is added",
                                hal::PinOptions<double>{.unit = "counts"});
            amplitude.emplace_back(c, f, (name + ".sine-amplitude" + number).c_str(),
                                   "amplitude of the sine at the input",
                                   hal::PinOptions<double>{.unit = "counts"});
            frequency.emplace_back(c, f, (name + ".sine-frequency" + number).c_str(),
                                   "frequency of the sine at the input",
                                   hal::PinOptions<double>{.unit = "Hz"});
        }
        for (std::size_t n = 0; n < io.outputs(); ++n) {
            const std::string number = (n < 10 ? "-0" : "-") + std::to_string(n);
            value.emplace_back(c, f, (name + ".value" + number).c_str(),
                               "newest sample of the output",
                               hal::PinOptions<double>{.unit = "counts"});
        }
    }

    /// Copies the pins to the device and back. [realtime]
    void update() noexcept {
        for (std::size_t n = 0; n < offset.size(); ++n) {
            io.set_input(n, offset[n], amplitude[n], frequency[n]);
        }
        for (std::size_t n = 0; n < value.size(); ++n) {
            value[n] = static_cast<double>(io.output(n));
        }
        samples = io.samples();
    }

    devices::SampledIo& io;
    hal::Out<std::uint32_t> samples;
    // deques: a pin may not move once it is declared
    std::deque<hal::In<double>> offset, amplitude, frequency;
    std::deque<hal::Out<double>> value;
};

/// Pin of one channel of an I/O device.
template <class Pin>
struct ChannelPin {
    devices::IoBehaviour& io;
    unsigned number;
    Pin pin;
    ChannelPin(hal::Component& c, const hal::Function& f, const std::string& name,
               const char* about, devices::IoBehaviour& its_io, unsigned n)
        : io(its_io), number(n), pin(c, f, name.c_str(), about) {}
};

}  // namespace hal::ethercat
