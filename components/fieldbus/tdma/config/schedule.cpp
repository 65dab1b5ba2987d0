// SPDX-License-Identifier: MIT
#include "schedule.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>

#include "hal/read_file.hpp"
#include "text/quoting.hpp"

namespace hal::tdma::config {

const char* code_of(Topic topic) {
    constexpr const char* codes[] = {"tdma-line", "tdma-value", "tdma-schedule"};
    return codes[static_cast<std::size_t>(topic)];
}

Time Schedule::wire(std::size_t length) const {
    return static_cast<Time>(ethernet::wire_bytes(length)) * 8000 / static_cast<Time>(speed);
}

Time Schedule::path(std::size_t length) const {
    return forward == 0 ? wire(length) : 2 * wire(length) + forward;
}

const StationEntry* Schedule::master() const {
    const auto found = std::find_if(stations.begin(), stations.end(),
                                    [](const StationEntry& s) { return s.role == Role::master; });
    return found == stations.end() ? nullptr : &*found;
}

bool ReadResult::good() const { return text::good(messages); }

StationSetup setup_of(const Schedule& s, std::size_t index) {
    const StationEntry& e = s.stations.at(index);
    StationSetup out;
    out.role = e.role;
    out.cycle = s.cycle;
    out.backup_offset = e.backup_offset;

    out.phase = e.phase;
    out.lead = e.lead;
    out.guard = s.guard;
    out.lost_limit = s.lost;
    out.rounds = s.rounds;
    out.speed = s.speed;
    // Twice what the slots of anybody hold of the shortest frames, with syncs and replies.
    Time max = 0;
    for (const StationEntry& other : s.stations) {
        Time share = static_cast<Time>(s.stations.size()) + 2;
        for (const SlotEntry& slot : other.slots) {
            share +=
                s.wire(ethernet::header_bytes + slot.setup.size) / s.wire(ethernet::smallest_frame);
        }
        max = std::max(max, share);
    }
    out.babble_limit = static_cast<std::uint32_t>(std::max<Time>(64, 2 * max));
    out.backup_from = s.cycle;
    for (const StationEntry& other : s.stations) {
        if (other.role == Role::backup) {
            out.backup_from = std::min(out.backup_from, other.backup_offset);
        }
    }
    for (const SlotEntry& slot : e.slots) {
        out.slots.push_back(slot.setup);
    }
    for (std::size_t i = 0; i < s.stations.size(); ++i) {
        if (i == index) continue;
        Other& other = out.others.emplace_back(Other{s.stations[i].mac.value_or(Address{}),
                                                     s.stations[i].role,
                                                     {},
                                                     static_cast<std::uint16_t>(i)});
        for (const SlotEntry& slot : s.stations[i].slots) {
            other.slots.push_back(slot.setup);
        }
    }
    bool all_named = true;
    for (const StationEntry& other : s.stations) {
        if (other.role == Role::slave) continue;
        if (other.mac) {
            out.masters.push_back(*other.mac);
        } else {
            all_named = false;
        }
    }
    if (!all_named) {
        out.masters.clear();
    }
    return out;
}

std::optional<std::size_t> find(const Schedule& s, std::string_view which) {
    const auto ip = parse_ip(which);
    const auto mac = ethernet::parse_address(which);
    for (std::size_t i = 0; i < s.stations.size(); ++i) {
        const StationEntry& e = s.stations[i];
        if (e.name == which || (ip && e.ip == ip) || (mac && e.mac == mac)) return i;
    }
    return {};
}

std::string names(const Schedule& s) {
    std::string text;
    for (const StationEntry& e : s.stations) {
        append_item(text, e.name);
    }
    return text;
}

namespace {

std::string plain(Time t) {
    char text[40];
    std::snprintf(text, sizeof text, "%.12g", static_cast<double>(t) / 1e3);
    return text;
}

}  // namespace

std::string microseconds(Time t) { return plain(t) + " us"; }

std::string block_of(const Schedule& s, std::size_t index) {
    const StationEntry& e = s.stations.at(index);
    std::string text = "cycle " + plain(s.cycle) + "\nspeed " + std::to_string(s.speed) +
                       "\nguard " + plain(s.guard) + "\nforward " + plain(s.forward) + "\nlost " +
                       std::to_string(s.lost) + "\nrounds " + std::to_string(s.rounds) +
                       "\nheartbeat " + std::to_string(s.heartbeat_ms) + "\n";
    if (e.role == Role::master) {
        text += "master:\n";
    } else if (e.role == Role::backup) {
        text += "backup-master:\n";
    } else {
        text += "slave:\n";
    }
    text += "name " + e.name + "\nphase " + plain(e.phase) + "\nlead " + plain(e.lead) + "\n";
    if (e.ip) {
        text += "ip " + to_string(*e.ip) + "\n";
    }
    if (e.role == Role::backup) {
        text += "backup-offset " + plain(e.backup_offset) + "\n";
    }
    for (const SlotEntry& slot : e.slots) {
        text += "slot " + std::to_string(slot.setup.id) + " " + plain(slot.setup.offset) + " " +
                std::to_string(slot.setup.phasing + 1) + "/" + std::to_string(slot.setup.period) +
                " " + std::to_string(slot.setup.size) + "\n";
    }
    return text;
}

bool read_from_disk(const std::string& path, std::string& bytes) {
    if (!read_regular_file(path, 16'000'000, bytes)) return false;
    if (!bytes.empty()) return true;
    bytes = "the file is empty";
    return false;
}

std::string to_string(const ReadResult& reading, const std::string& path) {
    return text::errors_text(reading.messages, path);
}

std::string to_string(const Ip& ip) {
    return std::to_string(ip[0]) + "." + std::to_string(ip[1]) + "." + std::to_string(ip[2]) + "." +
           std::to_string(ip[3]);
}

std::optional<Ip> parse_ip(std::string_view text) {
    Ip ip{};
    const char* at = text.data();
    const char* end = at + text.size();
    for (std::size_t i = 0; i < 4; ++i) {
        if (i != 0) {
            if (at == end || *at != '.') {
                return {};
            }
            ++at;
        }
        const auto [next, error] = std::from_chars(at, end, ip[i]);
        if (error != std::errc() || next == at) {
            return {};
        }
        at = next;
    }
    return at == end ? std::optional(ip) : std::nullopt;
}

}  // namespace hal::tdma::config
