// SPDX-License-Identifier: MIT
// `hal ethercat config`: writes a configuration and a netlist for the slaves on a bus, or for descriptions of their makers.
#include <filesystem>

#include "bus/ethercat/wire.hpp"
#include "bus/ethercat/words.hpp"
#include "cli/output.hpp"
#include "ethercat/config/config.hpp"
#include "ethercat/devices/esi_device.hpp"
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
};

/// Takes the slaves from a bus. Returns false after printing the reason.
bool from_bus(const EthercatConfigOptions& options, const std::string& name, EthercatWire& wire,
              Source& to) {
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
    to.link = emulated ? "sim:" + name : wire.address();
    to.segment = emulated ? devices_of(options.emulate) : "";
    return true;
}

/// Takes the slaves from descriptions. Returns false after printing the reason.
bool from_descriptions(const EthercatConfigOptions& options, const std::filesystem::path& stem,
                       const std::string& address, Source& to) {
    const std::string name = stem.filename().string();
    const std::filesystem::path folder =
        stem.has_parent_path() ? stem.parent_path() : std::filesystem::path(".");
    std::string list = options.esi;
    while (!list.empty()) {
        const std::size_t comma = std::min(list.find(','), list.size());
        std::string item = list.substr(0, comma);
        list.erase(0, comma + 1);
        item.erase(0, item.find_first_not_of(' '));
        item.erase(item.find_last_not_of(' ') + 1);
        const std::size_t colon = item.rfind(".xml:");
        const std::string path = colon == std::string::npos ? item : item.substr(0, colon + 4);
        const std::string wanted = colon == std::string::npos ? "" : item.substr(colon + 5);
        std::string bytes, problem;
        if (!read_regular_file(path, 64'000'000, bytes)) {
            fail(options, fmt::format("cannot read '{}': {}", path, bytes));
            return false;
        }
        const ethercat::esi::File file = ethercat::esi::read(bytes);
        for (const auto& m : file.messages) {
            if (m.severity == Severity::error) {
                fail(options, fmt::format("{}:{}: {}; {}", path, m.at.line, m.sentence, m.help));

                return false;
            }
        }
        const auto* device = ethercat::devices::find_device(file, wanted, problem);
        if (device == nullptr) {
            std::string names;
            for (const auto& d : file.devices) {
                names += (names.empty() ? "" : ", ") + d.order;
            }
            fail(options, fmt::format("'{}': {}; write {}:NAME with one of: {}", path, problem,
                                      path, names));

            return false;
        }
        // paths in the files start at their own folder
        const std::string beside =
            path.starts_with('/') ? path : std::filesystem::proximate(path, folder).string();
        config::Found& found = to.slaves.emplace_back();
        found.name = device->order;
        found.device = device->name;
        found.esi = beside;

        found.order = device->order;
        found.vendor = file.vendor;
        found.product = device->product;

        found.revision = device->revision;
        const bool emulated =
            address.empty() && ethercat::devices::why_not_emulated(*device).empty();
        if (emulated) {
            to.segment += fmt::format("{}esi file={} device=0x{:x}", to.segment.empty() ? "" : ", ",
                                      beside, device->product);
        }
    }
    to.link = address.empty() ? "sim:" + name : address;
    return true;
}

}  // namespace

int run_ethercat_config(const EthercatConfigOptions& options) {
    EthercatWire wire;
    const bool described = !options.esi.empty();
    if (described && !options.emulate.empty()) {
        return fail(options, "--esi and --emulate exclude each other");
    }
    if (!described && !wire.open(options)) return 1;
    const std::vector<std::string>& words = described ? options.words : wire.arguments();
    if (described ? words.empty() || words.size() > 2 : words.size() != 1) {
        return fail(
            options,
            described
                ? "type: hal ethercat config --esi FILE.xml:DEVICE NAME, or eth:INTERFACE before "
                  "NAME"
                : "type: hal ethercat config ADDRESS NAME; it writes NAME.ethercat and NAME.hal");
    }
    const std::filesystem::path stem = words.back();
    const std::string file = stem.string() + ".ethercat";
    const std::string netlist = stem.string() + ".hal";

    const std::string name = stem.filename().string();
    for (const std::string& path : {file, netlist}) {
        if (std::filesystem::exists(path)) {
            return fail(options, fmt::format("'{}' exists already; choose another name", path));
        }
    }
    Source source;
    const std::string address = described && words.size() == 2 ? words.front() : "";
    if (!(described ? from_descriptions(options, stem, address, source)
                    : from_bus(options, name, wire, source))) {
        return 1;
    }
    constexpr std::int64_t millisecond = 1'000'000;
    const std::string text = config::write(source.link, millisecond, source.slaves);
    const config::Reading reading = config::read(text, file);
    if (!reading.good() || reading.buses.empty()) {
        return fail(options,
                    "the slaves describe their process data in a way that no configuration can be "
                    "made of: " +
                        config::to_string(reading, file));
    }
    const std::string lines =
        config::netlist(reading.buses.front(), name + ".ethercat", source.segment);
    for (const auto& [path, contents] : {std::pair(&file, &text), std::pair(&netlist, &lines)}) {
        if (const std::string problem = write_file(*path, *contents); !problem.empty()) {
            return fail(options, problem);
        }
    }
    if (options.json) {
        return print(fmt::format("{{\"configuration\":{},\"netlist\":{},\"slaves\":{}}}\n",
                                 json_string(file), json_string(netlist), source.slaves.size()))
                   ? 0
                   : 1;
    }
    return print(fmt::format("{} and {} written, {} slave{}; next: hal run {}\n", file, netlist,
                             source.slaves.size(), source.slaves.size() == 1 ? "" : "s", netlist))
               ? 0
               : 1;
}

}  // namespace hal::tools
