// SPDX-License-Identifier: MIT
#include "bus/canopen/objects.hpp"

#include <algorithm>
#include <fmt/core.h>

#include "bus/json_text.hpp"
#include "canopen/eds/xdd.hpp"
#include "canopen/master/gateway/gateway_values.hpp"
#include "cia301/values.hpp"
#include "cli/output.hpp"
#include "text/characters.hpp"
#include "text/diagnostic.hpp"
#include "text/glyphs.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace eds = canopen::eds;
namespace gateway = canopen::gateway;
using canopen::Type;

namespace {

bool hex_number(std::string_view text, unsigned max, unsigned& value) {
    remove_hex_prefix(text);
    return parse_whole(text, value, 16) && value <= max;
}

Type basic(std::uint16_t code) {
    return code <= 0x1b && canopen::to_string(static_cast<Type>(code))[0] != '\0'
               ? static_cast<Type>(code)
               : Type::none;
}

ObjectName object_of(const eds::Object& object, const eds::Entry& entry) {
    const bool whole = object.single() || entry.name.empty();
    return {object.index, entry.sub, basic(entry.data_type),
            whole ? object.name : object.name + ", " + entry.name};
}

bool looks_like_text(std::span<const std::uint8_t> bytes) {
    std::size_t end = bytes.size();
    while (end > 0 && bytes[end - 1] == 0) {
        --end;
    }
    return end >= 3 && std::all_of(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(end),
                                   [](std::uint8_t c) { return c >= 0x20 && c < 0x7f; });
}

std::string text_in(std::span<const std::uint8_t> bytes) {
    std::string text(bytes.begin(), bytes.end());
    while (text.ends_with('\0')) {
        text.pop_back();
    }
    return text;
}

bool is_text(Type type) { return type == Type::visible_string; }
bool is_time(Type type) { return type == Type::time_of_day || type == Type::time_difference; }
bool is_number(Type type, std::size_t size) {
    return canopen::bits_of(type) != 0 && canopen::bytes_of(type) == size && !is_time(type);
}

}  // namespace

/// Parses INDEX, INDEX:SUB or INDEXsubSUB in hex. An index without 0x has four digits.
static bool parse_numbers(const std::string& text, ObjectName& out) {
    unsigned index = 0;
    unsigned sub = 0;
    const auto colon = std::min(text.find(':'), text.find("sub"));
    const std::string first = text.substr(0, colon);
    if (first.size() != 4 && !first.starts_with("0x")) return false;
    if (!hex_number(first, 0xffff, index)) return false;
    const std::size_t separator = text.size() > colon && text[colon] == ':' ? 1 : 3;
    if (colon != text.npos && !hex_number(text.substr(colon + separator), 0xff, sub)) return false;
    out.index = static_cast<std::uint16_t>(index);
    out.sub = static_cast<std::uint8_t>(sub);
    return true;
}

std::string ObjectName::label() const {
    return fmt::format("{:04X}:{:X}{}", index, sub, name.empty() ? "" : " " + hal::printable(name));
}

bool ObjectNames::load(const Options& options, const std::string& file) {
    if (file.empty()) return true;
    std::string bytes;
    if (!read_file(file, bytes)) {
        fail(options, fmt::format("cannot read '{}': {}", file, bytes));
        return false;
    }
    eds::ReadResult reading = eds::read_description(bytes);
    if (!reading.description) {
        fail(options, fmt::format("'{0}' is not a valid device description; for the "
                                  "problems type: hal can eds check {0}",
                                  file));

        return false;
    }
    file_ = file;
    doubts_ = reading.doubts();
    print_doubts(options);
    description_ = std::move(reading.description);
    for (const eds::Object& object : description_->objects) {
        for (const eds::Entry& entry : object.entries) {
            const ObjectName name = object_of(object, entry);
            if (object.single() || entry.sub == 0) {
                rows_.push_back({dashed(object.name), name});
                continue;
            }
            rows_.push_back({dashed(object.name + " " + entry.name), name});
            rows_.push_back({dashed(entry.name), name});
        }
    }
    return true;
}

bool ObjectNames::load_objects(const Options& options, const std::string& file) {
    if (file.empty()) {
        fail(options, "missing --eds FILE: the description lists the objects of the node");
        return false;
    }
    if (!load(options, file)) return false;
    if (!description_->objects.empty()) return true;
    fail(options, fmt::format("'{}' describes no object: nothing to read; give the whole EDS of "
                              "the device",
                              file));
    return false;
}

