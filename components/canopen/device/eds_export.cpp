// SPDX-License-Identifier: MIT
#include "eds_export.hpp"

#include <algorithm>
#include <bit>

namespace hal::canopen {

namespace {

struct Name {
    std::uint16_t first, last;
    const char* name;  ///< "#" is replaced by the position in the range, from 1
};
constexpr Name names[] = {
    {0x1003, 0x1003, "Pre-defined error field"},
    {0x1010, 0x1010, "Store parameters"},
    {0x1011, 0x1011, "Restore default parameters"},
    {0x1016, 0x1016, "Consumer heartbeat time"},
    {0x1018, 0x1018, "Identity object"},
    {0x1020, 0x1020, "Verify configuration"},
    {0x1028, 0x1028, "Emergency consumer"},
    {0x1029, 0x1029, "Error behaviour"},
    {0x1200, 0x127f, "SDO server parameter #"},
    {0x1280, 0x12ff, "SDO client parameter #"},
    {0x1400, 0x15ff, "RPDO communication parameter #"},
    {0x1600, 0x17ff, "RPDO mapping parameter #"},
    {0x1800, 0x19ff, "TPDO communication parameter #"},
    {0x1a00, 0x1bff, "TPDO mapping parameter #"},
    {0x1f50, 0x1f50, "Program data"},
    {0x1f51, 0x1f51, "Program control"},
    {0x1f56, 0x1f56, "Program software identification"},
    {0x1f57, 0x1f57, "Flash status identification"},
    {0x1fa0, 0x1fcf, "Object scanner list #"},
    {0x1fd0, 0x1fff, "Object dispatching list #"},
};
constexpr Name drive_names[] = {
    {0x6046, 0x6046, "vl velocity min max amount"},
    {0x6048, 0x6048, "vl velocity acceleration"},
    {0x6049, 0x6049, "vl velocity deceleration"},
    {0x604a, 0x604a, "vl velocity quick stop"},
    {0x604b, 0x604b, "vl set-point factor"},
    {0x604c, 0x604c, "vl dimension factor"},
    {0x607b, 0x607b, "Position range limit"},
    {0x607d, 0x607d, "Software position limit"},
    {0x608f, 0x608f, "Position encoder resolution"},
    {0x6090, 0x6090, "Velocity encoder resolution"},
    {0x6091, 0x6091, "Gear ratio"},
    {0x6092, 0x6092, "Feed constant"},
    {0x6096, 0x6096, "Velocity factor"},
    {0x6097, 0x6097, "Acceleration factor"},
    {0x6099, 0x6099, "Homing speeds"},
    {0x60c1, 0x60c1, "Interpolation data record"},
    {0x60c2, 0x60c2, "Interpolation time period"},
    {0x60c4, 0x60c4, "Interpolation data configuration"},
    {0x60e3, 0x60e3, "Supported homing methods"},
    {0x60fe, 0x60fe, "Digital outputs"},
};

std::string find_name(std::span<const Name> table, std::uint16_t index) {
    for (const auto& row : table) {
        if (index < row.first || index > row.last) continue;
        std::string name = row.name;
        if (name.back() == '#') {
            name.pop_back();
            name += std::to_string(index - row.first + 1);
        }
        return name;
    }
    return {};
}

std::string hexadecimal(std::uint64_t value) {
    std::string digits;
    do {
        digits.insert(digits.begin(), "0123456789ABCDEF"[value & 15]);
    } while ((value >>= 4) != 0);
    return "0x" + digits;
}

std::string value_text(const EntryDescription& e) {
    if (e.type == Type::domain || e.value.empty()) {
        return {};
    }
    const auto text = eds::spell(e.value, static_cast<std::uint16_t>(e.type));
    return e.plus_node_id ? "$NODEID+" + text : text;
}

std::string limit_text(const EntryDescription& e, std::int64_t limit) {
    std::vector<std::uint8_t> bytes(bytes_of(e.type));
    if (e.type == Type::real32) {
        store(bytes.data(), static_cast<float>(std::bit_cast<double>(limit)));
    } else {
        std::copy_n(reinterpret_cast<const std::uint8_t*>(&limit), bytes.size(), bytes.begin());
    }
    return eds::spell(bytes, static_cast<std::uint16_t>(e.type));
}

eds::Entry entry_of(const EntryDescription& e) {
    eds::Entry out;
    out.sub = e.sub;
    out.name = e.name.empty() ? "Value of " + hexadecimal(e.index).substr(2) + "h" : e.name;
    out.type = e.type == Type::domain ? eds::ObjectType::domain : eds::ObjectType::var;
    out.data_type = static_cast<std::uint16_t>(e.type);
    out.pdo_mapping = e.rpdo || e.tpdo;
    switch (e.access) {
    case Access::read_only: out.access = eds::Access::ro; break;
    case Access::write_only: out.access = eds::Access::wo; break;
    case Access::constant: out.access = eds::Access::constant; break;
    case Access::read_write:
        if (e.rpdo == e.tpdo) {
            out.access = eds::Access::rw;
        } else if (e.rpdo) {
            out.access = eds::Access::rww;
        } else {
            out.access = eds::Access::rwr;
        }
        break;
    }
    out.default_value = value_text(e);
    if (e.ranged) {
        out.low_limit = limit_text(e, e.low);
        out.high_limit = limit_text(e, e.high);
    }
    return out;
}

/// CiA 301 defines these as records although their values may have the same type.
bool record_by_rule(std::uint16_t index) {
    return index == 0x1018 || (index >= 0x1200 && index <= 0x1bff);
}

/// CiA 301 requires three objects of each device; 2000h..5FFFh are those of its manufacturer.
eds::Category category_of(std::uint16_t index) {
    if (index == 0x1000 || index == 0x1001 || index == 0x1018) return eds::Category::mandatory;
    if (index >= 0x2000 && index <= 0x5fff) return eds::Category::manufacturer;
    return eds::Category::optional;
}

/// The entries of one object, ascending. Sub-index 0 of an object with several entries is their
/// number.
using ObjectEntries = std::span<const EntryDescription* const>;

bool is_single(ObjectEntries entries) { return entries.size() == 1 && entries.front()->sub == 0; }

/// An ARRAY has values of one type and one access, a RECORD any.
eds::ObjectType type_of_several(ObjectEntries entries) {
    const auto values = entries.front()->sub == 0 ? entries.subspan(1) : entries;
    const EntryDescription& last = *values.back();
    const bool are_alike = std::ranges::all_of(values, [&](const EntryDescription* value) {
        return value->type == last.type && value->access == last.access;
    });
    if (!are_alike || last.type == Type::domain || record_by_rule(last.index)) {
        return eds::ObjectType::record;
    }
    return eds::ObjectType::array;
}

eds::Object object_of(const Description& d, ObjectEntries entries) {
    eds::Object out;
    out.index = entries.front()->index;
    out.category = category_of(out.index);
    for (const auto* e : entries) {
        out.entries.push_back(entry_of(*e));
    }
    if (is_single(entries)) {
        out.name = out.entries[0].name;
        out.type = out.entries[0].type;
    } else {
        out.name = object_name(d, out.index);
        out.type = type_of_several(entries);
    }
    return out;
}

/// The name of an object of CiA 402, whose axes have 800h indices each; "" for others.
std::string drive_object_name(std::uint16_t index) {
    constexpr unsigned first = 0x6000;
    constexpr unsigned per_axis = 0x800;
    if (index < first || index > 0x9fff) return {};
    const unsigned axis = (index - first) / per_axis;
    const unsigned index_of_first_axis = first + (index - first) % per_axis;
    const auto name = find_name(drive_names, static_cast<std::uint16_t>(index_of_first_axis));
    if (name.empty() || axis == 0) return name;
    return name + " " + std::to_string(axis + 1);
}

/// Returns an UNSIGNED32 of the description; 0 if it has none.
std::uint32_t number(const Description& d, std::uint16_t index, std::uint8_t sub) {
    const auto* e = const_cast<Description&>(d).find(index, sub);
    return e != nullptr && e->value.size() == 4 ? load<std::uint32_t>(e->value.data()) : 0;
}

}  // namespace

std::string object_name(const Description& d, std::uint16_t index) {
    if (const auto own = d.objects.find(index); own != d.objects.end()) return own->second;
    if (auto name = find_name(names, index); !name.empty()) return name;
    const std::uint32_t profile = number(d, 0x1000, 0) & 0xffff;
    if (profile == 402) {
        if (auto name = drive_object_name(index); !name.empty()) return name;
    }
    return "Object " + hexadecimal(index).substr(2) + "h";
}

namespace {

/// The entries by index and sub-index; of repeated ones the first.
std::vector<const EntryDescription*> sorted_entries(const Description& d) {
    std::vector<const EntryDescription*> entries;
    for (const auto& e : d.entries) {
        entries.push_back(&e);
    }
    const auto key = [](const EntryDescription* e) {
        return std::uint32_t{e->index} << 8 | e->sub;
    };
    std::ranges::stable_sort(entries, {}, key);
    const auto repeated = std::ranges::unique(entries, {}, key);
    entries.erase(repeated.begin(), repeated.end());
    return entries;
}

/// The number of entries from the front that belong to the same object.
std::size_t object_size(ObjectEntries entries) {
    const std::uint16_t index = entries.front()->index;
    const auto next_object =
        std::ranges::find_if(entries, [&](const EntryDescription* e) { return e->index != index; });
    return static_cast<std::size_t>(next_object - entries.begin());
}

/// The number of PDOs whose communication parameters begin at this index.
std::uint16_t count_pdos(const std::vector<eds::Object>& objects, std::uint16_t first) {
    return static_cast<std::uint16_t>(std::ranges::count_if(objects, [&](const eds::Object& o) {
        return o.index >= first && o.index < first + 0x200;
    }));
}

}  // namespace

eds::DeviceDescription eds_of(const Description& d) {
    eds::DeviceDescription out;
    const std::vector<const EntryDescription*> entries = sorted_entries(d);
    ObjectEntries rest(entries);
    while (!rest.empty()) {
        const std::size_t size = object_size(rest);
        out.objects.push_back(object_of(d, rest.first(size)));
        rest = rest.subspan(size);
    }
    auto& info = out.device;
    info.vendor_number = number(d, 0x1018, 1);
    info.product_number = number(d, 0x1018, 2);
    info.revision_number = number(d, 0x1018, 3);
    if (const auto* name = const_cast<Description&>(d).find(0x1008, 0); name != nullptr) {
        info.product_name.assign(name->value.begin(), name->value.end());
    }
    for (std::size_t n = 0; n < eds::baud_rates.size(); ++n) {
        info.supports[n] = eds::baud_rates[n] != 100;
    }
    info.boot_up_slave = true;
    info.lss = true;
    info.granularity = 1;
    info.rx_pdos = count_pdos(out.objects, 0x1400);
    info.tx_pdos = count_pdos(out.objects, 0x1800);
    for (std::uint16_t type = 1; type <= 7; ++type) {
        out.dummies.emplace_back(type, true);
    }
    out.file.eds_version = "4.0";
    out.file.version = 1;
    out.file.revision = 1;
    return out;
}

}  // namespace hal::canopen
