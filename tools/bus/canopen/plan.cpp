// SPDX-License-Identifier: MIT
// `hal canopen plan`: schedulability of a configuration, the worst-case response time of each
// message. `hal canopen check`: checks a configuration and lists its pins.
#include "bus/canopen/plan.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <numeric>
#include <sstream>
#include <unistd.h>

#include "base/types.hpp"
#include "bus/timeline/plan_output.hpp"
#include "bus/timeline/text_table.hpp"
#include "canopen/master/config/bus_schedule.hpp"
#include "canopen/master/config/config_lines.hpp"
#include "fieldbus/can_timing/recorded.hpp"
#include "link/can.hpp"
#include "link/capture.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

namespace config = canopen::config;

struct Row {
    can_timing::Message message;
    std::string name;
    std::size_t line = 0;  ///< 0: none, of a recording
};

struct Table {
    can_timing::Bus bus;
    std::vector<Row> rows;  ///< highest priority first
    std::string notes;  ///< lines below the table
    bool queues = false;  ///< a node sends in order of arrival
};

Table table_of(const config::Schedule& schedule) {
    Table table{schedule.bus, {}, {}};
    for (std::size_t i = 0; i < schedule.messages.size(); ++i) {
        table.rows.push_back({schedule.messages[i], schedule.names[i], schedule.spans[i].line});

        table.queues = table.queues || schedule.messages[i].fifo != 0;
    }
    std::stable_sort(table.rows.begin(), table.rows.end(), [](const Row& a, const Row& b) {
        return can_timing::before(a.message, b.message);
    });
    if (schedule.sync > 0) {
        table.notes =
            fmt::format("{} frames with each SYNC of {:g} ms take {:.3f} ms at most: {:.1f} %\n",
                        schedule.per_sync, static_cast<double>(schedule.sync) / 1e6,
                        schedule.sync_share * static_cast<double>(schedule.sync) / 1e6,
                        100 * schedule.sync_share);
    }
    return table;
}

/// Returns the messages of a recording. `problem` is set when there are none.
Table table_of(const can::Capture& capture, std::uint32_t bit_rate, std::string& problem) {
    Table table{{bit_rate, 0, {}}, {}, {}, false};
    std::size_t irregular = 0;
    std::size_t once = 0;
    for (const can_timing::Recorded& r : can_timing::recorded(capture.frames)) {
        if (r.message.period == 0) {
            ++once;
            continue;
        }
        irregular += !r.periodic;
        table.rows.push_back(
            {r.message, fmt::format("{} frames{}", r.frames, r.periodic ? "" : ", irregular"), 0});
    }
    if (irregular != 0) {
        table.notes += fmt::format(
            "{} irregular: their period is the shortest distance between two frames\n", irregular);
    }
    if (once != 0) {
        table.notes += fmt::format("{} seen once: not counted\n",
                                   counted(once, "identifier was", "identifiers were"));
    }
    if (table.rows.empty()) {
        problem = "no message is in it twice: record for longer";
    }
    return table;
}

/// Formats milliseconds with fixed digits, for columns.
std::string ms(std::int64_t ns) {
    return ns < 0 ? "endless" : fmt::format("{:.3f}", static_cast<double>(ns) / 1e6);
}

std::string id_of(const can_timing::Message& m) {
    return fmt::format("{:0{}X}", m.id, m.extended ? 8 : 3);
}
std::string called(const Row& row) {
    return row.name.empty() ? id_of(row.message)
                            : fmt::format("{} ({})", id_of(row.message), row.name);
}

std::string length_text(const can_timing::Message& m) {
    if (m.remote) return "R";
    const char* const form = m.bit_rate_switch ? "brs" : "fd";
    return fmt::format("{}{}", m.bytes, m.fd || m.bit_rate_switch ? form : "");
}

std::string used_text(const can_timing::Message& m, const can_timing::Response& r) {
    if (r.worst < 0) return "-";
    return fmt::format("{:.0f} %",
                       100.0 * static_cast<double>(r.worst) / static_cast<double>(m.limit()));
}

