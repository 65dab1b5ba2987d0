// SPDX-License-Identifier: MIT
// Objects by index and sub-index, or by their names in an EDS; values by their types.
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
    canopen::Type type = canopen::Type::none;  ///< none: unknown
    std::string name;                          ///< empty: unknown
    /// Returns "6041:0", followed by its name if known.
    std::string label() const;
};

/// The object names of a device; empty without a file.
class ObjectNames {
public:
    /// Reads an EDS; does nothing when `file` is empty. Prints the problems that make values of the
    /// file unreliable, the first ones with their lines. Returns false after printing the reason.
    bool load(const Options&, const std::string& file);
    /// The same; the file is required, and describes objects.
    bool load_objects(const Options&, const std::string& file);
    /// False when load() has printed such problems.
    bool reliable() const { return doubts_.empty(); }
    /// Finds `6041`, `0x1018:1`, `Statusword`, `Identity Object/Vendor-ID`, `vendor-id`. Returns
    /// false and sets `problem`.
    bool find(const std::string& text, ObjectName&, std::string& problem) const;
    ObjectName named(std::uint16_t index, std::uint8_t sub) const;
    const canopen::eds::DeviceDescription* description() const {
        return description_ ? &*description_ : nullptr;
    }

private:
    void print_doubts(const Options&) const;
    std::vector<const ObjectName*> objects_named(const std::string& name) const;
    struct Row {
        std::string words;  ///< as returned by dashed()
        ObjectName object;
    };
    std::optional<canopen::eds::DeviceDescription> description_;
    std::vector<canopen::eds::Message> doubts_;
    std::string file_;
    std::vector<Row> rows_;
};

/// Parses `u16`, `i32`, `r32`, `visible_string`, `domain`, `UNSIGNED16`, …; nullopt for an invalid
/// type.
std::optional<canopen::Type> parse_type(std::string_view word);
/// Returns the valid types, for messages.
std::string type_names();
/// Returns "u16"; "" for none.
std::string type_word(canopen::Type);

/// Formats a value for a person: "0x0237 (567)", "-5 (0xFFFB)", "1.5 (0x3FC00000)", "\"text\" (4
/// bytes)"; without a type, the possible readings.
std::string value_text(std::span<const std::uint8_t> bytes, canopen::Type);
/// Formats a value as JSON: a number, string or true/false.
std::string value_json(std::span<const std::uint8_t> bytes, canopen::Type);
/// Parses a value. Returns false and sets `problem`.
bool parse_value(const std::string& text, canopen::Type, std::vector<std::uint8_t>& bytes,
                 std::string& problem);
std::string hex_bytes(std::span<const std::uint8_t> bytes, const char* separator);

}  // namespace hal::tools
