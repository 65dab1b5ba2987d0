// SPDX-License-Identifier: MIT
#include "config_lines.hpp"

#include <iterator>

namespace hal::canopen::config {

namespace {

/// The data types of CiA 301, in the order of bus::ValueType.
constexpr Type types[] = {Type::boolean,    Type::unsigned8, Type::unsigned16, Type::unsigned32,
                          Type::unsigned64, Type::integer8,  Type::integer16,  Type::integer32,
                          Type::integer64,  Type::real32,    Type::real64};
static_assert(std::size(types) == static_cast<std::size_t>(bus::ValueType::f64) + 1);

}  // namespace

const char* code_of(Topic topic) {
    constexpr const char* codes[] = {"canopen-line", "canopen-value", "canopen-object",
                                     "canopen-node", "canopen-load"};
    return codes[static_cast<std::size_t>(topic)];
}

std::optional<std::uint32_t> rate(std::string_view text) {
    return bus::parse_bit_rate(text, 5e3, 20e6);
}

std::optional<Time> duration(std::string_view text) { return parse_duration_ns(text, 0.0); }

std::optional<Type> parse_type(const Word& word, Report& report) {
    if (same_word(word.text, "text")) return Type::visible_string;
    const bus::TypeName type = bus::parse_value_type(word.text);
    if (type.name == nullptr) return std::nullopt;
    bus::warn_old_type(report, Topic::value, word, type);
    return types[static_cast<std::size_t>(type.type)];
}

std::optional<ObjectAddress> parse_address(const Word& word, Report& report) {
    const auto address = bus::parse_object_address(word.text);
    if (address) {
        bus::warn_bare_hex(report, Topic::value, word, *address);
    }
    return address;
}

}  // namespace hal::canopen::config
