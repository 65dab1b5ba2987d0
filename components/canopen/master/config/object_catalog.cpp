// SPDX-License-Identifier: MIT
#include "object_catalog.hpp"

#include <algorithm>

#include "canopen/protocol/description.hpp"
#include "cia301/values.hpp"
#include "config_lines.hpp"

namespace hal::canopen::config {

namespace {

enum class Direction : std::uint8_t { kept, sent, received };  // by the node

struct Row {
    std::uint16_t index;
    std::uint8_t first, last;  // sub-indices; 0, 0: a plain variable
    const char* name;          // with a # for the sub-index
    Type type;
    Direction direction;
};
using enum Type;
using enum Direction;

constexpr Row drive[] = {
    {0x6007, 0, 0, "Abort connection option code", integer16, kept},
    {0x603f, 0, 0, "Error code", unsigned16, sent},
    {0x6040, 0, 0, "Controlword", unsigned16, received},
    {0x6041, 0, 0, "Statusword", unsigned16, sent},
    {0x6042, 0, 0, "vl target velocity", integer16, received},
    {0x6043, 0, 0, "vl velocity demand", integer16, sent},
    {0x6044, 0, 0, "vl velocity actual value", integer16, sent},
    {0x605a, 0, 0, "Quick stop option code", integer16, kept},
    {0x605b, 0, 0, "Shutdown option code", integer16, kept},
    {0x605c, 0, 0, "Disable operation option code", integer16, kept},
    {0x605d, 0, 0, "Halt option code", integer16, kept},
    {0x605e, 0, 0, "Fault reaction option code", integer16, kept},
    {0x6060, 0, 0, "Modes of operation", integer8, received},
    {0x6061, 0, 0, "Modes of operation display", integer8, sent},
    {0x6062, 0, 0, "Position demand value", integer32, sent},
    {0x6063, 0, 0, "Position actual internal value", integer32, sent},
    {0x6064, 0, 0, "Position actual value", integer32, sent},
    {0x6065, 0, 0, "Following error window", unsigned32, kept},
    {0x6066, 0, 0, "Following error time out", unsigned16, kept},
    {0x6067, 0, 0, "Position window", unsigned32, kept},
    {0x6068, 0, 0, "Position window time", unsigned16, kept},
    {0x606b, 0, 0, "Velocity demand value", integer32, sent},
    {0x606c, 0, 0, "Velocity actual value", integer32, sent},
    {0x6071, 0, 0, "Target torque", integer16, received},
    {0x6072, 0, 0, "Max torque", unsigned16, received},
    {0x6073, 0, 0, "Max current", unsigned16, received},
    {0x6074, 0, 0, "Torque demand", integer16, sent},
    {0x6075, 0, 0, "Motor rated current", unsigned32, kept},
    {0x6076, 0, 0, "Motor rated torque", unsigned32, kept},
    {0x6077, 0, 0, "Torque actual value", integer16, sent},
    {0x6078, 0, 0, "Current actual value", integer16, sent},
    {0x6079, 0, 0, "DC link circuit voltage", unsigned32, sent},
    {0x607a, 0, 0, "Target position", integer32, received},
    {0x607c, 0, 0, "Home offset", integer32, kept},
    {0x607d, 1, 2, "Software position limit #", integer32, kept},
    {0x607e, 0, 0, "Polarity", unsigned8, kept},
    {0x607f, 0, 0, "Max profile velocity", unsigned32, received},
    {0x6080, 0, 0, "Max motor speed", unsigned32, kept},
    {0x6081, 0, 0, "Profile velocity", unsigned32, received},
    {0x6082, 0, 0, "End velocity", unsigned32, received},
    {0x6083, 0, 0, "Profile acceleration", unsigned32, received},
    {0x6084, 0, 0, "Profile deceleration", unsigned32, received},
    {0x6085, 0, 0, "Quick stop deceleration", unsigned32, received},
    {0x6086, 0, 0, "Motion profile type", integer16, kept},
    {0x6087, 0, 0, "Torque slope", unsigned32, received},
    {0x608f, 1, 2, "Position encoder resolution #", unsigned32, kept},
    {0x6091, 1, 2, "Gear ratio #", unsigned32, kept},
    {0x6092, 1, 2, "Feed constant #", unsigned32, kept},
    {0x6098, 0, 0, "Homing method", integer8, received},
    {0x6099, 1, 2, "Homing speeds #", unsigned32, kept},
    {0x609a, 0, 0, "Homing acceleration", unsigned32, kept},
    {0x60a3, 0, 0, "Profile jerk use", unsigned8, kept},
    {0x60a4, 1, 1, "Profile jerk #", unsigned32, kept},
    {0x60b0, 0, 0, "Position offset", integer32, received},
    {0x60b1, 0, 0, "Velocity offset", integer32, received},
    {0x60b2, 0, 0, "Torque offset", integer16, received},
    {0x60b8, 0, 0, "Touch probe function", unsigned16, received},
    {0x60b9, 0, 0, "Touch probe status", unsigned16, sent},
    {0x60ba, 0, 0, "Touch probe 1 positive edge", integer32, sent},
    {0x60bb, 0, 0, "Touch probe 1 negative edge", integer32, sent},
    {0x60bc, 0, 0, "Touch probe 2 positive edge", integer32, sent},
    {0x60bd, 0, 0, "Touch probe 2 negative edge", integer32, sent},
    {0x60c0, 0, 0, "Interpolation sub mode select", integer16, kept},
    {0x60c1, 1, 1, "Interpolation data record #", integer32, received},
    {0x60c2, 1, 1, "Interpolation time period value", unsigned8, kept},
    {0x60c2, 2, 2, "Interpolation time period index", integer8, kept},
    {0x60c5, 0, 0, "Max acceleration", unsigned32, received},
    {0x60c6, 0, 0, "Max deceleration", unsigned32, received},
    {0x60e4, 1, 1, "Additional position actual value #", integer32, sent},
    {0x60e6, 1, 1, "Additional encoder increments #", unsigned32, kept},
    {0x60e8, 1, 1, "Additional gear motor revolutions #", unsigned32, kept},
    {0x60e9, 1, 1, "Additional feed #", unsigned32, kept},
    {0x60eb, 1, 1, "Additional encoder motor revolutions #", unsigned32, kept},
    {0x60ed, 1, 1, "Additional gear shaft revolutions #", unsigned32, kept},
    {0x60ee, 1, 1, "Additional feed shaft revolutions #", unsigned32, kept},
    {0x60f4, 0, 0, "Following error actual value", integer32, sent},
    {0x60fa, 0, 0, "Control effort", integer32, sent},
    {0x60fc, 0, 0, "Position demand internal value", integer32, sent},
    {0x60fd, 0, 0, "Digital inputs", unsigned32, sent},
    {0x60fe, 1, 1, "Digital outputs", unsigned32, received},
    {0x60fe, 2, 2, "Digital outputs bit mask", unsigned32, received},
    {0x60ff, 0, 0, "Target velocity", integer32, received},
    {0x6502, 0, 0, "Supported drive modes", unsigned32, sent},
};

constexpr Row inputs_and_outputs[] = {
    {0x6000, 1, 8, "Read inputs #", unsigned8, sent},
    {0x6002, 1, 8, "Polarity inputs #", unsigned8, kept},
    {0x6003, 1, 8, "Filter inputs #", unsigned8, kept},
    {0x6005, 0, 0, "Global interrupt enable digital", boolean, kept},
    {0x6006, 1, 8, "Interrupt mask any change #", unsigned8, kept},
    {0x6200, 1, 8, "Write outputs #", unsigned8, received},
    {0x6202, 1, 8, "Polarity outputs #", unsigned8, kept},
    {0x6206, 1, 8, "Error mode outputs #", unsigned8, kept},
    {0x6207, 1, 8, "Error value outputs #", unsigned8, kept},
    {0x6208, 1, 8, "Filter outputs #", unsigned8, kept},
    {0x6401, 1, 16, "Read analogue input #", integer16, sent},
    {0x6411, 1, 16, "Write analogue output #", integer16, received},
    {0x6421, 1, 16, "Analogue input trigger #", unsigned8, kept},
    {0x6423, 0, 0, "Analogue input global interrupt enable", boolean, kept},
    {0x6424, 1, 16, "Analogue input upper limit #", integer32, kept},
    {0x6425, 1, 16, "Analogue input lower limit #", integer32, kept},
    {0x6426, 1, 16, "Analogue input delta #", unsigned32, kept},
    {0x6443, 1, 16, "Analogue output error mode #", unsigned8, kept},
    {0x6444, 1, 16, "Analogue output error value #", integer32, kept},
};

constexpr Row force_torque[] = {
    {0x6130, 1, 6, "Process value float #", real32, sent},
    {0x7130, 1, 6, "Process value #", integer16, sent},
    {0x7100, 1, 6, "Field value #", integer16, sent},
    {0x7140, 1, 6, "Net value #", integer16, sent},
    {0x6150, 1, 6, "Status #", unsigned8, sent},
    {0x6125, 1, 6, "Autozero #", unsigned32, kept},
    {0x6139, 1, 6, "Autotare #", unsigned32, kept},
};

/// Default mapping of a profile: PDO n carries these.
struct Default {
    bool to_node;
    unsigned number;
    std::initializer_list<std::uint32_t> objects;
};

std::vector<std::uint8_t> little(std::uint64_t value, unsigned bytes) {
    std::vector<std::uint8_t> out;
    for (unsigned i = 0; i < bytes; ++i) {
        out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    }
    return out;
}

void add(std::vector<Known>& all, std::span<const Row> rows, std::uint16_t offset,
         const std::string& prefix) {
    for (const Row& row : rows) {
        for (unsigned sub = row.first; sub <= row.last; ++sub) {
            std::string name = row.name;
            if (const auto at = name.find('#'); at != name.npos) {
                name.replace(at, 1, std::to_string(sub));
            }
            Known k;
            k.index = static_cast<std::uint16_t>(row.index + offset);

            k.sub = static_cast<std::uint8_t>(sub);
            k.single = row.last == 0;
            k.name = prefix + dashed(name);
            k.about = name;
            k.type = row.type;
            k.to_node = row.direction == received;
            k.from_node = row.direction != kept;
            k.writable = row.direction != sent;
            all.push_back(std::move(k));
        }
    }
}

void map(std::vector<Known>& all, const Default& pdo) {
    const auto put = [&](unsigned index, unsigned sub, Type type, std::uint64_t value) {
        Known k;
        k.index = static_cast<std::uint16_t>(index);
        k.sub = static_cast<std::uint8_t>(sub);

        k.single = false;
        k.type = type;
        k.value = little(value, bytes_of(type));
        all.push_back(std::move(k));
    };
    const unsigned base = (pdo.to_node ? 0x1400U : 0x1800U) + pdo.number - 1;
    put(base, 1, unsigned32, pdo.number <= 4 ? 0 : cob_invalid);  // 0: the predefined one
    put(base, 2, unsigned8, 255);
    put(base + 0x200, 0, unsigned8, pdo.objects.size());
    unsigned n = 0;
    for (const std::uint32_t object : pdo.objects) {
        put(base + 0x200, ++n, unsigned32, object);
    }
}

}  // namespace

Catalog::Catalog(const eds::DeviceDescription& device, unsigned node_id) {
    const bool several_axes = device.find(0x6840) != nullptr || device.find(0x6841) != nullptr;
    for (const eds::Object& object : device.objects) {
        if (object.index < 0x1000) continue;
        std::string prefix;
        if (several_axes && object.index >= 0x6000 && object.index < 0xa000) {
            prefix = "axis-" + std::to_string((object.index - 0x6000) / 0x800 + 1) + ".";
        }
        for (const eds::Entry& entry : object.entries) {
            Known k;
            k.index = object.index;
            k.sub = entry.sub;
            k.single = object.single();
            k.about = k.single ? object.name : object.name + " " + entry.name;
            k.name = prefix + dashed(k.single ? object.name : object.name + "-" + entry.name);
            k.type = bits_of(static_cast<Type>(entry.data_type)) != 0 || entry.data_type >= 9
                         ? static_cast<Type>(entry.data_type)
                         : Type::none;
            k.writable = entry.writable();
            k.readable = entry.readable();
            k.to_node = entry.pdo_mapping && k.writable && entry.access != eds::Access::rwr;
            k.from_node = entry.pdo_mapping && k.readable && entry.access != eds::Access::rww &&
                          entry.access != eds::Access::constant;
            const std::string& text =
                entry.parameter_value.empty() ? entry.default_value : entry.parameter_value;
            if (eds::Encoded value = eds::encode(text, entry.data_type, node_id)) {
                k.value = std::move(value.bytes);
            }
            all_.push_back(std::move(k));
        }
    }
    finish();
}

Catalog::Catalog(std::string_view profile, unsigned axes) {
    const std::uint32_t controlword = map_entry(0x6040, 0, 16);

    const std::uint32_t statusword = map_entry(0x6041, 0, 16);
    if (profile == "cia402") {
        for (unsigned axis = 0; axis < axes; ++axis) {
            add(all_, drive, static_cast<std::uint16_t>(0x800 * axis),
                axes > 1 ? "axis-" + std::to_string(axis + 1) + "." : "");
        }
        map(all_, {true, 1, {controlword}});
        map(all_, {true, 2, {controlword, map_entry(0x6060, 0, 8)}});
        map(all_, {true, 3, {controlword, map_entry(0x607a, 0, 32)}});
        map(all_, {true, 4, {controlword, map_entry(0x60ff, 0, 32)}});
        map(all_, {false, 1, {statusword}});
        map(all_, {false, 2, {statusword, map_entry(0x6061, 0, 8)}});
        map(all_, {false, 3, {statusword, map_entry(0x6064, 0, 32)}});
        map(all_, {false, 4, {statusword, map_entry(0x606c, 0, 32)}});
    } else if (profile == "cia401") {
        add(all_, inputs_and_outputs, 0, "");
        map(all_, {true, 1, {map_entry(0x6200, 1, 8)}});
        map(all_, {false, 1, {map_entry(0x6000, 1, 8)}});
    } else if (profile == "jr3") {
        add(all_, force_torque, 0, "");
        const auto channel = [](unsigned n) {
            return map_entry(0x7130, static_cast<std::uint8_t>(n), 16);
        };
        map(all_, {false,
                   2,
                   {channel(1), channel(2), channel(3), map_entry(0x2201, 0, 8),
                    map_entry(0x2202, 0, 8)}});
        map(all_, {false,
                   4,
                   {channel(4), channel(5), channel(6), map_entry(0x2201, 0, 8),
                    map_entry(0x2202, 0, 8)}});
    }
    finish();
}

void Catalog::finish() {
    std::stable_sort(all_.begin(), all_.end(), [](const Known& a, const Known& b) {
        return a.index != b.index ? a.index < b.index : a.sub < b.sub;
    });
    for (std::size_t i = 0; i < all_.size(); ++i) {
        Known& k = all_[i];
        if (k.name.empty() || k.index < 0x1000) continue;
        // two of one name
        if (by_name_.contains(k.name)) {
            k.name +=
                "-" +
                dashed(k.single ? index_text(k.index) : object_text(k.index, k.sub)).substr(2);
        }
        by_name_.emplace(k.name, i);
    }
}

const Known* Catalog::find(std::uint16_t index, std::uint8_t sub) const {
    const auto at = std::lower_bound(all_.begin(), all_.end(), std::pair(index, sub),
                                     [](const Known& k, const auto& key) {
        return k.index != key.first ? k.index < key.first : k.sub < key.second;
    });
    return at != all_.end() && at->index == index && at->sub == sub ? &*at : nullptr;
}

const Known* Catalog::find(std::string_view name) const {
    const auto at = by_name_.find(name);
    return at == by_name_.end() ? nullptr : &all_[at->second];
}

bool Catalog::has(std::uint16_t index) const {
    return std::any_of(all_.begin(), all_.end(), [&](const Known& k) { return k.index == index; });
}

std::uint64_t Catalog::number(std::uint16_t index, std::uint8_t sub,
                              std::uint64_t otherwise) const {
    const Known* k = find(index, sub);
    const bool has_number = k != nullptr && !k->value.empty() && k->value.size() <= 8;
    return has_number ? cia301::natural_of(k->value) : otherwise;
}

std::vector<std::string> Catalog::names(bool to_node) const {
    std::vector<std::string> out;
    for (const Known& k : all_) {
        if (!k.name.empty() && (to_node ? k.to_node : k.from_node)) {
            out.push_back(k.name);
        }
    }
    return out;
}

std::vector<std::string> Catalog::names() const {
    std::vector<std::string> out;
    for (const Known& k : all_) {
        if (!k.name.empty()) {
            out.push_back(k.name);
        }
    }
    return out;
}

}  // namespace hal::canopen::config
