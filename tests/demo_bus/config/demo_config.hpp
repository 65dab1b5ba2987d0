// SPDX-License-Identifier: MIT
// The configuration of a demo bus, NAME.demo. Everything here is [setup].
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "text/config_text.hpp"

namespace hal::demo {

struct Device {
    std::uint8_t address = 0;  ///< 1..127
    std::string name;  ///< of its pins
    double scale = 1.0;  ///< units per count
};
struct Bus {
    std::int64_t silence_ns = 100'000'000;
    std::vector<Device> devices;
};

enum class Topic : std::uint8_t { line, value };
/// Returns the diagnostic code of a topic.
const char* code_of(Topic topic);

struct ReadResult {
    Bus bus;
    std::vector<text::Message<Topic>> messages;
};
/// Reads a file, and reports everything that is invalid in it.
ReadResult read(std::string_view text);
/// Return the tables of keys for the page of the bus.
std::string bus_reference();
std::string device_reference();

}  // namespace hal::demo
