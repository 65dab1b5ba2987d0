// SPDX-License-Identifier: MIT
#include "emergency_text.hpp"

#include <algorithm>

#include "canopen/protocol/emcy.hpp"
#include "cia402/drive_profile.hpp"
#include "cia402/error_words.hpp"

namespace hal::canopen {

namespace {

bool is_drive(const config::Node& node) noexcept {
    const auto of_drive = [](const config::Object& o) {
        const auto index = cia402::of_first_axis(o.index);
        return !o.filler &&
               (index == cia402::object::controlword || index == cia402::object::statusword);
    };
    return (node.setup.device_type & 0xffff) == cia402::profile_number ||
           std::any_of(node.pdos.begin(), node.pdos.end(), [&](const config::Pdo& p) {
        return std::any_of(p.objects.begin(), p.objects.end(), of_drive);
    });
}

}  // namespace

const char* emergency_text(const config::MasterConfig& config, std::uint8_t id,
                           std::uint16_t code) noexcept {
    for (const config::Node& n : config.nodes) {
        if (n.setup.id == id && is_drive(n)) return cia402::error_word(code);
    }
    return emergency_text(code);
}

}  // namespace hal::canopen
