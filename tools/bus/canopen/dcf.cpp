// SPDX-License-Identifier: MIT
// `hal can dcf read` and `hal can dcf write`: saves the settings of a node as a DCF (CiA 306), and
// restores them to the node or its replacement. Only differences are written, PDOs in the order
// required by CiA 301, and read back.
#include "bus/canopen/dcf.hpp"

#include <algorithm>
#include <ctime>
#include <fmt/chrono.h>
#include <fmt/core.h>
#include <map>
#include <unistd.h>

#include "bus/canopen/node_client.hpp"
#include "bus/canopen/objects.hpp"
#include "canopen/master/boot/object_writes.hpp"
#include "cli/output.hpp"

namespace hal::tools {

namespace eds = canopen::eds;
using canopen::SdoRequest;

namespace {

// of one object; a larger one is a program, not a setting
constexpr std::size_t max_bytes = 65536;

/// Set-points and outputs of CiA 401 and 402: a write moves the device.
bool moves(std::uint16_t index) {
    if (index < 0x6000 || index >= 0xa000) return false;
    const unsigned first_axis = 0x6000 + (index - 0x6000U) % 0x800;
    constexpr std::uint16_t acting[] = {0x6040, 0x6042, 0x6071, 0x607a, 0x60b0, 0x60b1,
                                        0x60b2, 0x60c1, 0x60fe, 0x60ff, 0x6200, 0x6220,
                                        0x6300, 0x6320, 0x6410, 0x6411, 0x6412, 0x6413};
    return std::ranges::find(acting, first_axis) != std::end(acting);
}

/// Returns true for a setting to save and restore: not an object that acts when written, moves the
/// device, or is a program.
bool is_setting(std::uint16_t index, const eds::Entry& entry) {
    constexpr std::uint32_t refused_by_scans = 1;  // ObjFlags
    constexpr std::uint16_t domain = 0x000f;
    constexpr std::uint16_t acting[] = {0x1003, 0x1010, 0x1011, 0x1f50, 0x1f51, 0x1f52,
                                        0x1f53, 0x1f54, 0x1f55, 0x1f56, 0x1f57, 0x1f82};
    const bool acts = std::ranges::find(acting, index) != std::end(acting) || moves(index);
    const bool is_program = entry.data_type == domain;
    const bool is_kept = entry.readable() && entry.writable() && entry.access != eds::Access::rww;
    return is_kept && !acts && !is_program && (entry.flags & refused_by_scans) == 0;
}

enum class Read { value, refused, failed };

Read read_object(NodeClient& station, std::uint8_t node, std::uint16_t index, std::uint8_t sub,
                 std::vector<std::uint8_t>& bytes, SdoRequest& request) {
    bytes.resize(max_bytes);
    request = {.index = index, .sub = sub, .upload = true, .buffer = bytes};
    const bool read = station.transfer(node, request);
    bytes.resize(request.ok() ? request.size : 0);
    if (read) return Read::value;
    if (request.aborted_by_server) return Read::refused;
    return Read::failed;
}

void date(eds::DeviceDescription& description, const DcfReadOptions& options) {
    const std::time_t now = std::time(nullptr);
    const std::tm day = fmt::gmtime(now);
    eds::FileInfo& file = description.file;
    const auto name = [](const std::string& path) { return path.substr(path.rfind('/') + 1); };
    file.last_eds = name(options.eds);
    if (!options.output.empty()) {
        file.file_name = name(options.output);
    }
    file.modified_by = "hal can dcf read";
    file.modification_date = fmt::format("{:%m-%d-%Y}", day);
    file.modification_time = fmt::format("{:%I:%M%p}", day);
}

/// Reads the settings of a node into its description.
class SettingsReader {
public:
    SettingsReader(const DcfReadOptions& options, std::uint8_t node, const ObjectNames& names,
                   NodeClient& station)
        : options_(options), node_(node), names_(names), station_(station) {}

