// SPDX-License-Identifier: MIT
// `hal ethercat pdos` and `config`: process data as the EEPROM has it, and a configuration from it. `check` and `plan`: of a configuration.
#include <algorithm>
#include <filesystem>
#include <fmt/ranges.h>
#include <optional>

#include "bus/ethercat/bus_file.hpp"
#include "bus/ethercat/plan_picture.hpp"
#include "bus/ethercat/wire.hpp"
#include "bus/ethercat/words.hpp"
#include "bus/timeline/plan_output.hpp"
#include "ethercat/config/plan.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::tools {

namespace {

namespace config = ethercat::config;

std::string plan_json(const config::Plan& p) {
    std::string cyclic, slots, trips;
    for (const auto& f : p.cyclic) {
        std::string datagrams;
        for (const auto& d : f.datagrams) {
            datagrams += fmt::format(
                R"({}{{"command":"{}","domain":{},"data_bytes":{},"output_bytes":{},"input_bytes":{},"mailbox_states":{},"wkc":{}}})",
                datagrams.empty() ? "" : ",", d.command,
                d.domain.empty() ? "null" : json_string(d.domain), d.data_bytes, d.output_bytes,
                d.input_bytes, d.mailbox_states, d.expected_wkc);
        }
        cyclic += fmt::format(R"({}{{"every":{},"bytes":{},"wire_ns":{},"datagrams":[{}]}})",
                              cyclic.empty() ? "" : ",", f.every, f.bytes, f.wire_ns, datagrams);
    }
    for (const auto& s : p.slots) {
        slots += fmt::format(R"({}{{"cycles":[{}],"frames":[{}],"wire_ns":{}}})",
                             slots.empty() ? "" : ",", fmt::join(s.cycles, ","),
                             fmt::join(s.frames, ","), s.wire_ns);
    }
    for (const auto& t : p.trips) {
        trips +=
            fmt::format(R"({}{{"from":{},"to":{},"cycles":{},"synchronised":{},"worst_ns":{}}})",
                        trips.empty() ? "" : ",", json_string(t.from), json_string(t.to), t.cycles,
                        t.synchronised, t.worst_ns);
    }
    return fmt::format(
               R"({{"frames":{},"frame_bytes":{},"wire_ns":{},"propagation_ns":{},"cycle_ns":{},"shortest_cycle_ns":{},)",
               p.frames, p.frame_bytes, p.wire_ns, p.propagation_ns, p.cycle_ns,
               p.shortest_cycle_ns) +
           fmt::format(
               R"("input_to_output_ns":{},"load":{:.4f},"fits":{},"period":{},"cyclic":[{}],"slots":[{}],"trips":[{}]}})",
               p.input_to_output_ns, p.load, p.fits, p.period, cyclic, slots, trips);
}

/// Calls `visit(entry, output, slave)` for each entry that has a pin.
template <class Visit>
void for_each_pin(const config::Bus& bus, Visit visit) {
    for (const auto& s : bus.setup.slaves) {
        for (const auto& sm : s.sync_managers) {
            for (const auto& pdo : sm.pdos) {
                for (const auto& e : pdo.entries) {
                    if (!e.name.empty()) {
                        visit(e, sm.output, s.name);
                    }
                }
            }
        }
    }
}

/// Returns a line per pin, each behind `lead`.
std::string pin_lines(const config::Bus& bus, const std::string& lead) {
    std::string text;
    for_each_pin(bus, [&](const auto& entry, bool output, const std::string& slave) {
        text += lead + config::pin_line(entry, output, slave);
    });
    return text;
}

std::string pins_json(const config::Bus& bus) {
    std::string text;
    for_each_pin(bus, [&](const auto& entry, bool output, const std::string& slave) {
        text += fmt::format(
            R"({}{{"name":{},"type":"{}","direction":"{}","owner":{},"index":{},"sub":{}}})",
            text.empty() ? "" : ",", json_string(slave + "." + entry.pin_name()),
            config::pin_type(entry), output && !entry.copied ? "in" : "out", json_string(slave),
            entry.index, entry.sub);
    });
    return text;
}

}  // namespace

