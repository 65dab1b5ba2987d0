// SPDX-License-Identifier: MIT
// `hal ethercat config`: writes a configuration and a netlist for the slaves on a bus, or for
// descriptions of their makers.
#include <algorithm>
#include <filesystem>
#include <fmt/ranges.h>
#include <optional>

#include "bus/ethercat/description_folder.hpp"
#include "bus/ethercat/wire.hpp"
#include "bus/ethercat/words.hpp"
#include "cli/output.hpp"
#include "ethercat/config/config.hpp"
#include "ethercat/devices/device_words.hpp"
#include "ethercat/devices/esi_device.hpp"
#include "ethercat/esi/lookup.hpp"
#include "hal/read_file.hpp"

namespace hal::tools {

namespace {

namespace config = ethercat::config;

std::string devices_of(const std::string& emulate) {
    std::string text = emulate;
    if (std::filesystem::is_regular_file(emulate) && read_file(emulate, text)) {
        std::string devices;
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t end = std::min(text.find('\n', at), text.size());
            const std::string line = text.substr(at, std::min(text.find('#', at), end) - at);
            if (line.find_first_not_of(" \t\r") != std::string::npos) {
                devices += (devices.empty() ? "" : ", ") + line;
            }
            at = end + 1;
        }
        return devices;
    }
    return text;
}

/// What the files are made of.
struct Source {
    std::vector<config::Found> slaves;
    std::string link, segment;  ///< segment: devices of an emulated line, or empty
    /// what the emulation leaves out, which slaves have no description
    std::vector<std::string> notes;
};

/// Returns whether a text arrives as it is when it is the value of a key in a `.ethercat` file.
bool fits_configuration(const std::string& text) {
    const bool is_line = std::none_of(text.begin(), text.end(), [](char c) {
        return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
    });
    const text::Word whole{text, {}};
    const bool is_trimmed = text::part(whole, 0, text.size()).text == text;
    const bool has_comment = text.starts_with('#') || text.starts_with(';') ||
                             text.find(" #") != text.npos || text.find(" ;") != text.npos;
    return !text.empty() && is_line && is_trimmed && !has_comment;
}

/// Returns whether a text arrives as it is between the double quotes of `devices="…"`.
bool fits_netlist(const std::string& text) {
    return fits_configuration(text) && text.find_first_of("\"$[") == text.npos;
}

using Fits = bool (*)(const std::string&);

/// Returns the shortest text that means this device in a look-up with `wanted`: one of `names`, or
/// an empty text if the rest of `wanted` is enough; nullopt if no text does.
std::optional<std::string> name_of(const ethercat::esi::File& file,
                                   const ethercat::esi::Device& device,
                                   ethercat::esi::Wanted wanted,
                                   const std::vector<std::string>& names, Fits fits) {
    for (const std::string& name : names) {
        if (!name.empty() && !fits(name)) continue;
        wanted.name = name;
        if (ethercat::esi::look_up(file, wanted).device == &device) return name;
    }
    return std::nullopt;
}

std::filesystem::path folder_of(const std::filesystem::path& stem) {
    return stem.has_parent_path() ? stem.parent_path() : ".";
}

/// Returns the path of a description as it is written to a file in `folder`.
std::string written_path(const std::filesystem::path& path, const std::filesystem::path& folder) {
    return path.is_absolute() ? path.string() : std::filesystem::proximate(path, folder).string();
}

/// Returns the device key of a configuration that means this device of the file; nullopt if no text
/// does.
std::optional<std::string> key_of(const ethercat::esi::File& file,
                                  const ethercat::esi::Device& device, std::uint32_t revision) {
    // a configuration names no product 0
    const auto product = device.product != 0 ? std::optional(device.product) : std::nullopt;
    return name_of(file, device,
                   {.vendor = device.vendor, .product = product, .revision = revision},
                   {device.order, device.name, ""}, fits_configuration);
}

/// Replaces what the EEPROM of a slave has by its description. Returns why no description fits: the
/// reason why its process data is taken from the EEPROM; empty: it has been replaced.
std::string describe(const DescriptionFolder& descriptions, const std::filesystem::path& folder,
                     config::Found& found) {
    const auto [file, path, match] = descriptions.find(found.vendor, found.product, found.revision);
    if (match.device == nullptr) return "no file describes it";
    const ethercat::esi::Device& device = *match.device;
    if (match.revision == ethercat::esi::Match::Revision::other) {
        return fmt::format("'{}' describes revision {}, not {}", path.string(),
                           ethercat::esi::number_text(device.revision),
                           ethercat::esi::number_text(found.revision));
    }
    if (!device.slots.empty()) return "its identity does not name its modules";
    const std::string beside = written_path(path, folder);
    const auto key = key_of(*file, device, found.revision);
    if (!key || !fits_configuration(beside)) {
        return fmt::format("the path '{}' cannot be written to a configuration", path.string());
    }
    found.name = device.order.empty() ? found.name : device.order;
    found.device = device.name;
    found.esi = beside;
    found.order = *key;
    return {};
}

/// Describes all slaves. Returns false after printing the reason.
bool describe_all(const EthercatConfigOptions& options, const std::filesystem::path& folder,
                  Source& to) {
    DescriptionFolder descriptions;
    if (const std::string problem = descriptions.open(options.descriptions); !problem.empty()) {
        fail(options, problem);
        return false;
    }
    to.notes = descriptions.notes();
    for (std::size_t n = 0; n < to.slaves.size(); ++n) {
        config::Found& found = to.slaves[n];
        const std::string name = found.name.empty() ? found.device : found.name;
        if (const std::string why = describe(descriptions, folder, found); !why.empty()) {
            to.notes.push_back(
                fmt::format("slave {}{}: process data as its EEPROM has it, because {}", n,
                            name.empty() ? "" : " (" + name + ")", why));
        }
    }
    return true;
}

/// Takes the slaves from a bus. Returns false after printing the reason.
bool from_bus(const EthercatConfigOptions& options, const std::filesystem::path& stem,
              EthercatWire& wire, Source& to) {
    wire.identify();
    for (std::size_t n = 0; n < wire.size(); ++n) {
        const auto& c = wire.contents(n);
        config::Found& found = to.slaves.emplace_back();
        found.name = c.general.order.empty() ? c.general.name : c.general.order;
        found.device = c.general.name;
        found.vendor = c.vendor;
        found.product = c.product;
        found.revision = c.revision;
        found.alias = c.alias();
        found.rx = c.rx;
        found.tx = c.tx;
        found.sync_managers = c.sync_managers;
        if (!c.dc.empty()) {
            found.assign_activate = c.dc.front().assign_activate;
        }
    }
    const bool emulated = !options.emulate.empty();
    to.link = emulated ? "sim:" + stem.filename().string() : wire.address();
    to.segment = emulated ? devices_of(options.emulate) : "";
    return options.descriptions.empty() || describe_all(options, folder_of(stem), to);
}

/// Splits FILE or FILE:DEVICE. The path is the longest beginning that names a file.
std::pair<std::string, std::string> split_item(const std::string& text) {
    const std::string plain = ethercat::devices::without_device_quotes(text);
    for (std::size_t end = plain.size(); end != plain.npos && end != 0;
         end = plain.rfind(':', end - 1)) {
        const std::string path = plain.substr(0, end);
        if (!std::filesystem::is_regular_file(path)) continue;
        return {path, end == plain.size() ? "" : plain.substr(end + 1)};
    }
    const std::size_t extension = plain.rfind(".xml:");
    if (extension == plain.npos) return {plain, ""};
    return {plain.substr(0, extension + 4), plain.substr(extension + 5)};
}

/// Reads a description. Returns false after printing the reason.
bool read_description(const EthercatConfigOptions& options, const std::string& path,
                      ethercat::esi::File& to) {
    std::string bytes;
    if (!read_regular_file(path, 64'000'000, bytes)) {
        fail(options, fmt::format("cannot read '{}': {}", path, bytes));
        return false;
    }
    to = ethercat::esi::read(bytes);
    for (const auto& m : to.messages) {
        if (m.severity == Severity::error) {
            fail(options, fmt::format("{}:{}: {}; {}", path, m.at.line, m.sentence, m.help));
            return false;
        }
    }
    return true;
}

/// Adds the device of FILE:DEVICE. Returns false after printing the reason.
bool add_description(const EthercatConfigOptions& options, const std::string& item,
                     const std::filesystem::path& folder, bool emulate, Source& to) {
    namespace esi = ethercat::esi;
    const auto [path, wanted] = split_item(item);
    esi::File file;
    if (!read_description(options, path, file)) return false;
    const esi::Match match = esi::look_up(file, {.name = wanted});
    if (match.device == nullptr) {
        fail(options, fmt::format("'{}' {}; write {}:NAME with one of: {}", path, match.problem,
                                  path, fmt::join(match.choices, ", ")));
        return false;
    }
    const esi::Device& device = *match.device;
    const std::string beside = written_path(path, folder);
    const std::string code = esi::number_text(device.product);
    const auto key = key_of(file, device, device.revision);
    if (!key || !fits_configuration(beside)) {
        fail(options, fmt::format("'{}': the path cannot be written to a configuration; rename "
                                  "the file so that it has no ' #', ' ;' or control characters",
                                  path));
        return false;
    }
    config::Found& found = to.slaves.emplace_back();
    found.name = device.order;
    found.device = device.name;
    found.esi = beside;
    found.order = *key;
    found.vendor = device.vendor;
    found.product = device.product;
    found.revision = device.revision;
    if (!emulate) return true;
    if (const std::string left_out = ethercat::devices::not_emulated(device); !left_out.empty()) {
        to.notes.push_back(fmt::format("'{}' is emulated without {}", device.order, left_out));
    }
    const auto word = name_of(file, device, {.revision = device.revision},
                              {code, device.order, device.name}, fits_netlist);
    if (!word || !fits_netlist(beside)) {
        fail(options, fmt::format("'{}': the path cannot be written to a netlist; rename the file "
                                  "so that it has no \", $ or [",
                                  path));
        return false;
    }
    to.segment += fmt::format("{}esi file={} device={}", to.segment.empty() ? "" : ", ",
                              ethercat::devices::device_value(beside),
                              ethercat::devices::device_value(*word));
    if (esi::look_up(file, {.name = *word}).device != &device) {
        to.segment += " revision=" + esi::number_text(device.revision);
    }
    return true;
}

/// Takes the slaves from descriptions. Returns false after printing the reason.
bool from_descriptions(const EthercatConfigOptions& options, const std::filesystem::path& stem,
                       const std::string& address, Source& to) {
    const std::string name = stem.filename().string();
    const std::filesystem::path folder = folder_of(stem);
    for (const std::string& item : ethercat::devices::device_list(options.esi)) {
        if (!add_description(options, item, folder, address.empty(), to)) return false;
    }
    to.link = address.empty() ? "sim:" + name : address;
    return true;
}

std::string json_summary(const std::string& file, const std::string& netlist,
                         const Source& source) {
    std::string notes;
    for (const std::string& note : source.notes) {
        notes += (notes.empty() ? "" : ",") + json_string(note);
    }
    return fmt::format("{{\"configuration\":{},\"netlist\":{},\"slaves\":{},\"notes\":[{}]}}\n",
                       json_string(file), json_string(netlist), source.slaves.size(), notes);
}

std::string summary(const std::string& file, const std::string& netlist, const Source& source) {
    std::string lines;
    for (const std::string& note : source.notes) {
        lines += note + "\n";
    }
    return lines + fmt::format("{} and {} written, {} slave{}; next: hal run {}\n", file, netlist,
                               source.slaves.size(), source.slaves.size() == 1 ? "" : "s", netlist);
}

/// Returns what is wrong with the options together, nullptr: nothing.
const char* contradiction(const EthercatConfigOptions& options) {
    if (options.esi.empty()) return nullptr;
    if (!options.emulate.empty()) return "--esi and --emulate exclude each other";
    if (!options.descriptions.empty()) return "--esi and --descriptions exclude each other";
    return nullptr;
}

/// Returns what to type when the command line has a wrong number of words, nullptr: the number is
/// right. `described`: with --esi.
const char* usage_for(bool described, std::size_t words) {
    if (described) {
        return words == 1 || words == 2 ? nullptr
                                        : "type: hal ethercat config --esi FILE.xml:DEVICE NAME, "
                                          "or eth:INTERFACE before "
                                          "NAME";
    }
    return words == 1
               ? nullptr
               : "type: hal ethercat config ADDRESS NAME; it writes NAME.ethercat and NAME.hal";
}

/// The files that the command writes.
struct OutputFiles {
    explicit OutputFiles(const std::filesystem::path& stem)
        : configuration(stem.string() + ".ethercat"), netlist(stem.string() + ".hal") {}
    std::string configuration, netlist;
};

/// Writes configuration and netlist of the slaves. Returns why that is not possible, empty on
/// success.
std::string write_files(const OutputFiles& files, const std::string& name, const Source& source) {
    constexpr std::int64_t millisecond = 1'000'000;
    const std::string text = config::write(source.link, millisecond, source.slaves);
    const config::ReadResult reading = config::read(text, files.configuration);
    if (!reading.good() || reading.buses.empty()) {
        return "the slaves describe their process data in a way that no configuration can be "
               "made of: " +
               config::to_string(reading, files.configuration);
    }
    const std::string lines =
        config::netlist(reading.buses.front(), name + ".ethercat", source.segment);
    if (std::string problem = write_file(files.configuration, text); !problem.empty()) {
        return problem;
    }
    return write_file(files.netlist, lines);
}

}  // namespace

int run_ethercat_config(const EthercatConfigOptions& options) {
    EthercatWire wire;
    const bool described = !options.esi.empty();
    if (const char* const problem = contradiction(options)) return fail(options, problem);
    if (!described && !wire.open(options)) return 1;
    const std::vector<std::string>& words = described ? options.words : wire.arguments();
    if (const char* const usage = usage_for(described, words.size())) return fail(options, usage);
    const std::filesystem::path stem = words.back();
    const OutputFiles files(stem);
    for (const std::string& path : {files.configuration, files.netlist}) {
        if (std::filesystem::exists(path)) {
            return fail(options, fmt::format("'{}' exists already; choose another name", path));
        }
    }
    Source source;
    const std::string address = described && words.size() == 2 ? words.front() : "";
    const bool has_slaves = described ? from_descriptions(options, stem, address, source)
                                      : from_bus(options, stem, wire, source);
    if (!has_slaves) return 1;
    const std::string problem = write_files(files, stem.filename().string(), source);
    if (!problem.empty()) return fail(options, problem);
    const std::string report = options.json
                                   ? json_summary(files.configuration, files.netlist, source)
                                   : summary(files.configuration, files.netlist, source);
    return print(report) ? 0 : 1;
}

}  // namespace hal::tools
