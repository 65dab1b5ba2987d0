// SPDX-License-Identifier: MIT
// The sections [bus] and [messages].
#include "config_sections.hpp"

namespace hal::canopen::config {

namespace {

constexpr Choice<AtStop> stops[] = {{"nothing", AtStop::nothing},
                                    {"pre-operational", AtStop::pre_operational},
                                    {"stopped", AtStop::stopped}};

void take_sync(Keys& keys, MasterConfig& to) {
    if (const Line* line = keys.find("sync")) {
        const std::string word = lower(line->value.text);
        const auto words = words_of(line->value);
        const auto time = duration(word);
        const auto followed = words.size() == 2 && lower(words[0].text) == "follow"
                                  ? duration(words[1].text)
                                  : std::nullopt;
        if (word == "none" || word == "no") {
            to.sync = SyncMode::none;
        } else if (word == "cycle") {
            to.sync = SyncMode::cycle;
        } else if (word == "follow") {
            to.sync = SyncMode::follow;
        } else if (followed && *followed > 0) {
            to.sync = SyncMode::follow;
            to.sync_period = *followed;
        } else if (time && *time >= 100 * microsecond && *time <= 60 * second) {
            to.sync = SyncMode::timed;
            to.sync_period = *time;
        } else {
            keys.reject(*line, "cycle, a time such as 2ms, follow, follow 2ms, or none");
        }
    }
    constexpr Choice<bool> clocks[] = {{"sync", true}, {"own", false}};
    for (const char* key : {"clock", "sync-phase"}) {
        if (const Line* line = keys.find(key); line != nullptr && to.sync != SyncMode::follow) {
            keys.report().error(
                Topic::value, line->key.at,
                std::string("'") + key +
                    "' applies only when the master follows the SYNC of another node",
                "write sync = follow, or delete it");
        }
    }
    keys.take_choice("clock", to.sync_clock, clocks);
    keys.take_time("sync-phase", to.sync_phase, 0, 60 * second);
    keys.take_small("sync-counter", to.sync_counter, 2, 240);
    keys.take_time("sync-window", to.sync_window, microsecond, 60 * second);
    keys.take_small("sync-cob-id", to.sync_cob, 1, 0x7ff);
    keys.take_flag("sync-at-boot", to.sync_at_boot);
}

void take_flying(Keys& keys, MasterConfig& to) {
    constexpr Choice<int> priorities[] = {{"no", -1}, {"high", 0}, {"medium", 1}, {"low", 2}};
    FlyingSetup& f = to.flying;
    const Line* const flying = keys.find("flying-master");
    int priority = flying == nullptr ? -1 : -2;  // -2: invalid
    keys.take_choice("flying-master", priority, priorities);
    f.enabled = priority >= 0;
    f.id = to.node_id;
    if (f.enabled) {
        f.priority = static_cast<std::uint8_t>(priority);
    }
    for (const char* key : {"flying-timeout", "flying-delay", "flying-priority-slot",
                            "flying-device-slot", "flying-detect", "flying-silence"}) {
        if (const Line* line = keys.find(key); line != nullptr && priority == -1) {
            keys.report().error(Topic::value, line->key.at,
                                std::string("'") + key + "' applies to flying masters only",
                                "write flying-master = medium");
        }
    }
    f.silence = Time{to.heartbeat_ms} * millisecond * 5 / 2;
    keys.take_time("flying-timeout", f.timeout, millisecond, 60 * second);
    keys.take_time("flying-delay", f.delay, 0, 60 * second);
    keys.take_time("flying-priority-slot", f.priority_slot, millisecond, 60 * second);
    keys.take_time("flying-device-slot", f.device_slot, 10 * microsecond, second);
    keys.take_time("flying-detect", f.detect_cycle, 100 * millisecond, 3600 * second);
    keys.take_time("flying-silence", f.silence, millisecond, 60 * second);
    if (f.enabled && to.heartbeat_ms == 0 && flying != nullptr) {
        keys.report().error(
            Topic::value, flying->key.at,
            "a flying master needs a heartbeat: without one, its loss goes undetected",
            "write heartbeat = 100ms");
    }
    for (const std::string& problem : problems_of(f)) {
        if (flying != nullptr) {
            keys.report().error(Topic::value, flying->key.at, problem);
        }
    }
}

}  // namespace

void read_bus(Keys& keys, MasterConfig& to) {
    keys.take_text("link", to.link);
    for (const char* key : {"bitrate", "datarate"}) {
        if (const Line* line = keys.find(key)) {
            const auto bits = rate(line->value.text);
            if (bits) {
                (*key == 'b' ? to.bit_rate : to.data_rate) = *bits;
            } else {
                keys.reject(*line, "bits per second, as in 1M, 500k or 125000");
            }
        }
    }
    keys.take_small("node-id", to.node_id, 1, 127);
    take_sync(keys, to);
    keys.take_time("time", to.time_period, 10 * millisecond, 3600 * second, true);
    Time heartbeat = Time{to.heartbeat_ms} * millisecond;
    if (keys.take_time("heartbeat", heartbeat, millisecond, 65535 * millisecond, true)) {
        to.heartbeat_ms = static_cast<std::uint16_t>(heartbeat / millisecond);
    }
    keys.take_choice("on-stop", to.at_stop, stops);
    take_flying(keys, to);
    MasterSetup& m = to.master;
    m.id = to.node_id;
    keys.take_time("sdo-timeout", m.sdo.timeout, millisecond, 60 * second);
    keys.take_small("sdo-retries", m.sdo.resends, 0, 20);
    keys.take_time("nmt-inhibit", m.nmt_inhibit, 0, second, true);
    keys.take_small("parallel", m.parallel, 0, 127);
    keys.take_small("resets", m.resets, 0, 1000);
    keys.take_flag("reset-at-start", m.reset_at_start);
    constexpr Choice<bool> starts[] = {{"each", false}, {"together", true}};
    keys.take_choice("start", m.start_all_at_once, starts);
    for (Line* line : keys.rest()) {
        line->used = true;
        const std::vector<std::string> all{"link",
                                           "bitrate",
                                           "datarate",
                                           "node-id",
                                           "sync",
                                           "sync-counter",
                                           "sync-window",
                                           "sync-cob-id",
                                           "sync-at-boot",
                                           "time",
                                           "heartbeat",
                                           "on-stop",
                                           "sdo-timeout",
                                           "sdo-retries",
                                           "nmt-inhibit",
                                           "parallel",
                                           "resets",
                                           "reset-at-start",
                                           "start",
                                           "clock",
                                           "sync-phase",
                                           "flying-master",
                                           "flying-timeout",
                                           "flying-delay",
                                           "flying-priority-slot",
                                           "flying-device-slot",
                                           "flying-detect",
                                           "flying-silence"};
        keys.report().error(Topic::line, line->key.at,
                            "unknown key '" + line->key.text + "' in [bus]",
                            suggestion(line->key.text, all, "the keys are"));
    }
}

/// `0x181 drive 1, status = 8, 2ms, -, 100us, drive`: identifier and name; bytes, period, deadline, jitter, queue.
void read_foreign(const Line& line, MasterConfig& to, Report& report) {
    Foreign f;
    f.at = line.key.at;
    const std::size_t blank = std::min(line.written.find_first_of(" \t"), line.written.size());
    const std::string_view id_text = std::string_view(line.written).substr(0, blank);
    const auto id = id_text.starts_with("0x") ? parse_natural(id_text) : std::nullopt;
    if (blank < line.written.size()) {
        f.name = line.written.substr(line.written.find_first_not_of(" \t", blank));
    }
    if (!id || *id > 0x1fffffff) {
        return report.error(
            Topic::value, line.key.at, "invalid identifier '" + std::string(id_text) + "'",
            "write it in hexadecimal, as in 0x181; an extended one has eight digits");
    }
    f.id = static_cast<std::uint32_t>(*id);
    f.extended = id_text.size() == 10 || f.id > 0x7ff;
    const auto fields = list_of(line.value);
    if (fields.size() < 2 || fields.size() > 5) {
        return report.error(Topic::value, line.value.at,
                            "invalid message: expected BYTES, PERIOD, DEADLINE, JITTER, QUEUE",
                            "the last three are optional: 8, 10ms");
    }
    std::string bytes = lower(fields[0].text);
    if (bytes.ends_with("brs")) {
        f.fd = f.bit_rate_switch = true;
        bytes.resize(bytes.size() - 3);
    } else if (bytes.ends_with("fd")) {
        f.fd = true;
        bytes.resize(bytes.size() - 2);
    } else if (bytes == "r") {
        f.remote = true;
        bytes = "0";
    }
    const auto length = parse_natural(bytes);
    if (!length || *length > (f.fd ? 64U : 8U)) {
        return report.error(
            Topic::value, fields[0].at, "invalid length '" + fields[0].text + "'",
            "write 0..8, R for a remote request, or up to 64fd or 64brs for CAN FD");
    }
    f.bytes = static_cast<std::uint8_t>(*length);
    Time* const times[] = {&f.period, &f.deadline, &f.jitter};
    constexpr const char* names[] = {"period", "deadline", "jitter"};
    for (std::size_t i = 1; i < std::min<std::size_t>(fields.size(), 4); ++i) {
        if (i > 1 && fields[i].text == "-") continue;
        const auto time = duration(fields[i].text);
        if (!time || *time > 3600 * second || (*time < microsecond && i != 3)) {
            return report.error(
                Topic::value, fields[i].at,
                std::string("invalid ") + names[i - 1] + " '" + fields[i].text + "'",
                "write 10ms, 250us or 1s");
        }
        *times[i - 1] = *time;
    }
    if (fields.size() == 5) {
        f.queue = fields[4].text;
    }
    to.foreign.push_back(std::move(f));
}

}  // namespace hal::canopen::config
