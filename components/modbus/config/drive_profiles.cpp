// SPDX-License-Identifier: MIT
// Registers of frequency converters, as their manuals and the drivers of LinuxCNC, grblHAL and
// FluidNC name them.
#include "drive_profiles.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

namespace hal::modbus {

namespace {

constexpr Table none = Table::none;
constexpr Table coil = Table::coil;
constexpr Table holding = Table::holding;
constexpr Table input = Table::input;
constexpr Table huanyang = Table::huanyang;

constexpr Profile all_profiles[] = {
    {.name = "generic",
     .title = "a drive whose registers are in the file",
     .forward = {},
     .reverse = {},
     .stop = {},
     .reset = {},
     .speed = {},
     .counts_per_hz = 0,
     .speed_by_16 = false,
     .one_telegram = false,
     .feedback = Feedback::share,
     .actual = {},
     .load = {},
     .running = {},
     .fault = {},
     .gap_us = 0,
     .setup = "the keys forward, stop and speed name the registers",
     .ending = "as declared"},
    // functions 03, 05 and 04 with a length byte: not Modbus but its frames
    {.name = "huanyang",
     .title = "Huanyang HY, first dialect",
     .forward = {{huanyang, 0x03, 0x01}},
     .reverse = {{huanyang, 0x03, 0x11}},
     .stop = {{huanyang, 0x03, 0x08}},
     .reset = {},
     .speed = {huanyang, 0x05, 0},
     .counts_per_hz = 100,
     .speed_by_16 = false,
     .one_telegram = false,
     .feedback = Feedback::frequency,
     .actual = {huanyang, 1, 0.01, 0, 1},
     .load = {},
     .running = {},
     .fault = {},
     .gap_us = 6000,
     .setup = "PD001 = 2, PD002 = 2, PD163 address, PD164 baud, PD165 = 3 (8N1)",
     .ending = "ramp"},
    {.name = "huanyang-gt",
     .title = "Huanyang GT: command 0x1000, speed 0x2000",
     .forward = {{holding, 0x1000, 1}},
     .reverse = {{holding, 0x1000, 2}},
     .stop = {{holding, 0x1000, 5}},
     .reset = {holding, 0x1000, 7},
     .speed = {holding, 0x2000, 10000},
     .counts_per_hz = 0,
     .speed_by_16 = false,
     .one_telegram = false,
     .feedback = Feedback::frequency,
     .actual = {holding, 0x3000, 0.01, 0, 1},
     .load = {},
     .running = {},
     .fault = {holding, 0x5000, 1, 0xffff, 1},
     .gap_us = 8300,
     .setup = "command and frequency source: communication",
     .ending = "ramp"},
    {.name = "huanyang-p2a",
     .title = "Huanyang P2A and H2A: command 0x2000, speed 0x1000",
     .forward = {{holding, 0x2000, 1}},
     .reverse = {{holding, 0x2000, 2}},
     .stop = {{holding, 0x2000, 6}},
     .reset = {},
     .speed = {holding, 0x1000, 10000},
     .counts_per_hz = 0,
     .speed_by_16 = false,
     .one_telegram = false,
     .feedback = Feedback::rpm,
     .actual = {holding, 0x700c, 1, 0, 1},
     .load = {},
     .running = {},
     .fault = {},
     .gap_us = 6000,
     .setup = "command and frequency source: communication",
     .ending = "ramp"},
    {.name = "h100",
     .title = "H100",
     .forward = {{coil, 0x49, 1}},
     .reverse = {{coil, 0x4a, 1}},
     .stop = {{coil, 0x4b, 1}},
     .reset = {},
     .speed = {holding, 0x0201, 0},
     .counts_per_hz = 10,
     .speed_by_16 = false,
     .one_telegram = false,
     .feedback = Feedback::frequency,
     .actual = {input, 0x0000, 0.1, 0, 1},
     .load = {},
     .running = {},
     .fault = {},
     .gap_us = 0,
     .setup = "command and frequency source: communication",
     .ending = "ramp"},
    {.name = "yl620",
     .title = "YL620",
     .forward = {{holding, 0x2000, 0x12}},
     .reverse = {{holding, 0x2000, 0x22}},
     .stop = {{holding, 0x2000, 0x01}},
     .reset = {},
     .speed = {holding, 0x2001, 0},
     .counts_per_hz = 10,
     .speed_by_16 = false,
     .one_telegram = false,
     .feedback = Feedback::frequency,
     .actual = {holding, 0x200b, 0.1, 0, 1},
     .load = {},
     .running = {},
     .fault = {},
     .gap_us = 0,
     .setup = "P00.01 = 3, P03.02 = 2",
     .ending = "ramp"},
    {.name = "gs2",
     .title = "AutomationDirect GS2",
     .forward = {{holding, 0x091c, 0}, {holding, 0x091b, 1}},
     .reverse = {{holding, 0x091c, 1}, {holding, 0x091b, 1}},
     .stop = {{holding, 0x091b, 0}},
     .reset = {holding, 0x091e, 1},
     .speed = {holding, 0x091a, 0},
     .counts_per_hz = 10,
     .speed_by_16 = false,
     .one_telegram = false,
     .feedback = Feedback::frequency,
     .actual = {holding, 0x2103, 0.1, 0, 1},
     .load = {holding, 0x210b, 0.1, 0, 1},
     .running = {},
     .fault = {},
     .gap_us = 0,
     .setup = "P3.00 and P4.00: communication; P6 stop method: 0100 = 0 ramp, 1 coast",
     .ending = "as parameter 0100: ramp or coast"},
    {.name = "delta-ms300",
     .title = "Delta MS300, VFD-EL, VFD-B; AutomationDirect GS20",
     .forward = {{holding, 0x2000, 0x12}},
     .reverse = {{holding, 0x2000, 0x22}},
     .stop = {{holding, 0x2000, 0x01}},
     .reset = {holding, 0x2002, 2},
     .speed = {holding, 0x2001, 0},
     .counts_per_hz = 100,
     .speed_by_16 = false,
     .one_telegram = false,
     .feedback = Feedback::frequency,
     .actual = {holding, 0x2103, 0.01, 0, 1},
     .load = {},
     .running = {},
     .fault = {holding, 0x2100, 1, 0xffff, 1},
     .gap_us = 0,
     .setup = "command and frequency source: RS-485",
     .ending = "as the stop method of the drive"},
    // the FC profile: bit 3 of the status word is a trip
    {.name = "danfoss-fc",
     .title = "Danfoss VLT 2800 and FC 51, FC profile",
     .forward = {{coil, 0x0000, 0x047c}},
     .reverse = {{coil, 0x0000, 0x847c}},
     .stop = {{coil, 0x0000, 0x043c}},
     .reset = {coil, 0x0000, 0x04bc},
     .speed = {coil, 0x0010, 0x4000},
     .counts_per_hz = 0,
     .speed_by_16 = false,
     .one_telegram = true,
     .feedback = Feedback::share,
     .actual = {coil, 0x0030, 1.0 / 0x4000, 0, 1},
     .load = {},
     .running = {},
     .fault = {coil, 0x0020, 1, 0x0008, 1},
     .gap_us = 0,
     .setup = "protocol Modbus RTU, control site: bus only",
     .ending = "ramp"},
    {.name = "wj200",
     .title = "Hitachi WJ200",
     .forward = {{coil, 1, 0}, {coil, 0, 1}},
     .reverse = {{coil, 1, 1}, {coil, 0, 1}},
     .stop = {{coil, 0, 0}},
     .reset = {coil, 3, 1},
     .speed = {holding, 0x0001, 0},
     .counts_per_hz = 100,
     .speed_by_16 = true,
     .one_telegram = false,
     .feedback = Feedback::frequency,
     .actual = {holding, 0x1000, 0.01, 0, 2},
     .load = {},
     .running = {coil, 0x000e, 1, 1, 1},
     .fault = {coil, 0x0017, 1, 1, 1},
     .gap_us = 0,
     .setup = "A001 = 3, A002 = 3: Modbus",
     .ending = "as B091: ramp or coast"},
    {.name = "vfs11",
     .title = "Toshiba VF-S11",
     .forward = {{holding, 0xfa00, 0xc400}},
     .reverse = {{holding, 0xfa00, 0xc600}},
     .stop = {{holding, 0xfa00, 0xc000}},
     .reset = {holding, 0xfa00, 0xe000},
     .speed = {holding, 0xfa01, 0},
     .counts_per_hz = 100,
     .speed_by_16 = false,
     .one_telegram = false,
     .feedback = Feedback::frequency,
     .actual = {holding, 0xfd00, 0.01, 0, 1},
     .load = {holding, 0xfe03, 0.01, 0, 1},
     .running = {holding, 0xfd01, 1, 0x0400, 1},
     .fault = {holding, 0xfd01, 1, 0x1002, 1},
     .gap_us = 0,
     .setup = "the bus takes precedence by bits 15 and 14 of each command",
     .ending = "ramp"},
};

std::string writes_text(const Write (&writes)[2]) {
    std::string text;
    for (const Write& write : writes) {
        if (write.table == none) continue;
        text += (text.empty() ? "" : ", ") + write_text(write);
    }
    return text.empty() ? "as declared" : text;
}

std::string reading_text(const Reading& reading) {
    if (reading.table == none) return "no";
    char text[48];
    if (reading.table == Table::huanyang) {
        std::snprintf(text, sizeof text, "function 04, index %u", reading.address);
    } else if (reading.mask > 1 && reading.mask != 0xffff) {
        std::snprintf(text, sizeof text, "%s 0x%04X & 0x%X", to_string(reading.table),
                      reading.address, reading.mask);
    } else {
        std::snprintf(text, sizeof text, "%s 0x%04X", to_string(reading.table), reading.address);
    }
    return text;
}

std::string set_point_text(const Profile& p) {
    if (p.speed.table == none) return "as declared";
    char text[64];
    if (p.speed.table == Table::huanyang) {
        std::snprintf(text, sizeof text, "function %02X", p.speed.address);
    } else {
        std::snprintf(text, sizeof text, "%s 0x%04X", to_string(p.speed.table), p.speed.address);
    }
    const std::string where = text;
    if (p.counts_per_hz != 0) {
        std::snprintf(text, sizeof text, ", %g Hz", 1 / p.counts_per_hz);
    } else {
        std::snprintf(text, sizeof text, ", %u at full speed", p.speed.value);
    }
    return where + text;
}

std::string reset_text(const Profile& p) {
    return p.reset.table == none ? "panel" : write_text(p.reset);
}

/// A row of the table of the page.
std::string row(const std::vector<std::string>& cells) {
    std::string text = "|";
    for (const std::string& cell : cells) {
        text += " " + cell + " |";
    }
    return text + "\n";
}

}  // namespace

const char* to_string(Table table) {
    constexpr const char* names[] = {"none", "coil", "discrete", "holding", "input", "huanyang"};
    return names[static_cast<std::size_t>(table)];
}

std::span<const Profile> profiles() { return all_profiles; }

const Profile* find_profile(std::string_view name) {
    const auto* at = std::find_if(std::begin(all_profiles), std::end(all_profiles),
                                  [&](const Profile& p) { return name == p.name; });
    return at == std::end(all_profiles) ? nullptr : at;
}

std::string write_text(const Write& write) {
    char text[48];
    if (write.table == Table::huanyang) {
        std::snprintf(text, sizeof text, "function %02X: %02X", write.address, write.value);
    } else {
        std::snprintf(text, sizeof text, "%s 0x%04X := 0x%X", to_string(write.table), write.address,
                      write.value);
    }
    return text;
}

std::string profile_reference() {
    const std::vector<std::string> titles = {
        "profile", "drive",  "forward",   "reverse", "stop",  "a stop is",          "set-point",
        "speed",   "`load`", "`running`", "`fault`", "reset", "to set at the panel"};
    std::string table = row(titles) + row(std::vector<std::string>(titles.size(), "---"));
    for (const Profile& p : all_profiles) {
        const bool is_generic = p.speed.table == none;
        table += row({std::string("`") + p.name + "`", p.title, writes_text(p.forward),
                      writes_text(p.reverse), writes_text(p.stop), p.ending, set_point_text(p),
                      is_generic ? "as declared" : reading_text(p.actual), reading_text(p.load),
                      reading_text(p.running), reading_text(p.fault), reset_text(p), p.setup});
    }
    return table;
}

}  // namespace hal::modbus