std::string load_text(const Table& table, const can_timing::Analysis& a) {
    std::string text = fmt::format("{} messages at {} bit/s: load {:.1f} % with all stuff bits",
                                   table.rows.size(), table.bus.bit_rate, 100 * a.load);
    const can_timing::Errors& errors = table.bus.errors;
    if (errors.burst == 0) return text;
    text += fmt::format("; errors: {} at once", errors.burst);
    if (errors.period != 0) {
        text += fmt::format(" and 1 in every {} ms", ms(errors.period));
    }
    return text;
}

std::string table_text(const Table& table, const can_timing::Analysis& a) {
    TextTable rows({{"id", 8},
                    {"bytes", 6},
                    {"bits", 5},
                    {"period ms", 10},
                    {"deadline", 10},
                    {"worst", 10},
                    {"used", 6},
                    {"", 0, true}});
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
        const can_timing::Message& m = table.rows[i].message;
        const can_timing::Response& r = a.responses[i];
        rows.add({id_of(m), length_text(m), fmt::format("{}", r.bits), ms(m.period), ms(m.limit()),
                  ms(r.worst), used_text(m, r), (r.in_time ? "" : "LATE ") + table.rows[i].name});
    }
    return rows.text() + table.notes + load_text(table, a) + "\n";
}

/// Returns the response times, with their deadlines.
Timeline timeline_of(const Table& table, const can_timing::Analysis& a) {
    Timeline timeline;
    timeline.command = "hal canopen plan";
    timeline.title = load_text(table, a);
    timeline.response_title = "Worst-case response time of each message and its deadline, ms";
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
        const can_timing::Response& r = a.responses[i];
        ResponseTime one;
        one.name = fmt::format("{} {}", id_of(table.rows[i].message), table.rows[i].name);
        one.worst_ns = r.worst;
        one.colour = r.in_time ? Colour::leader : Colour::compared;
        one.deadline_ns = table.rows[i].message.limit();
        timeline.responses.push_back(std::move(one));
    }
    timeline.summary = {"Red lines: deadlines. Red bars: messages that may miss them."};
    std::istringstream notes(table.notes);
    for (std::string line; std::getline(notes, line);) {
        timeline.summary.push_back(line);
    }
    return timeline;
}

/// Explains a late message of a bus whose nodes send in order of arrival.
std::string late_in_queue(const Row& row, std::int64_t worst_ns) {
    const std::string needed = worst_ns < 0 ? "more than the bus has" : ms(worst_ns) + " ms";
    const bool is_within_deadline =
        worst_ns > row.message.period && worst_ns <= row.message.limit();
    if (is_within_deadline) {
        return fmt::format(
            "{} needs {}, more than its period: with queues in order of arrival nothing is known "
            "then",
            called(row), needed);
    }
    return fmt::format("{} needs {}, deadline {} ms", called(row), needed, ms(row.message.limit()));
}

/// Explains a message for which the ones before it leave no time.
std::string never_sent(const Row& row, const std::vector<can_timing::Message>& messages,
                       const can_timing::Analysis& a, std::size_t i) {
    double use = 0;
    for (std::size_t k = 0; k < messages.size(); ++k) {
        if (k == i || can_timing::before(messages[k], messages[i])) {
            use +=
                static_cast<double>(a.responses[k].frame) / static_cast<double>(messages[k].period);
        }
    }
    return fmt::format(
        "{} may never be sent: with the messages before it, it needs {:.1f} % of the bus time",
        called(row), 100 * use);
}

/// Explains the response time of a late message.
std::string why_late(const Table& table, const std::vector<can_timing::Message>& messages,
                     const can_timing::Analysis& a, std::size_t i) {
    const can_timing::Response& r = a.responses[i];
    const Row& row = table.rows[i];
    if (table.queues) return late_in_queue(row, r.worst);
    if (r.worst < 0) return never_sent(row, messages, a, i);
    std::string text = fmt::format("{} needs {} ms, deadline {} ms:", called(row), ms(r.worst),
                                   ms(row.message.limit()));
    if (r.errors > 0) {
        text += fmt::format(" {} for errors +", ms(r.errors));
    }
    if (r.blocker) {
        text += fmt::format(" {} for {} already on the bus +", ms(r.blocking),
                            id_of(messages[*r.blocker]));
    }
    if (r.instance > 0) {
        text += fmt::format(" {} for {} earlier instances of itself +", ms(r.instance * r.frame),
                            r.instance);
    }
    for (std::size_t k = 0; k < messages.size(); ++k) {
        if (k == i || !can_timing::before(messages[k], messages[i])) continue;
        const std::int64_t times = can_timing::times_before(messages[k], r.queued, table.bus);
        text +=
            fmt::format(" {} x {} for {} +", times, ms(a.responses[k].frame), id_of(messages[k]));
    }
    text += fmt::format(" {} for itself", ms(r.frame));
    if (row.message.jitter > 0) {
        text += fmt::format(" + {} jitter", ms(row.message.jitter));
    }
    if (r.instance > 0) {
        text += fmt::format(" - {} since it was due", ms(r.instance * row.message.period));
    }
    return text;
}

