// SPDX-License-Identifier: MIT
#include "object_writes.hpp"

#include <algorithm>

namespace hal::canopen {

namespace {

constexpr bool is_communication(std::uint16_t index) noexcept {
    return (index >= 0x1400 && index < 0x1600) || (index >= 0x1800 && index < 0x1a00);
}

std::vector<ObjectWrite> pdo_writes(std::uint16_t communication, unsigned number, const PdoDescription& wished, std::uint32_t predefined,
                                    std::uint8_t node) {
    const auto index = static_cast<std::uint16_t>(communication + number - 1);
    const auto mapping = static_cast<std::uint16_t>(index + 0x200);
    const auto pdo = (communication == 0x1400 ? "RPDO" : "TPDO") + std::to_string(number) + ' ';
    std::uint32_t cob = wished.cob;
    if (cob == 0) cob = number <= 4 ? predefined + (number - 1) * 0x100 + node : cob_invalid;
    else if (wished.plus_node_id) cob += node;
    const bool multiplexed = wished.multiplex != Multiplex::none;
    if (wished.mapping.empty() && !multiplexed) cob |= cob_invalid;
    std::vector<ObjectWrite> writes{object_write(index, 1, cob | cob_invalid, pdo + "COB-ID")};
    if (wished.mapping.empty() && !multiplexed) return writes;
    const auto add = [&](std::uint16_t at, std::uint8_t sub, auto value, const std::string& name) -> ObjectWrite& {
        writes.push_back(object_write(at, sub, value, pdo + name));
        return writes.back();
    };
    add(mapping, 0, std::uint8_t{0}, "mapping");
    for (std::size_t n = 0; n < wished.mapping.size(); ++n)
        add(mapping, static_cast<std::uint8_t>(n + 1), wished.mapping[n], "entry " + std::to_string(n + 1));
    add(mapping, 0, multiplexed ? static_cast<std::uint8_t>(wished.multiplex) : static_cast<std::uint8_t>(wished.mapping.size()),
        "mapping");
    add(index, 2, wished.transmission, "transmission type");
    add(index, 3, wished.inhibit_100us, "inhibit time").optional = wished.inhibit_100us == 0;
    add(index, 5, wished.event_ms, "event timer").optional = wished.event_ms == 0;
    if (communication == 0x1800) add(index, 6, wished.sync_start, "SYNC start value").optional = wished.sync_start == 0;
    if ((cob & cob_invalid) == 0) add(index, 1, cob, "COB-ID");
    return writes;
}

}  // namespace

std::vector<ObjectWrite> rpdo_writes(unsigned number, const PdoDescription& wished, std::uint8_t node) {
    return pdo_writes(0x1400, number, wished, 0x200, node);
}
std::vector<ObjectWrite> tpdo_writes(unsigned number, const PdoDescription& wished, std::uint8_t node) {
    return pdo_writes(0x1800, number, wished, 0x180, node);
}

std::vector<ObjectWrite> object_writes(std::span<const eds::Write> writes) {
    std::vector<ObjectWrite> result;
    for (const auto& w : writes) result.push_back({w});
    return result;
}

bool same_value(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> wished,
                std::span<const std::uint8_t> found) noexcept {
    if (is_communication(index) && sub == 1 && wished.size() == 4 && found.size() == 4) {
        const auto a = load<std::uint32_t>(wished.data()), b = load<std::uint32_t>(found.data());
        if (((a | b) & cob_invalid) != 0) return ((a & b) & cob_invalid) != 0;
        return ((a ^ b) & ~cob_flag30) == 0;
    }
    return std::ranges::equal(wished, found);
}

}  // namespace hal::canopen
