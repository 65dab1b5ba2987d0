// SPDX-License-Identifier: MIT
// How values are written in a configuration.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "bus/config/key_table.hpp"
#include "bus/config/old_forms.hpp"
#include "bus/config/section_file.hpp"
#include "master_config.hpp"
#include "text/characters.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal::canopen::config {

using bus::index_text;
using bus::object_text;
using bus::ObjectAddress;
using bus::value_type_names;
using text::list_of;
using text::Word;
using text::words_of;
using Report = text::Messages<Topic>;

using Line = bus::Entry;
using bus::Keys;
using bus::Section;

/// Parses a bit rate of 5 kbit/s to 20 Mbit/s: 1M, 500k, 125000. [setup]
std::optional<std::uint32_t> rate(std::string_view text);
/// Parses a time with a unit, or 0: 1ms, 250us, 2s, 0.5s. [setup]
std::optional<Time> duration(std::string_view text);
/// Returns the data type that a word names, `u8`, `s16`, `f32`, `text` and the like, and warns about
/// the name of an earlier version. [setup]
std::optional<Type> parse_type(const Word& word, Report&);
/// Parses INDEX or INDEX:SUB and warns about a form of an earlier version. [setup]
std::optional<ObjectAddress> parse_address(const Word& word, Report&);

}  // namespace hal::canopen::config