/// Suggests changes, best first.
std::string help_text(const Table& table, const std::vector<can_timing::Message>& messages) {
    std::string text;
    if (const auto rate = can_timing::sufficient_bit_rate(messages, table.bus)) {
        text += fmt::format("  = help: with bitrate = {} every message meets its deadline\n",
                            *rate == 1'000'000 ? "1M" : fmt::format("{}k", *rate / 1000));
    }
    if (const auto order = can_timing::sufficient_order(messages, table.bus); !order.empty()) {
        text +=
            "  = help: with identifiers in this order, lowest first, every message meets its "
            "deadline:";
        for (const std::size_t i : order) {
            text += fmt::format(" {}", id_of(messages[i]));
        }
        text += "\n";
    }
    for (std::int64_t percent = 110; percent <= 1000; percent += 10) {
        std::vector<can_timing::Message> slower = messages;
        for (can_timing::Message& m : slower) {
            m.deadline = m.limit();
            m.period = m.period * percent / 100;
        }
        if (!can_timing::analyse(slower, table.bus).fits) continue;
        return text + fmt::format(
                          "  = help: with every period {} % longer and unchanged deadlines, every "
                          "message meets its deadline\n",
                          percent - 100);
    }
    return text + "  = help: combine values in one message, remove messages, or use a second bus\n";
}

std::string json_text(const Table& table, const can_timing::Analysis& a) {
    std::string text = fmt::format(R"({{"bitrate":{},"load":{:.6f},"fits":{},"messages":[)",
                                   table.bus.bit_rate, a.load, a.fits);
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
        const can_timing::Response& r = a.responses[i];
        const can_timing::Message& m = table.rows[i].message;
        text += fmt::format(
            R"({}{{"id":{},"extended":{},"bits":{},"frame_ns":{},"period_ns":{},"deadline_ns":{},"blocking_ns":{},"worst_ns":{},"in_time":{}}})",
            i == 0 ? "\n " : ",\n ", m.id, m.extended, r.bits, r.frame, m.period, m.limit(),
            r.blocking, r.worst < 0 ? "null" : fmt::format("{}", r.worst), r.in_time);
    }
    return text + "]}\n";
}

/// Reads the configuration and prints its errors and warnings. Returns 0 when it is valid.
int read_configuration(const Options& options, const std::string& file,
                       config::ReadResult& reading) {
    std::string text;
    if (!config::read_from_disk(file, text)) {
        return fail(options, fmt::format("cannot read '{}': {}", file, text));
    }
    reading = config::read(text, file);
    const auto code = [](const config::Message& m) {
        return Code::named(config::code_of(m.topic)).value_or(Code("canopen-line"));
    };
    return print_findings(file, text, reading.messages, code) ? 0 : 1;
}

const char* word(config::PinType type) {
    constexpr const char* words[] = {"s32", "bit", "s32", "u32", "s64", "u64", "float"};
    return words[static_cast<std::size_t>(type)];
}

std::string pin_text(const config::Node& node, const config::Object& object, bool to_node) {
    std::string text;
    const auto line = [&](const std::string& name, const char* type, const std::string& about) {
        text += fmt::format("    {:<5} {} {}.{}  {}\n", type, to_node ? "in " : "out", node.name,
                            name, about);
    };
    std::string about = fmt::format("{:04X}", object.index) +
                        (object.sub != 0 ? fmt::format(":{}", object.sub) : "") + " " +
                        printable(object.about);
    if (object.scale != 1.0 || object.offset != 0.0) {
        about += fmt::format(", {:g} to one{}{}", object.scale, object.unit.empty() ? "" : " ",
                             object.unit);
    } else if (!object.unit.empty()) {
        about += ", " + object.unit;
    }
    for (const config::BitPin& b : object.bit_pins) {
        line(b.name, "bit", fmt::format("{}, bit {}", about, b.bit));
    }
    if (object.bit_pins.empty()) {
        line(object.pin, word(object.as), about);
    }
    return text;
}