    /// A setting that the node rejects is skipped. Returns 1 after printing any other failure.
    int read(eds::DeviceDescription& description) {
        for (eds::Object& object : description.objects) {
            for (eds::Entry& entry : object.entries) {
                entry.parameter_value.clear();
                if (!is_setting(object.index, entry)) continue;
                if (const int status = read(object.index, entry); status != 0) return status;
            }
        }
        return 0;
    }
    std::string summary() const {
        std::string text = fmt::format("{} settings of node {}", read_, node_);
        if (skipped_ != 0) {
            text += fmt::format(", {} skipped", skipped_);
        }
        return text;
    }

private:
    int read(std::uint16_t index, eds::Entry& entry) {
        SdoRequest request;
        const std::string label = names_.named(index, entry.sub).label();
        switch (read_object(station_, node_, index, entry.sub, bytes_, request)) {
        case Read::failed: return station_.fail_transfer(node_, request, label);
        case Read::refused:
            ++skipped_;
            fail(options_,
                 fmt::format("skipped: {}: {} (0x{:08X})", label, canopen::to_string(request.abort),
                             static_cast<std::uint32_t>(request.abort)));
            return 0;
        case Read::value: break;
        }
        ++read_;
        entry.parameter_value = spelled(entry);
        return 0;
    }
    /// As in the description where equal ($NODEID), so that the file also fits a node with another
    /// ID.
    std::string spelled(const eds::Entry& entry) const {
        const eds::Encoded usual = eds::encode(entry.default_value, entry.data_type, node_);
        const bool is_usual = usual && usual.bytes == bytes_ && !bytes_.empty();
        return is_usual ? entry.default_value : eds::spell(bytes_, entry.data_type);
    }

    const DcfReadOptions& options_;
    const std::uint8_t node_;
    const ObjectNames& names_;
    NodeClient& station_;
    std::vector<std::uint8_t> bytes_;
    std::size_t read_ = 0;
    std::size_t skipped_ = 0;
};

}  // namespace

int run_can_dcf_read(const DcfReadOptions& options) {
    if (options.words.size() != 2) {
        return fail(
            options,
            "expected ADDRESS NODE; type: hal can dcf read ADDRESS NODE --eds FILE -o NODE.dcf");
    }
    std::uint8_t node = 0;
    ObjectNames names;
    if (!node_of(options, options.words[1], node) || !names.load_objects(options, options.eds)) {
        return 1;
    }
    NodeClient station(options, options.timeout_ns);
    if (!station.open(options.words[0])) return 1;
    eds::DeviceDescription description = *names.description();
    SettingsReader reader(options, node, names, station);
    if (const int status = reader.read(description); status != 0) return status;
    date(description, options);
    eds::Commissioning& commissioning = description.commissioning.emplace();
    commissioning.node_id = node;
    commissioning.baud_rate =
        static_cast<std::uint16_t>(station.bus.link->description().bit_rate / 1000);
    const std::string text = eds::write_eds(description);
    if (options.output.empty()) return exit_code(print(text));
    if (const std::string problem = write_file(options.output, text); !problem.empty()) {
        return fail(options, fmt::format("cannot write '{}': {}", options.output, problem));
    }
    return exit_code(print(fmt::format("{}: {}\n", options.output, reader.summary())));
}

namespace {

/// Returns false after printing why the file is not for this node and bus. `bit_rate` 0: unknown.
bool fits(const DcfWriteOptions& options, const eds::DeviceDescription& dcf, std::uint8_t node,
          std::uint32_t bit_rate) {
    const std::string problem = options.other_node ? "" : eds::misfit(dcf, node, bit_rate);
    if (problem.empty()) return true;
    fail(options, fmt::format("'{}' does not fit: {}; to write it all the same, add --other-node",
                              options.words[2], problem));

    return false;
}

/// Compares the settings of a file with those of a node.
class Download {
public:
    Download(const DcfWriteOptions& options, std::uint8_t node, const ObjectNames& names,
             std::vector<eds::Write> writes)
        : options_(options),
          node_(node),
          names_(names),
          writes_(std::move(writes)),
          station_(options, options.timeout_ns) {}

