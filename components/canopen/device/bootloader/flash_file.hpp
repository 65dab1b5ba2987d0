// SPDX-License-Identifier: MIT
// The flash of a simulated device, kept in a file.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hal::canopen {

/// Reads an image of at most `max` bytes; a file that does not exist leaves `image` empty. Returns
/// the problem, or "". [setup]
std::string read_flash(const std::string& path, std::size_t max,
                       std::optional<std::vector<std::uint8_t>>& image);
/// Replaces the file atomically: it has the new image or the old one. Returns the problem, or "".
/// [setup]
std::string write_flash(const std::string& path, std::span<const std::uint8_t> image);

}  // namespace hal::canopen
