// SPDX-License-Identifier: MIT
#include "bus/canopen/node_client.hpp"

#include <fmt/core.h>

#include "bus/transfer_progress.hpp"
#include "cli/output.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

using canopen::Abort;

namespace {

canopen::SdoClientSettings settings_of(std::int64_t timeout_ns) {
    canopen::SdoClientSettings settings;
    if (timeout_ns > 0) {
        settings.timeout = timeout_ns;
    }
    return settings;
}

}  // namespace

NodeClient::NodeClient(const Options& options, std::int64_t timeout_ns)
    : network(out, *this, settings_of(timeout_ns)),
      lss(out, timeout_ns > 0
                   ? canopen::LssMasterSettings{.timeout = timeout_ns, .scan_timeout = timeout_ns}
                   : canopen::LssMasterSettings{.timeout = canopen::second, .repeats = 5}),
      options_(options),
      timeout_ns_(timeout_ns),
      frames_(256) {}

bool NodeClient::open(const std::string& address) { return bus.open(options_, address, false); }

bool NodeClient::turn(std::int64_t wait_ns) {
    if (on_turn) {
        on_turn(monotonic_ns());
    }
    network.poll(monotonic_ns());
    lss.poll(monotonic_ns());
    for (const can::Frame* f;
         (f = out.front()) != nullptr && bus.link->send(*f, can::unclocked) == can::Sent::queued;) {
        out.drop();
    }
    bus.link->flush(can::unclocked);
    std::size_t count = bus.link->receive(frames_, can::unclocked);
    if (count == 0 && wait_ns > 0) {
        bus.link->wait(wait_ns);
        count = bus.link->receive(frames_, can::unclocked);
    }
    for (std::size_t n = 0; n < count; ++n) {
        const can::Frame& f = frames_[n];
        if (f.own || f.error) continue;
        if (lss.listens_to(f)) {
            lss.handle(f, monotonic_ns());
        } else {
            network.handle(f, monotonic_ns());
        }
        if (on_frame) {
            on_frame(f);
        }
    }
    return outlasts_stop || !bus.stop.requested();
}

bool NodeClient::until(const std::function<bool()>& done, std::int64_t for_ns) {
    const std::int64_t began = monotonic_ns();
    while (!done()) {
        if (!turn() || (for_ns >= 0 && monotonic_ns() - began >= for_ns)) return done();
    }
    return true;
}

bool NodeClient::transfer(std::uint8_t node, canopen::SdoRequest& request) {
    canopen::SdoClient& client = network.add(node).sdo();
    client.submit(request);
    TransferProgress progress(fmt::format("node {}, {:04X}:{}", node, request.index, request.sub));
    const auto done = [&] {
        progress.update(client.transferred(), client.announced());
        return request.done();
    };
    if (!until(done)) {  // Ctrl-C: abort the transfer on the node, too
        client.cancel(request);
        turn(0);
    }
    return request.ok();
}