void ObjectNames::print_doubts(const Options& options) const {
    constexpr std::size_t max_printed = 3;
    for (std::size_t n = 0; n < doubts_.size() && n < max_printed; ++n) {
        const eds::Message& doubt = doubts_[n];
        fail(options, fmt::format("{}:{}: {}{}", file_, doubt.at.line, doubt.sentence,
                                  doubt.help.empty() ? "" : "; " + doubt.help));
    }
    if (doubts_.size() > max_printed) {
        fail(options, fmt::format("{} more; list them with: hal can eds check {}",
                                  doubts_.size() - max_printed, file_));
    }
}

ObjectName ObjectNames::named(std::uint16_t index, std::uint8_t sub) const {
    if (description_) {
        if (const eds::Object* object = description_->find(index)) {
            if (const eds::Entry* entry = object->find(sub)) return object_of(*object, *entry);
        }
    }
    return {index, sub, Type::none, {}};
}

/// Returns the objects with this name, each once.
std::vector<const ObjectName*> ObjectNames::objects_named(const std::string& name) const {
    std::vector<const ObjectName*> found;
    for (const Row& row : rows_) {
        const bool again = std::ranges::any_of(found, [&](const ObjectName* f) {
            return f->index == row.object.index && f->sub == row.object.sub;
        });
        if (row.words == name && !again) {
            found.push_back(&row.object);
        }
    }
    return found;
}

bool ObjectNames::find(const std::string& text, ObjectName& out, std::string& problem) const {
    if (parse_numbers(text, out)) {
        out = named(out.index, out.sub);
        return true;
    }
    if (!description_) {
        problem = fmt::format(
            "invalid object '{}'; write INDEX or INDEX:SUB in hex, such as 6041 or 1018:1, "
            "or add --eds FILE for names",
            text);

        return false;
    }
    const std::string wanted = dashed(text);
    const std::vector<const ObjectName*> found = objects_named(wanted);
    if (found.size() == 1) {
        out = *found[0];
        return true;
    }
    if (found.empty()) {
        std::vector<std::string> names;
        for (const Row& row : rows_) {
            names.push_back(row.words);
        }
        const std::string hint = did_you_mean(wanted, names);
        problem = fmt::format("unknown object '{}' in {}; {}", text, file_,
                              hint.empty() ? "write INDEX:SUB in hex, or one of its names" : hint);

        return false;
    }
    std::string all;
    for (std::size_t n = 0; n < std::min<std::size_t>(found.size(), 4); ++n) {
        append_item(all, fmt::format("{:04X}:{:X}", found[n]->index, found[n]->sub));
    }
    problem = fmt::format(
        "ambiguous name '{}' of {} objects ({}{}); write the index, such as {:04X}:{:X}", text,
        found.size(), all, found.size() > 4 ? ", …" : "", found[0]->index, found[0]->sub);

    return false;
}

std::optional<Type> parse_type(std::string_view word) {
    if (const gateway::Format* f = gateway::format(word); f && f->type != Type::none) {
        return f->type;
    }
    if (const eds::DataType* type = eds::data_type(word)) {
        return basic(type->code) != Type::none ? std::optional(basic(type->code)) : std::nullopt;
    }
    constexpr std::pair<std::string_view, Type> others[] = {{"bool", Type::boolean},
                                                            {"string", Type::visible_string},
                                                            {"octets", Type::octet_string},
                                                            {"float", Type::real32},
                                                            {"double", Type::real64}};
    for (const auto& [name, type] : others) {
        if (eds::same_word(name, word)) return type;
    }
    return std::nullopt;
}

std::string type_names() {
    return "bool, i8 … i64, u8 … u64, r32, r64, visible_string, octet_string, unicode_string, "
           "domain, time_of_day or time_difference";
}

std::string type_word(Type type) {
    const gateway::Format* f = type == Type::none ? nullptr : gateway::format(type);
    return f ? std::string(f->word) : "";
}

std::string hex_bytes(std::span<const std::uint8_t> bytes, const char* separator) {
    std::string text;
    for (const auto byte : bytes) {
        append_item(text, fmt::format("{:02X}", byte), separator);
    }
    return text;
}