bool read_bus_file(const Options& options, const std::string& path, config::ReadResult& reading) {
    std::string text;
    if (!config::read_from_disk(path, text)) {
        fail(options, fmt::format("cannot read '{}': {}", path, text));
        return false;
    }
    reading = config::read(text, path);
    return print_findings(path, text, reading.messages, [](const config::Message& m) {
        return Code::named(config::code_of(m.topic)).value_or(Code("ethercat-line"));
    });
}

int run_ethercat_pdos(const EthercatOptions& options) {
    EthercatWire wire;
    if (!wire.open(options) || !wire.without_arguments(options)) return 1;
    wire.identify();
    std::string text, json;
    for (std::size_t n = 0; n < wire.size(); ++n) {
        const auto& c = wire.contents(n);
        text += fmt::format("{}  {}\n", n, wire.name(n));
        for (const bool outputs : {true, false}) {
            const char* const direction = outputs ? "outputs" : "inputs";
            for (const auto& pdo : outputs ? c.rx : c.tx) {
                const std::string assignment =
                    pdo.sync_manager == 0xff ? "not assigned"
                                             : fmt::format("sync manager {}", pdo.sync_manager);
                text += fmt::format("  {:04X} {}, {}  {}\n", pdo.index, direction, assignment,
                                    pdo.name);
                json += fmt::format(
                    R"({}{{"position":{},"index":{},"direction":"{}","sync_manager":{},"name":{},"entries":[)",
                    json.empty() ? "[" : ",\n ", n, pdo.index, direction,
                    pdo.sync_manager == 0xff ? "null" : std::to_string(pdo.sync_manager),
                    json_string(pdo.name));
                for (std::size_t i = 0; i < pdo.entries.size(); ++i) {
                    const auto& e = pdo.entries[i];
                    text += e.index == 0
                                ? fmt::format("    gap, {} bit\n", e.bits)
                                : fmt::format("    {:04X}:{} {}, {} bit  {}\n", e.index, e.sub,
                                              ethercat::sii::type_name(e.type), e.bits, e.name);
                    json +=
                        fmt::format(R"({}{{"index":{},"sub":{},"bits":{},"name":{}}})",
                                    i == 0 ? "" : ",", e.index, e.sub, e.bits, json_string(e.name));
                }
                json += "]}";
            }
        }
    }
    return print(list_or_text(options.json, json, text)) ? 0 : 1;
}

namespace {

/// What a slave's clock states about itself.
struct ClockState {
    std::int64_t deviation_ns;  ///< from the reference clock
    std::uint32_t delay_ns;  ///< from the reference clock to the slave
    bool sync;  ///< it makes SYNC signals
};

/// Reads the registers of a slave's clock (ETG.1000.4, clause 6.7); nothing: it does not answer.
std::optional<ClockState> read_clock(EthercatWire& wire, std::size_t n) {
    namespace reg = ethercat::registers;
    const auto delay = wire.read(n, reg::dc_system_time_delay, 4);
    const auto difference = wire.read(n, reg::dc_system_time_difference, 4);
    const auto activation = wire.read(n, reg::dc_activation, 1);
    if (!delay || !difference || !activation) return std::nullopt;
    const auto raw = ethercat::get<std::uint32_t>(difference->data());  // magnitude and sign
    const auto magnitude = static_cast<std::int64_t>(raw & 0x7fffffff);
    return ClockState{raw >> 31 != 0 ? -magnitude : magnitude,
                      ethercat::get<std::uint32_t>(delay->data()), ((*activation)[0] & 0x01) != 0};
}

}  // namespace

