// SPDX-License-Identifier: MIT
// Our side of the CAN figures, over any link: `can_stack ADDRESS slave`, `… master [FACTOR]`, `…
// receive COUNT`, as can_neutral.c has them, and `can_stack memory [FACTOR]`: SDO from queue to
// queue. Results are lines "name value".
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <string_view>
#include <vector>

#include "canopen/master/network.hpp"
#include "canopen/protocol/device.hpp"

using namespace hal::canopen;
namespace can = hal::can;

namespace {

constexpr std::uint8_t node = 5;

Time clock_ns(clockid_t clock) {
    timespec t{};
    clock_gettime(clock, &t);
    return t.tv_sec * second + t.tv_nsec;
}
Time now() { return clock_ns(CLOCK_MONOTONIC); }
Time cpu() { return clock_ns(CLOCK_PROCESS_CPUTIME_ID); }

void fail(const char* what) {
    std::fprintf(stderr, "can_stack: %s\n", what);
    std::exit(1);
}

Description served() {
    Description d = basic_device({.vendor = 1, .product = 2});
    d.add(0x2000, 0, Type::unsigned32, Access::read_write, 0);
    d.add_domain(0x2001, 0, Access::read_write, 8 << 20);
    d.add(0x2002, 0, Type::unsigned64, Access::read_write, 0).mappable();
    add_rpdo(d, 1, {.mapping = {map_entry(0x2002, 0, 64)}});
    add_tpdo(d, 1, {.transmission = 1, .mapping = {map_entry(0x2002, 0, 64)}});
    return d;
}

/// The master's own node: it makes the SYNC and takes TPDO 1 of the other.
Description commanding() {
    Description d = basic_device({.vendor = 1, .product = 3});
    d.find(0x1005, 0)->value = {0x80, 0, 0, 0x40};
    d.add(0x2002, 0, Type::unsigned64, Access::read_write, 0).mappable();
    add_rpdo(d, 1, {.cob = 0x180U + node, .mapping = {map_entry(0x2002, 0, 64)}});
    return d;
}

struct Arrivals : DeviceEvents {
    std::uint64_t count = 0;
    void on_rpdo(unsigned, Time) noexcept override { ++count; }
};

class Port {
public:
    Port(const char* address, std::initializer_list<can::Filter> filters)
        : opened_(can::open(address, {.receive_capacity = 4096})) {
        if (!opened_) {
            fail(opened_.problem.c_str());
        }
        const std::vector<can::Filter> all(filters);
        if (!opened_.link->set_filters(all)) {
            fail("filters");
        }
        std::puts("ready");
        std::fflush(stdout);
    }
    void send(FrameQueue& out, Time t) {
        if (out.size() == 0) return;
        for (const Frame* f;
             (f = out.front()) != nullptr && opened_.link->send(*f, t) == can::Sent::queued;) {
            out.drop();
        }
        opened_.link->flush(t);
    }
    /// Waits, and hands over what has come.
    template <class Take>
    bool take(Time at_most, Take&& each) {
        if (!opened_.link->wait(at_most)) {
            last_ = now();
            return false;
        }
        for (std::size_t count = room_.size(); count == room_.size();) {
            count = opened_.link->receive(room_, can::unclocked);
            if (count != 0) {
                last_ = room_[0].time_ns;  // the driver has read the clock
            }
            for (std::size_t n = 0; n < count; ++n) {
                each(room_[n], last_);
            }
        }
        return true;
    }
    Time last() const { return last_; }  ///< when the last frames came

private:
    can::Opened opened_;
    std::array<Frame, 64> room_;
    Time last_ = now();
};

[[noreturn]] void slave(const char* address) {
    DeviceEvents events;
    Device device(served(), {.node_id = node, .auto_start = true, .sdo = {.timeout = 5 * second}},
                  events);
    Port port(address, {{0x080, 0x7ff, false},
                        {0x200U + node, 0x7ff, false},
                        {0x600U + node, 0x7ff, false},
                        {0x000, 0x7ff, false}});
    device.start(now());
    for (;;) {
        const Time t = port.last();
        device.poll(t);
        port.send(device.out(), t);
        // Frames that the bus had no space for are sent soon, independent of received frames.
        port.take(device.out().size() > 0 ? millisecond : second,
                  [&](const Frame& f, Time at) { device.handle(f, at); });
    }
}

struct Master {
    Arrivals events;
    FrameQueue out{1024};
    Network network{out, events, {.timeout = 2 * second}};
    RemoteNode& remote = network.add(node);
    Port port;
    explicit Master(const char* address) : port(address, {{0x580U + node, 0x7ff, false}}) {}

