// SPDX-License-Identifier: MIT
// `hal modbus check` and `hal modbus plan`: the telegrams of a configuration, the use of the line,
// and how old each value can be.
#include <fmt/core.h>

#include <algorithm>

#include "bus/modbus/bus_file.hpp"
#include "bus/modbus/options.hpp"
#include "bus/timeline/text_table.hpp"
#include "cli/output.hpp"
#include "modbus/config/plan.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

using namespace modbus;

std::string ms_text(std::int64_t ns) {
    return fmt::format("{:.1f}", static_cast<double>(ns) / 1e6);
}

std::string registers_text(const Telegram& t) {
    if (t.kind == Telegram::Kind::drive) return "command, speed";
    if (t.count <= 1) return fmt::format("{} 0x{:04X}", modbus::to_string(t.table), t.address);
    return fmt::format("{} 0x{:04X}..0x{:04X}", modbus::to_string(t.table), t.address,
                       t.address + t.count - 1);
}

std::string names_text(const Plan& plan, const Telegram& t) {
    std::string names;
    for (const std::uint32_t n : t.values) {
        append_item(names, plan.values[n].value->name);
    }
    return names;
}

const char* kind_text(const Telegram& t) {
    constexpr const char* names[] = {"read", "write", "drive"};
    return names[static_cast<std::size_t>(t.kind)];
}

std::string list_text(const std::vector<Write>& writes) {
    std::string text;
    for (const Write& write : writes) {
        append_item(text, write_text(write));
    }
    return text.empty() ? "none" : text;
}

bool has_addressed_stops(const modbus::Bus& bus) {
    return std::any_of(bus.slaves.begin(), bus.slaves.end(),
                       [](const Slave& slave) { return !slave.stop.empty(); });
}

std::string stop_text(const modbus::Bus& bus, const Load& load) {
    std::string text;
    if (!bus.broadcast_stop.empty()) {
        text +=
            fmt::format("the broadcast stop is sent within {} ms\n", ms_text(load.broadcast_ns));
    }
    if (has_addressed_stops(bus)) {
        text += fmt::format("all stop telegrams are sent within {} ms\n", ms_text(load.stop_ns));
    }
    if (!bus.broadcast_stop.empty()) {
        text += fmt::format("broadcast stop: {}\n", list_text(bus.broadcast_stop));
    }
    for (const Slave& slave : bus.slaves) {
        text += fmt::format("stop of slave {} ({}): {}\n", slave.unit, slave.name,
                            list_text(slave.stop));
    }
    return text;
}

std::string plan_text(const modbus::Bus& bus, const Plan& plan, Framing framing, const Load& load,
                      std::int64_t thinking) {
    const bool serial = framing == Framing::rtu;
    std::string text =
        fmt::format("{}{}; a slave answers after {} ms\n\n", serial ? "RTU, " : "TCP",
                    serial ? line::format_text(bus.line) : "", ms_text(thinking));
    TextTable table({{"slave", 12, true},
                     {"kind", 5, true},
                     {"registers", 24, true},
                     {"every ms", 9},
                     {"takes ms", 9},
                     {"line %", 7},
                     {"age ms", 8},
                     {"values", 0, true}});
    for (std::size_t n = 0; n < plan.telegrams.size(); ++n) {
        const Telegram& t = plan.telegrams[n];
        const std::int64_t all = time_of(t, bus, framing).all(thinking);
        const double use = 100.0 * static_cast<double>(all) / static_cast<double>(t.period_ns);
        table.add({bus.slaves[t.slave].name, kind_text(t), registers_text(t), ms_text(t.period_ns),
                   ms_text(all), fmt::format("{:.1f}", use),
                   t.kind == Telegram::Kind::read ? ms_text(load.ages[n]) : "",
                   names_text(plan, t)});
    }
    text += table.text() + "\n";
    text +=
        fmt::format("{} telegrams use {:.1f} % of the line{}\n", plan.telegrams.size(),
                    100 * load.use, load.use > 1 ? "; all periods are longer by this factor" : "");
    for (const Slave& slave : bus.slaves) {
        if (slave.confirm != modbus::Confirm::always) continue;
        text += fmt::format(
            "confirm of slave {} ({}): a changed value is read twice; the table counts one read\n",
            slave.unit, slave.name);
    }
    if (load.set_point_ns != 0) {
        text += fmt::format("a set-point is sent within {} ms\n", ms_text(load.set_point_ns));
    }
    return text + stop_text(bus, load);
}

std::string plan_json(const modbus::Bus& bus, const Plan& plan, Framing framing, const Load& load,
                      std::int64_t thinking) {
    std::string text = fmt::format(
        R"({{"use":{:.6f},"set_point_ns":{},"broadcast_ns":{},"stop_ns":{},"telegrams":[)",
        load.use, load.set_point_ns, load.broadcast_ns, load.stop_ns);
    for (std::size_t n = 0; n < plan.telegrams.size(); ++n) {
        const Telegram& t = plan.telegrams[n];
        std::string names;
        for (const std::uint32_t value : t.values) {
            append_item(names, "\"" + plan.values[value].value->name + "\"", ",");
        }
        text += fmt::format(
            R"({}{{"slave":{},"kind":"{}","table":"{}","address":{},"count":{},"period_ns":{},"time_ns":{},"age_ns":{},"values":[{}]}})",
            n == 0 ? "\n " : ",\n ", bus.slaves[t.slave].unit, kind_text(t),
            modbus::to_string(t.table), t.address, t.count, t.period_ns,
            time_of(t, bus, framing).all(thinking), load.ages[n], names);
    }
    return text + "]}\n";
}

}  // namespace

int run_modbus_check(const ModbusCheckOptions& options) {
    bool good = true;
    for (const std::string& file : options.words) {
        ReadResult result;
        if (!read_modbus_file(options, file, result)) {
            good = false;
            continue;
        }
        const Plan plan = make_plan(result.bus);
        print(fmt::format("{}: {}, {}, {}\n", file, counted(result.bus.slaves.size(), "slave"),
                          counted(plan.values.size(), "value"),
                          counted(plan.telegrams.size(), "telegram")));
    }
    return exit_code(good);
}

int run_modbus_plan(const ModbusPlanOptions& options) {
    ReadResult result;
    if (!read_modbus_file(options, options.words[0], result)) return 1;
    const modbus::Bus& bus = result.bus;
    const Plan plan = make_plan(bus);
    const Framing framing = bus.framing_on(line::describe(bus.link));
    const Load load = load_of(plan, bus, framing, options.thinking_ns);
    return exit_code(print(options.json
                               ? plan_json(bus, plan, framing, load, options.thinking_ns)
                               : plan_text(bus, plan, framing, load, options.thinking_ns)));
}

}  // namespace hal::tools
