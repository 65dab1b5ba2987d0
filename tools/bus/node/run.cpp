// SPDX-License-Identifier: MIT
#include "bus/node/run.hpp"

#include <algorithm>
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
#include "bus/node/node_station.hpp"
#include "canopen/device/eds_export.hpp"
#include "canopen/device/node.hpp"
#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "hal/message_log.hpp"
#include "text/numbers.hpp"

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
        if (parse_whole(digits, setting.value)) {
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
        if (from > 0) {
            text += ", ";
        }
        text += names[from];
        if (to - from > 1) {
            text += " … " + names[to - 1];
        }
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
    const std::optional<std::uint64_t> value = parse_natural(text);
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
             hal::LinePrefix prefix, std::function<bool(const std::string&)> print)
        : node_(node),
          program_(program),
          began_(began),
          print_(std::move(print)),
          log_(std::move(prefix), [this](const std::string& line) { text_ += line; }) {}

    /// Returns false when standard output is closed.
    bool look(std::int64_t now) {
        auto& device = node_.device();
        const auto log = [&](const std::string& what) { log_.print(what, what, now); };
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
        // of outputs that change with every SYNC the log prints the newest, and counts the others
        if (std::string news = program_.news(); news != news_) {
            news_ = std::move(news);
            log_.print(hal::MessageSubject{"program", news_}, news_, now);
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
        if (std::string news = program_.news(); news != news_) {
            log_.print(hal::MessageSubject{"program", news}, news, now);
        }
        log_.close();
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
    canopen::Node& node_;
    const canopen::Program& program_;
    const std::int64_t began_;
    const std::function<bool(const std::string&)> print_;
    std::string text_;  // to be printed
    hal::MessageLog log_;
    canopen::NmtState state_ = canopen::NmtState::initialising;
    std::uint8_t id_ = 0;
    std::uint8_t errors_ = 0;
    std::string news_;
    can::State bus_ = can::State::active;
};

using Faults = std::vector<std::pair<canopen::Fault, canopen::FaultSetting>>;

/// One run of a node: turns it on its link until the time is over, a signal arrives, or standard
/// output is closed.
class NodeRun {
public:
    NodeRun(const NodeOptions& options, const NodeKind& kind, canopen::Program& program,
            std::vector<Setting> settings)
        : options_(options), kind_(kind), program_(program), settings_(std::move(settings)) {}

    /// Returns the exit status.
    int run(std::uint8_t id, const Faults& faults) {
        std::string link = options_.link;
        std::unique_ptr<NodeStation> station;
        if (const std::string problem = make_station(link, station); !problem.empty()) {
            return fail(options_, problem);
        }
        can::Options settings;
        settings.receive_capacity = 16384;
        can::Opened opened = can::open(link, settings);
        if (!opened) return fail(options_, opened.problem);
        const can::Description about = opened.link->description();
        if (const std::string why = out_of_reach(about); !why.empty()) return fail(options_, why);
        canopen::Node node(program_, std::move(opened.link),
                           {.node_id = id, .auto_start = options_.starts_itself});
        for (const auto& [fault, setting] : faults) {
            node.faults().set(fault, setting);
        }
        if (!announce(id, about)) return 1;
        now_ns_ = monotonic_ns();
        return station ? run_on_segment(node, *station) : run_on_link(node, about.simulated);
    }

private:
    bool over() const { return stop_.requested() || now_ns_ >= end_ns_; }

    /// Makes the station of a TDMA segment, if one is wanted; `link` is then its end of the bus.
    std::string make_station(std::string& link, std::unique_ptr<NodeStation>& station) {
        if (options_.tdma.empty()) return {};
        const auto ended = [&] { return stop_.wait_ns(5'000'000) || monotonic_ns() >= end_ns_; };
        return make_tdma_station(options_, link, prefix_, ended, station);
    }

    bool announce(std::uint8_t id, const can::Description& about) const {
        const std::string who =
            id == canopen::unconfigured ? "without node ID" : fmt::format("node {}", id);
        return print(fmt::format("{}, {} on {} ({}): {}; press Ctrl-C to end\n", kind_.name, who,
                                 about.address, about.transport, kind_.what));
    }

    /// Sets the values of the environment whose time has come.
    void apply_settings() {
        while (next_setting_ < settings_.size() &&
               now_ns_ - began_ns_ >= settings_[next_setting_].at_ns) {
            const Setting& setting = settings_[next_setting_];
            program_.set(setting.name, setting.value);
            ++next_setting_;
        }
    }

    /// Prints what has changed, and keeps the memory of the node. Returns false at a failure.
    bool report(Reporter& reporter) {
        is_read_ = reporter.look(now_ns_);
        if (!is_read_) return false;
        if (kind_.keep) {
            problem_ = kind_.keep();
        }
        return problem_.empty();
    }

    int run_on_segment(canopen::Node& node, NodeStation& station) {
        std::optional<BackgroundWriter> writer(std::in_place);
        Reporter reporter(node, program_, began_ns_, prefix_,
                          [&](const std::string& text) { return writer->write(text); });
        station.run([&](std::int64_t local_ns, bool) {
            apply_settings();
            node.turn(local_ns, can::unclocked);
            now_ns_ = monotonic_ns();
            return !over() && report(reporter);
        });
        writer.reset();
        if (is_read_ && problem_.empty()) {
            is_read_ = print(station.summary());
        }
        return finish(reporter);
    }

    int run_on_link(canopen::Node& node, bool simulated) {
        Reporter reporter(node, program_, began_ns_, prefix_,
                          [](const std::string& text) { return print(text); });
        while (!over()) {
            apply_settings();
            node.turn(now_ns_, simulated ? now_ns_ : can::unclocked);
            if (!report(reporter)) break;
            node.link().wait(1'000'000);
            now_ns_ = monotonic_ns();
        }
        return finish(reporter);
    }

    int finish(Reporter& reporter) const {
        if (!problem_.empty()) return fail(options_, problem_);
        if (!is_read_) return 1;
        return exit_code(print(reporter.end(now_ns_)));
    }

    StopRequest stop_;
    const NodeOptions& options_;
    const NodeKind& kind_;
    canopen::Program& program_;
    const std::vector<Setting> settings_;
    std::size_t next_setting_ = 0;
    /// Begins the time of lines, settings and `--for`, also of the wait for a TDMA segment.
    const std::int64_t began_ns_ = monotonic_ns();
    const std::int64_t end_ns_ = options_.for_ns >= 0 ? began_ns_ + options_.for_ns : INT64_MAX;
    const hal::LinePrefix prefix_ = hal::LinePrefix::time_since(began_ns_);
    std::int64_t now_ns_ = began_ns_;
    bool is_read_ = true;  // standard output is open
    std::string problem_;
};

}  // namespace

int run_node(const NodeOptions& options, const NodeKind& kind, canopen::Program& program) {
    if (options.eds) return exit_code(print(eds_text(kind, program)));
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
        return NodeRun(options, kind, program, std::move(settings)).run(id, faults);
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
    return exit_code(print(text));
}

}  // namespace hal::tools
