// SPDX-License-Identifier: MIT
// `hal node modbus`: the slaves of a configuration as a process.
#include <poll.h>

#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "bus/modbus/bus_file.hpp"
#include "bus/modbus/options.hpp"
#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "link/system.hpp"
#include "modbus/device/slave_bus.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

using namespace modbus;

/// Parses SLAVE.NAME=VALUE and sets the value. Returns the problem, or "".
std::string apply_setting(SlaveBus& bus, const std::string& text) {
    const auto dot = text.find('.');
    const auto equals = text.find('=');
    const auto value = equals != text.npos ? parse_real(text.substr(equals + 1)) : std::nullopt;
    if (dot == text.npos || !value || dot > equals) {
        return "invalid --set '" + text + "'; write SLAVE.NAME=VALUE";
    }
    const std::string slave = text.substr(0, dot);
    const std::string name = text.substr(dot + 1, equals - dot - 1);
    const auto of_name = [&](const EmulatedSlave& one) { return one.config().name == slave; };
    const auto found = std::find_if(bus.slaves().begin(), bus.slaves().end(), of_name);
    if (found == bus.slaves().end()) {
        std::string names;
        for (const EmulatedSlave& one : bus.slaves()) {
            append_item(names, one.config().name);
        }
        return "--set '" + text + "': unknown slave '" + slave + "'; slaves are " + names;
    }
    const std::string problem = found->problem_of(name, *value);
    if (!problem.empty()) return "--set '" + text + "': " + slave + "." + name + ": " + problem;
    found->set(name, *value);
    return {};
}

/// Opens the line on which the slaves answer: that of --link, or the end of that of the file at
/// which they are.
line::Opened open_line(const ModbusNodeOptions& options, const Bus& bus, std::string& link) {
    const std::string listening = line::listening_address(bus.link);
    if (!options.link.empty()) {
        link = options.link;
        if (const std::string own = line::listening_address(link); !own.empty()) {
            line::Opened rejected;
            rejected.problem =
                link + " makes a connection, and slaves wait for one; write --link " + own;
            return rejected;
        }
    } else {
        link = listening.empty() ? bus.link : listening;
    }
    auto opened = line::open(link, bus.line);
    if (!opened && options.link.empty() && !listening.empty()) {
        opened.problem +=
            "; link = " + bus.link +
            " of the file must be an address of this computer and a free port; for another one "
            "write --link listen:5020, and load the machine with link=tcp:127.0.0.1:5020";
    }
    return opened;
}

/// Prints drives whose state has changed.
class DriveReport {
public:
    bool print_changes(SlaveBus& bus, std::int64_t since_ns) {
        std::string now;
        for (EmulatedSlave& slave : bus.slaves()) {
            const DriveModel* const drive = slave.drive();
            if (drive == nullptr) continue;
            const char* direction = drive->direction > 0 ? "forward" : "reverse";
            const bool steady = std::fabs(std::fabs(drive->speed_rpm) -
                                          std::fabs(drive->direction * drive->set_point_rpm)) < 1;
            now +=
                fmt::format("{}: {}, set-point {:.0f} rpm{}\n", slave.config().name,
                            drive->direction == 0 ? "stop" : direction, drive->set_point_rpm,
                            steady ? fmt::format(", turns with {:.0f} rpm", drive->speed_rpm) : "");
        }
        if (now == last_) return true;
        last_ = now;
        return print(fmt::format("{:.3f} s\n{}", static_cast<double>(since_ns) / 1e9, now));
    }

private:
    std::string last_;
};

}  // namespace

int run_node_modbus(const ModbusNodeOptions& options) {
    ReadResult result;
    if (!read_modbus_file(options, options.words[0], result)) return 1;
    SlaveBus bus(result.bus);
    for (const std::string& text : options.faults) {
        SlaveFault fault;
        if (const std::string problem = parse_fault(text, fault); !problem.empty()) {
            return fail(options, "--fault: " + problem);
        }
        bus.faults().push_back(fault);
    }
    for (const std::string& text : options.settings) {
        if (const std::string problem = apply_setting(bus, text); !problem.empty()) {
            return fail(options, problem);
        }
    }
    StopRequest stop;
    std::string link;
    auto opened = open_line(options, result.bus, link);
    if (!opened) return fail(options, opened.problem);
    bus.set_thinking(options.thinking_ns);
    bus.attach(*opened.line);
    print(fmt::format("modbus: {} on {}\n", counted(bus.slaves().size(), "slave"), link));
    DriveReport report;
    const std::int64_t begin = hal::link::monotonic_ns();
    while (!stop.requested()) {
        const std::int64_t now = hal::link::monotonic_ns();
        if (options.for_ns >= 0 && now - begin >= options.for_ns) break;
        const std::int64_t next = bus.work(now);
        if (options.verbose && !report.print_changes(bus, now - begin)) break;
        pollfd p{opened.line->descriptor(), POLLIN, 0};
        const timespec wait = hal::link::to_timespec(
            std::clamp<std::int64_t>(next - hal::link::monotonic_ns(), 0, 10'000'000));
        ppoll(&p, p.fd >= 0 ? 1 : 0, &wait, nullptr);
    }
    print(fmt::format("modbus: {} requests\n", bus.requests()));
    return 0;
}

}  // namespace hal::tools
