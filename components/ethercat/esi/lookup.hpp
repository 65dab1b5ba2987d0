// SPDX-License-Identifier: MIT
// Which device of a description is meant: the one look-up of configuration, emulation and tools.
//
//     const esi::Match match = esi::look_up(file, {.name = "EL3104", .revision = 0x00120000});
//     if (match.device == nullptr) return match.problem;
//
// Everything here is [setup].
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ethercat/esi/esi.hpp"

namespace hal::ethercat::esi {

/// What is known of a device; what is not set matches every device.
struct Wanted {
    /// order code, else name, else product code as in 0x0c1e3052
    std::string_view name{};
    std::uint32_t vendor = 0;
    std::optional<std::uint32_t> product{};
    std::optional<std::uint32_t> revision{};
};

struct Match {
    /// Revision for which the device was chosen.
    enum class Revision : std::uint8_t {
        newest,  ///< none was wanted
        exact,
        accepted,  ///< another one, whose CheckRevisionNo accepts the wanted one
        other,  ///< no description is valid for the wanted one: the newest
    };
    const Device* device = nullptr;
    Revision revision = Revision::newest;
    /// why there is no device, as what the file does: "does not describe a product 0x00000007"
    std::string problem{};
    /// order codes or product codes that distinguish the devices; empty: there is no choice
    std::vector<std::string> choices{};
};

/// Finds the device. Devices of one product code and one order code are revisions of one type;
/// several types are never confused: then there is no device, and the types are the choices.
Match look_up(const File&, const Wanted&);

/// Returns the text of a revision or product code, as in 0x00120000.
std::string number_text(std::uint32_t number);
/// Returns the revisions of the type of a device in the order of the file.
std::vector<std::string> revisions_of(const File&, const Device&);

}  // namespace hal::ethercat::esi
