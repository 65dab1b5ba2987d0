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

/// Reads the objects of a node one after the other, and writes them as CSV or prints them.
class ReadAll {
public:
    ReadAll(const ReadAllOptions& options, std::uint8_t node, const ObjectNames& names,
            NodeClient& station)
        : options_(options), node_(node), names_(names), station_(station) {}

    /// Returns the exit status, after printing the reason if it is not 0.
    int run() {
        for (const eds::Object& object : names_.description()->objects) {
            for (const eds::Entry& entry : object.entries) {
                if (const int status = handle(object.index, entry); status != 0) return status;
            }
        }
        if (to_file()) {
            const std::string problem = write_file(options_.output, csv_);
            if (!problem.empty()) {
                return fail(options_,
                            fmt::format("cannot write '{}': {}", options_.output, problem));
            }
        }
        return print_summary();
    }

private:
    bool to_file() const { return !options_.output.empty(); }

    int handle(std::uint16_t index, const eds::Entry& entry) {
        ReadObject object{.object = names_.named(index, entry.sub),
                          .access = eds::name_of(entry.access),
                          .bytes = {},
                          .asked = entry.readable()};
        if (object.asked) {
            if (const int status = read(object); status != 0) return status;
        } else {
            ++write_only_;
        }
        if (to_file()) {
            csv_ += object.csv_line();
            return 0;
        }
        return exit_code(print(options_.json ? object.json_line(node_) : object.table_line()));
    }
    /// A rejection by the node is a result; returns 1 for any other failure.
    int read(ReadObject& object) {
        canopen::SdoRequest request{.index = object.object.index,
                                    .sub = object.object.sub,
                                    .upload = true,
                                    .buffer = {received_.get(), max_bytes}};
        if (station_.transfer(node_, request)) {
            ++read_;
            object.bytes = {received_.get(), request.size};
        } else if (request.aborted_by_server) {
            ++rejected_;
        } else {
            return station_.fail_transfer(node_, request, object.object.label());
        }
        object.abort = request.abort;
        return 0;
    }
    int print_summary() const {
        const std::string summary =
            fmt::format("{} objects of node {} read, {} rejected, {} write-only\n", read_, node_,
                        rejected_, write_only_);
        if (to_file()) return exit_code(print(options_.output + ": " + summary));
        write_all(STDERR_FILENO, summary);
        return 0;
    }

    static constexpr std::size_t max_bytes = 64 << 20;  // of one object

    const ReadAllOptions& options_;
    const std::uint8_t node_;
    const ObjectNames& names_;
    NodeClient& station_;
    // uses memory only as far as it is filled
    const std::unique_ptr<std::uint8_t[]> received_ =
        std::make_unique_for_overwrite<std::uint8_t[]>(max_bytes);
    std::string csv_ = "index,sub,name,type,access,value,data,reason\r\n";
    std::size_t read_ = 0;
    std::size_t rejected_ = 0;
    std::size_t write_only_ = 0;
};

}  // namespace

int run_can_read_all(const ReadAllOptions& options) {
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
    return ReadAll(options, node, names, station).run();
}

}  // namespace hal::tools
