// SPDX-License-Identifier: MIT
#include "bus/node/run.hpp"

#include <algorithm>
#include <charconv>
#include <fmt/chrono.h>
#include <fmt/core.h>
#include <functional>
#include <optional>
#include <stdexcept>
#include <unistd.h>

#include "base/types.hpp"
#include "bus/can/bus.hpp"
#include "bus/node/background_writer.hpp"
#include "bus/node/kinds.hpp"
#include "bus/node/tdma_station.hpp"
#include "bus/number_text.hpp"
#include "canopen/device/eds_export.hpp"
#include "canopen/device/node.hpp"
#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "hal/message_log.hpp"

namespace hal::tools {

namespace {

/// A value of the simulated environment, set at a time after the start.
struct Setting {
    std::string name;
    double value = 0;
    std::int64_t at_ns = 0;
};

/// Parses NAME=VALUE or NAME=VALUE@TIME.
bool parse_setting(const std::string& text, Setting& setting, std::string& problem) {
    const auto equals = text.find('=');
    const auto at = text.find('@');
    const auto ns =
        at == text.npos ? std::optional<std::int64_t>(0) : parse_duration_ns(text.substr(at + 1));
    if (equals != text.npos && equals != 0 && (at == text.npos || at > equals) && ns && *ns >= 0) {
        const std::string digits =
            text.substr(equals + 1, at == text.npos ? text.npos : at - equals - 1);
        const auto [end, wrong] =
            std::from_chars(digits.data(), digits.data() + digits.size(), setting.value);
        if (wrong == std::errc() && end == digits.data() + digits.size()) {
            setting.name = text.substr(0, equals);
            setting.at_ns = *ns;
            return true;
        }
    }
    problem = fmt::format("invalid --set '{}'; write NAME=VALUE, or NAME=VALUE@2s for later", text);

    return false;
}

/// Joins names, "in-0 … in-63, fx": names that differ only in their number are abbreviated.
std::string listed(const std::vector<std::string>& names) {
    const auto stem = [](const std::string& name) {
        return name.substr(0, name.find_last_not_of("0123456789") + 1);
    };
    std::string text;
    for (std::size_t from = 0, to = 0; from < names.size(); from = to) {
        while (to < names.size() && stem(names[to]) == stem(names[from])) {
            ++to;
        }
        text +=
            (from == 0 ? "" : ", ") + names[from] + (to - from > 1 ? " … " + names[to - 1] : "");
    }
    return text;
}

bool parse_id(const NodeOptions& options, const NodeKind& kind, std::uint8_t& id,
              std::string& problem) {
    const std::string& text = options.id;
    if (text.empty() && kind.id != 0) {
        id = kind.id;
        return true;
    }
    if (text.empty()) {
        problem = "missing --id: use --id 5, or --id none to wait for an LSS master";
        return false;
    }
    if (text == "none") {
        id = canopen::unconfigured;
        return true;
    }
    const std::optional<std::uint64_t> value = parse_number(text);
    if (!value || *value < 1 || *value > 127) {
        problem = fmt::format(
            "invalid --id '{}'; write 1..127, 0x50, or none to wait for an LSS master", text);

        return false;
    }
    id = static_cast<std::uint8_t>(*value);
    return true;
}

std::string eds_text(const NodeKind& kind, const canopen::Program& program) {
    auto eds = canopen::eds_of(program.description());
    const std::time_t now = std::time(nullptr);
    const std::tm day = fmt::gmtime(now);
    eds.file.file_name = kind.name + ".eds";
    eds.file.description = fmt::format("hal node {}: {}", kind.name, kind.what);
    eds.file.created_by = eds.file.modified_by = eds.device.vendor_name = "Halcyon";
    eds.file.creation_date = eds.file.modification_date = fmt::format("{:%m-%d-%Y}", day);
    eds.file.creation_time = eds.file.modification_time = fmt::format("{:%I:%M%p}", day);
    return canopen::eds::write_eds(eds);
}

/// Prints the changes of a node until `print` returns false because standard output is closed.
class Reporter {
public:
    Reporter(canopen::Node& node, const canopen::Program& program, std::int64_t began,
             std::function<bool(const std::string&)> print)
        : node_(node), program_(program), began_(began), print_(std::move(print)) {}