std::string transmission_text(const config::Pdo& pdo) {
    if (pdo.multiplexed()) return "multiplexed: one object at a time, when it changes";
    if (pdo.request != 0) {
        return fmt::format("requested every {} ms", pdo.request / canopen::millisecond);
    }
    if (pdo.transmission == 0) return "with the SYNC when changed";
    if (pdo.transmission == 1) return "with every SYNC";
    if (pdo.transmission <= 240) {
        return fmt::format("with every SYNC number {}", pdo.transmission);
    }
    return pdo.event_ms != 0 ? fmt::format("when changed and every {} ms", pdo.event_ms)
                             : "when changed";
}

std::string network_text(const std::string& file, const config::MasterConfig& c) {
    std::string text = fmt::format("{}: {} at {} bit/s, master {}, {}\n", file, c.link, c.bit_rate,
                                   c.node_id, counted(c.nodes.size(), "node"));
    for (const config::Node& n : c.nodes) {
        text += fmt::format("node {} {}, {}\n", n.setup.id, n.name,
                            n.setup.mandatory ? "mandatory" : "optional");
        for (const config::Pdo& p : n.pdos) {
            if (p.safety) {
                text += fmt::format(
                    "  {}{} {:X} and {:X}, {} bytes plain and inverted, every {} ms; SCT {} ms, "
                    "SRVT {} ms\n",
                    p.to_node ? "rsrdo" : "tsrdo", p.number, p.cob, p.cob + 1, p.bytes(),
                    p.safety->refresh / canopen::millisecond, p.safety->sct / canopen::millisecond,
                    p.safety->srvt / canopen::millisecond);
            } else {
                text += fmt::format("  {}{} {:X}, {}, {}\n", p.to_node ? "rpdo" : "tpdo", p.number,
                                    canopen::cob_id(p.cob), counted(p.bytes(), "byte"),
                                    transmission_text(p));
            }
            for (const config::Object& o : p.objects) {
                if (!o.filler) {
                    text += pin_text(n, o, p.to_node);
                }
            }
        }
    }
    return text;
}

}  // namespace

