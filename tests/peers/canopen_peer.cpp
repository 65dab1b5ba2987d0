// SPDX-License-Identifier: MIT
// Our side of canopen_peer_test.py: `device ADDRESS NODE` is a node on that bus until it is killed;
// `client ADDRESS NODE` does what its standard input are commands to that node, one per line:
// `write INDEX SUB MODE HEXBYTES`, `read INDEX SUB MODE`, `nmt COMMAND`. One line answers.
// `master ADDRESS NODE` boots that node, prints a line for each of its steps, and goes on until it is killed.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string>

#include "canopen/master/boot/nmt_master.hpp"
#include "canopen/protocol/device.hpp"

using namespace hal::canopen;

namespace {

Time clock_now() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

struct Port {
    hal::can::Opened opened;
    explicit Port(const char* address) : opened(hal::can::open(address)) {
        std::puts(opened ? "open" : opened.problem.c_str());
        std::fflush(stdout);
        if (!opened) {
            std::exit(1);
        }
    }
    template <class Take>
    void turn(FrameQueue& out, Take take) {
        auto& link = *opened.link;
        link.wait(millisecond);
        const Time now = clock_now();
        for (Frame f; link.receive(f, hal::can::unclocked);) {
            take(f, now);
        }
        for (const Frame* f; (f = out.front()) != nullptr &&
                             link.send(*f, hal::can::unclocked) == hal::can::Sent::queued;) {
            out.drop();
        }
        link.flush(hal::can::unclocked);
    }
};

Description description() {
    using enum Access;
    Description d = basic_device({.device_type = 0x191,
                                  .vendor = 0x1234,
                                  .product = 2,
                                  .revision = 3,
                                  .serial = 4,
                                  .name = "halcyon peer"});
    d.add(0x2000, 0, Type::unsigned32, read_write, 0x12345678).mappable();
    d.add(0x2001, 0, Type::integer16, read_write).mappable();
    d.add_text(0x2005, 0, read_write, "hello world", 100);
    d.add_domain(0x2006, 0, read_write, 1 << 20);
    add_rpdo(d, 1, {.mapping = {map_entry(0x2000, 0, 32), map_entry(0x2001, 0, 16)}});
    add_tpdo(d, 1,
             {.transmission = 1, .mapping = {map_entry(0x2001, 0, 16), map_entry(0x2000, 0, 32)}});
    return d;
}

int device(const char* address, std::uint8_t id) {
    Port port(address);
    DeviceEvents events;
    Device device(description(), {.node_id = id}, events);
    device.start(clock_now());
    for (;;) {
        port.turn(device.out(), [&](const Frame& f, Time now) { device.handle(f, now); });
        device.poll(clock_now());
        // An error on request, so that the other side can see one.
        if (device.dictionary().get<std::uint32_t>(0x2000, 0) == 0xe) {
            device.emcy().raise(0x5030, error_manufacturer, {1, 2, 3, 4, 5});
        } else {
            device.emcy().clear(0x5030);
        }
    }
}

int client(const char* address, std::uint8_t id) {
    Port port(address);
    DeviceEvents events;
    FrameQueue out(1024);
    Network network(out, events, {.timeout = 1 * second});
    auto& node = network.add(id);
    std::vector<std::uint8_t> data, buffer(1 << 20);
    for (std::string line; std::getline(std::cin, line);) {
        std::istringstream words(line);
        std::string what, index, sub, mode, bytes;
        words >> what >> index;
        if (what == "nmt") {
            network.command(static_cast<NmtCommand>(std::strtoul(index.c_str(), nullptr, 16)), id);
            port.turn(out, [&](const Frame& f, Time now) { network.handle(f, now); });
            std::puts("done");
        } else {
            words >> sub >> mode >> bytes;
            data.clear();
            for (std::size_t n = 0; n + 1 < bytes.size(); n += 2) {
                data.push_back(
                    static_cast<std::uint8_t>(std::stoul(bytes.substr(n, 2), nullptr, 16)));
            }
            SdoRequest r{.index = static_cast<std::uint16_t>(std::stoul(index, nullptr, 16)),
                         .sub = static_cast<std::uint8_t>(std::stoul(sub)),
                         .upload = what == "read",
                         .mode = mode == "block" ? SdoMode::block : SdoMode::segmented,
                         .data = data,
                         .buffer = buffer};
            node.sdo().submit(r);
            while (!r.done()) {
                network.poll(clock_now());
                port.turn(out, [&](const Frame& f, Time now) { network.handle(f, now); });
            }
            if (r.abort != Abort::none) {
                std::printf("abort %08x %s\n", static_cast<unsigned>(r.abort), to_string(r.abort));
            } else {
                std::printf("ok ");
                for (std::size_t n = 0; r.upload && n < r.size; ++n) {
                    std::printf("%02x", buffer[n]);
                }
                std::puts("");
            }
        }
        std::fflush(stdout);
    }
    return 0;
}

struct Teller : MasterEvents {
    const NodeSetup* setup = nullptr;
    void on_step(const NodeStatus& s) noexcept override {
        std::printf("%s %s\n", to_string(s.step),
                    setup != nullptr ? sentence(*setup, s).c_str() : "");
        std::fflush(stdout);
    }
};

int master(const char* address, std::uint8_t id) {
    Port port(address);
    NodeSetup node;
    node.id = id;
    node.device_type = 0x1234;
    node.writes = tpdo_writes(
        1, {.transmission = 1, .mapping = {map_entry(0x2001, 0, 16), map_entry(0x2000, 0, 32)}},
        id);
    node.writes.push_back(object_write(0x2000, 0, std::uint32_t{4711}));
    node.writes.push_back(object_write(0x2001, 0, std::int16_t{-5}));
    node.writes.push_back({{0x2005, 0, {'a', ' ', 'l', 'o', 'n', 'g', ' ', 't', 'e', 'x', 't'}}});
    MasterSetup setup;
    setup.nodes = {node};
    setup.sdo.timeout = 1 * second;
    FrameQueue out(1024);
    Teller teller;
    teller.setup = &setup.nodes.front();
    Master master(setup, out, teller);
    for (master.start(clock_now());; master.poll(clock_now())) {
        port.turn(out, [&](const Frame& f, Time now) { master.handle(f, now); });
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 4) {
        std::fputs("canopen_peer device|client|master ADDRESS NODE\n", stderr);
        return 2;
    }
    const auto id = static_cast<std::uint8_t>(std::atoi(argv[3]));
    if (argv[1][0] == 'm') return master(argv[2], id);
    return argv[1][0] == 'd' ? device(argv[2], id) : client(argv[2], id);
}