    int run() {
        for (const eds::Write& write : writes_) {
            wanted_[key(write)] = &write;
        }
        if (!station_.open(options_.words[0])) return 1;
        const std::uint32_t rate = station_.bus.link->description().bit_rate;
        if (!fits(options_, *names_.description(), node_, rate == can::unlimited ? 0 : rate)) {
            return 1;
        }
        for (const auto& [at, write] : wanted_) {
            if (!compare(*write)) return 1;
        }
        std::size_t written = 0;
        if (!options_.check && !write_differing(written)) return 1;
        const char* const done = differences_ == 0 ? "differed" : "differed and were written";
        if (!print(fmt::format("node {}: {} of {} settings {}\n", node_, differences_,
                               wanted_.size(), options_.check ? "differ" : done))) {
            return 1;
        }
        if (written != 0 && !print(fmt::format("not stored: they are lost at power-off; to store "
                                               "them: hal can sdo write {} {} 1010:1 0x65766173 "
                                               "--type u32\n",
                                               options_.words[0], node_))) {
            return 1;
        }
        return options_.check && differences_ != 0 ? 1 : 0;
    }

private:
    /// Writes the settings that differ, counts them, and reads them back. Returns false after
    /// printing the reason.
    bool write_differing(std::size_t& written) {
        for (const eds::Write& write : writes_) {
            if (!differing_.contains(group(write))) continue;
            if (!put(write)) return false;
            ++written;
        }
        return std::ranges::all_of(wanted_, [&](const auto& row) {
            const eds::Write& write = *row.second;
            return !differing_.contains(group(write)) || verify(write);
        });
    }
    static std::uint32_t key(const eds::Write& write) {
        return std::uint32_t{write.index} << 8 | write.sub;
    }
    /// Writes settings that belong together: a PDO is disabled while it changes.
    static std::uint32_t group(const eds::Write& write) {
        const bool of_pdo = write.index >= 0x1400 && write.index < 0x1c00;
        return of_pdo ? std::uint32_t{write.index & 0xfdffU} << 8 | 0xff : key(write);
    }
    std::string label(const eds::Write& write) const {
        return names_.named(write.index, write.sub).label();
    }
    std::string shown(const eds::Write& write, std::span<const std::uint8_t> bytes) const {
        return value_text(bytes, names_.named(write.index, write.sub).type);
    }
    /// Returns false after printing the reason: the node does not respond.
    bool compare(const eds::Write& write) {
        SdoRequest request;
        std::vector<std::uint8_t> bytes;
        const Read read = read_object(station_, node_, write.index, write.sub, bytes, request);
        if (read == Read::failed) {
            station_.fail_transfer(node_, request, label(write));
            return false;
        }
        if (read == Read::value && canopen::same_value(write.index, write.sub, write.data, bytes)) {
            return true;
        }
        ++differences_;
        differing_[group(write)] = true;
        const std::string has =
            read == Read::value ? "is " + shown(write, bytes) : "cannot be read";
        return print(
            fmt::format("{} {}, the file has {}\n", label(write), has, shown(write, write.data)));
    }
    bool put(const eds::Write& write) {
        SdoRequest request{.index = write.index, .sub = write.sub, .data = write.data};
        return station_.transfer(node_, request) ||
               (station_.fail_transfer(node_, request, label(write)), false);
    }
    bool verify(const eds::Write& write) {
        SdoRequest request;
        std::vector<std::uint8_t> bytes;
        switch (read_object(station_, node_, write.index, write.sub, bytes, request)) {
        case Read::failed: station_.fail_transfer(node_, request, label(write)); return false;
        case Read::refused: return true;  // write-only
        case Read::value: break;
        }
        if (canopen::same_value(write.index, write.sub, write.data, bytes)) return true;
        fail(options_,
             fmt::format("node {} accepted {} for {} but stored {}; write a value it can store",
                         node_, shown(write, write.data), label(write), shown(write, bytes)));

        return false;
    }

    const DcfWriteOptions& options_;
    const std::uint8_t node_;
    const ObjectNames& names_;
    const std::vector<eds::Write> writes_;
    NodeClient station_;
    std::map<std::uint32_t, const eds::Write*> wanted_;  // the last of each object
    std::map<std::uint32_t, bool> differing_;  // by group
    std::size_t differences_ = 0;
};

}  // namespace

int run_can_dcf_write(const DcfWriteOptions& options) {
    if (options.words.size() != 3) {
        return fail(options,
                    "expected ADDRESS NODE FILE; type: hal can dcf write ADDRESS NODE FILE.dcf");
    }
    std::uint8_t node = 0;
    if (!node_of(options, options.words[1], node)) return 1;
    ObjectNames names;
    if (!names.load(options, options.words[2])) return 1;
    if (!names.reliable()) {
        return fail(options, fmt::format("'{}' is not reliable: no setting was {}; correct the "
                                         "file, or create it again: hal can dcf read",
                                         options.words[2], options.check ? "compared" : "written"));
    }
    if (!fits(options, *names.description(), node, 0)) return 1;
    eds::Configuration configuration = eds::configuration_of(*names.description(), node, true);
    bool valid = true;
    for (const eds::Message& message : configuration.messages) {
        valid = valid && message.severity != eds::Severity::error;
        fail(options,
             fmt::format("{}:{}: {}{}", options.words[2], message.at.line, message.sentence,
                         message.help.empty() ? "" : "; " + message.help));
    }
    if (!valid && !options.check) {
        return fail(options, fmt::format("'{}' has invalid values: no setting was written; correct "
                                         "them in the file",
                                         options.words[2]));
    }
    std::erase_if(configuration.writes, [&](const eds::Write& write) {
        if (moves(write.index)) {
            fail(options, fmt::format("skipped: {}: it moves the device",
                                      names.named(write.index, write.sub).label()));
        }
        return moves(write.index);
    });
    if (configuration.writes.empty()) {
        return fail(options, fmt::format("'{}' has no settings: no ParameterValue to write; to "
                                         "create such a file: hal can dcf read",
                                         options.words[2]));
    }
    const int result = Download(options, node, names, std::move(configuration.writes)).run();
    return valid ? result : 1;
}

}  // namespace hal::tools
