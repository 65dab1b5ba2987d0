// SPDX-License-Identifier: MIT
// Which telegrams carry the values of a bus, and how long they take. [setup]
#pragma once

#include <cstdint>
#include <vector>

#include "modbus/config/bus_config.hpp"

namespace hal::modbus {

struct Telegram {
    enum class Kind : std::uint8_t {
        read,
        write,
        drive,  ///< command and speed of a frequency converter: up to four requests
    };
    Kind kind = Kind::read;
    std::uint32_t slave = 0;
    Table table = Table::none;
    std::uint16_t address = 0;
    std::uint16_t count = 0;  ///< bits or registers
    std::int64_t period_ns = 0;
    std::vector<std::uint32_t> values;  ///< indices in Plan::values
};

/// A value and where it is in its telegram.
struct PlannedValue {
    std::uint32_t slave = 0;
    const Value* value = nullptr;
    std::uint32_t telegram = 0;
    std::uint16_t offset = 0;  ///< in bits or registers from the first of the telegram
};

/// The telegrams of a bus. It points into the Bus, which outlives it. Two processes that read the
/// same file have the same plan.
struct Plan {
    std::vector<PlannedValue> values;
    std::vector<Telegram> telegrams;
};

/// Merges values of one slave, kind and period into as few telegrams as its limits allow.
Plan make_plan(const Bus& bus);

/// Times of a telegram on a line, in ns.
struct TelegramTime {
    std::int64_t request = 0;
    std::int64_t answer = 0;
    std::int64_t silence = 0;  ///< 3.5 characters before both, and the gap of the slave
    std::int64_t all(std::int64_t thinking) const { return request + answer + silence + thinking; }
};
TelegramTime time_of(const Telegram& telegram, const Bus& bus, Framing framing);

/// The silence between two frames: 3.5 characters, 1.75 ms above 19200 baud (serial line V1.02,
/// clause 2.5.1.1). [any]
std::int64_t silence_ns(const line::Options& options) noexcept;

struct Load {
    double use = 0.0;                 ///< share of the time in which the line is busy, 1: all
    std::vector<std::int64_t> ages;  ///< of each telegram: worst age of its values when read, in ns
    std::int64_t set_point_ns = 0;  ///< worst time from a changed set-point to the end of its frame
    std::int64_t broadcast_ns = 0;  ///< worst time from a stop until its broadcasts are sent
    std::int64_t stop_ns = 0;  ///< worst time from a stop until the last addressed one is sent
};
/// `thinking`: how long a slave takes to answer.
Load load_of(const Plan& plan, const Bus& bus, Framing framing, std::int64_t thinking);

/// Returns the longest time from a stop until all stop telegrams are acknowledged or sent as often
/// as the slaves declare, when no slave answers, on a serial line.
std::int64_t max_stop_ns(const Plan& plan, const Bus& bus);
/// Returns how long to wait for that, and for what it does not contain: a line that is lost or
/// accepts nothing, and bytes that are late. When it has passed, the master has failed.
inline std::int64_t stop_limit_ns(const Plan& plan, const Bus& bus) {
    return max_stop_ns(plan, bus) + 5'000'000'000;
}

}  // namespace hal::modbus
