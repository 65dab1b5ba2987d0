// SPDX-License-Identifier: MIT
#include "jr3.hpp"

namespace hal::canopen {

namespace {

constexpr const char* channel[] = {"Fx", "Fy", "Fz", "Mx", "My", "Mz"};

struct Row {
    std::uint16_t index;
    const char* object;
    Type type;
    Access access;
    bool sent = false;
    double real = 0.0;
    std::uint64_t value = 0;
};

void add(Description& d, const Row& row) {
    d.objects[row.index] = row.object;
    d.add(row.index, 0, Type::unsigned8, Access::constant, 6, "Highest sub-index");
    for (std::uint8_t n = 1; n <= 6; ++n) {
        auto& e = is_real(row.type)
                      ? d.add_real(row.index, n, row.type, row.access, row.real, channel[n - 1])
                      : d.add(row.index, n, row.type, row.access, row.value, channel[n - 1]);
        e.tpdo = row.sent;
    }
}

void add_own(Description& d, const jr3::Calibration& c) {
    d.objects[0x2100] = "Decoupling matrix";
    d.add(0x2100, 0, Type::unsigned8, Access::constant, 36, "Highest sub-index");
    for (unsigned n = 0; n < 36; ++n) {
        d.add_real(0x2100, static_cast<std::uint8_t>(n + 1), Type::real32, Access::read_only,
                   c.matrix[n / 6][n % 6], std::string(channel[n / 6]) + " of " + channel[n % 6]);
    }
    add(d, {0x2101, "Full scale", Type::real32, Access::read_only});
    add(d, {0x2102, "Overload of the sensor", Type::real32, Access::read_only});
    add(d, {0x2103, "Overload limit", Type::real32, Access::read_write});
    for (std::uint8_t n = 1; n <= 6; ++n) {
        const auto put = [&](std::uint16_t index, double value) {
            store(d.find(index, n)->value.data(), static_cast<float>(value));
        };
        put(0x2101, c.full_scale[n - 1U]);
        put(0x2102, c.overload[n - 1U]);

        put(0x2103, c.full_scale[n - 1U]);
    }
    d.add_domain(0x2104, 0, Access::read_only, jr3::memory_size, "Calibration memory");
    d.add(0x2105, 0, Type::unsigned32, Access::read_only, c.serial, "Serial number of the sensor");
    d.add(0x2200, 0, Type::integer16, Access::read_only, 0, "Supply voltage feedback").sent();
    d.add(0x2201, 0, Type::unsigned8, Access::read_only, 0, "Sensor status").sent();
    d.add(0x2202, 0, Type::unsigned8, Access::read_only, 0, "Sample counter").sent();
    d.add(0x2203, 0, Type::unsigned32, Access::read_only, 0, "Packets received");
    d.add(0x2204, 0, Type::unsigned32, Access::read_only, 0, "Packets with errors");
}

constexpr std::uint32_t newton = 0x00210000;  // CiA 303-2; torques have no unit code
constexpr AnalogChannel channels[] = {{"Fx", 0, newton, 2}, {"Fy", 0, newton, 2},
                                      {"Fz", 0, newton, 2}, {"Mx", 0, 0, 3},
                                      {"My", 0, 0, 3},      {"Mz", 0, 0, 3}};

}  // namespace

Description jr3_description(const Jr3Settings& s) {
    Description d = basic_device({.device_type = 0x00040194,
                                  .vendor = example_vendor,
                                  .product = 0x404,
                                  .revision = 0x00010000,
                                  .serial = s.serial,
                                  .name = "Halcyon JR3",
                                  .heartbeat_ms = s.heartbeat_ms});
    add_storage(d);
    add_own(d, s.calibration);
    add_analog_inputs(d, channels);
    for (unsigned pdo = 1; pdo <= 4; ++pdo) {
        PdoDescription p;
        const bool by_change = pdo % 2 == 1;
        p.cob = 0x180 + (pdo - 1) * 0x100 + (by_change ? cob_invalid : 0);
        p.plus_node_id = true;
        p.transmission = by_change ? 255 : 1;
        p.inhibit_100us = by_change ? 10 : 0;
        for (unsigned n = 0; n < 3; ++n) {
            p.mapping.push_back(
                map_entry(0x7130, static_cast<std::uint8_t>((pdo <= 2 ? 1 : 4) + n), 16));
        }
        p.mapping.push_back(map_entry(0x2201, 0, 8));
        p.mapping.push_back(map_entry(0x2202, 0, 8));
        add_tpdo(d, pdo, p);
    }
    return d;
}

}  // namespace hal::canopen