    /// Returns false when standard output is closed.
    bool look(std::int64_t now) {
        auto& device = node_.device();
        const auto log = [&](const std::string& what) { log_.print(what, timed(what, now), now); };
        if (device.state() != state_ || device.node_id() != id_) {
            state_ = device.state();
            id_ = device.node_id();
            log(id_ == canopen::unconfigured ? "waiting for a node ID"
                                             : canopen::to_string(state_));
        }
        if (const auto errors = device.emcy().error_register(); errors != errors_) {
            errors_ = errors;
            const auto code =
                static_cast<std::uint16_t>(device.dictionary().get<std::uint32_t>(0x1003, 1, 0));
            log(errors == 0
                    ? "error reset"
                    : fmt::format("error 0x{:04X}: {}", code, canopen::emergency_text(code)));
        }
        // outputs can change with every SYNC: print the newest once per second
        if (now - news_at_ >= 1'000'000'000) {
            if (std::string news = program_.news(); news != news_) {
                news_at_ = now;
                text_ += timed(news_ = std::move(news), now) + "\n";
            }
        }
        for (can::Rejected what; node_.link().rejected(what);) {
            log(can::to_string(what));
        }
        if (const auto bus = node_.link().state(); bus != bus_) {
            bus_ = bus;
            log(fmt::format("bus {}", can::to_string(bus)));
        }
        log_.flush(now);
        std::string text;
        text.swap(text_);
        return print_(text);
    }

    std::string end(std::int64_t now) {
        const can::Statistics s = node_.link().statistics();
        auto& device = node_.device();
        std::uint64_t transfers = 0;
        std::uint64_t aborted = 0;
        std::uint64_t pdos = 0;
        for (std::size_t n = 0; n < device.sdo_servers(); ++n) {
            transfers += device.sdo_server(n).transfers();

            aborted += device.sdo_server(n).aborted();
        }
        for (unsigned n = 1; n <= canopen::Pdos::max_pdos; ++n) {
            pdos += device.pdos().tpdo(n).count;
        }
        log_.close();
        if (std::string news = program_.news(); news != news_) {
            text_ += timed(news, now) + "\n";
        }
        std::string text = std::exchange(text_, {});
        text += fmt::format(
            "{:.1f} s: {} frames sent, {} received, {} dropped, {} lost in transit, {} lost here, "
            "{} rejected; "
            "{} SDO transfers, {} aborted; {} PDOs sent\n",
            static_cast<double>(now - began_) / 1e9, s.sent, s.received, s.dropped, s.lost_on_wire,
            s.lost - s.lost_on_wire, s.rejected, transfers, aborted, pdos);
        for (const auto& row : canopen::fault_rows()) {
            if (const auto hits = node_.faults().hits(row.fault); hits != 0) {
                text += fmt::format("fault {}: {} times\n", row.name, hits);
            }
        }
        if (const std::string summary = program_.summary(); !summary.empty()) {
            text += summary + "\n";
        }
        return text;
    }

private:
    std::string timed(const std::string& what, std::int64_t now) const {
        return fmt::format("{:9.3f} s  {}", static_cast<double>(now - began_) / 1e9, what);
    }

