// SPDX-License-Identifier: MIT
// Objects of CiA 402 and the synchronisation parameters, which need no description of the device.
#include "ethercat/config/slave_pdos.hpp"

namespace hal::ethercat::config {

namespace {

using master::Type;

struct ProfileObject {
    std::uint16_t index;
    std::uint8_t sub;
    Type type;
    const char* name;
};
constexpr ProfileObject profile_objects[] = {
    {0x603f, 0, Type::u16, "error-code"},
    {0x6040, 0, Type::u16, "controlword"},
    {0x6041, 0, Type::u16, "statusword"},
    {0x6060, 0, Type::s8, "modes-of-operation"},
    {0x6061, 0, Type::s8, "modes-of-operation-display"},
    {0x6064, 0, Type::s32, "position-actual-value"},
    {0x6065, 0, Type::u32, "following-error-window"},
    {0x606c, 0, Type::s32, "velocity-actual-value"},
    {0x6071, 0, Type::s16, "target-torque"},
    {0x6072, 0, Type::u16, "max-torque"},
    {0x6077, 0, Type::s16, "torque-actual-value"},
    {0x607a, 0, Type::s32, "target-position"},
    {0x607c, 0, Type::s32, "home-offset"},
    {0x607d, 1, Type::s32, "min-position-limit"},
    {0x607d, 2, Type::s32, "max-position-limit"},
    {0x6080, 0, Type::u32, "max-motor-speed"},
    {0x6081, 0, Type::u32, "profile-velocity"},
    {0x6083, 0, Type::u32, "profile-acceleration"},
    {0x6084, 0, Type::u32, "profile-deceleration"},
    {0x6085, 0, Type::u32, "quick-stop-deceleration"},
    {0x608f, 1, Type::u32, "position-encoder-resolution-1"},
    {0x608f, 2, Type::u32, "position-encoder-resolution-2"},
    {0x6091, 1, Type::u32, "gear-ratio-1"},
    {0x6091, 2, Type::u32, "gear-ratio-2"},
    {0x6092, 1, Type::u32, "feed-constant-1"},
    {0x6092, 2, Type::u32, "feed-constant-2"},
    {0x6098, 0, Type::s8, "homing-method"},
    {0x6099, 1, Type::u32, "homing-speed-switch"},
    {0x6099, 2, Type::u32, "homing-speed-zero"},
    {0x609a, 0, Type::u32, "homing-acceleration"},
    {0x60b0, 0, Type::s32, "position-offset"},
    {0x60b1, 0, Type::s32, "velocity-offset"},
    {0x60b2, 0, Type::s16, "torque-offset"},
    {0x60b8, 0, Type::u16, "touch-probe-function"},
    {0x60b9, 0, Type::u16, "touch-probe-status"},
    {0x60ba, 0, Type::s32, "touch-probe-1-positive-edge"},
    {0x60bb, 0, Type::s32, "touch-probe-1-negative-edge"},
    {0x60bc, 0, Type::s32, "touch-probe-2-positive-edge"},
    {0x60bd, 0, Type::s32, "touch-probe-2-negative-edge"},
    {0x60c2, 1, Type::u8, "interpolation-time-value"},
    {0x60c2, 2, Type::s8, "interpolation-time-index"},
    {0x60e4, 1, Type::s32, "additional-position-actual-value-1"},
    {0x60e6, 1, Type::u32, "additional-encoder-increments-1"},
    {0x60e8, 1, Type::u32, "additional-gear-motor-revolutions-1"},
    {0x60e9, 1, Type::u32, "additional-feed-1"},
    {0x60eb, 1, Type::u32, "additional-encoder-motor-revolutions-1"},
    {0x60ed, 1, Type::u32, "additional-gear-shaft-revolutions-1"},
    {0x60ee, 1, Type::u32, "additional-feed-shaft-revolutions-1"},
    {0x60f4, 0, Type::s32, "following-error"},
    {0x60fd, 0, Type::u32, "digital-inputs"},
    {0x60fe, 1, Type::u32, "digital-outputs"},
    {0x60fe, 2, Type::u32, "digital-outputs-mask"},
    {0x60ff, 0, Type::s32, "target-velocity"},
    {0x6502, 0, Type::u32, "supported-drive-modes"},
};
constexpr unsigned width_of(Type t) {
    constexpr unsigned widths[] = {1, 8, 16, 32, 64, 8, 16, 32, 64, 32, 64};
    return widths[static_cast<std::size_t>(t)];
}

/// Returns the name of an object of an axis; with several axes it has the number of its own.
std::string name_on(unsigned axis, unsigned axes, const char* name) {
    return axes > 1 ? "axis-" + std::to_string(axis + 1) + "-" + name : std::string(name);
}

}  // namespace

std::optional<ObjectAddress> profile_address(std::string_view name, unsigned axes) {
    for (unsigned axis = 0; axis < axes; ++axis) {
        for (const ProfileObject& o : profile_objects) {
            if (name != name_on(axis, axes, o.name)) continue;
            ObjectAddress address;
            address.index = static_cast<std::uint16_t>(o.index + 0x800U * axis);
            address.sub = o.sub;
            return address;
        }
    }
    return std::nullopt;
}

Known profile_object(std::uint16_t index, std::uint8_t sub, unsigned axes) {
    if (index >= 0x1c32 && index <= 0x1c33 && sub >= 1 && sub <= 6) {
        return sub == 1 || sub == 4 ? Known{"", Type::u16, 16} : Known{"", Type::u32, 32};
    }
    for (unsigned axis = 0; axis < axes; ++axis) {
        for (const ProfileObject& o : profile_objects) {
            if (o.index + 0x800U * axis == index && o.sub == sub) {
                return {name_on(axis, axes, o.name), o.type, width_of(o.type)};
            }
        }
    }
    return {};
}

}  // namespace hal::ethercat::config
