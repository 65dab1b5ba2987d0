// SPDX-License-Identifier: MIT
// `hal ethercat pdos` and `config`: process data as the EEPROM has it, and a configuration from it. `check` and `plan`: of a configuration.
#include <algorithm>
#include <filesystem>

#include "bus/ethercat/wire.hpp"
#include "bus/ethercat/words.hpp"
#include "cli/output.hpp"
#include "ethercat/config/plan.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::tools {

namespace {

namespace config = ethercat::config;

/// Returns a line per pin, each behind `lead`.
std::string pin_lines(const config::Bus& bus, const std::string& lead) {
    std::string text;
    for (const auto& s : bus.setup.slaves)
        for (const auto& sm : s.sync_managers)
            for (const auto& pdo : sm.pdos)
                for (const auto& e : pdo.entries)
                    if (!e.name.empty()) text += lead + config::pin_line(e, sm.output, s.name);
    return text;
}

/// Reads a configuration. Returns false after printing what is wrong with it.
bool read_bus_file(const Options& options, const std::string& path, config::Reading& reading) {
    std::string text;
    if (!config::read_from_disk(path, text)) return fail(options, fmt::format("cannot read '{}': {}", path, text)), false;
    reading = config::read(text, path);
    if (const std::string messages = config::to_string(reading, path); !messages.empty())
        write_all(2, messages.back() == '\n' ? messages : messages + "\n");
    return reading.good();
}

std::string devices_of(const std::string& emulate) {
    std::string text = emulate;
    if (std::filesystem::is_regular_file(emulate) && read_file(emulate, text)) {
        std::string devices;
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t end = std::min(text.find('\n', at), text.size());
            const std::string line = text.substr(at, std::min(text.find('#', at), end) - at);
            if (line.find_first_not_of(" \t\r") != std::string::npos) devices += (devices.empty() ? "" : ", ") + line;
            at = end + 1;
        }
        return devices;
    }
    return text;
}

}  // namespace

int run_ethercat_pdos(const EthercatOptions& options) {
    EthercatWire wire;
    if (!wire.open(options) || !wire.without_arguments(options)) return 1;
    std::string text, json;
    for (std::size_t n = 0; n < wire.size(); ++n) {
        const auto& c = wire.contents(n);
        text += fmt::format("{}  {}\n", n, wire.name(n));
        for (const bool outputs : {true, false})
            for (const auto& pdo : outputs ? c.rx : c.tx) {
                const std::string place = pdo.sync_manager == 0xff ? "not assigned" : fmt::format("sync manager {}", pdo.sync_manager);
                text += fmt::format("  {:04X} {}, {}  {}\n", pdo.index, outputs ? "outputs" : "inputs", place, pdo.name);
                json += fmt::format(R"({}{{"position":{},"index":{},"direction":"{}","sync_manager":{},"name":{},"entries":[)",
                                    json.empty() ? "[" : ",\n ", n, pdo.index, outputs ? "outputs" : "inputs",
                                    pdo.sync_manager == 0xff ? "null" : std::to_string(pdo.sync_manager), json_string(pdo.name));
                for (std::size_t i = 0; i < pdo.entries.size(); ++i) {
                    const auto& e = pdo.entries[i];
                    text += e.index == 0 ? fmt::format("    gap, {} bit\n", e.bits)
                                         : fmt::format("    {:04X}:{:X} {}, {} bit  {}\n", e.index, e.sub, ethercat::sii::type_name(e.type),
                                                       e.bits, e.name);
                    json += fmt::format(R"({}{{"index":{},"sub":{},"bits":{},"name":{}}})", i == 0 ? "" : ",", e.index, e.sub, e.bits,
                                        json_string(e.name));
                }
                json += "]}";
            }
    }
    return print(options.json ? (json.empty() ? "[" : json) + "]\n" : text) ? 0 : 1;
}

int run_ethercat_config(const EthercatOptions& options) {
    EthercatWire wire;
    if (!wire.open(options)) return 1;
    if (wire.arguments().size() != 1) return fail(options, "type: hal ethercat config ADDRESS NAME; it writes NAME.ethercat and NAME.hal");
    const std::filesystem::path stem = wire.arguments()[0];
    const std::string file = stem.string() + ".ethercat", netlist = stem.string() + ".hal", name = stem.filename().string();
    for (const std::string& path : {file, netlist})
        if (std::filesystem::exists(path)) return fail(options, fmt::format("'{}' exists already; choose another name", path));
    std::vector<config::Found> found(wire.size());
    for (std::size_t n = 0; n < wire.size(); ++n) {
        const auto& c = wire.contents(n);
        found[n].name = c.general.order.empty() ? c.general.name : c.general.order;
        found[n].device = c.general.name;
        found[n].vendor = c.vendor, found[n].product = c.product, found[n].revision = c.revision, found[n].alias = c.alias();
        found[n].rx = c.rx, found[n].tx = c.tx, found[n].sync_managers = c.sync_managers;
        if (!c.dc.empty()) found[n].assign_activate = c.dc.front().assign_activate;
    }
    constexpr std::int64_t millisecond = 1'000'000;
    const bool emulated = !options.emulate.empty();
    const std::string text = config::write(emulated ? "sim:" + name : wire.address(), millisecond, found);
    const config::Reading reading = config::read(text, file);
    if (!reading.good() || reading.buses.empty())
        return fail(options, "the slaves describe their process data in a way that no configuration can be made of: " +
                                 config::to_string(reading, file));
    const std::string lines = config::netlist(reading.buses.front(), name + ".ethercat", emulated ? devices_of(options.emulate) : "");
    for (const auto& [path, contents] : {std::pair(&file, &text), std::pair(&netlist, &lines)})
        if (const std::string problem = write_file(*path, *contents); !problem.empty()) return fail(options, problem);
    if (options.json)
        return print(fmt::format("{{\"configuration\":{},\"netlist\":{},\"slaves\":{}}}\n", json_string(file), json_string(netlist),
                                 wire.size()))
                   ? 0
                   : 1;
    return print(fmt::format("{} and {} written, {} slave{}; next: hal run {}\n", file, netlist, wire.size(), wire.size() == 1 ? "" : "s",
                             netlist))
               ? 0
               : 1;
}

