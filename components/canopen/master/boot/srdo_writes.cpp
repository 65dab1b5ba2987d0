// SPDX-License-Identifier: MIT
#include "srdo_writes.hpp"

namespace hal::canopen {

std::vector<ObjectWrite> srdo_writes(unsigned number, const SrdoDescription& s) {
    const auto index = static_cast<std::uint16_t>(0x1300 + number);

    const auto mapping = static_cast<std::uint16_t>(0x1380 + number);
    const std::string srdo = "SRDO" + std::to_string(number) + ' ';
    std::vector<ObjectWrite> writes;
    const auto add = [&](std::uint16_t at, std::uint8_t sub, auto value, const std::string& name) {
        writes.push_back(object_write(at, sub, value, srdo + name));
    };
    add(mapping, 0, std::uint8_t{0}, "mapping");
    for (std::size_t n = 0; n < s.mapping.size(); ++n) {
        add(mapping, static_cast<std::uint8_t>(n + 1), s.mapping[n],
            "entry " + std::to_string(n + 1));
    }
    add(mapping, 0, static_cast<std::uint8_t>(s.mapping.size()), "mapping");
    add(index, 1, static_cast<std::uint8_t>(s.direction), "direction");
    add(index, 2, s.cycle_ms, s.direction == SrdoDirection::sends ? "refresh time" : "SCT");
    add(index, 3, s.validation_ms, "SRVT");
    add(index, 5, s.cob, "COB-ID 1");
    add(index, 6, s.cob + 1, "COB-ID 2");
    add(0x13ff, static_cast<std::uint8_t>(number), srdo_signature(s), "signature");
    return writes;
}

ObjectWrite srdo_valid_write() {
    return object_write(0x13fe, 0, Srdos::valid_mark, "configuration valid");
}

}  // namespace hal::canopen