/// `hal ethercat dc`: prints the clock of each slave.
int run_ethercat_dc(const EthercatOptions& options) {
    EthercatWire wire;
    if (!wire.open(options) || !wire.without_arguments(options)) return 1;
    wire.identify();
    std::string text, json;
    for (std::size_t n = 0; n < wire.size(); ++n) {
        if (!wire.slave(n).has_dc()) {
            text += fmt::format("{}  no clock  {}\n", n, wire.name(n));
            json += fmt::format(
                R"({}{{"position":{},"deviation_ns":null,"delay_ns":null,"sync":null}})",
                json.empty() ? "[" : ",\n ", n);
            continue;
        }
        const std::optional<ClockState> clock = read_clock(wire, n);
        if (!clock) {
            return fail(options,
                        fmt::format("slave {} no longer responds; check its supply and cable", n));
        }
        text +=
            fmt::format("{}  deviation {} ns  delay {} ns  SYNC {}  {}\n", n, clock->deviation_ns,
                        clock->delay_ns, clock->sync ? "on" : "off", wire.name(n));
        json += fmt::format(R"({}{{"position":{},"deviation_ns":{},"delay_ns":{},"sync":{}}})",
                            json.empty() ? "[" : ",\n ", n, clock->deviation_ns, clock->delay_ns,
                            clock->sync);
    }
    return print(list_or_text(options.json, json, text)) ? 0 : 1;
}

int run_ethercat_check(const EthercatCheckOptions& options) {
    int status = 0;
    std::string json;
    for (const std::string& file : options.words) {
        config::ReadResult reading;
        if (!read_bus_file(options, file, reading)) {
            status = 1;
            continue;
        }
        for (const config::Bus& bus : reading.buses) {
            const std::size_t slaves = bus.setup.slaves.size();
            if (options.json) {
                json += fmt::format(
                    R"({}{{"file":{},"link":{},"cycle_ns":{},"slaves":{},"pins":[{}]}})",
                    json.empty() ? "[" : ",\n ", json_string(file), json_string(bus.link),
                    bus.setup.cycle_ns, slaves, pins_json(bus));
            } else if (!print(fmt::format("{}: {}, cycle {} us, {} slave{}\n{}", file, bus.link,
                                          static_cast<double>(bus.setup.cycle_ns) / 1000, slaves,
                                          slaves == 1 ? "" : "s", pin_lines(bus, "  ")))) {
                return 1;
            }
        }
    }
    if (options.json && !print((json.empty() ? "[" : json) + "]\n")) return 1;
    return status;
}

int run_ethercat_plan(const EthercatPlanOptions& options) {
    if (options.words.size() != 1) {
        return fail(options, fmt::format("nothing is expected at '{}'; see: hal help ethercat plan",
                                         options.words[1]));
    }
    config::ReadResult reading;
    if (!read_bus_file(options, options.words[0], reading)) return 1;
    if (!options.svg.empty()) {
        if (reading.buses.size() != 1) {
            return fail(options, fmt::format("{} has {} masters; a picture shows one",
                                             options.words[0], reading.buses.size()));
        }
        const config::PlanOptions assumed;
        const config::Plan p = config::plan(reading.buses[0], assumed);
        return write_picture(options, options.svg, options.json,
                             timeline_of(reading.buses[0], p, assumed));
    }
    std::string text, json;
    bool fits = true;
    for (const config::Bus& bus : reading.buses) {
        const config::Plan p = config::plan(bus);
        fits = fits && p.fits;
        text += (reading.buses.size() == 1 ? "" : "master " + bus.name + ":\n") + p.text;
        json += (json.empty() ? "[" : ",\n ") + plan_json(p);
    }
    if (!print(list_or_text(options.json, json, text))) return 1;
    if (fits) return 0;
    return fail(options, fmt::format("{}: the cycle is too short; raise `cycle`, or exchange slow "
                                     "slaves in a [domain] with every = 4",
                                     options.words[0]));
}

}  // namespace hal::tools
