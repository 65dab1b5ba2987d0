// SPDX-License-Identifier: MIT
// What the conformance cases share. Their numbers and subjects are those of the conformance test's
// published reports; where a case only scans a device for what it has, ours checks that it has it.
#pragma once

#include "node.hpp"

namespace hal::canopen::test {

/// A device with everything the cases ask for: objects of all access rights and limits, four PDOs
/// each way, SDO channels, storing.
inline Description conforming() {
    Description d = basic_device({.device_type = 0x191,
                                  .vendor = 1,
                                  .product = 2,
                                  .revision = 3,
                                  .serial = 4,
                                  .name = "a conforming device",
                                  .heartbeat_consumers = 4,
                                  .emcy_consumers = 4});
    using enum Access;
    for (const std::uint16_t index : {std::uint16_t{0x1010}, std::uint16_t{0x1011}}) {
        d.add(index, 0, Type::unsigned8, constant, 2);
        for (std::uint8_t sub = 1; sub <= 2; ++sub) {
            d.add(index, sub, Type::unsigned32, read_write, 1);
        }
    }
    d.add(0x2000, 0, Type::unsigned32, read_write, 5).limited(2, 1000);
    d.add(0x2001, 0, Type::integer16, read_write, 0).limited(-100, 100);
    d.add(0x2002, 0, Type::unsigned8, write_only, 7);
    d.add(0x2003, 0, Type::unsigned8, read_only, 7);
    d.add(0x2004, 0, Type::unsigned16, read_write, 0);                   // not mappable
    d.add_domain(0x2006, 0, read_write, 10'000);
    d.add(0x6000, 0, Type::unsigned8, constant, 8);
    d.add(0x6200, 0, Type::unsigned8, constant, 8);
    for (std::uint8_t n = 1; n <= 8; ++n) {
        d.add(0x6000, n, Type::unsigned8, read_only, 0x10U + n).sent();      // process inputs
        d.add(0x6200, n, Type::unsigned8, read_write, 0).received();         // process outputs
    }
    d.add(0x6401, 0, Type::integer16, read_only, 0x1234).sent();
    d.add(0x6411, 0, Type::integer16, read_write, 0).received();
    add_rpdo(d, 1, {.mapping = {map_entry(0x6200, 1, 8), map_entry(0x6200, 2, 8)}});
    add_rpdo(d, 2, {.transmission = 1, .mapping = {map_entry(0x6411, 0, 16)}});
    add_rpdo(d, 3, {});
    add_rpdo(d, 4, {});
    add_tpdo(d, 1, {.mapping = {map_entry(0x6000, 1, 8), map_entry(0x6000, 2, 8)}});
    add_tpdo(d, 2, {.transmission = 1, .mapping = {map_entry(0x6401, 0, 16)}});
    add_tpdo(d, 3, {});
    add_tpdo(d, 4, {});
    add_sdo_server(d, 1, cob_invalid, cob_invalid);
    add_sdo_client(d, 0, cob_invalid, cob_invalid, 0);
    return d;
}

struct Conformance : Node {
    void SetUp() override { make(conforming()); }

    static Abort abort_of(const Frame& f) {
        return f.length == 8 && f.data[0] == 0x80
                   ? static_cast<Abort>(load<std::uint32_t>(f.data.data() + 4))
                   : Abort::none;
    }
    static bool one_of(Abort why, std::initializer_list<Abort> all) {
        return std::find(all.begin(), all.end(), why) != all.end();
    }
    /// Why it cannot be read; none when it can.
    Abort read_abort(std::uint16_t index, std::uint8_t sub) {
        return abort_of(sdo({0x40, static_cast<std::uint8_t>(index),
                             static_cast<std::uint8_t>(index >> 8), sub, 0, 0, 0, 0}));
    }
    unsigned width(std::uint16_t index, std::uint8_t sub) {
        return device->dictionary().find(index, sub)->size;
    }
    /// Written as wide as it is.
    Abort put(std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
        return write(index, sub, value, width(index, sub));
    }
    std::uint32_t get(std::uint16_t index, std::uint8_t sub) {
        const auto size = width(index, sub);
        return read(index, sub) & (size == 4 ? 0xffffffffU : (1U << 8 * size) - 1);
    }
    /// How many data frames with that identifier since the log was cleared.
    std::size_t count(std::uint32_t id) {
        std::size_t n = 0;
        for (const auto& f : since(id)) {
            n += f.remote ? 0 : 1;
        }
        return n;
    }
    std::size_t count_in(std::uint32_t id, Time ms) {
        bus.log.clear();
        run(ms);
        return count(id);
    }
    void sync(int counter = -1) {
        run(1);
        if (counter < 0) {
            send({0x80, {}});
        } else {
            send({0x80, {static_cast<std::uint8_t>(counter)}});
        }
    }
    std::size_t count_of_syncs(std::uint32_t id, unsigned syncs, unsigned overflow = 0) {
        bus.log.clear();
        for (unsigned n = 0; n < syncs; ++n) {
            overflow == 0 ? sync() : sync(static_cast<int>(n % overflow + 1));
        }
        return count(id);
    }
    void operational() {
        nmt(NmtCommand::start);
        run(1);
        bus.log.clear();
    }
};

}  // namespace hal::canopen::test
