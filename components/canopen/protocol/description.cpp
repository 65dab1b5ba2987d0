// SPDX-License-Identifier: MIT
#include "description.hpp"

#include <algorithm>
#include <utility>

#include "cia301/shorthand.hpp"
#include "text/find_row.hpp"

namespace hal::canopen {

namespace {
using namespace cia301::shorthand;

void put(std::vector<std::uint8_t>& to, const void* from, std::size_t size) {
    const auto* bytes = static_cast<const std::uint8_t*>(from);
    to.assign(bytes, bytes + size);
}
}  // namespace

EntryDescription& Description::add(std::uint16_t index, std::uint8_t sub, Type type, Access access,
                                   std::uint64_t value, std::string name) {
    auto& e = entries.emplace_back();
    e.index = index;
    e.sub = sub;
    e.type = type;
    e.access = access;
    e.name = std::move(name);
    put(e.value, &value, bytes_of(type));
    return e;
}
EntryDescription& Description::add_real(std::uint16_t index, std::uint8_t sub, Type type,
                                        Access access, double value, std::string name) {
    auto& e = add(index, sub, type, access, 0, std::move(name));
    const auto single = static_cast<float>(value);
    type == Type::real32 ? put(e.value, &single, sizeof single)
                         : put(e.value, &value, sizeof value);
    return e;
}
EntryDescription& Description::add_text(std::uint16_t index, std::uint8_t sub, Access access,
                                        std::string_view text, std::uint32_t capacity,
                                        std::string name) {
    auto& e = add(index, sub, Type::visible_string, access, 0, std::move(name));
    put(e.value, text.data(), text.size());
    e.capacity = capacity;
    return e;
}
EntryDescription& Description::add_domain(std::uint16_t index, std::uint8_t sub, Access access,
                                          std::uint32_t capacity, std::string name) {
    auto& e = add(index, sub, Type::domain, access, 0, std::move(name));
    e.capacity = capacity;
    return e;
}
EntryDescription* Description::find(std::uint16_t index, std::uint8_t sub) {
    return find_row_if(entries,
                       [&](const EntryDescription& e) { return e.index == index && e.sub == sub; });
}

Description basic_device(const Basics& basics) {
    Description d;
    d.add(0x1000, 0, u32, ro, basics.device_type, "Device type");
    d.add(0x1001, 0, u8, ro, 0, "Error register").sent();
    d.add(0x1002, 0, u32, ro, 0, "Manufacturer status register").sent();
    d.add(0x1003, 0, u8, rw, 0, "Number of errors");
    for (unsigned n = 1; n <= std::min(basics.error_history, 254U); ++n) {
        d.add(0x1003, static_cast<std::uint8_t>(n), u32, ro, 0, "Standard error field");
    }
    d.add(0x1005, 0, u32, rw, 0x80, "COB-ID SYNC");
    d.add(0x1006, 0, u32, rw, 0, "Communication cycle period");
    d.add(0x1007, 0, u32, rw, 0, "Synchronous window length");
    d.add_text(0x1008, 0, fixed, basics.name, 0, "Manufacturer device name");
    d.add(0x100c, 0, u16, rw, 0, "Guard time");
    d.add(0x100d, 0, u8, rw, 0, "Life time factor");
    d.add(0x1012, 0, u32, rw, 0x80000100, "COB-ID TIME");
    d.add(0x1014, 0, u32, rw, 0x80, "COB-ID EMCY").with_node_id();
    d.add(0x1015, 0, u16, rw, 0, "Inhibit time EMCY");
    if (basics.heartbeat_consumers != 0) {
        const auto count = std::min(basics.heartbeat_consumers, 127U);
        d.add(0x1016, 0, u8, fixed, count, "Highest sub-index");
        for (unsigned n = 1; n <= count; ++n) {
            d.add(0x1016, static_cast<std::uint8_t>(n), u32, rw, 0, "Consumer heartbeat time");
        }
    }
    d.add(0x1017, 0, u16, rw, basics.heartbeat_ms, "Producer heartbeat time");
    d.add(0x1018, 0, u8, fixed, 4, "Highest sub-index");
    d.add(0x1018, 1, u32, ro, basics.vendor, "Vendor-ID");
    d.add(0x1018, 2, u32, ro, basics.product, "Product code");
    d.add(0x1018, 3, u32, ro, basics.revision, "Revision number");
    d.add(0x1018, 4, u32, ro, basics.serial, "Serial number");
    d.add(0x1019, 0, u8, rw, 0, "Synchronous counter overflow value");
    if (basics.emcy_consumers != 0) {
        const auto count = std::min(basics.emcy_consumers, 127U);
        d.add(0x1028, 0, u8, fixed, count, "Highest sub-index");
        for (unsigned n = 1; n <= count; ++n) {
            d.add(0x1028, static_cast<std::uint8_t>(n), u32, rw, 0x80000000, "Emergency consumer");
        }
    }
    d.add(0x1029, 0, u8, fixed, 1, "Highest sub-index");
    d.add(0x1029, 1, u8, rw, 0, "Communication error");
    add_sdo_server(d, 0, 0x600, 0x580);
    return d;
}

namespace {
void add_pdo(Description& d, std::uint16_t communication, std::uint32_t predefined, unsigned number,
             const PdoDescription& pdo, bool sends) {
    if (number < 1 || number > 512) return;
    const auto index = static_cast<std::uint16_t>(communication + number - 1);

    const auto mapping = static_cast<std::uint16_t>(index + 0x200);
    const bool has_default = pdo.cob == 0 && number <= 4;
    std::uint32_t cob = pdo.cob != 0 ? pdo.cob : cob_invalid;
    if (has_default) {
        cob = predefined + (number - 1) * 0x100;
    }
    d.add(index, 0, u8, fixed, sends ? 6 : 5, "Highest sub-index");
    d.add(index, 1, u32, rw, cob, "COB-ID").plus_node_id = has_default || pdo.plus_node_id;
    d.add(index, 2, u8, rw, pdo.transmission, "Transmission type");
    d.add(index, 3, u16, rw, pdo.inhibit_100us, "Inhibit time");
    d.add(index, 5, u16, rw, pdo.event_ms, "Event timer");
    if (sends) {
        d.add(index, 6, u8, rw, pdo.sync_start, "SYNC start value");
    }
    d.add(mapping, 0, u8, rw,
          pdo.multiplex != Multiplex::none ? static_cast<std::uint64_t>(pdo.multiplex)
                                           : pdo.mapping.size(),
          "Number of mapped objects");
    const auto capacity =
        std::min(std::max<std::size_t>(pdo.max_mapped, pdo.mapping.size()), std::size_t{64});
    for (std::size_t n = 0; n < capacity; ++n) {
        d.add(mapping, static_cast<std::uint8_t>(n + 1), u32, rw,
              n < pdo.mapping.size() ? pdo.mapping[n] : 0, "Mapped object");
    }
}
}  // namespace

void add_rpdo(Description& d, unsigned number, const PdoDescription& pdo) {
    add_pdo(d, 0x1400, 0x200, number, pdo, false);
}
void add_tpdo(Description& d, unsigned number, const PdoDescription& pdo) {
    add_pdo(d, 0x1800, 0x180, number, pdo, true);
}

void add_sdo_server(Description& d, unsigned number, std::uint32_t request_cob,
                    std::uint32_t answer_cob) {
    if (number > 127) return;
    const auto index = static_cast<std::uint16_t>(0x1200 + number);
    const auto access = number == 0 ? ro : rw;
    d.add(index, 0, u8, fixed, number == 0 ? 2 : 3, "Highest sub-index");
    d.add(index, 1, u32, access, request_cob, "COB-ID client to server").plus_node_id = number == 0;
    d.add(index, 2, u32, access, answer_cob, "COB-ID server to client").plus_node_id = number == 0;
    if (number != 0) {
        d.add(index, 3, u8, rw, 0, "Node-ID of the SDO client");
    }
}
void add_sdo_client(Description& d, unsigned number, std::uint32_t request_cob,
                    std::uint32_t answer_cob, std::uint8_t server) {
    if (number > 127) return;
    const auto index = static_cast<std::uint16_t>(0x1280 + number);
    d.add(index, 0, u8, fixed, 3, "Highest sub-index");
    d.add(index, 1, u32, rw, request_cob, "COB-ID client to server");
    d.add(index, 2, u32, rw, answer_cob, "COB-ID server to client");
    d.add(index, 3, u8, rw, server, "Node-ID of the SDO server");
}

}  // namespace hal::canopen
