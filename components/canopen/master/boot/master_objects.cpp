// SPDX-License-Identifier: MIT
#include "master_objects.hpp"

namespace hal::canopen {

namespace {

constexpr std::uint16_t request_nmt = 0x1f82;
constexpr std::uint8_t all_nodes = 128;
// Values read from 1F82h besides the NMT states.
constexpr std::uint8_t state_unknown = 0;
constexpr std::uint8_t node_missing = 1;
// Values written to 1F82h.
constexpr std::uint8_t to_stopped = 4;
constexpr std::uint8_t to_operational = 5;
constexpr std::uint8_t reset_node = 6;
constexpr std::uint8_t reset_communication = 7;

constexpr std::uint8_t to_pre_operational = 127;

}  // namespace

std::uint32_t startup_of(const MasterSetup& s) {
    const auto bit = [](bool value, unsigned number) { return value ? 1U << number : 0U; };
    std::uint32_t value = 1U | bit(s.start_all_at_once, 1) | bit(!s.start_self, 2);
    bool nobody = !s.nodes.empty();
    for (const auto& n : s.nodes) {
        nobody = nobody && !n.start;
        if (!n.mandatory) continue;
        if (n.on_failure == Reaction::reset_all) {
            value |= 1U << 4;
        }
        if (n.on_failure == Reaction::stop_all) {
            value |= 1U << 6;
        }
    }
    return value | bit(nobody, 3);
}

std::uint32_t assignment_of(const NodeSetup& n) {
    const auto bit = [](bool value, unsigned number) { return value ? 1U << number : 0U; };
    return bit(true, 0) | bit(n.configure, 2) | bit(n.mandatory, 3) | bit(n.keep_alive, 4) |
           bit(n.program.checked(), 5) | bit(n.program.update, 6) | bit(n.restore, 7) |
           std::uint32_t{n.guard_ms != 0 ? n.guard_factor : std::uint8_t{0}} << 8 |
           std::uint32_t{n.guard_ms} << 16;
}

void add_master_objects(Description& d, const MasterSetup& s) {
    using enum Access;
    d.add(0x102a, 0, Type::unsigned16, read_only,
          static_cast<std::uint64_t>(s.nmt_inhibit / (100 * microsecond)), "NMT inhibit time");
    d.add(0x1f80, 0, Type::unsigned32, read_only, startup_of(s), "NMT startup");
    Time max = 0;
    struct List {
        std::uint16_t index;
        const char* name;
        std::uint32_t (*value)(const NodeSetup&);
    };
    constexpr List lists[] = {
        {0x1f81, "NMT slave assignment", [](const NodeSetup& n) { return assignment_of(n); }},
        {0x1f84, "Device type identification", [](const NodeSetup& n) { return n.device_type; }},
        {0x1f85, "Vendor identification", [](const NodeSetup& n) { return n.vendor; }},
        {0x1f86, "Product code", [](const NodeSetup& n) { return n.product; }},
        {0x1f87, "Revision number", [](const NodeSetup& n) { return n.revision; }},
        {0x1f88, "Serial number", [](const NodeSetup& n) { return n.serial; }},
    };
    for (const auto& list : lists) {
        d.add(list.index, 0, Type::unsigned8, constant, 127, list.name);
        for (const auto& n : s.nodes) {
            d.add(list.index, n.id, Type::unsigned32, read_only, list.value(n));
        }
    }
    d.add(request_nmt, 0, Type::unsigned8, constant, all_nodes, "Request NMT");
    for (const auto& n : s.nodes) {
        d.add(request_nmt, n.id, Type::unsigned8, read_write);
        if (n.mandatory && n.boot_limit > max) {
            max = n.boot_limit;
        }
    }
    d.add(request_nmt, all_nodes, Type::unsigned8, write_only);
    d.add(0x1f89, 0, Type::unsigned32, read_only, static_cast<std::uint64_t>(max / millisecond),
          "Boot time");
}

MasterObjects::MasterObjects(Dictionary& dictionary, Master& master) : master_(master) {
    dictionary.handle(request_nmt, *this);
}

Abort MasterObjects::reading(Entry& e) noexcept {
    if (e.sub == 0 || e.sub >= all_nodes) return Abort::none;
    const auto& s = master_.status(e.sub);
    if (!s.online) {
        e.data[0] = node_missing;
    } else if (s.last_heard == 0) {
        e.data[0] = state_unknown;
    } else {
        e.data[0] = static_cast<std::uint8_t>(s.state);
    }
    return Abort::none;
}

Abort MasterObjects::writing(Entry& e, std::span<const std::uint8_t> value) noexcept {
    if (e.sub == 0) return Abort::none;
    const auto id = e.sub == all_nodes ? std::uint8_t{0} : e.sub;
    const auto command = [&](NmtCommand c) {
        return master_.command(c, id, master_.now()) ? Abort::none : Abort::no_sub;
    };
    switch (value[0]) {
    case to_stopped: return command(NmtCommand::stop);
    case to_operational: return command(NmtCommand::start);
    case reset_node: return command(NmtCommand::reset_node);
    case reset_communication: return command(NmtCommand::reset_communication);
    case to_pre_operational: return command(NmtCommand::enter_pre_operational);
    default: return Abort::value;
    }
}

}  // namespace hal::canopen
