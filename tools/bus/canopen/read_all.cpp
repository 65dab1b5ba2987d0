// SPDX-License-Identifier: MIT
// `hal can read-all`: reads every object that the description of a node lists, with the reason of
// each abort.
#include "bus/canopen/read_all.hpp"

#include <fmt/core.h>
#include <memory>
#include <unistd.h>

#include "bus/canopen/node_client.hpp"
#include "bus/canopen/objects.hpp"
#include "bus/json_text.hpp"
#include "cli/output.hpp"

namespace hal::tools {

namespace {

namespace eds = canopen::eds;

/// The result of reading an object.
struct ReadObject {
    ObjectName object;
    std::string_view access;
    std::span<const std::uint8_t> bytes;
    canopen::Abort abort = canopen::Abort::none;
    bool asked = true;  ///< false: write-only

    std::string reason() const {
        if (!asked) return "write-only";
        return abort == canopen::Abort::none
                   ? ""
                   : fmt::format("{} (0x{:08X})", canopen::to_string(abort),
                                 static_cast<std::uint32_t>(abort));
    }
    std::string table_line() const {
        const std::string why = reason();
        return why.empty()
                   ? fmt::format("{} = {}\n", object.label(), value_text(bytes, object.type))
                   : fmt::format("{}: {}: {}\n", object.label(), asked ? "rejected" : "not read",
                                 why);
    }
    std::string csv_line() const {
        std::string value = reason().empty() ? value_json(bytes, object.type) : "";
        if (object.type == canopen::Type::visible_string) {  // as CSV quotes it, not as JSON does
            value = quoted({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
        } else if (value.starts_with('"')) {
            value = quoted(std::string_view(value).substr(1, value.size() - 2));
        }
        return fmt::format("0x{:04X},{},{},{},{},{},{},{}\r\n", object.index, object.sub,
                           quoted(object.name), type_word(object.type), access, value,
                           hex_bytes(bytes, ""), quoted(reason()));
    }
    std::string json_line(std::uint8_t node) const {
        const std::string why = reason();
        return fmt::format(
            R"({{"node":{},"index":{},"sub":{},"name":{},"type":{},"access":"{}","value":{},"data":{},"reason":{}}})"
            "\n",
            node, object.index, object.sub, json_text(object.name),
            object.type == canopen::Type::none ? "null" : json_text(type_word(object.type)), access,
            why.empty() ? value_json(bytes, object.type) : "null",
            why.empty() ? json_text(hex_bytes(bytes, "")) : "null",
            why.empty() ? "null" : json_text(why));
    }

private:
    /// Quotes a field if necessary (RFC 4180).
    static std::string quoted(std::string_view text) {
        if (text.find_first_of(",\"\r\n") == text.npos) return std::string(text);
        std::string out = "\"";
        for (const char c : text) {
            out += c == '"' ? "\"\"" : std::string(1, c);
        }
        return out + "\"";
    }
};

}  // namespace

int run_can_read_all(const ReadAllOptions& options) {
    // of one object; memory is used only as far as it is filled
    constexpr std::size_t max_bytes = 64 << 20;
    if (options.words.size() != 2) {
        return fail(options,
                    "expected ADDRESS NODE; type: hal can read-all ADDRESS NODE --eds FILE");
    }
    if (options.json && !options.output.empty()) {
        return fail(options, "--json and -o exclude each other: -o writes CSV");
    }
    std::uint8_t node = 0;
    ObjectNames names;
    if (!node_of(options, options.words[1], node) || !names.load_objects(options, options.eds)) {
        return 1;
    }
    NodeClient station(options, options.timeout_ns);
    if (!station.open(options.words[0])) return 1;
    const auto received = std::make_unique_for_overwrite<std::uint8_t[]>(max_bytes);
    std::string csv = "index,sub,name,type,access,value,data,reason\r\n";
    std::size_t read = 0;
    std::size_t refused = 0;
    std::size_t write_only = 0;
    for (const eds::Object& object : names.description()->objects) {
        for (const eds::Entry& entry : object.entries) {
            ReadObject one{.object = names.named(object.index, entry.sub),
                           .access = eds::name_of(entry.access),
                           .bytes = {}};
            one.asked = entry.readable();
            if (one.asked) {
                canopen::SdoRequest request{.index = object.index,
                                            .sub = entry.sub,
                                            .upload = true,
                                            .buffer = {received.get(), max_bytes}};
                const bool good = station.transfer(node, request);
                if (!good && !request.aborted_by_server) {
                    return station.fail_transfer(node, request, one.object.label());
                }
                one.abort = request.abort;
                if (good) {
                    one.bytes = {received.get(), request.size};
                }
                ++(good ? read : refused);
            } else {
                ++write_only;
            }
            if (!options.output.empty()) {
                csv += one.csv_line();
            } else if (!print(options.json ? one.json_line(node) : one.table_line())) {
                return 1;
            }
        }
    }
    if (!options.output.empty()) {
        if (const std::string wrong = write_file(options.output, csv); !wrong.empty()) {
            return fail(options, fmt::format("cannot write '{}': {}", options.output, wrong));
        }
    }
    const std::string sum = fmt::format("{} objects of node {} read, {} rejected, {} write-only\n",
                                        read, node, refused, write_only);
    if (!options.output.empty()) return exit_code(print(options.output + ": " + sum));
    write_all(STDERR_FILENO, sum);
    return 0;
}

}  // namespace hal::tools
