// SPDX-License-Identifier: MIT
#include <algorithm>
#include <string>
#include <type_traits>

#include "cia402/drive/axis_objects.hpp"
#include "drive.hpp"

namespace hal::canopen {

using namespace cia402;

namespace {
void add_axis(Description& d, unsigned axis, const AxisSettings& settings) {
    AxisValues objects(possible(settings));
    // A second axis needs names of its own.
    const std::string suffix = axis == 0 ? "" : " " + std::to_string(axis + 1);
    each_object(objects, [&](const ObjectRow& row, const auto& value) {
        using T = std::remove_cvref_t<decltype(value)>;
        const auto index = of_axis(row.index, axis);
        if (row.sub != 0) {
            if (row.sub == 1) {
                d.add(index, 0, Type::unsigned8, Access::constant, 0, "Highest sub-index" + suffix);
            }
            d.find(index, 0)->value[0] = row.sub;
        }
        auto& entry = d.add(index, row.sub, cia301::type_for<T>(), row.access,
                            static_cast<std::uint64_t>(value), row.name + suffix);
        switch (row.pdo) {
        case ObjectRow::sent: entry.sent(); break;
        case ObjectRow::received:  // a master may read back what it commands
        case ObjectRow::both: entry.mappable(); break;
        case ObjectRow::no_pdo: break;
        }
        if (row.low != 0 || row.high != 0) {
            entry.limited(row.low, row.high);
        }
    });
    struct Carried {
        std::uint16_t index;
        std::uint8_t sub, bits;
    };
    using namespace object;
    constexpr Carried nothing{0, 0, 0};
    constexpr Carried received[] = {nothing,
                                    {modes_of_operation, 0, 8},
                                    {target_position, 0, 32},
                                    {target_velocity, 0, 32},
                                    {target_torque, 0, 16},
                                    {vl_target_velocity, 0, 16},
                                    {digital_outputs, 1, 32}};
    constexpr Carried sent[] = {nothing,
                                {modes_of_operation_display, 0, 8},
                                {position_actual, 0, 32},
                                {velocity_actual, 0, 32},
                                {torque_actual, 0, 16},
                                {vl_control_effort, 0, 16},
                                {digital_inputs, 0, 32}};
    const auto mapping = [&](std::uint16_t word, const Carried& c) {
        std::vector<std::uint32_t> result{map_entry(of_axis(word, axis), 0, 16)};
        if (c.index != 0) {
            result.push_back(map_entry(of_axis(c.index, axis), c.sub, c.bits));
        }
        return result;
    };
    for (unsigned n = 1; n <= 7; ++n) {
        // Status is sent on change; values that change continuously are sent with the SYNC.
        add_rpdo(d, pdo_of_axis(n, axis), {.mapping = mapping(controlword, received[n - 1])});
        const std::uint8_t transmission = n <= 2 ? 255 : 1;
        add_tpdo(d, pdo_of_axis(n, axis),
                 {.transmission = transmission, .mapping = mapping(statusword, sent[n - 1])});
    }
}
}  // namespace

Description drive_description(const DriveSettings& settings) {
    const auto axes = std::clamp(settings.axes, 1U, max_axes);
    Description d =
        basic_device({.device_type = (axes == 1 ? servo_drive : 0xffff0000) | profile_number,
                      .vendor = settings.vendor,
                      .product = settings.product,
                      .revision = settings.revision,
                      .serial = settings.serial,
                      .name = settings.name,
                      .heartbeat_ms = settings.heartbeat_ms});
    for (const std::uint16_t index : {std::uint16_t{0x1010}, std::uint16_t{0x1011}}) {
        const bool stores = index == 0x1010;
        d.add(index, 0, Type::unsigned8, Access::constant, 3, "Highest sub-index");
        d.add(index, 1, Type::unsigned32, Access::read_write, 1,
              stores ? "Save all" : "Restore all");
        d.add(index, 2, Type::unsigned32, Access::read_write, 1,
              stores ? "Save communication" : "Restore communication");
        d.add(index, 3, Type::unsigned32, Access::read_write, 1,
              stores ? "Save application" : "Restore application");
    }
    for (unsigned n = 0; n < axes; ++n) {
        add_axis(d, n, settings.axis[n]);
    }
    for (const std::uint16_t index : settings.without) {
        std::erase_if(d.entries, [&](const EntryDescription& e) { return e.index == index; });
        d.objects.erase(index);
    }
    return d;
}

}  // namespace hal::canopen
