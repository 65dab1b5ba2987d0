// SPDX-License-Identifier: MIT
// A force/torque node after CiA 404: it decodes the bit stream of a JR3 sensor and serves three
// forces and three torques on the bus. TPDOs 1 and 2 carry the forces, 3 and 4 the torques; 1 and 3
// are sent when a value changes, 2 and 4 at each SYNC. Each has two more bytes: status (2201h) and
// sample counter (2202h), which identifies the PDOs of the same SYNC.
#pragma once

#include <vector>

#include "analog_input.hpp"
#include "canopen/device/program.hpp"
#include "jr3_calibration.hpp"

namespace hal::canopen {

struct Jr3Settings {
    jr3::Calibration calibration{};  ///< contents of the sensor's memory
    /// recorded line, eight clocks per byte, repeated; empty: the sensor is simulated
    std::vector<std::uint8_t> recording;
    std::uint32_t serial = 1;
    std::uint16_t heartbeat_ms = 0;
};

/// Bits of 2201h.
namespace jr3_status {
inline constexpr std::uint8_t overload = 0x01;
inline constexpr std::uint8_t no_signal = 0x02;
inline constexpr std::uint8_t supply = 0x04;

inline constexpr std::uint8_t not_calibrated = 0x08;
inline constexpr std::uint8_t saturated = 0x10;
}  // namespace jr3_status
/// EMCY codes of the node; with `overload`, the first manufacturer byte has one bit per channel.
namespace jr3_error {
inline constexpr std::uint16_t overload = 0xff01;
inline constexpr std::uint16_t no_signal = 0x5010;
inline constexpr std::uint16_t supply = 0x3210;

inline constexpr std::uint16_t calibration = 0x6310;
}  // namespace jr3_error

/// Returns the objects of the node. [setup]
Description jr3_description(const Jr3Settings&);

/// The node, with its sensor simulated or recorded.
class Jr3 final : public Program {
public:
    /// Throws std::invalid_argument when the calibration matrix is singular. [setup]
    explicit Jr3(Jr3Settings);

    // The simulated environment of the sensor; no effect on a recording. [realtime]
    void set_wrench(const jr3::Six& wrench) noexcept { applied_ = wrench; }  ///< N and N·m
    /// fraction of full scale; nominal 0.75
    void set_supply(double share) noexcept { supply_ = share; }
    /// amplitude on raw readings
    void set_noise(unsigned counts) noexcept { noise_ = counts; }
    /// false: the line is idle
    void set_cable(bool joined) noexcept { cable_ = joined; }

    /// Returns the decoded wrench in N and N·m, before offset, scaling and tare. [realtime]
    const jr3::Six& wrench() const noexcept { return field_; }
    std::uint8_t status() const noexcept { return status_; }
    /// Returns the status LED: off in stopped, blinking in pre-operational, on in operational.
    /// [realtime]
    bool led() const noexcept { return led_; }
    const jr3::Decoder& decoder() const noexcept { return decoder_; }
    bool calibrated() const noexcept { return calibrated_; }

    Description description() const override { return jr3_description(settings_); }
    void attach(Device&) override;
    void step(Time now) noexcept override;
    bool set(std::string_view name, double value) override;
    std::vector<std::string> settable() const override;
    std::string summary() const override;
    std::string news() const override;
    void on_sync(std::uint8_t, Time now) noexcept override {
        sample(now);
        publish();
    }
    void on_reset(bool application) noexcept override;
    Abort reading(Entry&) noexcept override;

private:
    class Memory final : public Stream {
    public:
        explicit Memory(Jr3& node) : node_(node) {}
        Abort open_read(Entry&, std::uint32_t& size) noexcept override;
        Abort read(Entry&, std::uint32_t offset, std::span<std::uint8_t> buffer) noexcept override;
        Abort open_write(Entry&, std::uint32_t) noexcept override { return Abort::read_only; }
        Abort write(Entry&, std::uint32_t, std::span<const std::uint8_t>) noexcept override {
            return Abort::read_only;
        }
        Abort close(Entry&, bool, bool) noexcept override { return Abort::none; }

    private:
        Jr3& node_;
    };

    void sample(Time now) noexcept;
    void take(const jr3::Packet&) noexcept;
    void drive_sensor() noexcept;
    void supervise(Time now) noexcept;
    void publish() noexcept;
    void trigger_changes() noexcept;
    void alarm(std::uint8_t bit, bool on, std::uint16_t code, std::uint8_t about) noexcept;
    void show_calibration() noexcept;

    const Jr3Settings settings_;
    // the sensor
    std::array<jr3::Six, 6> inverse_{};
    std::array<std::uint8_t, jr3::memory_size> sensor_memory_{};
    jr3::Generator sensor_;
    jr3::Six applied_{};
    double supply_ = 0.75;
    unsigned noise_ = 0;
    std::uint32_t random_ = 0x4a5233;
    bool cable_ = true;
    std::size_t recorded_bit_ = 0;
    double clocks_ = 0;  // fraction of a clock of the line that is due, below 1
    // the node
    jr3::Decoder decoder_;
    jr3::MemoryReader memory_reader_;
    jr3::Calibration calibration_;  // from the last complete memory, until then the default
    AnalogInputs inputs_;
    std::array<std::int16_t, 6> raw_{};
    std::array<float, 6> limits_{};
    jr3::Six field_{};
    std::int16_t supply_raw_ = 0;
    std::uint8_t status_ = jr3_status::no_signal | jr3_status::not_calibrated;
    std::uint8_t sent_status_ = 0;

    std::uint8_t counter_ = 0;
    bool calibrated_ = false;
    bool led_ = false;
    bool started_ = false;
    Time last_ = 0;
    Time heard_ = 0;
    Time began_ = 0;
    Memory memory_stream_{*this};
};

}  // namespace hal::canopen
