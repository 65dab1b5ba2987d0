// SPDX-License-Identifier: MIT
// CompactPDO: PDOs that are counted and not described are all alike.
#include <algorithm>

#include "eds_reader.hpp"

namespace hal::canopen::eds {

namespace {

/// Returns the COB-ID of a PDO before it is configured (CiA 301, predefined connection set).
std::string default_cob(unsigned n, bool receive) {
    if (n >= 4) return "0x80000000";
    return "$NODEID+" + hex((receive ? 0x200u : 0x180u) + 0x100u * n, 3);
}

Object communication(std::uint16_t index, std::uint8_t mask, bool receive, unsigned n) {
    Object object;
    object.index = index;
    object.name = receive ? "RPDO communication parameter" : "TPDO communication parameter";
    object.type = ObjectType::record;
    struct Sub {
        const char* name;
        std::uint16_t type;
    };
    constexpr Sub subs[] = {{"COB-ID used by PDO", 7}, {"Transmission type", 5},
                            {"Inhibit time", 6},       {"Reserved", 5},
                            {"Event timer", 6},        {"SYNC start value", 5}};
    Entry entry;
    entry.data_type = 5;
    entry.access = Access::constant;
    entry.name = "Highest sub-index supported";
    object.entries.push_back(entry);
    for (unsigned i = 0; i < std::size(subs); ++i) {
        if ((mask >> i & 1) == 0) continue;
        entry.sub = static_cast<std::uint8_t>(i + 1);
        entry.name = subs[i].name;
        entry.data_type = subs[i].type;
        entry.access = Access::rw;
        entry.default_value = i == 0 ? default_cob(n, receive) : std::string();
        object.entries.push_back(entry);
    }
    object.entries.front().default_value = std::to_string(object.entries.back().sub);
    return object;
}

Object mapping(std::uint16_t index, bool receive) {
    Object object;
    object.index = index;
    object.name = receive ? "RPDO mapping parameter" : "TPDO mapping parameter";
    object.type = ObjectType::record;
    Entry entry;
    entry.data_type = 5;
    entry.name = "Number of mapped objects";
    entry.default_value = "0";
    object.entries.push_back(entry);
    entry.data_type = 7;
    for (unsigned i = 1; i <= 64; ++i) {
        entry.sub = static_cast<std::uint8_t>(i);
        entry.name = "Mapped object " + std::to_string(i);
        object.entries.push_back(entry);
    }
    return object;
}

void insert(DeviceDescription& out, Object object) {
    const auto at =
        std::lower_bound(out.objects.begin(), out.objects.end(), object.index,
                         [](const Object& o, std::uint16_t index) { return o.index < index; });
    out.objects.insert(at, std::move(object));
}

}  // namespace

void add_compact_pdos(DeviceDescription& out) {
    const std::uint8_t mask = out.device.compact_pdo;
    if (mask == 0) return;
    for (const bool receive : {true, false}) {
        const std::uint16_t base = receive ? 0x1400 : 0x1800;

        const std::uint16_t wanted = receive ? out.device.rx_pdos : out.device.tx_pdos;
        const auto described = std::count_if(
            out.objects.begin(), out.objects.end(),
            [&](const Object& o) { return o.index >= base && o.index < base + 0x200; });
        unsigned missing_pdos = described < wanted ? static_cast<unsigned>(wanted - described) : 0;
        for (std::uint16_t n = 0; missing_pdos > 0 && n < 0x200; ++n) {
            if (out.find(static_cast<std::uint16_t>(base + n)) != nullptr) continue;
            --missing_pdos;
            insert(out, communication(static_cast<std::uint16_t>(base + n), mask, receive, n));
            if (out.find(static_cast<std::uint16_t>(base + 0x200 + n)) == nullptr) {
                insert(out, mapping(static_cast<std::uint16_t>(base + 0x200 + n), receive));
            }
        }
    }
}

}  // namespace hal::canopen::eds