namespace {

std::string number_text(std::span<const std::uint8_t> bytes, Type type, const std::string& raw) {
    const std::string decimal = gateway::text_of(bytes, *gateway::format(type));
    const bool decimal_first = canopen::is_signed(type) || canopen::is_real(type);
    return decimal_first ? fmt::format("{} ({})", decimal, raw)
                         : fmt::format("{} ({})", raw, decimal);
}

std::string time_text(std::span<const std::uint8_t> bytes, const std::string& raw) {
    const auto ms = cia301::natural_of(bytes.first(4)) & 0x0fffffff;
    return fmt::format("{} days {:02}:{:02}:{:02}.{:03} ({})", cia301::natural_of(bytes.subspan(4)),
                       ms / 3'600'000, ms / 60'000 % 60, ms / 1000 % 60, ms % 1000, raw);
}

/// Everything that up to eight bytes without a type may mean.
std::string guesses(std::span<const std::uint8_t> bytes, const std::string& raw) {
    const std::uint64_t number = cia301::natural_of(bytes);
    const std::int64_t integer =
        cia301::sign_extended(number, 8 * static_cast<unsigned>(bytes.size()));
    return fmt::format("{} ({}{}{})", raw, number,
                       integer < 0 ? fmt::format(", or {}", integer) : "",
                       looks_like_text(bytes) ? fmt::format(", or \"{}\"", text_in(bytes)) : "");
}

std::string bytes_text(std::span<const std::uint8_t> bytes, Type type) {
    constexpr std::size_t max = 32;
    const std::string no_such =
        canopen::bits_of(type) != 0
            ? fmt::format("; {} has {}", type_word(type), canopen::bytes_of(type))
            : "";
    return fmt::format("{}{} ({}{})", hex_bytes(bytes.first(std::min(bytes.size(), max)), " "),
                       bytes.size() > max ? " …" : "", counted(bytes.size(), "byte"), no_such);
}

}  // namespace

std::string value_text(std::span<const std::uint8_t> bytes, Type type) {
    const std::size_t size = bytes.size();
    if (size == 0) return "empty (0 bytes)";
    const std::string raw =
        size <= 8 ? fmt::format("0x{:0{}X}", cia301::natural_of(bytes), 2 * size) : "";
    if (type == Type::boolean && size == 1) {
        return fmt::format("{} ({})", bytes[0] != 0 ? "true" : "false", raw);
    }
    if (is_number(type, size)) return number_text(bytes, type, raw);
    if (is_time(type) && size == 6) return time_text(bytes, raw);
    const bool untyped = type == Type::none;
    if (is_text(type) || (untyped && size > 8 && looks_like_text(bytes))) {
        return fmt::format("\"{}\" ({})", hal::printable(text_in(bytes), 10'000),
                           counted(size, "byte"));
    }
    return untyped && size <= 8 ? guesses(bytes, raw) : bytes_text(bytes, type);
}

std::string value_json(std::span<const std::uint8_t> bytes, Type type) {
    if (type == Type::boolean && bytes.size() == 1) return bytes[0] != 0 ? "true" : "false";
    if (is_text(type)) return json_text(text_in(bytes));
    if (is_number(type, bytes.size())) {
        const std::string text = gateway::text_of(bytes, *gateway::format(type));
        // nan and inf are invalid in JSON
        return text.find_first_of("nN") == text.npos ? text : json_text(text);
    }
    if (type == Type::none && !bytes.empty() && bytes.size() <= 8) {
        return fmt::format("{}", cia301::natural_of(bytes));
    }
    if (type == Type::none && looks_like_text(bytes)) return json_text(text_in(bytes));
    return json_text(hex_bytes(bytes, ""));
}

bool parse_value(const std::string& text, Type type, std::vector<std::uint8_t>& bytes,
                 std::string& problem) {
    if (is_text(type)) {
        bytes.assign(text.begin(), text.end());
        return true;
    }
    const eds::Encoded value = eds::encode_strictly(text, static_cast<std::uint16_t>(type), 0);
    if (!value) {
        problem = value.error;
        return false;
    }
    if (value.node_id) {
        problem = fmt::format("invalid value '{}' with $NODEID; write the number", text);

        return false;
    }
    if (value.bytes.empty() && canopen::bits_of(type) != 0) {
        problem = "empty value";
        return false;
    }
    bytes = value.bytes;
    return true;
}

}  // namespace hal::tools
