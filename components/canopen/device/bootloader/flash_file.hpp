// SPDX-License-Identifier: MIT
// The flash of a device, kept in a file.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hal::canopen {

/// What is wrong, or nothing. No file is no image. [setup]
std::string read_flash(const std::string& path, std::size_t most, std::optional<std::vector<std::uint8_t>>& image);
/// The file has the whole image or what it had before. [setup]
std::string write_flash(const std::string& path, std::span<const std::uint8_t> image);

}  // namespace hal::canopen
