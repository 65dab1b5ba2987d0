// SPDX-License-Identifier: MIT
#include "gateway_own_node.hpp"

#include <algorithm>
#include <cstdio>

namespace hal::canopen::gateway {

std::string abort_text(Abort abort) {
    char text[24];
    std::snprintf(text, sizeof text, "ERROR:0x%08X #", static_cast<unsigned>(abort));
    return std::string(text) + canopen::to_string(abort);
}

/// Only objects that act or hold something: no PDO, SYNC or SDO parameters of a node whose object
/// dictionary the bus does not reach.
Description own_objects(const Identity& identity) {
    Description d;
    const auto number = [&d](std::uint16_t index, std::uint8_t sub, Type type, const char* name,
                             std::uint64_t value = 0) {
        d.add(index, sub, type, Access::read_only, value, name);
    };
    number(0x1000, 0, Type::unsigned32, "Device type");
    number(0x1001, 0, Type::unsigned8, "Error register");
    d.add_text(0x1008, 0, Access::constant, identity.product_name, 0, "Manufacturer device name");
    d.add_text(0x100a, 0, Access::constant, "1.0", 0, "Manufacturer software version");
    d.add(0x1017, 0, Type::unsigned16, Access::read_write, 0, "Producer heartbeat time");
    number(0x1018, 0, Type::unsigned8, "Highest sub-index", 4);
    // as `info version` reports them
    number(0x1018, 1, Type::unsigned32, "Vendor-ID", identity.vendor);
    number(0x1018, 2, Type::unsigned32, "Product code", identity.product);
    number(0x1018, 3, Type::unsigned32, "Revision number", identity.revision);
    number(0x1018, 4, Type::unsigned32, "Serial number", identity.serial);
    // DeviceInfo of an EDS (CiA 306), which a client of the gateway cannot read otherwise
    number(0x2000, 0, Type::unsigned8, "Highest sub-index", 3);
    d.add_text(0x2000, 1, Access::constant, identity.vendor_name, 0, "Vendor name");
    d.add_text(0x2000, 2, Access::constant, identity.product_name, 0, "Product name");
    d.add_text(0x2000, 3, Access::constant, identity.order_code, 0, "Order code");
    return d;
}

std::string value_text(std::span<const std::uint8_t> value, const Format* wanted) {
    return text_of(value, wanted != nullptr ? *wanted : *format("hex"));
}

std::string OwnNode::transfer(const Command& c, Time now) {
    dictionary_.set(0x1017, 0, static_cast<std::uint16_t>(heartbeat_ / millisecond));
    if (c.verb == Verb::write) {
        const Abort abort = dictionary_.write(c.index, c.sub, c.value);
        if (abort != Abort::none) return abort_text(abort);
        if (c.index == 0x1017) {
            set_heartbeat(dictionary_.get<std::uint16_t>(0x1017, 0) * millisecond, now);
        }
        return "OK";
    }
    std::uint8_t value[Identity::max_name];  // as long as the longest of own_objects()
    std::size_t size = 0;
    const Abort abort = dictionary_.read(c.index, c.sub, value, size);
    if (abort != Abort::none) return abort_text(abort);
    return value_text({value, size}, c.format);
}

void OwnNode::poll(FrameQueue& out, Time now) {
    if (heartbeat_ == 0 || id_ == 0 || now < next_heartbeat_) return;
    Frame beat = make_frame(0x700U + id_, 1);
    beat.data[0] = static_cast<std::uint8_t>(NmtState::operational);
    if (out.push(beat)) {
        next_heartbeat_ = std::max(next_heartbeat_ + heartbeat_, now);
    }
}

}  // namespace hal::canopen::gateway
