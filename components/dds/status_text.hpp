// SPDX-License-Identifier: MIT
// The status text that instances and nodes exchange over the network. Tolerates any input. No Fast
// DDS, no thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hal::dds {

constexpr std::size_t max_status_size = 60'000;

/// Returns a status as a sample: a string in XCDR1, truncated to `max_status_size` bytes. [any]
/// allocates
std::vector<std::uint8_t> status_bytes(std::string_view text);
/// Returns the text of a sample; empty when it is not a valid string. [any]
std::string_view status_text(std::span<const std::uint8_t> bytes) noexcept;
/// Returns the values of a key in lines "KEY VALUE", in order. [any] allocates
std::vector<std::string> values_of(std::string_view text, std::string_view key);

/// Splits "a,b,c" or, for netlists that avoid quotes, "a;b;c". [any] allocates
std::vector<std::string> list_of(const std::string& text);
/// Parses "cell/servo=x:float,y:bit;cell/slow=z:s32;" into topic and layout. [any] allocates
std::map<std::string, std::string> topics_of(const std::string& text);
/// Returns the first difference between the layout that node `sender` publishes and the one that
/// node `receiver` expects; empty: they are equal. [any] allocates
std::string difference(const std::string& sent, const std::string& sender,
                       const std::string& expected, const std::string& receiver);
/// Makes a text from the network safe for a terminal: control characters replaced by ?, at most 600
/// bytes. [any] allocates
std::string shown(std::string text);

}  // namespace hal::dds
