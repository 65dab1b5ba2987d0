// SPDX-License-Identifier: MIT
// What a file NAME.modbus describes: a line, its slaves, and which of their values become pins.
// Everything here is [setup].
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bus/config/value_types.hpp"
#include "link/line.hpp"
#include "modbus/config/drive_profiles.hpp"
#include "modbus/wire/frame.hpp"
#include "text/config_text.hpp"

namespace hal::modbus {

using text::Span;

/// Subject of a message: its diagnostic code.
enum class Topic : std::uint8_t {
    line,   ///< an invalid line, section or key
    value,  ///< an invalid value
    slave,  ///< slaves and values that cannot work
};
const char* code_of(Topic);

/// The order of the bytes of a value of several registers.
enum class Order : std::uint8_t { abcd, cdab, badc, dcba };

/// When the values of an answer are accepted: at once, or when the last two answers to the same
/// request are equal.
enum class Confirm : std::uint8_t {
    on_errors,  ///< when they are equal, while answers are corrupt
    never,
    always,
};

/// What a value is for.
enum class Purpose : std::uint8_t { pin, speed, load, running, fault };

struct Value {
    std::string name;
    Table table = Table::none;
    std::uint16_t address = 0;
    bus::ValueType type = bus::ValueType::u16;
    std::uint16_t mask = 0;  ///< of a register: a bit; 0: the whole value
    Order order = Order::abcd;
    bool is_output = false;  ///< written to the slave
    bool scaled = false;     ///< the pin is a float: count * scale + offset
    bool has_age = false;    ///< a pin NAME-age
    double scale = 1.0;
    double offset = 0.0;
    std::optional<double> safe;  ///< of the pin, while the slave is offline
    std::string unit;
    std::int64_t period_ns = 0;
    Purpose purpose = Purpose::pin;
    Span at;

    /// Registers or bits.
    std::uint16_t size() const;
    bool is_bit() const { return type == bus::ValueType::bit; }
};

/// A frequency converter.
struct Drive {
    std::string profile;
    std::vector<Write> forward, reverse, stop, reset;
    Write speed;  ///< `value`: counts at `max_speed_rpm`
    bool speed_by_16 = false;
    bool one_telegram = false;
    double max_speed_rpm = 24000;
    double max_frequency_hz = 400;
    double tolerance = 0.02;  ///< of the commanded speed, for at-speed
    std::int64_t stall_ns = 3'000'000'000;
    std::int64_t period_ns = 0;
};

struct Slave {
    std::uint8_t unit = 1;
    std::string name;
    Span at;
    std::int64_t timeout_ns = 100'000'000;
    std::int64_t gap_ns = 0;  ///< silence before a request, beyond 3.5 characters
    std::int64_t period_ns = 0;  ///< of values without `every`
    std::uint32_t lost = 3;   ///< failures in a row until the slave is offline
    std::uint16_t max_registers = max_read_registers;
    std::uint16_t max_gap = 8;  ///< unused registers that are read along with others
    bool single_writes = false;
    Confirm confirm = Confirm::on_errors;
    std::vector<Value> values;
    std::optional<Drive> drive;
    std::vector<Write> stop;
    std::uint32_t stop_attempts = 5;

    bool is_huanyang() const;
};

struct Bus {
    std::string file;
    std::string link;
    line::Options line;
    std::optional<Framing> framing;  ///< not given: by the line
    bool guardian = true;  ///< a process of its own sends the stop telegrams
    std::int64_t heartbeat_ns = 50'000'000;  ///< cycles that are missing for longer stop the drives
    std::vector<Write> broadcast_stop;  ///< stop telegrams to all slaves, which none acknowledges
    /// The silence after a broadcast (serial line V1.02, clause 2.4.1).
    std::int64_t turnaround_ns = 100'000'000;
    std::vector<Slave> slaves;
    Span at;

    bool has_stops() const;
    /// The longest silence that one of the slaves needs before a request.
    std::int64_t max_gap_ns() const;
    /// The framing on a line.
    Framing framing_on(const line::Description&) const;
};

struct ReadResult {
    Bus bus;
    std::vector<text::Message<Topic>> messages;
    bool good() const { return text::good(messages); }
};
/// Reads a configuration; `file` is its name in messages.
ReadResult read(std::string_view text, const std::string& file);

/// Return the keys as tables in Markdown.
std::string bus_reference();
std::string slave_reference();
std::string drive_reference();

}  // namespace hal::modbus
