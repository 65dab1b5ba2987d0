// SPDX-License-Identifier: MIT
#include "object_writes.hpp"

#include <algorithm>

namespace hal::canopen {

namespace {

constexpr bool is_communication(std::uint16_t index) noexcept {
    return (index >= 0x1400 && index < 0x1600) || (index >= 0x1800 && index < 0x1a00);
}

std::vector<ObjectWrite> pdo_writes(std::uint16_t communication, unsigned number,
                                    const PdoDescription& p, std::uint32_t predefined,
                                    std::uint8_t node) {
    const auto index = static_cast<std::uint16_t>(communication + number - 1);
    const auto mapping = static_cast<std::uint16_t>(index + 0x200);
    const auto pdo = (communication == 0x1400 ? "RPDO" : "TPDO") + std::to_string(number) + ' ';
    std::uint32_t cob = p.cob;
    if (cob == 0) {
        // only the first four PDOs have predefined COB-IDs (CiA 301, 7.3.5)
        cob = number <= 4 ? predefined + (number - 1) * 0x100 + node : cob_invalid;
    } else if (p.plus_node_id) {
        cob += node;
    }
    const bool multiplexed = p.multiplex != Multiplex::none;
    if (p.mapping.empty() && !multiplexed) {
        cob |= cob_invalid;
    }
    // off first: a mapping may change only while its PDO is invalid
    std::vector<ObjectWrite> writes{object_write(index, 1, cob | cob_invalid, pdo + "COB-ID")};
    if (p.mapping.empty() && !multiplexed) return writes;
    const auto add = [&](std::uint16_t at, std::uint8_t sub, auto value,
                         const std::string& name) -> ObjectWrite& {
        writes.push_back(object_write(at, sub, value, pdo + name));
        return writes.back();
    };
    add(mapping, 0, std::uint8_t{0}, "mapping");
    for (std::size_t n = 0; n < p.mapping.size(); ++n) {
        add(mapping, static_cast<std::uint8_t>(n + 1), p.mapping[n],
            "entry " + std::to_string(n + 1));
    }
    add(mapping, 0,
        multiplexed ? static_cast<std::uint8_t>(p.multiplex)
                    : static_cast<std::uint8_t>(p.mapping.size()),
        "mapping");
    add(index, 2, p.transmission, "transmission type");
    // 0 is the default: a node without these objects has it
    add(index, 3, p.inhibit_100us, "inhibit time").optional = p.inhibit_100us == 0;
    add(index, 5, p.event_ms, "event timer").optional = p.event_ms == 0;
    if (communication == 0x1800) {
        add(index, 6, p.sync_start, "SYNC start value").optional = p.sync_start == 0;
    }
    if ((cob & cob_invalid) == 0) {
        add(index, 1, cob, "COB-ID");
    }
    return writes;
}

}  // namespace

std::vector<ObjectWrite> rpdo_writes(unsigned number, const PdoDescription& p, std::uint8_t node) {
    return pdo_writes(0x1400, number, p, 0x200, node);
}
std::vector<ObjectWrite> tpdo_writes(unsigned number, const PdoDescription& p, std::uint8_t node) {
    return pdo_writes(0x1800, number, p, 0x180, node);
}

std::vector<ObjectWrite> object_writes(std::span<const eds::Write> writes) {
    std::vector<ObjectWrite> result;
    for (const auto& w : writes) {
        result.push_back({w});
    }
    return result;
}

bool same_value(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> expected,
                std::span<const std::uint8_t> found) noexcept {
    if (is_communication(index) && sub == 1 && expected.size() == 4 && found.size() == 4) {
        const auto a = load<std::uint32_t>(expected.data());
        const auto b = load<std::uint32_t>(found.data());
        if (((a | b) & cob_invalid) != 0) return ((a & b) & cob_invalid) != 0;
        return ((a ^ b) & ~cob_flag30) == 0;
    }
    return std::ranges::equal(expected, found);
}

}  // namespace hal::canopen