    canopen::Node& node_;
    const canopen::Program& program_;
    const std::int64_t began_;
    const std::function<bool(const std::string&)> print_;
    std::string text_;  // to be printed
    hal::MessageLog log_{"", [this](const std::string& line) { text_ += line; }};
    canopen::NmtState state_ = canopen::NmtState::initialising;
    std::uint8_t id_ = 0;
    std::uint8_t errors_ = 0;
    std::int64_t news_at_ = INT64_MIN / 2;
    std::string news_;
    can::State bus_ = can::State::active;
};

int turn_until_ended(const NodeOptions& options, const NodeKind& kind, canopen::Program& program,
                     std::vector<Setting> settings, std::uint8_t id,
                     const std::vector<std::pair<canopen::Fault, canopen::FaultSetting>>& faults) {
    StopRequest stop;
    can::Options how;
    how.receive_capacity = 16384;
    std::string link = options.link;
    std::unique_ptr<TdmaStation> station;
    const std::int64_t give_up = options.for_ns >= 0 ? monotonic_ns() + options.for_ns : INT64_MAX;
    const auto ended = [&] { return stop.wait_ns(5'000'000) || monotonic_ns() >= give_up; };
    if (!options.tdma.empty()) {
        const std::string problem = TdmaStation::make(options, link, ended, station);
        if (!problem.empty()) return fail(options, problem);
    }
    can::Opened opened = can::open(link, how);
    if (!opened) return fail(options, opened.problem);
    const can::Description about = opened.link->description();
    if (const std::string why = out_of_reach(about); !why.empty()) return fail(options, why);
    canopen::Node node(program, std::move(opened.link),
                       {.node_id = id, .auto_start = options.starts_itself});
    for (const auto& [fault, setting] : faults) {
        node.faults().set(fault, setting);
    }

    const std::string who =
        id == canopen::unconfigured ? "without node ID" : fmt::format("node {}", id);
    if (!print(fmt::format("{}, {} on {} ({}): {}; press Ctrl-C to end\n", kind.name, who,
                           about.address, about.transport, kind.what))) {
        return 1;
    }
    const std::int64_t began = monotonic_ns();

    const std::int64_t end = options.for_ns >= 0 ? began + options.for_ns : INT64_MAX;
    std::optional<BackgroundWriter> writer;
    if (station) {
        writer.emplace();
    }
    Reporter reporter(node, program, began, [&](const std::string& text) {
        return writer ? writer->write(text) : print(text);
    });
    std::size_t next = 0;
    std::string problem;
    const auto change_world = [&](std::int64_t now) {
        for (; next < settings.size() && now - began >= settings[next].at_ns; ++next) {
            program.set(settings[next].name, settings[next].value);
        }
    };
    const auto look = [&](std::int64_t now) {
        return reporter.look(now) && (!kind.keep || (problem = kind.keep()).empty());
    };
    std::int64_t now = began;
    bool is_read = true;
    if (station) {
        station->run([&](std::int64_t local, bool) {
            change_world(now);
            node.turn(local, can::unclocked);
            now = monotonic_ns();
            return !stop.requested() && now < end && (is_read = look(now));
        });
        writer.reset();
        if (is_read) {
            is_read = print(station->summary());
        }
    } else {
        while (!stop.requested() && now < end) {
            change_world(now);
            node.turn(now, about.simulated ? now : can::unclocked);
            is_read = look(now);
            if (!is_read) break;
            node.link().wait(1'000'000);
            now = monotonic_ns();
        }
    }
    if (!problem.empty()) return fail(options, problem);
    if (!is_read) return 1;
    return print(reporter.end(now)) ? 0 : 1;
}

}  // namespace

int run_node(const NodeOptions& options, const NodeKind& kind, canopen::Program& program) {
    if (options.eds) return print(eds_text(kind, program)) ? 0 : 1;
    std::string problem;
    std::uint8_t id = 0;
    if (options.link.empty()) {
        return fail(options,
                    "missing --link; add --link udp:239.74.163.2:43113, or can:can0, "
                    "slcan:/dev/ttyACM0; see: hal help node " +
                        kind.name);
    }
    if (!parse_id(options, kind, id, problem)) return fail(options, problem);
    const NodeOptions& given = options;
    if (given.tdma.empty()) {
        for (const auto& [name, value] : {std::pair{"--station", &given.station},
                                          {"--tunnel", &given.tunnel},
                                          {"--skew", &given.skew},
                                          {"--drift", &given.drift}}) {
            if (!value->empty()) {
                return fail(options,
                            fmt::format("{} needs a TDMA schedule; add --tdma FILE", name));
            }
        }
    }
    std::vector<std::pair<canopen::Fault, canopen::FaultSetting>> faults(options.faults.size());
    for (std::size_t n = 0; n < faults.size(); ++n) {
        if (!canopen::parse_fault(options.faults[n], faults[n].first, faults[n].second, problem)) {
            return fail(options, problem);
        }
    }
    std::vector<Setting> settings(options.settings.size());
    for (std::size_t n = 0; n < settings.size(); ++n) {
        if (!parse_setting(options.settings[n], settings[n], problem)) {
            return fail(options, problem);
        }
    }
    const std::vector<std::string> known = program.settable();
    for (const Setting& s : settings) {
        if (std::find(known.begin(), known.end(), s.name) == known.end()) {
            return fail(options,
                        known.empty()
                            ? fmt::format("invalid --set: a {} has no settable values", kind.name)
                            : fmt::format("unknown value '{}' in --set; write one of: {}", s.name,
                                          listed(known)));
        }
    }
    std::stable_sort(settings.begin(), settings.end(),
                     [](const Setting& a, const Setting& b) { return a.at_ns < b.at_ns; });
    try {
        return turn_until_ended(options, kind, program, std::move(settings), id, faults);
    } catch (const std::invalid_argument& e) {
        return fail(options, e.what());
    }
}

int run_node_faults(const Options&) {
    std::string text;
    for (const auto& row : canopen::fault_rows()) {
        text += fmt::format(
            "{:15} every {}{}\n", row.name, row.what,
            row.time == 0 ? std::string()
                          : fmt::format("; time={:g}ms", static_cast<double>(row.time) / 1e6));
    }
    return print(text) ? 0 : 1;
}

}  // namespace hal::tools
