// SPDX-License-Identifier: MIT
#include "bus/can/bus.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <time.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "link/capture.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

std::string out_of_reach(const can::Description& bus) {
    if (!bus.simulated || bus.transport == "capture") {
        return {};
    }
    return fmt::format(
        "'{}' is a bus in memory, which other programs cannot open; while its machine runs, bridge "
        "it to one that they can: "
        "hal shell loadrt can_bridge a={} b=udp:239.74.163.2:43113, hal shell addf "
        "can-bridge.0.update THREAD, and here "
        "udp:239.74.163.2:43113",
        bus.address, bus.address);
}

namespace {

/// Opens a link; returns nullptr after printing the reason.
std::unique_ptr<can::Link> open_link(const Options& options, const std::string& address, bool fd,
                                     std::span<const std::string> wanted) {
    std::vector<can::Filter> filters(wanted.size());
    std::string problem;
    for (std::size_t i = 0; i < filters.size(); ++i) {
        if (!parse_filter(wanted[i], filters[i], problem)) {
            fail(options, problem);
            return nullptr;
        }
    }
    can::Options how;
    how.error_frames = how.own_frames = how.stamps = true;
    how.receive_capacity = 16384;
    how.fd = fd && !can::describe(address).fd_on_request;
    can::Opened opened = can::open(address, how);
    if (!opened && how.fd) {
        how.fd = false;
        opened = can::open(address, how);
    }
    if (!opened) {
        fail(options, opened.problem);
        return nullptr;
    }
    if (const std::string why = out_of_reach(opened.link->description()); !why.empty()) {
        fail(options, why);
        return nullptr;
    }
    if (!opened.link->set_filters(filters)) {
        fail(options, "too many filters for this driver; use a MASK: 180/780");
        return nullptr;
    }
    return std::move(opened.link);
}

}  // namespace

bool Bus::open(const Options& options, const std::string& address, bool fd,
               std::span<const std::string> filters) {
    return (link = open_link(options, address, fd, filters)) != nullptr;
}

bool Bus::open(const Options& options, std::span<const std::string> addresses,
               std::span<const std::string> filters) {
    if (!open(options, addresses.front(), true, filters)) return false;
    for (const std::string& address : addresses.subspan(1)) {
        if (more.push_back(open_link(options, address, true, filters)); !more.back()) return false;
    }
    return true;
}

void Bus::announce(const Options& options) const {
    std::string text;
    const auto add = [&text](const can::Description& d) {
        append_item(text, fmt::format("{} ({}", d.address, d.transport));
        if (d.bit_rate != 0) {
            text += fmt::format(", {} bit/s", d.bit_rate);
        }
        text += ")";
    };
    add(link->description());
    for (const auto& other : more) {
        add(other->description());
    }
    write_all(STDERR_FILENO,
              fmt::format("{}: listening on {}; press Ctrl-C to end\n", options.program, text));
}

void listen(Bus& bus, std::int64_t for_ns,
            const std::function<bool(std::span<const can::Frame>)>& take, std::int64_t slice_ns,
            const std::function<void()>& idle) {
    std::vector<can::Frame> buffer(256);
    const std::int64_t end = for_ns >= 0 ? monotonic_ns() + for_ns : INT64_MAX;
    for (;;) {
        const std::size_t count = bus.link->receive(buffer, can::unclocked);
        if (count > 0 && !take(std::span(buffer).first(count))) return;
        if (idle) {
            idle();
        }
        const std::int64_t now = monotonic_ns();
        if (now >= end || bus.stop.requested()) return;
        if (count > 0) continue;
        if (bus.is_capture() && bus.link->state() == can::State::down) return;
        bus.link->wait(std::min(slice_ns, end - now));
    }
}

