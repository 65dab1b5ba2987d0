// SPDX-License-Identifier: MIT
// How a line of devices is written: words between blanks, devices between commas or line ends. A
// value with blanks or commas stands between single quotes; a quote in it is written twice:
//
//     coupler, esi file='drives, all.xml' device='It''s one'
//
// Everything here is [setup].
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "text/config_text.hpp"

namespace hal::ethercat::devices {

/// Returns a list of devices with one device per line: commas outside of quotes become line ends.
std::string device_lines(std::string_view list);
/// Returns the words of a line without their quotes.
std::vector<text::Word> device_words(const text::Word& line);
/// Returns a value as it is written in a line.
std::string device_value(std::string_view value);
/// Splits a list at commas outside of quotes; the parts keep their quotes and have no blanks at
/// both ends.
std::vector<std::string> device_list(std::string_view list);
/// Returns a text without its quotes.
std::string without_device_quotes(std::string_view text);

}  // namespace hal::ethercat::devices
