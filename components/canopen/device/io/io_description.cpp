// SPDX-License-Identifier: MIT
#include <algorithm>
#include <limits>
#include <stdexcept>

#include "cia301/shorthand.hpp"
#include "io.hpp"

namespace hal::canopen {

namespace {

/// Describes sub-indices 1…count, and sub-index 0.
struct Row {
    std::uint16_t index;
    const char *object, *each;  ///< "Input block" gives "Input block 1" …
    Type type;
    Access access;
    bool rpdo = false;
    bool tpdo = false;
    std::uint64_t value = 0;
    double real = 0.0;
};

void add(Description& d, unsigned count, const Row& row) {
    if (count == 0) return;
    d.objects[row.index] = row.object;
    d.add(row.index, 0, Type::unsigned8, Access::constant, count, "Highest sub-index");
    for (unsigned n = 1; n <= count; ++n) {
        const auto sub = static_cast<std::uint8_t>(n);
        const auto name = std::string(row.each) + " " + std::to_string(n);
        auto& e = row.type == Type::real32
                      ? d.add_real(row.index, sub, row.type, row.access, row.real, name)
                      : d.add(row.index, sub, row.type, row.access, row.value, name);
        e.rpdo = row.rpdo;
        e.tpdo = row.tpdo;
    }
}

using namespace cia301::shorthand;

void add_digital_inputs(Description& d, unsigned bits) {
    const unsigned n = (bits + 7) / 8;
    const Row rows[] = {
        {0x6000, "Read input 8-bit", "Input block", u8, ro, false, true},
        {0x6002, "Polarity input 8-bit", "Input block", u8, rw},
        {0x6003, "Filter constant input 8-bit", "Input block", u8, rw},
        {0x6006, "Interrupt mask any change 8-bit", "Input block", u8, rw, false, false, 0xff},
        {0x6007, "Interrupt mask low to high 8-bit", "Input block", u8, rw},
        {0x6008, "Interrupt mask high to low 8-bit", "Input block", u8, rw},
    };
    for (const auto& row : rows) {
        add(d, n, row);
    }
    if (bits != 0) {
        d.add(0x6005, 0, boolean, rw, 1, "Global interrupt enable digital");
    }
    add(d, bits, {0x6020, "Read single input", "Input", boolean, ro, false, true});
    add(d, (bits + 15) / 16, {0x6100, "Read input 16-bit", "Input block", u16, ro, false, true});
    add(d, (bits + 31) / 32, {0x6120, "Read input 32-bit", "Input block", u32, ro, false, true});
    if (bits != 0) {
        d.add(0x2000, 0, u16, rw, 10, "Input filter time");
    }
}

void add_digital_outputs(Description& d, unsigned bits) {
    const unsigned n = (bits + 7) / 8;
    const Row rows[] = {
        {0x6200, "Write output 8-bit", "Output block", u8, rw, true, true},
        {0x6202, "Change polarity output 8-bit", "Output block", u8, rw},
        {0x6206, "Error mode output 8-bit", "Output block", u8, rw, false, false, 0xff},
        {0x6207, "Error value output 8-bit", "Output block", u8, rw},
        {0x6208, "Filter mask output 8-bit", "Output block", u8, rw, false, false, 0xff},
    };
    for (const auto& row : rows) {
        add(d, n, row);
    }
    add(d, bits, {0x6220, "Write single output", "Output", boolean, rw, true, true});
    add(d, (bits + 15) / 16, {0x6300, "Write output 16-bit", "Output block", u16, rw, true, true});
    add(d, (bits + 31) / 32, {0x6320, "Write output 32-bit", "Output block", u32, rw, true, true});
}

void add_analog_inputs(Description& d, unsigned n) {
    if (n == 0) return;
    const Row rows[] = {
        {0x6400, "Read analogue input 8-bit", "Analogue input", i8, ro, false, true},
        {0x6401, "Read analogue input 16-bit", "Analogue input", i16, ro, false, true},
        {0x6402, "Read analogue input 32-bit", "Analogue input", i32, ro, false, true},
        {0x6403, "Read analogue input float", "Analogue input", real, ro, false, true},
        {0x6421, "Analogue input interrupt trigger selection", "Analogue input", u8, rw, false,
         false, 7},
        {0x6424, "Analogue input interrupt upper limit integer", "Analogue input", i32, rw},
        {0x6425, "Analogue input interrupt lower limit integer", "Analogue input", i32, rw},
        {0x6426, "Analogue input interrupt delta unsigned", "Analogue input", u32, rw},
        {0x6427, "Analogue input interrupt negative delta unsigned", "Analogue input", u32, rw},
        {0x6428, "Analogue input interrupt positive delta unsigned", "Analogue input", u32, rw},
        {0x642e, "Analogue input offset float", "Analogue input", real, rw},
        {0x642f, "Analogue input scaling float", "Analogue input", real, rw, false, false, 0, 1.0},
    };
    for (const auto& row : rows) {
        add(d, n, row);
    }
    for (unsigned sub = 1; sub <= n; ++sub) {
        d.find(0x6421, static_cast<std::uint8_t>(sub))->limited(0, 31);
    }
    add(d, 1,
        {0x6422, "Analogue input interrupt source", "Interrupt source bank", u32, ro, false, true});
    d.add(0x6423, 0, boolean, rw, 0, "Analogue input global interrupt enable");
}

void add_analog_outputs(Description& d, unsigned n) {
    const Row rows[] = {
        {0x6410, "Write analogue output 8-bit", "Analogue output", i8, rw, true, true},
        {0x6411, "Write analogue output 16-bit", "Analogue output", i16, rw, true, true},
        {0x6412, "Write analogue output 32-bit", "Analogue output", i32, rw, true, true},
        {0x6413, "Write analogue output float", "Analogue output", real, rw, true, true},
        {0x6441, "Analogue output offset float", "Analogue output", real, rw},
        {0x6442, "Analogue output scaling float", "Analogue output", real, rw, false, false, 0,
         1.0},
        {0x6443, "Analogue output error mode", "Analogue output", u8, rw, false, false, 1},
        {0x6444, "Analogue output error value integer", "Analogue output", i32, rw},
        {0x6445, "Analogue output error value float", "Analogue output", real, rw},
    };
    for (const auto& row : rows) {
        add(d, n, row);
    }
    for (unsigned sub = 1; sub <= n; ++sub) {
        d.find(0x6443, static_cast<std::uint8_t>(sub))->limited(0, 1);
    }
}

/// Adds the default PDOs: PDO 1 carries the digital blocks, PDOs 2 to 4 four analogue values each.
void add_pdos(Description& d, void (*add_pdo)(Description&, unsigned, const PdoDescription&),
              std::uint16_t blocks, unsigned digital, std::uint16_t values, unsigned analog) {
    PdoDescription first;
    for (unsigned n = 1; n <= (digital + 7) / 8; ++n) {
        first.mapping.push_back(map_entry(blocks, static_cast<std::uint8_t>(n), 8));
    }
    if (digital == 0) {
        first.cob = cob_invalid;
    }
    add_pdo(d, 1, first);
    for (unsigned pdo = 0; pdo < 3; ++pdo) {
        PdoDescription p;
        for (unsigned n = pdo * 4 + 1; n <= std::min(analog, pdo * 4 + 4); ++n) {
            p.mapping.push_back(map_entry(values, static_cast<std::uint8_t>(n), 16));
        }
        if (p.mapping.empty()) {
            p.cob = cob_invalid;
        }
        add_pdo(d, pdo + 2, p);
    }
}

/// The I/O functionality in bits 16 to 19 of the device type (CiA 401, 1000h).
std::uint32_t kinds_of(const IoSettings& s) {
    std::uint32_t kinds = 0;
    if (s.digital_inputs != 0) {
        kinds |= 1;
    }
    if (s.digital_outputs != 0) {
        kinds |= 2;
    }
    if (s.analog_inputs != 0) {
        kinds |= 4;
    }
    if (s.analog_outputs != 0) {
        kinds |= 8;
    }
    return kinds;
}

}  // namespace

Description io_description(const IoSettings& s) {
    if (s.digital_inputs > 64 || s.digital_outputs > 64) {
        throw std::invalid_argument("too many digital terminals; at most 64 inputs and 64 outputs");
    }
    if (s.analog_inputs > 12 || s.analog_outputs > 12) {
        throw std::invalid_argument(
            "too many analogue terminals; at most 12 inputs and 12 outputs");
    }
    const std::uint32_t kinds = kinds_of(s);
    Description d = basic_device({.device_type = kinds << 16 | 0x191,
                                  .vendor = example_vendor,
                                  .product = 0x401,
                                  .revision = 0x00010000,
                                  .serial = s.serial,
                                  .name = "Halcyon I/O",
                                  .heartbeat_ms = s.heartbeat_ms});
    add_storage(d);
    add_digital_inputs(d, s.digital_inputs);
    add_digital_outputs(d, s.digital_outputs);
    add_analog_inputs(d, s.analog_inputs);
    add_analog_outputs(d, s.analog_outputs);
    add_pdos(d, add_rpdo, 0x6200, s.digital_outputs, 0x6411, s.analog_outputs);
    add_pdos(d, add_tpdo, 0x6000, s.digital_inputs, 0x6401, s.analog_inputs);
    constexpr std::uint8_t scanned = 20;  // every block of inputs
    d.add(0x1fa0, 0, u8, Access::constant, scanned, "Highest sub-index");
    for (std::uint8_t n = 1; n <= scanned; ++n) {
        d.add(0x1fa0, n, Type::unsigned32, rw, 0, "Scanned object");
    }
    return d;
}

}  // namespace hal::canopen