namespace {

/// Advice about an abort, as part of a sentence: {0} is the bus, {1} the node.
struct Advice {
    Abort abort;
    const char* text;
};

constexpr const char* lost_frames = "frames were lost or reordered: retry, or add --segmented";
constexpr const char* wrong_length =
    "the object has another length: add --type, such as u16 or i32";
constexpr const char* out_of_limits = "see LowLimit and HighLimit in the EDS of the device";
constexpr const char* conflict = "it conflicts with another object of the device";

constexpr Advice advices[] = {
    {Abort::toggle, lost_frames},
    {Abort::sequence, lost_frames},
    {Abort::crc, lost_frames},
    {Abort::block_size, lost_frames},
    {Abort::command,
     "another master may access this node, or it does not support block transfer: add --segmented"},
    {Abort::timeout, "the device timed out; to check for an overloaded bus: hal can load"},
    {Abort::write_only, "the object is write-only"},
    {Abort::read_only, "the object is read-only"},
    {Abort::no_object, "see the EDS of the device for its objects"},
    {Abort::no_sub, "sub-index 0 is the highest sub-index of the object"},
    {Abort::not_mappable, "mappable objects have PDOMapping=1 in the EDS of the device"},
    {Abort::pdo_length, "a PDO holds 8 bytes, and this device may allow fewer objects: map less"},
    {Abort::length, wrong_length},
    {Abort::too_long, wrong_length},
    {Abort::too_short, wrong_length},
    {Abort::value, out_of_limits},
    {Abort::too_high, out_of_limits},
    {Abort::too_low, out_of_limits},
    {Abort::incompatible, conflict},
    {Abort::internal_incompatible, conflict},
    {Abort::range_reversed, conflict},
    {Abort::access,
     "the object may be locked while in use; disable a PDO before changing it: hal can pdo show "
     "{0} {1}, then pdo disable"},
    {Abort::cannot_store,
     "1010 accepts only 0x65766173 (save), 1011 only 0x64616F6C (load); otherwise the memory is "
     "locked or worn out"},
    {Abort::local_control, "the device is under local control"},
    {Abort::device_state,
     "most settings are accepted in pre-operational only: hal can nmt {0} preop {1}"},
    {Abort::hardware, "see its error register: hal can sdo read {0} {1} 1001"},
    {Abort::no_resource, "all SDO channels of the device are in use"},
};

/// The advice about program data (1F50h), where it differs.
constexpr Advice program_advices[] = {
    {Abort::cannot_store,
     "the device rejected the image and may have no valid program now; check that the image is for "
     "this device"},
    {Abort::device_state,
     "stop and clear its program first: hal can sdo write {0} {1} 1F51:1 0 --type u8, then 3"},
};

const char* find_advice(std::span<const Advice> rows, Abort abort) {
    const auto row = std::find_if(rows.begin(), rows.end(),
                                  [&](const Advice& each) { return each.abort == abort; });
    return row == rows.end() ? nullptr : row->text;
}

/// Returns what to do about an abort; empty when there is no general advice.
std::string advice(Abort abort, const std::string& bus, unsigned node, std::uint16_t index) {
    constexpr std::uint16_t program_data = 0x1f50;
    const char* text = index == program_data ? find_advice(program_advices, abort) : nullptr;
    if (!text) {
        text = find_advice(advices, abort);
    }
    return text ? fmt::format(fmt::runtime(text), bus, node) : "";
}

}  // namespace

int NodeClient::fail_transfer(std::uint8_t node, const canopen::SdoRequest& request,
                              const std::string& object) const {
    if (bus.stop.requested() && !outlasts_stop && !request.aborted_by_server) {
        return fail(options_, fmt::format("interrupted while accessing node {}, {}", node, object));
    }
    if (request.abort == Abort::timeout && !request.aborted_by_server) {
        const can::Statistics s = bus.link->statistics();
        return fail(options_, fmt::format("node {} did not respond within {:g} s (object {}); the "
                                          "bus is {}; to list the nodes: hal can scan {}",
                                          node,
                                          static_cast<double>(settings_of(timeout_ns_).timeout) *
                                              (settings_of(timeout_ns_).resends + 1) / 1e9,
                                          object, can::to_string(s.state), options_.words.front()));
    }
    const std::string what = advice(request.abort, options_.words.front(), node, request.index);
    return fail(
        options_,
        fmt::format("node {}, {}: {}{} (0x{:08X}){}", node, object,
                    request.aborted_by_server ? "" : "gave up: ", canopen::to_string(request.abort),
                    static_cast<std::uint32_t>(request.abort), what.empty() ? "" : "; " + what));
}

bool parse_node(const std::string& text, std::uint8_t& node) {
    const std::optional<std::uint64_t> number = parse_natural(text);
    if (!number || *number < 1 || *number > 127) return false;
    node = static_cast<std::uint8_t>(*number);
    return true;
}

bool node_of(const Options& options, const std::string& text, std::uint8_t& node) {
    if (parse_node(text, node)) return true;
    fail(options, fmt::format("invalid node '{}'; write 1..127", text));
    return false;
}

}  // namespace hal::tools
