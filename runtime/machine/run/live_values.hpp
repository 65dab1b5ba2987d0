// SPDX-License-Identifier: MIT
// Reads and writes values of the running machine.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/abi.h"

namespace hal {

struct Pin;
struct Signal;
struct SessionState;

/// One value read from the running machine.
struct Reading {
    hal_type type = HAL_TYPE_BIT;
    hal_value value{};
};

/// Part of a Session. While a transaction is open, values are those that its objects would have
/// after the commit. [setup]
class LiveValues {
public:
    explicit LiveValues(SessionState& state) : state_(state) {}

    /// Reads pins or signals by name; all that belong to one thread are of the same finished cycle.
    /// The result has no value for an unknown name.
    std::vector<std::optional<Reading>> read(const std::vector<std::string>& names);
    /// The same for objects of the model, without look-up.
    std::vector<hal_value> read_pins(const std::vector<const Pin*>& pins);
    std::vector<hal_value> read_signals(const std::vector<const Signal*>& signals);
    /// Reads each value by itself, without waiting for the end of a cycle. For programs that poll.
    std::vector<hal_value> peek(const std::vector<Pin*>& pins);

    /// Writes values of pins that belong to programs, in one cycle of each thread that reads them.
    /// An input takes its value only while nothing writes its signal.
    void write(const std::vector<std::pair<Pin*, hal_value>>& values);

private:
    SessionState& state_;
};

}  // namespace hal
