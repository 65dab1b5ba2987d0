// SPDX-License-Identifier: MIT
// `hal scocan plan`: the table of a CAN bus with time slots as a timeline, its utilisation, and the worst-case latency of each message with its
// calculation, beside that on plain CAN; or as a picture.
#include "bus/scocan/plan.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <optional>
#include <utility>

#include "bus/scocan/plan_picture.hpp"
#include "bus/timeline/letter_strip.hpp"
#include "bus/timeline/plan_output.hpp"
#include "bus/timeline/text_table.hpp"
#include "hal/read_file.hpp"
#include "link/timing.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

using namespace scocan;
using plan::Latency;

std::string ms(Time t) {
    return t < 0 ? "unbounded" : fmt::format("{:.3f}", static_cast<double>(t) / 1e6);
}

std::string node_list(const Table& t) {
    std::string text;
    for (const Node& n : t.nodes) {
        append_item(text, n.name);
        if (n.role != Role::node) {
            text += fmt::format(" ({}{})", to_string(n.role),
                                n.role == Role::backup ? fmt::format(" {}", n.backup) : "");
        } else if (!n.senses) {
            text += " (type B)";
        }
    }
    return text;
}

/// A letter per node; | SYNC, . shared.
char mark_of(const std::vector<Use>& uses) {
    if (uses.empty()) return '.';
    switch (uses.front().kind) {
    case Kind::shared: return '.';
    case Kind::sync: return '|';
    case Kind::priv: break;
    }
    return strip_letter(uses.front().node);
}

std::string timeline_text(const Table& t, const Mode& m) {
    std::string line;
    std::vector<bool> used(t.nodes.size());
    for (const auto& uses : m.slots) {
        line += mark_of(uses);
        for (const Use& one : uses) {
            if (one.kind == Kind::priv) {
                used[one.node] = true;
            }
        }
    }
    std::vector<std::string> names;
    for (const Node& node : t.nodes) {
        names.push_back(node.name);
    }
    const std::string key = strip_key(names, used);
    return fmt::format("{}\n| SYNC, . shared{}{}\n", line, key.empty() ? "" : ", ", key);
}

std::string identifiers(const Use& use) {
    if (use.kind == Kind::sync) return "0x000";
    std::string ids;
    for (const std::uint32_t id : use.ids) {
        append_item(ids, scocan::id_text(id), " ");
    }
    if (ids.empty()) {
        ids = "any";
    }
    return use.every > 1 ? ids + fmt::format(", cycles {} of {}", use.offset, use.every) : ids;
}

std::string slots_text(const Table& t, const Mode& m) {
    TextTable table({{"slot", 4},
                     {"from us", 9},
                     {"use", 10, true},
                     {"node", 16, true, " "},
                     {"identifiers", 0, true, " "}});
    for (std::uint32_t slot = 0; slot < t.slots; ++slot) {
        for (const Use& u : m.slots[slot]) {
            if (u.kind == Kind::shared) continue;
            const std::string node = u.kind == Kind::priv ? t.nodes[u.node].name : "";
            table.add({fmt::format("{}", slot),
                       fmt::format("{:g}", static_cast<double>(t.slot() * slot) / 1e3),
                       std::string(to_string(u.kind)), node, identifiers(u)});
        }
    }
    return table.text();
}

std::string latencies_text(const Table& t, const plan::Plan& p) {
    TextTable table({{"id", 7, true},
                     {"message", 16, true, " "},
                     {"bytes", 5, false, " "},
                     {"slots", 8, true, " "},
                     {"deadline", 9, false, " "},
                     {"worst ms", 9, false, " | "},
                     {"jitter", 9, false, " "},
                     {"worst ms", 9, false, " | "},
                     {"jitter", 9, false, " "},
                     {"", 0, true}});
    table.add_text(fmt::format("{:>50}| {:^19} | {:^19}", "", "with slots", "plain CAN"));
    for (const Latency& l : p.latencies) {
        const Message& m = t.messages[l.message];
        table.add({scocan::id_text(m.id), m.name, fmt::format("{}", m.bytes),
                   l.priv ? "private" : "shared", ms(l.deadline), ms(l.worst), ms(l.jitter),
                   ms(l.plain), ms(l.plain_jitter), l.in_time ? "" : "LATE"});
    }
    return table.text();
}