bool send_with_timeout(Bus& bus, const can::Frame& frame) {
    can::Frame heard[16];
    for (int tries = 0;; ++tries) {
        // discards received frames; the link needs them for acknowledgements
        while (bus.link->receive(heard, can::unclocked) > 0) {
        }
        const std::uint64_t waiting = bus.link->statistics().queued;
        if (waiting < 256 || tries == 1000 || bus.stop.requested()) {
            return bus.link->send(frame, can::unclocked) == can::Sent::queued;
        }
        bus.link->flush(can::unclocked);
        bus.stop.wait_ns(1'000'000);
    }
}

int finish_sending(Bus& bus, const Options& options, std::uint64_t wanted) {
    can::Frame heard[16];
    for (int tries = 0; tries < 1000; ++tries) {
        bus.link->flush(can::unclocked);
        while (bus.link->receive(heard, can::unclocked) > 0) {
        }
        if (bus.link->statistics().queued == 0) break;
        bus.stop.wait_ns(1'000'000);
    }
    const can::Statistics s = bus.link->statistics();
    if (s.dropped == 0 && s.queued == 0) return 0;
    return fail(
        options,
        fmt::format(
            "{} of {} frames not sent; the bus is {}{}", s.dropped + s.queued, wanted,
            can::to_string(s.state),
            s.queued > 0 ? "; check that another node acknowledges, at the same bit rate" : ""));
}

namespace {

bool hex(std::string_view text, std::uint32_t& value) { return parse_whole(text, value, 16); }

bool identifier(std::string_view text, std::uint32_t& id, bool& extended) {
    remove_hex_prefix(text);
    if (text.size() > 8 || !hex(text, id) || id > 0x1fffffff) return false;
    extended = text.size() == 8 || id > 0x7ff;
    return true;
}

}  // namespace

bool parse_frame(std::string_view text, can::Frame& frame, std::string& problem) {
    const auto mark = text.find('#');
    std::string plain(text.substr(0, mark));
    const std::string quoted = fmt::format("invalid frame '{}'", text);
    std::uint32_t id = 0;
    if (mark == text.npos) {
        problem = quoted + ": write IDENTIFIER#DATA, such as 123#1122AABB";
        return false;
    }
    if (!hex(plain, id) || (plain.size() != 3 && plain.size() != 8) ||
        id > (plain.size() == 3 ? 0x7ffU : 0x1fffffffU)) {
        problem = fmt::format(
            "{}: invalid identifier '{}'; write three hex digits up to 7FF, or eight up to "
            "1FFFFFFF for an extended one",
            quoted, plain);

        return false;
    }
    for (const char c : text.substr(mark)) {
        if (c != '.') {
            plain += c;  // 11.22.33
        }
    }
    if (can::parse_log_line("(0) x " + plain, frame)) return true;
    const bool fd = plain.find("##") != plain.npos;
    problem = quoted + (fd ? ": after ##, write one digit of flags (1: data at the data "
                             "rate) and 0-8, 12, 16, 20, 24, 32, 48 or 64 bytes"
                           : ": after #, write up to 8 bytes of two hex digits, or R and "
                             "the requested length; CAN FD is written ##");

    return false;
}

bool parse_filter(std::string_view text, can::Filter& filter, std::string& problem) {
    const auto slash = text.find('/');
    bool wide = false;
    if (identifier(text.substr(0, slash), filter.id, filter.extended)) {
        if (slash == text.npos) {
            filter.mask = filter.extended ? 0x1fffffff : 0x7ff;
            return true;
        }
        if (identifier(text.substr(slash + 1), filter.mask, wide)) {
            filter.extended = filter.extended || wide;
            return true;
        }
    }
    problem = fmt::format(
        "invalid filter '{}'; write an identifier in hex, 181, or one with a mask, 180/780", text);

    return false;
}

std::string id_text(const can::Frame& f) {
    if (f.error) return "error";
    return fmt::format("{:0{}X}", f.id, f.extended ? 8 : 3);
}

std::string data_text(const can::Frame& f, const char* separator) {
    if (f.remote) {
        return "remote request, " + counted(f.length, "byte");
    }
    std::string text;
    for (const auto byte : f.bytes()) {
        append_item(text, fmt::format("{:02X}", byte), separator);
    }
    return text;
}

}  // namespace hal::tools
