// SPDX-License-Identifier: MIT
#include "bus/can/station.hpp"

#include <charconv>
#include <fmt/core.h>

#include "cli/output.hpp"

namespace hal::tools {

using canopen::Abort;

namespace {

canopen::SdoClientSettings settings_of(std::int64_t timeout_ns) {
    canopen::SdoClientSettings settings;
    if (timeout_ns > 0) settings.timeout = timeout_ns;
    return settings;
}

}  // namespace

Station::Station(const Options& options, std::int64_t timeout_ns)
    : network(out, *this, settings_of(timeout_ns)),
      lss(out, timeout_ns > 0 ? canopen::LssMasterSettings{.timeout = timeout_ns, .scan_timeout = timeout_ns}
                              : canopen::LssMasterSettings{.timeout = canopen::second, .repeats = 5}),
      options_(options),
      timeout_ns_(timeout_ns),
      room_(256) {}

bool Station::open(const std::string& address) { return bus.open(options_, address, false); }

bool Station::turn(std::int64_t wait_ns) {
    if (on_turn) on_turn(now_ns());
    network.poll(now_ns());
    lss.poll(now_ns());
    for (const can::Frame* f; (f = out.front()) != nullptr && bus.link->send(*f, can::unclocked) == can::Sent::queued;) out.drop();
    bus.link->flush(can::unclocked);
    std::size_t count = bus.link->receive(room_, can::unclocked);
    if (count == 0 && wait_ns > 0) {
        bus.link->wait(wait_ns);
        count = bus.link->receive(room_, can::unclocked);
    }
    for (std::size_t n = 0; n < count; ++n) {
        const can::Frame& f = room_[n];
        if (f.own || f.error) continue;
        if (lss.listens_to(f)) lss.handle(f, now_ns());
        else network.handle(f, now_ns());
        if (on_frame) on_frame(f);
    }
    return outlasts_stop || !bus.stop.requested();
}

bool Station::until(const std::function<bool()>& done, std::int64_t for_ns) {
    const std::int64_t began = now_ns();
    while (!done())
        if (!turn() || (for_ns >= 0 && now_ns() - began >= for_ns)) return done();
    return true;
}

bool Station::transfer(std::uint8_t node, canopen::SdoRequest& request) {
    canopen::SdoClient& client = network.add(node).sdo();
    client.submit(request);
    if (!until([&] { return request.done(); })) {  // Ctrl-C: the node is told, too
        client.cancel(request);
        turn(0);
    }
    return request.ok();
}

namespace {

/// What to do about an abort: half a sentence for `bus` and `node`; empty when nothing general can be said.
std::string advice(Abort why, const std::string& bus, unsigned node, std::uint16_t index) {
    switch (why) {
    case Abort::toggle:
    case Abort::sequence:
    case Abort::crc:
    case Abort::block_size: return "frames were lost or mixed up on the way: try again, or with --segmented";
    case Abort::command: return "another master may be talking to this node, or it knows no block transfer: --segmented does without";
    case Abort::timeout: return "the device waited in vain: is the bus overloaded? hal can load shows it";
    case Abort::write_only: return "it can only be written";
    case Abort::read_only: return "it can only be read";
    case Abort::no_object: return "the device's EDS lists the objects it has";
    case Abort::no_sub: return "sub-index 0 of the object tells the highest one it has";
    case Abort::not_mappable: return "the device's EDS says which objects can be: PDOMapping=1";
    case Abort::pdo_length: return "a PDO holds 8 bytes, and this device perhaps fewer objects: map less";
    case Abort::length:
    case Abort::too_long:
    case Abort::too_short: return "the object has another width: say --type, such as u16 or i32";
    case Abort::value:
    case Abort::too_high:
    case Abort::too_low: return "the device's EDS has the limits: LowLimit, HighLimit";
    case Abort::incompatible:
    case Abort::internal_incompatible:
    case Abort::range_reversed: return "another object of the device contradicts it";
    case Abort::access:
        return fmt::format("while it is in use it may be locked; a PDO is changed when it is off: hal can pdo show {} {}, then pdo disable", bus,
                           node);
    case Abort::cannot_store:
        if (index == 0x1f50) return "the device does not take this image, and may have no usable program now: is it made for this device?";
        return "1010 takes only 0x65766173 (save), 1011 only 0x64616F6C (load); else the memory is locked or worn";
    case Abort::local_control: return "a switch at the device, or its own program, has the command";
    case Abort::device_state:
        if (index == 0x1f50)
            return fmt::format("its program is stopped and cleared before: hal can sdo write {0} {1} 1F51:1 0 --type u8, then 3", bus,
                               node);
        return fmt::format("most settings are taken in pre-operational: hal can nmt {} preop {}", bus, node);
    case Abort::hardware: return fmt::format("see its error register: hal can sdo read {} {} 1001", bus, node);
    case Abort::no_resource: return "all SDO channels of the device are in use";
    default: return "";
    }
}

}  // namespace

int Station::fail_transfer(std::uint8_t node, const canopen::SdoRequest& request, const std::string& object) const {
    if (bus.stop.requested() && !outlasts_stop && !request.aborted_by_server)
        return fail(options_, fmt::format("ended while node {} was asked for {}", node, object));
    if (request.abort == Abort::timeout && !request.aborted_by_server) {
        const can::Statistics s = bus.link->statistics();
        return fail(options_,
                    fmt::format("node {} did not answer within {:g} s (asked for {}); the bus is {}; hal can scan {} shows who is there",
                                node, static_cast<double>(settings_of(timeout_ns_).timeout) * (settings_of(timeout_ns_).resends + 1) / 1e9,
                                object, can::to_string(s.state), options_.words.front()));
    }
    const std::string what = advice(request.abort, options_.words.front(), node, request.index);
    return fail(options_, fmt::format("node {}, {}: {}{} (0x{:08X}){}", node, object,
                                      request.aborted_by_server ? "" : "gave up: ", canopen::to_string(request.abort),
                                      static_cast<std::uint32_t>(request.abort), what.empty() ? "" : "; " + what));
}

bool parse_node(const std::string& text, std::uint8_t& node) {
    const bool hex = text.starts_with("0x");
    const char* end = text.data() + text.size();
    unsigned number = 0;
    const auto [stop, error] = std::from_chars(text.data() + (hex ? 2 : 0), end, number, hex ? 16 : 10);
    if (error != std::errc() || stop != end || number < 1 || number > 127) return false;
    return node = static_cast<std::uint8_t>(number), true;
}

bool node_of(const Options& options, const std::string& text, std::uint8_t& node) {
    if (parse_node(text, node)) return true;
    return fail(options, fmt::format("'{}' is no node; write 1 to 127", text)), false;
}

}  // namespace hal::tools
