// SPDX-License-Identifier: MIT
// The text below a configuration: sections and keys, each with its span, and how values are
// spelled.
#pragma once

#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "master_config.hpp"
#include "text/characters.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal::canopen::config {

using text::list_of;
using text::Word;
using text::words_of;
using Report = text::Messages<Topic>;

struct Line {
    Word key, value;  ///< key: lower case, dashes; value: as written
    std::string written{};   ///< the key as written
    bool used = false;
};

struct Section {
    std::vector<Word> words;  ///< of its header
    Span at;
    std::deque<Line> lines;
};

/// Splits a configuration into its sections. [setup]
std::vector<Section> split(std::string_view text, Report&);

/// Parses a bit rate of 5 kbit/s to 20 Mbit/s: 1M, 500k, 125000. [setup]
std::optional<std::uint32_t> rate(std::string_view text);
/// Parses a time with a unit, or 0: 1ms, 250us, 2s, 0.5s. [setup]
std::optional<Time> duration(std::string_view text);
std::optional<bool> yes_or_no(std::string_view text);
/// Returns the data type of u8, i16, real32, text and the like. [setup]
std::optional<Type> type_named(std::string_view word);
inline constexpr const char* type_words =
    "u8, u16, u32, u64, i8, i16, i32, i64, real32, real64 or bool";
/// Parses INDEX or INDEX:SUB with a hexadecimal index. [setup]
std::optional<std::pair<std::uint16_t, std::uint8_t>> address(std::string_view text, bool& has_sub);
/// Formats an object's address: "0x6040:0", "0x6099:1"; a `single` one has no sub-index: "0x6040".
/// [setup]
std::string object_label(std::uint16_t index, unsigned sub, bool single = false);

}  // namespace hal::canopen::config
