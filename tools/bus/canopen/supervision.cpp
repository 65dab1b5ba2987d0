// SPDX-License-Identifier: MIT
#include "bus/canopen/supervision.hpp"

#include <algorithm>
#include <cstring>
#include <fmt/core.h>
#include <unistd.h>

#include "cia402/drive_profile.hpp"
#include "cli/output.hpp"

namespace hal::tools {

using canopen::Abort;
using canopen::SdoRequest;

namespace {

constexpr int heartbeats_per_timeout = 5;
// long enough to receive other instances of this program
constexpr std::int64_t max_heartbeat_ns = 100'000'000;
constexpr std::int64_t listening_ns = 250'000'000;
constexpr std::uint8_t first_own = 112;
constexpr std::uint8_t last_own = 126;  // 127 is the default of masters
constexpr std::uint32_t no_reaction = 0;
constexpr std::uint32_t quick_stop = 3;  // 6007h

}  // namespace

Supervision::Supervision(const Options& options, NodeClient& station, std::uint8_t node,
                         const SupervisionSettings& settings)
    : options_(options),
      station_(station),
      node_(node),
      settings_(settings),
      began_(monotonic_ns()) {
    station_.on_frame = [this](const can::Frame& f) {
        if (f.extended || f.remote || f.length < 1 || f.id <= 0x700 || f.id >= 0x780) return;
        heartbeat_seen_[f.id & 0x7f] = true;
        if (way_ == Way::heartbeat && (f.id & 0x7f) == own_) {
            collided_ = true;
        }
    };
    station_.on_turn = [this](std::int64_t now) { send_heartbeat(now); };
}

void Supervision::warn(const std::string& sentence) const {
    write_all(STDERR_FILENO, fmt::format("{}: warning: {}\n", options_.program, sentence));
}

void Supervision::send_heartbeat(std::int64_t now) {
    if (way_ != Way::heartbeat || now < next_heartbeat_) return;
    canopen::Frame f = canopen::make_frame(0x700U + own_, 1);
    f.data[0] = static_cast<std::uint8_t>(canopen::NmtState::operational);
    if (station_.out.push(f)) {
        next_heartbeat_ =
            now + std::min(settings_.limit_ns / heartbeats_per_timeout, max_heartbeat_ns);
    }
}

Supervision::Read Supervision::read(std::uint16_t index, std::uint8_t sub, std::uint32_t& value) {
    std::uint8_t buffer_bytes[8] = {};
    SdoRequest request{.index = index, .sub = sub, .upload = true, .buffer = buffer_bytes};
    if (station_.transfer(node_, request)) {
        std::memcpy(&value, buffer_bytes, sizeof value);
        return Read::value;
    }
    if (request.aborted_by_server) {
        return Read::missing;  // unusable, whatever the reason
    }
    station_.fail_transfer(node_, request, fmt::format("{:04X}:{}", index, sub));
    return Read::failed;
}

bool Supervision::write(std::uint16_t index, std::uint8_t sub, unsigned bytes, std::uint32_t value,
                        bool& failed) {
    std::uint8_t data[4];
    std::memcpy(data, &value, sizeof data);
    SdoRequest request{.index = index, .sub = sub, .data = std::span(data, bytes)};
    if (station_.transfer(node_, request)) return true;
    if (!request.aborted_by_server) {
        station_.fail_transfer(node_, request, fmt::format("{:04X}:{}", index, sub));
        failed = true;
    }
    return false;
}

bool Supervision::change(std::uint16_t index, std::uint8_t sub, unsigned bytes, std::uint32_t was,
                         std::uint32_t value, bool& failed) {
    if (!write(index, sub, bytes, value, failed)) return false;
    changed_.push_back({index, sub, bytes, was});
    return true;
}

bool Supervision::arm(unsigned axis) {
    if (settings_.limit_ns == 0) return true;
    if (!tried_ && !set_up()) return false;
    tried_ = true;
    if (way_ == Way::none || (axes_done_ >> axis & 1) != 0) return true;
    if (!set_reaction(axis)) return false;
    axes_done_ = static_cast<std::uint8_t>(axes_done_ | 1U << axis);
    return true;
}

bool Supervision::set_up() {
    std::string heartbeat, guarding;
    if (!by_heartbeat(heartbeat)) return false;
    if (way_ != Way::none) return true;
    if (!by_guarding(guarding)) return false;
    if (way_ == Way::none) {
        warn(
            fmt::format("node {} does not supervise this program ({}; {}): if this program is "
                        "killed or the bus is cut, the axis keeps moving",
                        node_, heartbeat, guarding));
    }
    return true;
}

/// Returns the node whose heartbeat an entry of 1016h expects; 0: the entry is not in use.
unsigned Supervision::node_in(std::uint32_t entry) {
    return (entry & 0xffff) == 0 ? 0U : entry >> 16 & 0xff;
}

/// Reads the entries of the drive's heartbeat consumer; none when it has no such object. Returns
/// false when the bus failed.
bool Supervision::read_consumer(std::vector<std::uint32_t>& entries) {
    std::uint32_t count = 0;
    const Read found = read(0x1016, 0, count);
    if (found != Read::value) return found == Read::missing;
    entries.resize(count & 0xff);
    for (std::size_t i = 0; i < entries.size(); ++i) {
        if (read(0x1016, static_cast<std::uint8_t>(i + 1), entries[i]) == Read::failed) {
            return false;
        }
    }
    return true;
}

/// Returns a node ID for our heartbeat that no other node sends; 0: none is free. Programs that
/// start together begin with different IDs.
std::uint8_t Supervision::free_node_id() const {
    constexpr unsigned all = last_own - first_own + 1;
    const auto start = static_cast<unsigned>(::getpid()) % all;
    for (unsigned n = 0; n < all; ++n) {
        const auto id = static_cast<std::uint8_t>(first_own + (start + n) % all);
        if (!heartbeat_seen_[id] && id != node_) return id;
    }
    return 0;
}

/// Returns true for an entry that this program has left when it was killed.
bool Supervision::is_left_over(std::uint32_t entry) const {
    const unsigned id = node_in(entry);
    if (id == own_) return true;
    const bool is_chosen_here = settings_.own_node == 0 && id >= first_own && id <= last_own;
    return is_chosen_here && !heartbeat_seen_[id];
}

/// Returns the entry for our heartbeat: the first free one, or the last one that was left over,
/// with its node ID then. std::nullopt: all are in use.
std::optional<std::size_t> Supervision::choose_entry(std::vector<std::uint32_t>& entries) {
    std::optional<std::size_t> chosen;
    for (std::size_t i = entries.size(); i > 0; --i) {
        if (node_in(entries[i - 1]) == 0) {
            chosen = i - 1;
        }
    }
    for (std::size_t i = 0; i < entries.size(); ++i) {
        if (!is_left_over(entries[i])) continue;
        chosen = i;
        own_ = static_cast<std::uint8_t>(node_in(entries[i]));
        entries[i] = 0;
    }
    return chosen;
}

bool Supervision::by_heartbeat(std::string& why_not) {
    std::vector<std::uint32_t> entries;
    if (!read_consumer(entries)) return false;
    if (entries.empty()) {
        why_not = "it has no heartbeat consumer, 1016h";
        return true;
    }
    // receive other heartbeats
    station_.until([] { return false; },
                   std::max<std::int64_t>(began_ + listening_ns - monotonic_ns(), 0));
    if (settings_.own_node != 0 && heartbeat_seen_[settings_.own_node]) {
        fail(options_, fmt::format("node {} is on this bus: our heartbeat needs a free node ID; "
                                   "choose another --heartbeat-id",
                                   settings_.own_node));
        return false;
    }
    own_ = settings_.own_node != 0 ? settings_.own_node : free_node_id();
    if (own_ == 0) {
        why_not =
            fmt::format("no node ID from {} to {} is free for our heartbeat", first_own, last_own);
        return true;
    }
    const std::optional<std::size_t> chosen = choose_entry(entries);
    if (!chosen) {
        why_not = fmt::format("all {} entries of its heartbeat consumer, 1016h, are in use",
                              entries.size());
        return true;
    }
    const auto sub = static_cast<std::uint8_t>(*chosen + 1);
    const std::uint32_t entry =
        std::uint32_t{own_} << 16 | static_cast<std::uint32_t>(settings_.limit_ns / 1'000'000);
    bool failed = false;
    // Write zero first: some drives arm an entry only when it changes.
    if (!write(0x1016, sub, 4, 0, failed) ||
        !change(0x1016, sub, 4, entries[*chosen], entry, failed)) {
        why_not = "it rejects an entry in its heartbeat consumer, 1016h";
        return !failed;
    }
    way_ = Way::heartbeat;
    next_heartbeat_ = 0;
    station_.turn(0);
    return true;
}

bool Supervision::by_guarding(std::string& why_not) {
    std::uint32_t producer = 0;
    std::uint32_t time = 0;
    std::uint32_t factor = 0;
    const Read has_time = read(0x100c, 0, time);

    const Read has_factor = has_time == Read::value ? read(0x100d, 0, factor) : has_time;
    if (has_time == Read::failed || has_factor == Read::failed) return false;
    if (has_time == Read::missing || has_factor == Read::missing) {
        why_not = "it has no life guarding, 100Ch and 100Dh";
        return true;
    }
    if (read(0x1017, 0, producer) == Read::failed) return false;
    if ((producer & 0xffff) != 0) {
        why_not = "life guarding is not possible while it sends heartbeats, 1017h";
        return true;
    }
    if ((time & 0xffff) != 0 && (factor & 0xff) != 0) {
        why_not = "its life guarding is in use by another master";
        return true;
    }
    const std::int64_t period = settings_.limit_ns / heartbeats_per_timeout;
    bool failed = false;
    if (!change(0x100c, 0, 2, time & 0xffff, static_cast<std::uint32_t>(period / 1'000'000),
                failed) ||
        !change(0x100d, 0, 1, factor & 0xff, heartbeats_per_timeout, failed)) {
        why_not = "it rejects life guarding, 100Ch and 100Dh";
        return !failed;
    }
    way_ = Way::guarding;
    station_.network.add(node_).guard(period, heartbeats_per_timeout, monotonic_ns());
    station_.turn(0);
    return true;
}

bool Supervision::set_reaction(unsigned axis) {
    const auto index = cia402::of_axis(cia402::object::abort_connection_option, axis);
    const char letter = static_cast<char>('A' + axis);
    const char* what = way_ == Way::heartbeat ? "heartbeat" : "life guarding";
    std::uint32_t option = 0;
    switch (read(index, 0, option)) {
    case Read::failed: return false;
    case Read::missing: {
        std::uint32_t behaviour = 0;
        const Read has = read(0x1029, 1, behaviour);
        if (has == Read::failed) return false;
        const char* state = "keeps its NMT state";
        if (has == Read::missing || (behaviour & 0xff) == 0) {
            state = "leaves operational";
        } else if ((behaviour & 0xff) == 2) {
            state = "enters stopped";
        }
        warn(
            fmt::format("{}: no abort connection option, {:04X}h: on loss of our {} node {} {} "
                        "(1029h:1); whether that stops the motor is in "
                        "its manual",
                        letter, index, what, node_, state));
        return true;
    }
    case Read::value: break;
    }
    if ((option & 0xffff) != no_reaction) return true;
    bool failed = false;
    if (change(index, 0, 2, no_reaction, quick_stop, failed)) return true;
    if (!failed) {
        warn(
            fmt::format("{}: abort connection option {:04X}h is 0 (no action) and cannot be "
                        "changed: the axis keeps moving if this program is "
                        "killed",
                        letter, index));
    }
    return !failed;
}

bool Supervision::release() {
    bool failed = false;
    for (auto c = changed_.rbegin(); c != changed_.rend() && !failed; ++c) {
        write(c->index, c->sub, c->bytes, c->was, failed);
    }
    changed_.clear();
    if (way_ == Way::guarding) {
        station_.network.add(node_).guard(0, 0, monotonic_ns());
    }
    way_ = Way::none;
    tried_ = false;
    axes_done_ = 0;
    return !failed;
}

}  // namespace hal::tools
