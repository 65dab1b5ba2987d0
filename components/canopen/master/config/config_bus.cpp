// SPDX-License-Identifier: MIT
// The sections [bus] and [messages].
#include <algorithm>

#include "config_sections.hpp"

namespace hal::canopen::config {

namespace {

constexpr bus::Choice<AtStop> stops[] = {{"nothing", AtStop::nothing},
                                         {"pre-operational", AtStop::pre_operational},
                                         {"stopped", AtStop::stopped}};
constexpr bus::Choice<bool> starts[] = {{"each", false}, {"together", true}};
constexpr bus::Choice<bool> clocks[] = {{"sync", true}, {"own", false}};

/// A priority of a flying master; none: it is not one.
constexpr bus::Choice<std::optional<std::uint8_t>> priorities[] = {
    {"no", std::nullopt}, {"high", 0}, {"medium", 1}, {"low", 2}};

bool read_sync(MasterConfig& to, const Line& line) {
    const std::string word = lower(line.value.text);
    const auto words = words_of(line.value);
    const bool follows = lower(words[0].text) == "follow";
    if (word == "none" || word == "no") {
        to.sync = SyncMode::none;
        return true;
    }
    if (word == "cycle" || word == "follow") {
        to.sync = follows ? SyncMode::follow : SyncMode::cycle;
        return true;
    }
    const auto followed = words.size() == 2 && follows ? duration(words[1].text) : std::nullopt;
    if (followed && *followed > 0) {
        to.sync = SyncMode::follow;
        to.sync_period = *followed;
        return true;
    }
    const auto time = duration(word);
    if (!time || *time < 100 * microsecond || *time > 60 * second) return false;
    to.sync = SyncMode::timed;
    to.sync_period = *time;
    return true;
}

bool read_flying(MasterConfig& to, const Line& line) {
    std::optional<std::uint8_t> priority;
    const auto get = [&](MasterConfig&) -> auto& { return priority; };
    if (!bus::choice(get, priorities).parse(to, line)) return false;
    to.flying.enabled = priority.has_value();
    to.flying.priority = priority.value_or(to.flying.priority);
    return true;
}

template <class T>
auto of_master(T MasterSetup::* member) {
    return [member](MasterConfig& config) -> T& { return config.master.*member; };
}
template <class T>
auto of_flying(T FlyingSetup::* member) {
    return [member](MasterConfig& config) -> T& { return config.flying.*member; };
}
std::int64_t& sdo_timeout(MasterConfig& config) { return config.master.sdo.timeout; }
auto& sdo_resends(MasterConfig& config) { return config.master.sdo.resends; }

const bus::KeyTable<MasterConfig>& bus_keys() {
    using C = MasterConfig;
    using F = FlyingSetup;
    static const bus::KeyTable<MasterConfig> table{{
        {"link", bus::text_value(&C::link, "ADDRESS"), "`sim:canopen`",
         "`can:can0`, `sim:NAME`, `udp:…`, `slcan:…`, `replay:…`; see `drivers/README.md`"},
        {"bitrate", bus::bit_rate(&C::bit_rate, 5e3, 1e6), "`1M`",
         "bit rate; set on a `sim:` bus, checked on all others"},
        {"datarate", bus::bit_rate(&C::data_rate, 5e3, 20e6), "none",
         "data bit rate of the CAN FD frames in `[messages]`, for the plan"},
        {"node-id", bus::number(&C::node_id, 1, 127), "`127`", "node ID of the master"},
        {"sync",
         bus::own("cycle, a time such as 2ms, follow, follow 2ms, or none",
                  "cycle, 100us..60s, follow, follow 2ms, none", &read_sync),
         "`none`",
         "SYNC source. `cycle`: the master sends a SYNC in every cycle of the thread; a time: the "
         "master sends it with this period, preferably a multiple of the thread's; `follow` or "
         "`follow 2ms`: another node sends it; `none`: no SYNC"},
        {"clock", bus::choice(&C::sync_clock, clocks), "`sync`",
         "with `sync = follow`: `sync` synchronises the threads of the machine to the SYNC; `own` "
         "leaves them on their own clock"},
        {"sync-phase", bus::time(&C::sync_phase, 0, 60 * second), "half a period",
         "with `sync = follow`: time from the SYNC to the start of the thread's cycle"},
        {"sync-counter", bus::number(&C::sync_counter, 2, 240), "none",
         "highest value of the SYNC counter, which starts at 1; also written to 1019h of the nodes "
         "that have it"},
        {"sync-window", bus::time(&C::sync_window, microsecond, 60 * second), "none",
         "synchronous window length (object 1007h)"},
        {"sync-cob-id", bus::number(&C::sync_cob, 1, 0x7ff), "`0x80`",
         "COB-ID of the SYNC (object 1005h)"},
        {"sync-at-boot", bus::flag(&C::sync_at_boot), "`no`",
         "`yes`: the master sends SYNC from the first cycle on; `no`: once all mandatory nodes are "
         "configured. Always `yes` if a node has `keep-alive`"},
        {"time", bus::time(&C::time_period, 10 * millisecond, 3600 * second).or_none(), "`none`",
         "TIME period"},
        {"heartbeat",
         bus::time(&C::heartbeat_ms, millisecond, 65535 * millisecond).or_none().in(millisecond),
         "`100ms`", "heartbeat period of the master, which the nodes monitor, see `watch-master`"},
        {"on-stop", bus::choice(&C::at_stop, stops), "`pre-operational`",
         "NMT state of the nodes when the machine stops, after their safe values are sent"},
        {"sdo-timeout", bus::time(&sdo_timeout, millisecond, 60 * second), "`500ms`",
         "SDO response timeout"},
        {"sdo-retries", bus::number(&sdo_resends, 0, 20), "`2`", "number of SDO retries"},
        {"nmt-inhibit", bus::time(of_master(&MasterSetup::nmt_inhibit), 0, second).or_none(),
         "`none`", "minimum interval between two NMT commands"},
        {"parallel", bus::number(of_master(&MasterSetup::parallel), 0, 127), "`0`",
         "maximum number of nodes booted at the same time; 0: all"},
        {"resets", bus::number(of_master(&MasterSetup::resets), 0, 1000), "`3`",
         "number of `reset-all` reactions after which the network is stopped instead"},
        {"reset-at-start", bus::flag(of_master(&MasterSetup::reset_at_start)), "`yes`",
         "resets the communication of all nodes before they are booted"},
        {"start", bus::choice(of_master(&MasterSetup::start_all_at_once), starts), "`each`",
         "`each`: the master starts each node as soon as it is ready; `together`: all at once"},
        {"flying-master",
         bus::own("no, high, medium or low", "no, high, medium, low", &read_flying), "`no`",
         "makes this master one of several ([below](#flying-master)), with this priority"},
        {"flying-timeout", bus::time(of_flying(&F::timeout), millisecond, 60 * second), "`100ms`",
         "response timeout of the request for the active master (1F90h:1)"},
        {"flying-delay", bus::time(of_flying(&F::delay), 0, 60 * second), "`500ms`",
         "delay before the first request, and before a negotiation forced with 076h (1F90h:2)"},
        {"flying-priority-slot", bus::time(of_flying(&F::priority_slot), millisecond, 60 * second),
         "`1500ms`", "time slot per priority level; longer than 127 device slots (1F90h:4)"},
        {"flying-device-slot", bus::time(of_flying(&F::device_slot), 10 * microsecond, second),
         "`10ms`", "time slot per node ID (1F90h:5)"},
        {"flying-detect", bus::time(of_flying(&F::detect_cycle), 100 * millisecond, 3600 * second),
         "4 s + 10 ms · node ID",
         "interval at which an active master searches for others (1F90h:6)"},
        {"flying-silence", bus::time(of_flying(&F::silence), millisecond, 60 * second),
         "2.5 own heartbeats", "heartbeat timeout of the active master"},
    }};
    return table;
}

/// Reports keys of a master that follows the SYNC of another node, in one that does not.
void check_sync(Keys& keys, const MasterConfig& config, Report& report) {
    if (config.sync == SyncMode::follow) return;
    for (const char* key : {"clock", "sync-phase"}) {
        if (const Line* line = keys.find(key)) {
            report.error(Topic::value, line->key.at,
                         std::string("'") + key +
                             "' applies only when the master follows the SYNC of another node",
                         "write sync = follow, or delete it");
        }
    }
}

void check_flying(Keys& keys, const MasterConfig& config, Report& report) {
    const Line* const flying = keys.find("flying-master");
    const bool is_valid_no = flying == nullptr || same_word(flying->value.text, "no");
    if (!config.flying.enabled && is_valid_no) {
        for (const Line* line : keys.all_of("flying-")) {
            if (line == flying || bus_keys().find(line->key.text) == nullptr) continue;
            report.error(Topic::value, line->key.at,
                         "'" + line->key.text + "' applies to flying masters only",
                         "write flying-master = medium");
        }
    }
    if (flying == nullptr) return;
    if (config.flying.enabled && config.heartbeat_ms == 0) {
        report.error(Topic::value, flying->key.at,
                     "a flying master needs a heartbeat: without one, its loss goes undetected",
                     "write heartbeat = 100ms");
    }
    for (const std::string& problem : problems_of(config.flying)) {
        report.error(Topic::value, flying->key.at, problem);
    }
}

}  // namespace

std::string bus_reference() { return bus_keys().reference(); }

void read_bus(Keys& keys, MasterConfig& to, Report& report) {
    bus::TopicReport<Topic> key_report(report);
    bus_keys().apply(keys, to, key_report);
    to.master.id = to.node_id;
    to.flying.id = to.node_id;
    if (keys.find("flying-silence") == nullptr) {
        to.flying.silence = Time{to.heartbeat_ms} * millisecond * 5 / 2;
    }
    check_sync(keys, to, report);
    check_flying(keys, to, report);
    keys.report_rest("in [bus]", bus_keys().names());
}

namespace {

/// Reads `0x181 drive 1`: identifier and name.
bool read_identifier(const Line& line, Foreign& to, Report& report) {
    const std::string_view written = line.written;
    const std::size_t blank = std::min(written.find_first_of(" \t"), written.size());
    const std::string_view id_text = written.substr(0, blank);
    const auto id = id_text.starts_with("0x") ? parse_natural(id_text) : std::nullopt;
    to.name = trimmed(written.substr(blank));
    if (!id || *id > 0x1fffffff) {
        report.error(Topic::value, line.key.at, "invalid identifier '" + std::string(id_text) + "'",
                     "write it in hexadecimal, as in 0x181; an extended one has eight digits");
        return false;
    }
    to.id = static_cast<std::uint32_t>(*id);
    to.extended = id_text.size() == 10 || to.id > 0x7ff;
    return true;
}

/// Reads 8, 64fd, 64brs, or R for a remote request.
bool read_length(const Word& field, Foreign& to, Report& report) {
    std::string bytes = lower(field.text);
    to.bit_rate_switch = bytes.ends_with("brs");
    to.fd = to.bit_rate_switch || bytes.ends_with("fd");
    to.remote = bytes == "r";
    if (to.fd) {
        bytes.resize(bytes.size() - (to.bit_rate_switch ? 3 : 2));
    }
    const auto length = to.remote ? std::optional<std::uint64_t>(0) : parse_natural(bytes);
    if (!length || *length > (to.fd ? 64U : 8U)) {
        report.error(Topic::value, field.at, "invalid length '" + field.text + "'",
                     "write 0..8, R for a remote request, or up to 64fd or 64brs for CAN FD");
        return false;
    }
    to.bytes = static_cast<std::uint8_t>(*length);
    return true;
}

bool read_message_time(const Word& field, const char* name, Time min, Time& to, Report& report) {
    const auto time = duration(field.text);
    if (time && *time >= min && *time <= 3600 * second) {
        to = *time;
        return true;
    }
    report.error(Topic::value, field.at, std::string("invalid ") + name + " '" + field.text + "'",
                 "write 10ms, 250us or 1s");
    return false;
}

}  // namespace

/// `0x181 drive 1, status = 8, 2ms, -, 100us, drive`: identifier and name; bytes, period, deadline,
/// jitter, queue.
void read_foreign(const Line& line, MasterConfig& to, Report& report) {
    Foreign f;
    f.at = line.key.at;
    if (!read_identifier(line, f, report)) return;
    const auto fields = list_of(line.value);
    if (fields.size() < 2 || fields.size() > 5) {
        return report.error(Topic::value, line.value.at,
                            "invalid message: expected BYTES, PERIOD, DEADLINE, JITTER, QUEUE",
                            "the last three are optional: 8, 10ms");
    }
    const auto is_given = [&](std::size_t field) {
        return field < fields.size() && fields[field].text != "-";
    };
    if (!read_length(fields[0], f, report) ||
        !read_message_time(fields[1], "period", microsecond, f.period, report)) {
        return;
    }
    if (is_given(2) && !read_message_time(fields[2], "deadline", microsecond, f.deadline, report)) {
        return;
    }
    if (is_given(3) && !read_message_time(fields[3], "jitter", 0, f.jitter, report)) return;
    if (fields.size() == 5) {
        f.queue = fields[4].text;
    }
    to.foreign.push_back(std::move(f));
}

}  // namespace hal::canopen::config
