// SPDX-License-Identifier: MIT
// A slave made of software: the registers that a configuration names, and a converter behind those
// of a profile. Not real time.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "modbus/config/bus_config.hpp"
#include "modbus/device/drive_model.hpp"

namespace hal::modbus {

class EmulatedSlave {
public:
    /// `config` outlives it.
    explicit EmulatedSlave(const Slave& config);

    const Slave& config() const { return config_; }
    bool is_huanyang() const { return config_.is_huanyang(); }
    /// Answers a request: the normal answer, or an exception.
    Pdu answer(std::span<const std::uint8_t> request);
    /// Moves the motor and updates its registers.
    void advance(std::int64_t now_ns);
    DriveModel* drive() { return drive_ ? &*drive_ : nullptr; }
    /// Sets a value that the master reads, in its unit. Returns false for an unknown name.
    bool set(std::string_view name, double value);
    /// Returns why a value cannot be set to a number: unknown, written by the master or by the
    /// model of the drive, or out of the range of its registers; and what can be set. "" when it
    /// can. [setup]
    std::string problem_of(std::string_view name, double value) const;
    /// Returns a register; nullopt: there is none.
    std::optional<std::uint16_t> get(Table table, std::uint16_t address) const;

private:
    static std::uint32_t key(Table table, unsigned address) {
        return static_cast<std::uint32_t>(table) << 16 | (address & 0xffffU);
    }
    std::string settable_values() const;
    void create(Table table, unsigned address, unsigned count);
    void put(const Value& value, double number);
    Pdu read(std::span<const std::uint8_t> request, Table table);
    Pdu write_one(std::span<const std::uint8_t> request, Table table);
    Pdu write_many(std::span<const std::uint8_t> request, Table table);
    Pdu answer_huanyang(std::span<const std::uint8_t> request);
    void written(Table table, unsigned address, unsigned value);
    void follow(const std::vector<Write>& writes, const Write& last, int direction, bool& matched);
    bool holds(const Write& write) const;

    const Slave& config_;
    std::map<std::uint32_t, std::uint16_t> registers_;
    std::optional<DriveModel> drive_;
};

}  // namespace hal::modbus
