// SPDX-License-Identifier: MIT
#include "srdo_description.hpp"

#include <algorithm>

#include "cia301/shorthand.hpp"

namespace hal::canopen {

namespace {
using namespace cia301::shorthand;

constexpr std::size_t max_mapped = 16;

template <class T>
std::uint16_t with(std::uint16_t crc, T value) noexcept {
    std::array<std::uint8_t, sizeof(T)> bytes;
    store(bytes.data(), value);
    return crc16(bytes, crc);
}
}  // namespace

std::uint16_t srdo_signature(const SrdoDescription& s) noexcept {
    std::uint16_t crc = with(0, static_cast<std::uint8_t>(s.direction));
    crc = with(crc, s.cycle_ms);
    crc = with(crc, s.validation_ms);
    crc = with(crc, s.cob);
    crc = with(crc, s.cob == 0 ? 0 : s.cob + 1);
    crc = with(crc, static_cast<std::uint8_t>(s.mapping.size()));
    for (std::size_t n = 0; n < s.mapping.size(); ++n) {
        crc = with(with(crc, static_cast<std::uint8_t>(n + 1)), s.mapping[n]);
    }
    return crc;
}

void add_srdos(Description& d, std::span<const SrdoDescription> srdos) {
    const auto count = std::min<std::size_t>(srdos.size(), Srdos::max_srdos);
    if (count == 0) return;
    d.add(0x1300, 0, u8, rw, 1, "Global fail-safe command parameter");
    d.objects[0x13ff] = "Safety configuration signature";
    d.add(0x13ff, 0, u8, fixed, count, "Highest sub-index");
    bool valid = true;
    for (std::size_t n = 0; n < count; ++n) {
        const auto& s = srdos[n];
        const auto index = static_cast<std::uint16_t>(0x1301 + n);

        const auto mapping = static_cast<std::uint16_t>(0x1381 + n);
        const std::string number = "SRDO " + std::to_string(n + 1);
        d.objects[index] = number + " communication parameter";

        d.objects[mapping] = number + " mapping parameter";
        d.add(index, 0, u8, fixed, 6, "Highest sub-index");
        d.add(index, 1, u8, rw, static_cast<std::uint8_t>(s.direction), "Information direction");
        d.add(index, 2, u16, rw, s.cycle_ms, "Refresh time or SCT");
        d.add(index, 3, u8, rw, s.validation_ms, "SRVT");
        d.add(index, 4, u8, fixed, 254, "Transmission type");
        d.add(index, 5, u32, rw, s.cob, "COB-ID 1");
        d.add(index, 6, u32, rw, s.cob == 0 ? 0 : s.cob + 1, "COB-ID 2");
        d.add(mapping, 0, u8, rw, s.mapping.size(), "Number of mapped objects");
        for (std::size_t k = 0; k < std::max(max_mapped, s.mapping.size()); ++k) {
            d.add(mapping, static_cast<std::uint8_t>(k + 1), u32, rw,
                  k < s.mapping.size() ? s.mapping[k] : 0, "Mapped object");
        }
        d.add(0x13ff, static_cast<std::uint8_t>(n + 1), u16, rw, srdo_signature(s),
              number + " signature");
        valid = valid && (s.direction == SrdoDirection::none || s.cob != 0);
    }
    d.add(0x13fe, 0, u8, rw, valid ? Srdos::valid_mark : 0, "Configuration valid");
}

}  // namespace hal::canopen