namespace {

/// Prints the table, or what is late and what to change. `help` comes first then. Returns the exit
/// code.
int report_plan(const CanopenPlanOptions& options, const std::string& file, const Table& table,
                const std::string& help) {
    std::vector<can_timing::Message> messages;
    for (const Row& row : table.rows) {
        messages.push_back(row.message);
    }
    const can_timing::Analysis a = can_timing::analyse(messages, table.bus);
    if (!options.svg.empty()) {
        const Timeline timeline = timeline_of(table, a);
        if (const int status = write_picture(options, options.svg, options.json, timeline);
            status != 0) {
            return status;
        }
    } else if (!print(options.json ? json_text(table, a) : table_text(table, a))) {
        return 1;
    }
    if (a.fits) return 0;
    constexpr std::size_t max_explained = 3;
    std::string text;
    std::size_t late = 0;
    for (std::size_t i = 0; i < messages.size(); ++i) {
        if (a.responses[i].in_time) continue;
        ++late;
        if (late > max_explained) continue;
        const std::string location =
            table.rows[i].line == 0 ? file : fmt::format("{}:{}", file, table.rows[i].line);
        text += fmt::format("{}: {}\n", location, why_late(table, messages, a, i));
    }
    if (late > max_explained) {
        text += fmt::format("{}: {} more are late\n", file, late - max_explained);
    }
    write_all(STDERR_FILENO, text + help + help_text(table, messages));
    return 1;
}

/// Parses "1/10ms" or "3".
std::optional<can_timing::Errors> errors_of(const std::string& text) {
    const std::size_t slash = text.find('/');
    const auto burst = parse_natural(text.substr(0, slash));
    if (!burst || *burst < 1 || *burst > 1000) return std::nullopt;
    can_timing::Errors errors{static_cast<std::uint32_t>(*burst), 0};
    if (slash != text.npos) {
        const auto period = parse_duration_ns(text.substr(slash + 1));
        if (!period || *period < 1000) return std::nullopt;
        errors.period = *period;
    }
    return errors;
}

/// Reads a recording. Returns false after printing what is wrong.
bool read_recording(const CanopenPlanOptions& options, const std::string& file, Table& table) {
    if (options.bitrate.empty()) {
        fail(options, fmt::format("{}: a recording does not contain the bit rate; type: hal "
                                  "canopen plan {} --bitrate 500k",
                                  file, file));

        return false;
    }
    const auto rate = config::rate(options.bitrate);
    if (!rate) {
        fail(options,
             fmt::format("invalid --bitrate '{}'; write 500k, 1M or 125000", options.bitrate));

        return false;
    }
    const can::Capture capture = can::read_capture(file);
    if (!capture.problem.empty() && capture.frames.empty()) {
        fail(options, fmt::format("{}: {}", file, capture.problem));
        return false;
    }
    if (!capture.problem.empty()) {
        write_all(STDERR_FILENO, fmt::format("warning: {}: {}\n", file, capture.problem));
    }
    std::string problem;
    table = table_of(capture, *rate, problem);
    if (!problem.empty()) {
        fail(options, fmt::format("{}: {}", file, problem));
        return false;
    }
    return true;
}

int plan_recording(const CanopenPlanOptions& options, const std::string& file,
                   const can_timing::Errors& errors) {
    if (!options.cycle.empty()) {
        return fail(options, "--cycle is for configurations; a recording has its own SYNCs");
    }
    Table table;
    if (!read_recording(options, file, table)) return 1;
    table.bus.errors = errors;
    return report_plan(options, file, table, "");
}

int plan_configuration(const CanopenPlanOptions& options, const std::string& file,
                       const can_timing::Errors& errors) {
    if (!options.bitrate.empty()) {
        return fail(
            options,
            fmt::format(
                "--bitrate is for recordings; for {} write `bitrate = {}` in its section [bus]",
                file, options.bitrate));
    }
    config::ReadResult reading;
    if (const int status = read_configuration(options, file, reading); status != 0) return status;
    if (const std::string& link = reading.config.link; !can::describe(link).has_bit_rate) {
        return fail(
            options,
            fmt::format(
                "{} uses Ethernet ({}), where identifiers do not arbitrate; for its schedule type: "
                "hal tdma plan FILE.tdma",
                file, link));
    }
    const std::string period = options.cycle.empty() ? "1ms" : options.cycle;
    const auto cycle = parse_duration_ns(period);
    if (!cycle || *cycle < 1000) {
        return fail(options, fmt::format("invalid --cycle '{}'; write --cycle 1ms", options.cycle));
    }
    const bool syncs_every_cycle =
        reading.config.sync != config::SyncMode::none && reading.config.sync_period == 0;
    if (!syncs_every_cycle && !options.cycle.empty()) {
        return fail(options, fmt::format("--cycle has no effect: {} sends no SYNC in every cycle; "
                                         "delete --cycle, or write `sync = cycle` in [bus]",
                                         file));
    }
    std::string help;
    if (syncs_every_cycle) {
        help = fmt::format(
            "  = help: the SYNC is sent every cycle of the thread, assumed to be {}; for another "
            "period add: --cycle 2ms\n",
            period);
    }
    Table table = table_of(config::schedule_of(reading.config, *cycle));
    table.bus.errors = errors;
    return report_plan(options, file, table, help);
}

}  // namespace

int run_canopen_plan(const CanopenPlanOptions& options) {
    const std::string& file = options.words[0];
    can_timing::Errors errors;
    if (!options.errors.empty()) {
        const auto given = errors_of(options.errors);
        if (!given) {
            return fail(options, fmt::format("invalid --errors '{}'; write --errors 1/10ms",
                                             options.errors));
        }
        errors = *given;
    }
    const bool is_recording =
        file.ends_with(".log") || file.ends_with(".pcapng") || file.ends_with(".pcap");
    return is_recording ? plan_recording(options, file, errors)
                        : plan_configuration(options, file, errors);
}

int run_canopen_check(const CanopenCheckOptions& options) {
    int status = 0;
    for (const std::string& file : options.words) {
        config::ReadResult reading;
        if (const int one = read_configuration(options, file, reading); one != 0) {
            status = one;
        } else if (!print(network_text(file, reading.config))) {
            return 1;
        }
    }
    return status;
}

}  // namespace hal::tools
