// SPDX-License-Identifier: MIT
// The CiA 309-3 gateway fed with whatever comes, with a device on its bus: every line that is a
// command gets one answer, in the end nobody waits, and every frame is one that can be sent.
#include <cstdint>
#include <string>

#include "canopen/master/gateway/gateway.hpp"
#include "canopen/protocol/device.hpp"
#include "tests/fuzz/driver/require.hpp"

using namespace hal::canopen;

namespace {

using hal::fuzz::require;

Description description() {
    Description d =
        basic_device({.vendor = 1, .product = 2, .revision = 3, .serial = 4, .name = "fuzzed"});
    d.add(0x2000, 0, Type::unsigned32, Access::read_write, 5).mappable();
    d.add_text(0x2005, 0, Access::read_write, "text", 20);
    d.add_domain(0x2006, 0, Access::read_write, 500);
    add_tpdo(d, 1, {.transmission = 1, .mapping = {map_entry(0x2000, 0, 32)}});
    return d;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Description plan = description();
    DeviceEvents events;
    Device device(plan, {.node_id = 5, .queue = 256}, events);
    gateway::Gateway gateway(1);
    Time now = 0;
    device.start(now);
    const int client = gateway.connect();
    const auto turn = [&] {
        gateway.poll(now);
        device.poll(now);
        for (int n = 0; n < 400; ++n) {
            Frame f;
            const bool asked = gateway.out(1).pop(f);
            if (asked) {
                require(f.length <= 8 && (f.extended || f.id <= 0x7ff), "a frame that can be sent");

                device.handle(f, now);
            }
            const bool told = device.out().pop(f);
            if (told) {
                gateway.handle(1, f, now);
            }
            if (!asked && !told) break;
        }
    };
    std::size_t commands = 0;
    std::size_t begin = 0;
    const std::string text(reinterpret_cast<const char*>(data), size);
    for (std::size_t end; (end = text.find('\n', begin)) != text.npos; begin = end + 1) {
        const auto parsed = gateway::parse(std::string_view(text).substr(begin, end - begin));
        commands +=
            parsed.error != gateway::Error::none || parsed.command.verb != gateway::Verb::none;
    }
    // In pieces, as a socket hands it over.
    for (std::size_t n = 0; n < size; n += 37) {
        gateway.receive(client, std::string_view(text).substr(n, 37), now);
        turn();
        now += 3 * millisecond;
    }
    for (int n = 0; n < 200'000 && !gateway.idle(); ++n) {
        turn();
        now += 20 * millisecond;
    }
    require(gateway.idle(), "every command comes to an end");
    std::size_t answers = 0;
    const std::string& out = gateway.output(client);
    for (std::size_t at = 0; at < out.size();) {
        const auto end = out.find("\r\n", at);
        require(end != out.npos, "lines end", out);
        answers += out[at] == '[';
        at = end + 2;
    }
    require(answers == commands, "one answer for each command",
            std::to_string(answers) + " of " + std::to_string(commands) + "\n" + out);
    return 0;
}