int run_ethercat_dc(const EthercatOptions& options) {
    namespace reg = ethercat::registers;
    EthercatWire wire;
    if (!wire.open(options) || !wire.without_arguments(options)) return 1;
    std::string text, json;
    for (std::size_t n = 0; n < wire.size(); ++n) {
        const auto& s = wire.slave(n);
        if (!s.has_dc()) {
            text += fmt::format("{}  no clock  {}\n", n, wire.name(n));
            continue;
        }
        const auto delay = wire.read(n, reg::dc_system_time_delay, 4), difference = wire.read(n, reg::dc_system_time_difference, 4);
        const auto activation = wire.read(n, reg::dc_activation, 1);
        if (!delay || !difference) return fail(options, fmt::format("slave {} no longer responds; check its supply and cable", n));
        const auto raw = ethercat::get<std::uint32_t>(difference->data());
        const auto magnitude = static_cast<std::int64_t>(raw & 0x7fffffff), deviation = raw >> 31 != 0 ? -magnitude : magnitude;
        const bool sync = activation && ((*activation)[0] & 0x01) != 0;
        text += fmt::format("{}  deviation {} ns  delay {} ns  SYNC {}  {}\n", n, deviation, ethercat::get<std::uint32_t>(delay->data()),
                            sync ? "on" : "off", wire.name(n));
        json += fmt::format(R"({}{{"position":{},"deviation_ns":{},"delay_ns":{},"sync":{}}})", json.empty() ? "[" : ",\n ", n, deviation,
                            ethercat::get<std::uint32_t>(delay->data()), sync);
    }
    return print(options.json ? (json.empty() ? "[" : json) + "]\n" : text) ? 0 : 1;
}

int run_ethercat_check(const EthercatCheckOptions& options) {
    int status = 0;
    std::string json;
    for (const std::string& file : options.words) {
        config::Reading reading;
        if (!read_bus_file(options, file, reading)) {
            status = 1;
            continue;
        }
        for (const config::Bus& bus : reading.buses) {
            const std::size_t slaves = bus.setup.slaves.size();
            if (options.json)
                json += fmt::format(R"({}{{"file":{},"link":{},"cycle_ns":{},"slaves":{}}})", json.empty() ? "[" : ",\n ",
                                    json_string(file), json_string(bus.link), bus.setup.cycle_ns, slaves);
            else if (!print(fmt::format("{}: {}, cycle {} us, {} slave{}\n{}", file, bus.link,
                                        static_cast<double>(bus.setup.cycle_ns) / 1000, slaves, slaves == 1 ? "" : "s",
                                        pin_lines(bus, "  "))))
                return 1;
        }
    }
    return !options.json || print((json.empty() ? "[" : json) + "]\n") ? status : 1;
}

int run_ethercat_plan(const EthercatPlanOptions& options) {
    if (options.words.size() != 1)
        return fail(options, fmt::format("nothing is expected at '{}'; see: hal help ethercat plan", options.words[1]));
    config::Reading reading;
    if (!read_bus_file(options, options.words[0], reading)) return 1;
    std::string text, json;
    bool fits = true;
    for (const config::Bus& bus : reading.buses) {
        const config::Plan p = config::plan(bus);
        fits = fits && p.fits;
        text += p.text;
        json +=
            fmt::format(R"({}{{"frames":{},"frame_bytes":{},"wire_ns":{},"propagation_ns":{},"cycle_ns":{},"shortest_cycle_ns":{},)",
                        json.empty() ? "[" : ",\n ", p.frames, p.frame_bytes, p.wire_ns, p.propagation_ns, p.cycle_ns, p.shortest_cycle_ns);
        json += fmt::format(R"("input_to_output_ns":{},"load":{:.4f},"fits":{}}})", p.input_to_output_ns, p.load, p.fits);
    }
    if (!print(options.json ? (json.empty() ? "[" : json) + "]\n" : text)) return 1;
    if (fits) return 0;
    return fail(options, fmt::format("{}: the cycle is too short; raise `cycle`, or exchange slow slaves in a [domain] with every = 4",
                                     options.words[0]));
}

}  // namespace hal::tools
