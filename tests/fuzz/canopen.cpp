// SPDX-License-Identifier: MIT
// A device and an SDO client fed with whatever comes: an input is a row of frames, ten bytes each:
// what (which identifier, how long it took), length, eight data bytes. Nothing outside the objects
// is touched, and what is over is over: nobody waits for ever.
#include <algorithm>
#include <cstdint>

#include "canopen/master/network.hpp"
#include "canopen/protocol/device.hpp"
#include "tests/fuzz/driver/require.hpp"

using namespace hal::canopen;

namespace {

using hal::fuzz::require;

Description description() {
    Description d = basic_device({.vendor = 1,
                                  .product = 2,
                                  .revision = 3,
                                  .serial = 4,
                                  .name = "fuzzed",
                                  .emcy_consumers = 2});
    d.add(0x1010, 0, Type::unsigned8, Access::constant, 1);
    d.add(0x1010, 1, Type::unsigned32, Access::read_write, 1);
    d.add(0x1011, 0, Type::unsigned8, Access::constant, 1);
    d.add(0x1011, 1, Type::unsigned32, Access::read_write, 1);
    d.add(0x2000, 0, Type::unsigned32, Access::read_write, 5).mappable();
    d.add(0x2001, 0, Type::integer16, Access::read_write).mappable().limited(-100, 100);
    d.add(0x2002, 0, Type::boolean, Access::read_write).mappable();
    d.add(0x2003, 0, Type::integer24, Access::read_write).mappable();
    d.add(0x2004, 0, Type::unsigned64, Access::read_write).mappable();
    d.add_text(0x2005, 0, Access::read_write, "text", 20).mappable();
    d.add_domain(0x2006, 0, Access::read_write, 500);
    d.add(0x1fd0, 0, Type::unsigned8, Access::constant, 1);
    d.add(0x1fd0, 1, Type::unsigned64, Access::read_write, 0);
    add_rpdo(
        d, 1,
        {.mapping = {map_entry(0x2000, 0, 32), map_entry(0x2002, 0, 1), map_entry(0x2003, 0, 24)}});
    add_rpdo(d, 2, {.transmission = 1, .mapping = {map_entry(0x2001, 0, 16)}});
    add_tpdo(d, 1, {.event_ms = 5, .mapping = {map_entry(0x2000, 0, 32)}});
    add_tpdo(d, 2,
             {.transmission = 1, .mapping = {map_entry(0x2005, 0, 16), map_entry(0x2003, 0, 24)}});
    add_sdo_server(d, 1, cob_invalid, cob_invalid);
    return d;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Description plan = description();
    DeviceEvents events;
    Device device(plan, {.node_id = 5, .queue = 64, .sdo = {.tolerate_repeats = size % 2 == 0}},
                  events);
    FrameQueue out(64);
    Network network(out, events, {.timeout = 20 * millisecond});
    LssMaster lss(out);
    auto& node = network.add(5);
    node.expect_heartbeat(50 * millisecond);
    std::uint8_t buffer[64] = {};
    static std::uint8_t bytes[1200] = {1, 2, 3};
    SdoRequest requests[] = {
        {.index = 0x2006, .data = bytes},
        {.index = 0x2006, .upload = true, .mode = SdoMode::block, .buffer = buffer},
        {.index = 0x2006, .upload = true, .mode = SdoMode::segmented, .buffer = buffer},
        {.index = 0x2000, .data = {bytes, 4}}};
    Time now = 0;
    device.start(now);
    for (auto& r : requests) {
        node.sdo().submit(r);
    }
    lss.scan(now);
    static constexpr std::uint32_t to_device[] = {0x605, 0x605, 0x605, 0x605, 0x205, 0x305,
                                                  0x000, 0x080, 0x705, 0x7e5, 0x100, 0x709,
                                                  0x085, 0x606, 0x7ff, 0x185};
    static constexpr std::uint32_t to_master[] = {0x585, 0x585, 0x585, 0x705,
                                                  0x085, 0x7e4, 0x585, 0x706};
    const auto step = [&](const Frame* f, bool master) {
        if (f != nullptr && master) {
            lss.listens_to(*f) ? lss.handle(*f, now) : (void)network.handle(*f, now);
        }
        if (f != nullptr && !master) {
            device.handle(*f, now);
        }
        device.poll(now);
        network.poll(now);
        lss.poll(now);
        for (Frame sent; device.out().pop(sent);) {
            require(sent.length <= 8 && (sent.extended || sent.id <= 0x7ff),
                    "a frame that can be sent");
        }
        for (Frame sent; out.pop(sent);) {
            require(sent.length <= 8 && sent.id <= 0x7ff, "a frame that can be sent");
        }
    };
    for (std::size_t at = 0; at + 10 <= size; at += 10) {
        const std::uint8_t what = data[at];
        const std::uint8_t shape = data[at + 1];
        const bool master = (what & 0x80) != 0;
        Frame f = make_frame(master ? to_master[what & 7] : to_device[what & 15],
                             static_cast<std::uint8_t>(shape % 9));
        if ((shape & 0x40) == 0) {
            f.length = 8;
        }
        f.remote = (shape & 0x80) != 0;
        std::copy_n(data + at + 2, 8, f.data.begin());
        now += (what & 0x70) * millisecond / 4;
        step(&f, master);
    }
    for (int n = 0; n < 5000 && (!node.sdo().idle() || lss.busy()); ++n) {
        now += 10 * millisecond;
        step(nullptr, false);
    }
    require(node.sdo().idle() && !lss.busy(), "every request comes to an end");
    now += 10 * second;
    step(nullptr, false);
    now += 10 * second;
    step(nullptr, false);
    for (std::size_t n = 0; n < device.sdo_servers(); ++n) {
        require(!device.sdo_server(n).busy(), "a server gives up on a silent client");
    }
    for (const auto& r : requests) {
        require(r.done() && r.size <= std::max(r.buffer.size(), r.data.size()),
                "the transfer exceeds its buffer");
    }
    return 0;
}
