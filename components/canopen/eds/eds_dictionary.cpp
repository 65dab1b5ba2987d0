// SPDX-License-Identifier: MIT
#include "eds_dictionary.hpp"

#include <bit>
#include <limits>

#include "cia301/values.hpp"

namespace hal::canopen::eds {

namespace {

std::optional<std::int64_t> limit(const std::string& text, const DataType& type) {
    const Encoded value = encode(text, type.code, 0);
    if (!value || value.bytes.empty() || value.bytes.size() > 8) return {};
    const std::uint64_t bits = cia301::natural_of(value.bytes);
    if (type.kind == Kind::real) {
        return std::bit_cast<std::int64_t>(cia301::real_of(bits, type.bits));
    }
    if (type.kind != Kind::integer) return static_cast<std::int64_t>(bits);
    return cia301::sign_extended(bits, type.bits);
}

std::int64_t widest(const DataType& type, bool low) {
    using Infinity = std::numeric_limits<double>;
    if (type.kind == Kind::real) {
        return std::bit_cast<std::int64_t>(low ? -Infinity::infinity() : Infinity::infinity());
    }
    const std::uint64_t top = type.bits == 64 ? ~0ull : (1ull << type.bits) - 1;
    if (type.kind != Kind::integer) return low ? 0 : static_cast<std::int64_t>(top);
    const auto half = static_cast<std::int64_t>(top >> 1);
    return low ? -half - 1 : half;
}

EntryDescription made(std::uint16_t index, const Entry& entry, const DataType& type,
                      bool configured) {
    EntryDescription out;
    out.index = index;
    out.sub = entry.sub;
    out.name = entry.name;
    out.type = static_cast<Type>(type.code);
    using Right = hal::canopen::Access;
    if (entry.access == Access::constant) {
        out.access = Right::constant;
    } else if (!entry.writable()) {
        out.access = Right::read_only;
    } else if (!entry.readable()) {
        out.access = Right::write_only;
    } else {
        out.access = Right::read_write;
    }
    out.rpdo = entry.pdo_mapping && entry.writable() && entry.access != Access::rwr;
    out.tpdo = entry.pdo_mapping && entry.readable() && entry.access != Access::rww &&
               entry.access != Access::constant;
    const std::string& text =
        configured && !entry.parameter_value.empty() ? entry.parameter_value : entry.default_value;
    if (Encoded value = encode(text, type.code, 0)) {
        out.plus_node_id = value.node_id;
        out.value = std::move(value.bytes);
    }
    if (type.kind < Kind::text && type.kind != Kind::boolean) {
        const auto low = limit(entry.low_limit, type);
        const auto high = limit(entry.high_limit, type);
        out.ranged = low || high;
        out.low = low.value_or(widest(type, true));
        out.high = high.value_or(widest(type, false));
        if (!out.ranged) {
            out.low = out.high = 0;
        }
    }
    return out;
}

}  // namespace

Description dictionary_of(const DeviceDescription& device, bool configured) {
    Description out;
    for (const Object& object : device.objects) {
        if (object.index < 0x1000 || object.type == ObjectType::deftype ||
            object.type == ObjectType::defstruct) {
            continue;
        }
        for (const Entry& entry : object.entries) {
            const DataType* type = data_type(entry.data_type);
            if (type != nullptr && type->kind != Kind::structure) {
                out.entries.push_back(made(object.index, entry, *type, configured));
            }
        }
    }
    return out;
}

}  // namespace hal::canopen::eds
