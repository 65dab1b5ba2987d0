// SPDX-License-Identifier: MIT
// `hal can sdo read` and `hal can sdo write`: reads or writes objects of a node by their types.
#include "bus/canopen/sdo_command.hpp"

#include <fmt/core.h>
#include <memory>

#include "bus/canopen/node_client.hpp"
#include "bus/canopen/objects.hpp"
#include "bus/json_text.hpp"
#include "cli/output.hpp"

namespace hal::tools {

using canopen::SdoMode;
using canopen::SdoRequest;
using canopen::Type;

namespace {

// of one object; memory is used only as far as it is filled
constexpr std::size_t max_bytes = 64 << 20;

struct SdoTarget {
    std::uint8_t node = 0;
    std::optional<Type> type;
    ObjectNames names;
    SdoMode mode = SdoMode::automatic;
};

/// Checks the options of both commands before the bus is opened.
bool parse_target(const SdoOptions& options, SdoTarget& target) {
    if (!node_of(options, options.words[1], target.node) ||
        !target.names.load(options, options.eds)) {
        return false;
    }
    if (!options.type.empty() && !(target.type = parse_type(options.type))) {
        fail(options,
             fmt::format("invalid --type '{}'; write one of: {}", options.type, type_names()));

        return false;
    }
    if (options.block && options.segmented) {
        fail(options, "--block and --segmented exclude each other");
        return false;
    }
    if (options.block) {
        target.mode = SdoMode::block;
    }
    if (options.segmented) {
        target.mode = SdoMode::segmented;
    }
    return true;
}

bool save(const SdoReadOptions& options, std::span<const std::uint8_t> bytes) {
    const std::string why =
        write_file(options.output, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (why.empty()) return true;
    fail(options, why);
    return false;
}

std::string json_line(std::uint8_t node, const ObjectName& object, Type type,
                      std::span<const std::uint8_t> bytes) {
    return fmt::format(
        R"({{"node":{},"index":{},"sub":{},"name":{},"type":{},"value":{},"bytes":{},"data":"{}"}})"
        "\n",
        node, object.index, object.sub, object.name.empty() ? "null" : json_text(object.name),
        type == Type::none ? "null" : json_text(type_word(type)), value_json(bytes, type),
        bytes.size(), hex_bytes(bytes, ""));
}

/// Checks that the other options suit `--output`, which writes the bytes of one object. Returns
/// false after printing the reason.
bool check_output(const SdoReadOptions& options, std::size_t objects) {
    if (options.output.empty()) return true;
    if (objects != 1) {
        fail(options, "-o writes the bytes of one object; name only one");
        return false;
    }
    if (options.json || !options.type.empty()) {
        fail(options,
             fmt::format(
                 "{} has no effect with -o, which writes the bytes as they are; delete one of them",
                 options.json ? "--json" : "--type"));
        return false;
    }
    return true;
}

/// Writes the value of an object to the file of `--output`, or prints it. Returns whether that
/// succeeded, after printing the reason.
bool write_value(const SdoReadOptions& options, const SdoTarget& target, const ObjectName& object,
                 std::span<const std::uint8_t> bytes) {
    if (!options.output.empty()) return save(options, bytes);
    const Type type = target.type.value_or(object.type);
    if (options.json) return print(json_line(target.node, object, type, bytes));
    return print(fmt::format("{} = {}\n", object.label(), value_text(bytes, type)));
}

}  // namespace

int run_can_sdo_read(const SdoReadOptions& options) {
    if (options.words.size() < 3) {
        return fail(options,
                    "expected ADDRESS NODE OBJECT; type: hal can sdo read ADDRESS NODE OBJECT");
    }
    SdoTarget target;
    if (!parse_target(options, target)) return 1;
    std::vector<ObjectName> objects;
    for (const std::string& word : std::span(options.words).subspan(2)) {
        ObjectName object;
        std::string problem;
        if (!target.names.find(word, object, problem)) return fail(options, problem);
        objects.push_back(std::move(object));
    }
    if (!check_output(options, objects.size())) return 1;
    NodeClient station(options, options.timeout_ns);
    if (!station.open(options.words[0])) return 1;
    const auto buffer = std::make_unique_for_overwrite<std::uint8_t[]>(max_bytes);
    for (const ObjectName& object : objects) {
        SdoRequest request{.index = object.index,
                           .sub = object.sub,
                           .upload = true,
                           .mode = target.mode,
                           .buffer = {buffer.get(), max_bytes}};
        if (!station.transfer(target.node, request)) {
            return station.fail_transfer(target.node, request, object.label());
        }
        if (!write_value(options, target, object, {buffer.get(), request.size})) return 1;
    }
    return 0;
}

namespace {

/// Guesses the type of an object without a description: as wide as its present value, signed for a
/// negative value.
bool width_of(NodeClient& station, std::uint8_t node, const ObjectName& object,
              const std::string& value, Type& type, std::string& problem) {
    std::uint8_t received[64];
    SdoRequest request{
        .index = object.index, .sub = object.sub, .upload = true, .buffer = received};
    const bool read = station.transfer(node, request);
    const bool negative = value.starts_with('-');
    switch (read ? request.size : 0) {
    case 1: type = negative ? Type::integer8 : Type::unsigned8; return true;
    case 2: type = negative ? Type::integer16 : Type::unsigned16; return true;
    case 4: type = negative ? Type::integer32 : Type::unsigned32; return true;
    case 8: type = negative ? Type::integer64 : Type::unsigned64; return true;
    default: break;
    }
    problem = read ? fmt::format("it has {} bytes now", request.size)
                   : fmt::format("cannot read it ({})", canopen::to_string(request.abort));
    problem = fmt::format(
        "unknown type of {}: {}; add --type, such as u16 or visible_string, or --eds FILE",
        object.label(), problem);
    return false;
}

}  // namespace

int run_can_sdo_write(const SdoWriteOptions& options) {
    const bool from_file = !options.input.empty();
    if (options.words.size() != (from_file ? 3 : 4)) {
        return fail(options,
                    "expected one value; type: hal can sdo write ADDRESS NODE OBJECT VALUE, or "
                    "--from FILE in place of VALUE");
    }
    SdoTarget target;
    if (!parse_target(options, target)) return 1;
    ObjectName object;
    std::string problem;
    if (!target.names.find(options.words[2], object, problem)) return fail(options, problem);
    Type type = target.type.value_or(object.type);
    std::vector<std::uint8_t> bytes;
    if (from_file) {
        std::string text;
        if (!read_file(options.input, text)) {
            return fail(options, fmt::format("cannot read '{}': {}", options.input, text));
        }
        bytes.assign(text.begin(), text.end());
    } else if (type != Type::none && !parse_value(options.words[3], type, bytes, problem)) {
        return fail(options, problem);
    }
    NodeClient station(options, options.timeout_ns);
    if (!station.open(options.words[0])) return 1;
    if (!from_file && type == Type::none) {
        if (!width_of(station, target.node, object, options.words[3], type, problem)) {
            return fail(options, problem);
        }
        if (!parse_value(options.words[3], type, bytes, problem)) return fail(options, problem);
    }
    SdoRequest request{
        .index = object.index, .sub = object.sub, .mode = target.mode, .data = bytes};
    if (!station.transfer(target.node, request)) {
        return station.fail_transfer(target.node, request, object.label());
    }
    return 0;
}

}  // namespace hal::tools
