// SPDX-License-Identifier: MIT
// What a card has: its identity, its modules and its pins, and which of them are used. All functions
// are [setup].
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mesa/driver/config_string.hpp"
#include "mesa/driver/setup_link.hpp"
#include "mesa/hostmot2/pin.hpp"

namespace hal::mesa {

/// A module of the firmware with the instances that are used.
struct CardModule {
    ModuleDescriptor descriptor;
    ModuleAddresses addresses;
    std::uint32_t clock_hz = 0;
    unsigned used = 0;  ///< instances

    Tag tag() const noexcept { return descriptor.tag; }
};

struct CardPin {
    PinDescriptor descriptor;
    bool is_gpio = true;  ///< no module uses it

    bool is_module_output() const noexcept { return !is_gpio && descriptor.is_output; }
};

struct CardImage {
    std::string address;  ///< of the link
    std::string card;  ///< as the card reports it, "7I76E-16"
    std::string name;  ///< in names of pins, "7i76e"
    std::uint16_t lbp_version = 0;
    Idrom idrom;
    std::vector<CardModule> modules;
    std::vector<CardPin> pins;

    const CardModule* find(Tag tag) const noexcept;
    CardModule* find(Tag tag) noexcept;
    /// Returns the used channels of a smart-serial port, a bit each.
    std::uint32_t serial_channels(const ConfigString& config, unsigned port) const noexcept;
    /// Makes the pins of the channels of a smart-serial port GPIO, except those with a device:
    /// `devices` has a bit for each.
    void release_channels(unsigned port, std::uint32_t devices) noexcept;
};

/// Reads what a card has. It only reads. Throws CardError when there is no answer, when the
/// firmware is unknown, or when a module differs from the ones that the driver supports.
CardImage probe(SetupLink& link);

/// Marks what is used. Returns the problem, or "": the config asks for more than there is.
std::string apply(const ConfigString& config, CardImage& image);

/// Describes each module of the firmware that is not used, whatever the config asks for: UARTs, and
/// modules without a driver.
std::vector<std::string> unused_modules(const CardImage& image);

/// Returns a small 7I76E, for texts about the component without a card.
CardImage example_card();

}  // namespace hal::mesa