/// Returns why a message has no worst case.
const char* unbounded_reason(const Message& m, const Latency& l) {
    if (m.period <= 0) return "no period: write `period T` or `event T` behind it";
    if (l.priv) return "its slot has no turn";
    return "unbounded: the shared slots do not carry it with the messages before it within its "
           "period";
}

/// Explains the worst case of a message.
std::string arithmetic(const Table& t, const Latency& l) {
    const Message& m = t.messages[l.message];
    std::string text = fmt::format("{} {}: ", scocan::id_text(m.id), m.name);
    if (l.worst < 0) return text + unbounded_reason(m, l);
    if (m.jitter > 0) {
        text += fmt::format("{} jitter + ", ms(m.jitter));
    }
    if (l.priv) {
        text += fmt::format(
            "{} to the next turn of its slot{} + {} guard + {} frame", ms(l.gap * l.turns),
            l.turns > 1 ? fmt::format(" ({} identifiers x {})", l.turns, ms(l.gap)) : "",
            ms(t.guard), ms(l.frame));
    } else {
        text += fmt::format(
            "queued in the slot at {}: {} without a usable shared slot + {} of higher priority + "
            "{} guard + {} frame",
            ms(l.released), ms(l.waiting), ms(l.interference), ms(t.guard), ms(l.frame));
    }
    return text + fmt::format(" = {} ms", ms(l.worst));
}

/// Explains why a message is late, and what to change.
std::pair<std::string, std::string> reason(const Table& t, const Latency& l) {
    const Message& m = t.messages[l.message];
    if (l.worst < 0) {
        return {
            "",
            "give it a private slot, use more shared slots, a higher bit rate, or a longer period"};
    }
    const Time turn = l.gap * l.turns;
    std::string why;
    if (l.worst > l.deadline) {
        why += fmt::format(", deadline {} ms", ms(l.deadline));
    }
    if (!l.priv) {
        return {
            why,
            "give it a private slot, use more shared slots, a higher bit rate, or a longer period"};
    }
    if (m.period > 0 && turn > m.period) {
        why += fmt::format(", period {} ms is shorter than {} ms between two turns", ms(m.period),
                           ms(turn));
    }
    return {why, "give it more private slots, a shorter cycle, or a longer period and deadline"};
}

std::string text_of(const Table& t, const plan::Plan& p) {
    const Mode& m = *t.mode(p.mode);
    std::string text = fmt::format(
        "cycle {:g} ms, {} slots of {:g} us at {} bit/s; guard {}, idle {}; CRC {:04X}\n",
        static_cast<double>(t.cycle) / 1e6, t.slots, static_cast<double>(t.slot()) / 1e3,
        t.bit_rate, microseconds(t.guard), microseconds(t.idle), t.crc);
    text += fmt::format("nodes: {}\nmode {} ({})\n\n", node_list(t), m.number, m.name) +
            slots_text(t, m) + "\n" + timeline_text(t, m) + "\n";
    const auto frames = [&](Time first) {
        const Time space = t.last_start(8) - first;
        return space < 0 ? 0 : space / t.frame(8) + 1;
    };
    text += fmt::format(
        "private messages {:.1f} %, shared messages {:.1f} % of {:.1f} % that the {} shared slots "
        "carry; plain CAN {:.1f} %\n",
        100 * p.private_load, 100 * p.shared_load, 100 * p.capacity, p.shared_slots,
        100 * p.plain_load);
    text += fmt::format(
        "frames of 8 bytes in a shared slot: {}; in an idle private slot: {} by nodes of type A, "
        "{} by type B\n",
        frames(0), frames(t.idle + t.guard), frames(t.idle + t.guard + t.bits(61)));
    text += fmt::format("SYNC lost: nodes coast for {} cycles, {:g} ms\n\n", t.lost,
                        static_cast<double>(t.cycle * t.lost) / 1e6);
    text += latencies_text(t, p) + "\n";
    for (const Latency& l : p.latencies) {
        text += arithmetic(t, l) + "\n";
    }
    return text;
}

