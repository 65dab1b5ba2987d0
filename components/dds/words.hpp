// SPDX-License-Identifier: MIT
// The words that instances and nodes tell each other over the network: read here, whatever comes. No Fast DDS, no thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hal::dds {

constexpr std::size_t largest_status = 60'000;

/// A status as a sample: a string in XCDR1, cut at `largest_status`. [any] takes memory
std::vector<std::uint8_t> status_bytes(std::string_view text);
/// Empty when the bytes are no such string. [any]
std::string_view status_text(std::span<const std::uint8_t> bytes) noexcept;
/// The values of a key in lines "KEY VALUE", in order. [any] takes memory
std::vector<std::string> values_of(std::string_view text, std::string_view key);

/// "a,b,c" or, as netlists without quotes have it, "a;b;c". [any] takes memory
std::vector<std::string> list_of(const std::string& text);
/// "cell/servo=x:float,y:bit;cell/slow=z:s32;" as topic to layout. [any] takes memory
std::map<std::string, std::string> topics_of(const std::string& text);
/// The first difference of a topic's layout, of which `sender` says the one and `taker` the other; empty: they agree. [any] takes memory
std::string difference(const std::string& sends, const std::string& sender, const std::string& takes, const std::string& taker);
/// Words that came over the network, on their way to a terminal: one line, cut at 600 bytes. [any] takes memory
std::string shown(std::string words);

}  // namespace hal::dds
