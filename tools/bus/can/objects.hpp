// SPDX-License-Identifier: MIT
// Objects as they are typed and shown: by index and sub-index, or by the names an EDS gives them; values in their types.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canopen/eds/eds.hpp"
#include "canopen/protocol/numbers.hpp"
#include "cli/options.hpp"

namespace hal::tools {

struct ObjectName {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    canopen::Type type = canopen::Type::none;  ///< none: not known
    std::string name;                          ///< empty: not known
    /// "6041:0", with its name behind it where there is one.
    std::string label() const;
};

/// The names of a device; without a file there are none, and numbers do.
class ObjectNames {
public:
    /// Reads an EDS; none when `file` is empty. False after printing why not.
    bool load(const Options&, const std::string& file);
    /// `6041`, `0x1018:1`, `Statusword`, `Identity Object/Vendor-ID`, `vendor-id`. False, and `problem`.
    bool find(const std::string& text, ObjectName&, std::string& problem) const;
    ObjectName named(std::uint16_t index, std::uint8_t sub) const;
    const canopen::eds::DeviceDescription* description() const { return description_ ? &*description_ : nullptr; }

private:
    struct Row {
        std::string words;  ///< as `plain` makes them
        ObjectName object;
    };
    std::optional<canopen::eds::DeviceDescription> description_;
    std::string file_;
    std::vector<Row> rows_;
};

/// `u16`, `i32`, `r32`, `visible_string`, `domain`, `UNSIGNED16`, …; none when it is no type.
std::optional<canopen::Type> parse_type(std::string_view word);
/// What may be typed, for messages.
std::string type_words();
/// "u16"; "" for none.
std::string type_word(canopen::Type);

/// The value for a reader: "0x0237 (567)", "-5 (0xFFFB)", "1.5 (0x3FC00000)", "\"text\" (4 bytes)"; without a type, what the bytes could be.
std::string value_text(std::span<const std::uint8_t> bytes, canopen::Type);
/// The value for a program: a JSON number, string or true/false.
std::string value_json(std::span<const std::uint8_t> bytes, canopen::Type);
/// Text to bytes. False, and `problem`.
bool parse_value(const std::string& text, canopen::Type, std::vector<std::uint8_t>& bytes, std::string& problem);
std::string hex_bytes(std::span<const std::uint8_t> bytes, const char* separator);
std::string json_text(std::string_view text);

}  // namespace hal::tools