std::string json_text(const Table& t, const plan::Plan& p) {
    std::string text = fmt::format(
        R"({{"bitrate":{},"cycle_ns":{},"slot_ns":{},"guard_ns":{},"idle_ns":{},"crc":{},"mode":{},"private_load":{:.6f},"shared_load":{:.6f},"capacity":{:.6f},"plain_load":{:.6f},"fits":{},"slots":[)",
        t.bit_rate, t.cycle, t.slot(), t.guard, t.idle, t.crc, p.mode, p.private_load,
        p.shared_load, p.capacity, p.plain_load, p.fits);
    bool first = true;
    for (std::uint32_t slot = 0; slot < t.slots; ++slot) {
        for (const Use& u : t.mode(p.mode)->slots[slot]) {
            std::string ids;
            for (const std::uint32_t id : u.ids) {
                append_item(ids, std::to_string(id), ",");
            }
            text += fmt::format(
                R"({}{{"slot":{},"use":"{}","node":{},"ids":[{}],"every":{},"offset":{}}})",
                std::exchange(first, false) ? "\n " : ",\n ", slot, to_string(u.kind),
                u.kind == Kind::priv ? fmt::format("\"{}\"", t.nodes[u.node].name) : "null", ids,
                u.every, u.offset);
        }
    }
    text += "],\"messages\":[";
    first = true;
    const auto value = [](Time ns) { return ns < 0 ? std::string("null") : fmt::format("{}", ns); };
    for (const Latency& l : p.latencies) {
        const Message& m = t.messages[l.message];
        text += fmt::format(
            R"({}{{"id":{},"name":"{}","private":{},"deadline_ns":{},"worst_ns":{},"jitter_ns":{},"in_time":{},"plain_worst_ns":{},"plain_jitter_ns":{}}})",
            std::exchange(first, false) ? "\n " : ",\n ", m.id, m.name, l.priv, l.deadline,
            value(l.worst), value(l.jitter), l.in_time, value(l.plain), value(l.plain_jitter));
    }
    return text + "]}\n";
}

std::optional<std::uint32_t> find_mode(const Table& t, const std::string& which) {
    if (which.empty()) return 0;
    const auto number = parse_natural(which);
    for (const Mode& m : t.modes) {
        if (m.name == which || (number && m.number == *number)) return m.number;
    }
    return {};
}

}  // namespace

int run_scocan_plan(const ScocanPlanOptions& options) {
    const std::string& file = options.words[0];
    std::string text;
    if (!read_regular_file(file, 1'000'000, text)) {
        return fail(options, fmt::format("cannot read '{}': {}", file, text));
    }
    const ReadResult reading = scocan::read(text);
    const auto code = [](const Report& m) {
        return Code::named(code_of(m.topic)).value_or(Code("scocan-line"));
    };
    if (!print_findings(file, text, reading.messages, code)) return 1;
    const Table& t = reading.table;
    const auto mode = find_mode(t, options.mode);
    if (!mode) {
        std::string all;
        for (const Mode& m : t.modes) {
            append_item(all, fmt::format("{} ({})", m.number, m.name));
        }
        return fail(options,
                    fmt::format("unknown mode '{}'; modes of {}: {}", options.mode, file, all));
    }
    const plan::Plan p = plan::plan_of(t, *mode);
    if (!options.svg.empty()) {
        const Timeline timeline = timeline_of(t, p);
        const int status = write_picture(options, options.svg, options.json, timeline);
        if (status != 0) return status;
    } else if (!print(options.json ? json_text(t, p) : text_of(t, p))) {
        return 1;
    }
    if (p.fits) return 0;
    std::vector<Report> late;
    for (const Latency& l : p.latencies) {
        if (l.in_time) continue;
        const auto [why, help] = reason(t, l);
        late.push_back({Severity::error, Topic::slots, t.messages[l.message].at,
                        "late message " + arithmetic(t, l) + why, help});
    }
    print_findings(file, text, late, code);
    return 1;
}

}  // namespace hal::tools