    void run(SdoRequest& r) {
        remote.sdo().submit(r);
        while (!r.done()) {
            const Time t = port.last();
            network.poll(t);
            port.send(out, t);
            if (!r.done()) {
                port.take(second, [&](const Frame& f, Time at) { network.handle(f, at); });
            }
        }
        port.send(out, now());
        if (!r.ok()) {
            fail(to_string(r.abort));
        }
    }
    void expedited(bool upload, unsigned count) {
        std::uint8_t bytes[4] = {1, 2, 3, 4};
        const Time began = now();
        const Time used = cpu();
        for (unsigned n = 0; n < count; ++n) {
            SdoRequest r{.index = 0x2000, .upload = upload};
            if (upload) {
                r.buffer = bytes;
            } else {
                r.data = bytes;
            }
            run(r);
        }
        std::printf("exp_%s %.0f\nexp_%s_cpu %.3f\n", upload ? "up" : "down",
                    count * 1e9 / static_cast<double>(now() - began), upload ? "up" : "down",
                    static_cast<double>(cpu() - used) / count / 1000);
    }
    void transfers(const char* name, std::size_t size, SdoMode mode) {
        std::vector<std::uint8_t> data(size), back(size);
        for (std::size_t n = 0; n < size; ++n) {
            data[n] = static_cast<std::uint8_t>(n * 7 + n / 251);
        }
        Time began = now();
        SdoRequest down{.index = 0x2001, .mode = mode, .data = data};
        run(down);
        std::printf("%s_down %.1f\n", name,
                    static_cast<double>(size) * 1e6 / static_cast<double>(now() - began));
        began = now();
        SdoRequest up{.index = 0x2001, .upload = true, .mode = mode, .buffer = back};
        run(up);
        std::printf("%s_up %.1f\n", name,
                    static_cast<double>(size) * 1e6 / static_cast<double>(now() - began));
        if (data != back) {
            fail("the bytes read differ from those written");
        }
    }
};

void synchronous(const char* address, unsigned count) {
    Arrivals events;
    Device device(commanding(), {.node_id = 1, .auto_start = true, .nmt_slave = false}, events);
    Port port(address, {{0x180U + node, 0x7ff, false}});
    device.start(now());
    device.poll(now());
    port.send(device.out(), now());
    std::vector<Time> took;
    const Time used = cpu();
    Time next = now() + millisecond;
    for (unsigned n = 0; n < count; ++n, next += millisecond) {
        const timespec t{next / second, next % second};
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
        const auto before = events.count;
        const Time began = now();
        device.poll(began);
        if (!device.produce_sync(began)) {
            fail("no SYNC");
        }
        port.send(device.out(), began);
        while (events.count == before) {
            if (!port.take(second, [&](const Frame& f, Time at) { device.handle(f, at); })) {
                fail("no TPDO after a SYNC");
            }
        }
        took.push_back(now() - began);
    }
    const double cpu_us = static_cast<double>(cpu() - used) / count / 1000;
    std::sort(took.begin(), took.end());
    std::printf("sync_p50 %.1f\nsync_p99 %.1f\nsync_cpu %.2f\n",
                static_cast<double>(took[count / 2]) / 1000,
                static_cast<double>(took[count - count / 100 - 1]) / 1000, cpu_us);
}

void receive(const char* address, std::uint64_t count) {
    Arrivals events;
    Device device(commanding(), {.node_id = 1, .auto_start = true, .nmt_slave = false}, events);
    Port port(address, {{0x180U + node, 0x7ff, false}});
    device.start(now());
    const Time used = cpu();
    while (events.count < count &&
           port.take(second, [&](const Frame& f, Time at) { device.handle(f, at); })) {
        device.poll(now());
    }
    std::printf("received %llu\nreceive_cpu %.3f\n", static_cast<unsigned long long>(events.count),
                static_cast<double>(cpu() - used) /
                    static_cast<double>(std::max<std::uint64_t>(events.count, 1)) / 1000);
}

/// Client and server in one thread: what the protocol costs with queues for a bus, and what it
/// costs with the bus in memory between them.
void memory(unsigned part, bool on_bus) {
    DeviceEvents events;
    Device device(served(), {.node_id = node}, events);
    FrameQueue out(1024);
    Network network(out, events, {.timeout = 2 * second});
    SdoClient& client = network.add(node).sdo();
    device.start(0);
    Time t = 0;
    const can::Opened here = can::open("sim:bench?bitrate=unlimited");

    const can::Opened there = can::open("sim:bench?bitrate=unlimited");
    if (!here || !there) {
        fail("the bus in memory");
    }
    std::array<Frame, 64> room;
    /// What is in a queue to the other side.
    const auto carry = [&](FrameQueue& from, can::Link& sender, can::Link& receiver, auto&& take) {
        const Frame* f;
        if (!on_bus) {
            for (; (f = from.front()) != nullptr; from.drop()) {
                take(*f);
            }
            return;
        }
        while ((f = from.front()) != nullptr && sender.send(*f, t) == can::Sent::queued) {
            from.drop();
        }
        sender.flush(t);
        for (std::size_t count; (count = receiver.receive(room, t)) > 0;) {
            for (std::size_t n = 0; n < count; ++n) {
                take(room[n]);
            }
        }
    };
    const auto run = [&](SdoRequest& r) {
        client.submit(r);
        while (!r.done()) {
            t += 1000;
            network.poll(t);
            carry(out, *here.link, *there.link, [&](const Frame& f) { device.handle(f, t); });
            device.poll(t);
            carry(device.out(), *there.link, *here.link,
                  [&](const Frame& f) { network.handle(f, t); });
        }
        if (!r.ok()) {
            fail(to_string(r.abort));
        }
    };
    const std::string kind = on_bus ? "sim_" : "memory_";
    const auto rate = [&](const char* name, std::size_t size, bool upload, SdoMode mode,
                          unsigned count) {
        std::vector<std::uint8_t> bytes(size, 7);
        const Time began = cpu();
        for (unsigned n = 0; n < count; ++n) {
            SdoRequest r{.index = static_cast<std::uint16_t>(size <= 4 ? 0x2000 : 0x2001),
                         .upload = upload,
                         .mode = mode};
            if (upload) {
                r.buffer = bytes;
            } else {
                r.data = bytes;
            }
            run(r);
        }
        const double seconds = static_cast<double>(cpu() - began) / 1e9;
        std::printf(
            "%s%s %.1f\n", kind.c_str(), name,
            size <= 4 ? count / seconds : static_cast<double>(size) * count / seconds / 1000);
    };
    rate("exp_up", 4, true, SdoMode::automatic, 200'000 / part);
    rate("exp_down", 4, false, SdoMode::automatic, 200'000 / part);
    rate("seg_down", 1 << 20, false, SdoMode::segmented, 8 / part);
    rate("seg_up", 1 << 20, true, SdoMode::segmented, 8 / part);
    rate("blk_down", 1 << 20, false, SdoMode::block, 16 / part);
    rate("blk_up", 1 << 20, true, SdoMode::block, 16 / part);
}

}  // namespace

int main(int argc, char** argv) {
    const std::string_view what = argc > 2 ? argv[2] : argc > 1 ? argv[1] : "";
    const unsigned part = argc > 3 ? static_cast<unsigned>(std::max(1, std::atoi(argv[3]))) : 1;
    if (argc < 2) {
        std::fputs("can_stack ADDRESS slave|master [FACTOR]|receive COUNT, or can_stack memory\n",
                   stderr);

        return 2;
    }
    if (std::string_view(argv[1]) == "memory") {
        for (const bool on_bus : {false, true}) {
            memory(argc > 2 ? static_cast<unsigned>(std::max(1, std::atoi(argv[2]))) : 1, on_bus);
        }
        return 0;
    }
    if (what == "slave") {
        slave(argv[1]);
    }
    if (what == "receive" && argc > 3) {
        receive(argv[1], std::strtoull(argv[3], nullptr, 10));
        return 0;
    }
    if (what != "master") return 2;
    {
        Master master(argv[1]);
        master.expedited(true, 5000 / part);
        master.expedited(false, 5000 / part);
        master.transfers("seg64k", 65536, SdoMode::segmented);
        master.transfers("seg1m", (1 << 20) / part, SdoMode::segmented);
        master.transfers("blk64k", 65536, SdoMode::block);
        master.transfers("blk1m", 1 << 20, SdoMode::block);
    }
    synchronous(argv[1], 5000 / part);
    return 0;
}
