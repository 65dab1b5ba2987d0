// SPDX-License-Identifier: MIT
// After set-up nothing takes memory: the program's `new` counts while a device and a master work.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "canopen/device/drive/drive.hpp"
#include "canopen/master/boot/boot_channel.hpp"
#include "canopen/master/boot/nmt_master.hpp"
#include "canopen/protocol/device.hpp"

namespace {
bool counting = false;
int taken = 0;
}  // namespace

// g++ sees the `free` inlined next to a `new` and takes the pair for a mistake.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
#endif

void* operator new(std::size_t size) {
    if (counting) {
        ++taken;
    }
    if (void* memory = std::malloc(size != 0 ? size : 1)) return memory;
    throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    if (counting) {
        ++taken;
    }
    return std::malloc(size != 0 ? size : 1);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace hal::canopen::test {
namespace {

TEST(Memory, Is_not_taken_after_setup) {
    Description d = basic_device({.vendor = 1});
    d.add(0x2000, 0, Type::unsigned64, Access::read_write).mappable();
    d.add_domain(0x2006, 0, Access::read_write, 5000);
    add_rpdo(d, 1, {.mapping = {map_entry(0x2000, 0, 32)}});
    add_tpdo(d, 1, {.transmission = 1, .mapping = {map_entry(0x2000, 0, 64)}});
    DeviceEvents events;
    Device device(d, {.node_id = 5}, events);
    FrameQueue out(1024);
    Network network(out, events);
    auto& node = network.add(5);
    static std::uint8_t data[5000], buffer[5000];
    Time now = 0;
    int failed = 0;
    const auto turn = [&] {
        for (int n = 0; n < 300; ++n) {
            for (Frame f; out.pop(f);) {
                device.handle(f, now);
            }
            for (Frame f; device.out().pop(f);) {
                network.handle(f, now);
            }
            device.poll(now);
            network.poll(now);
        }
        now += millisecond;
    };
    const auto serve = [&](SdoRequest& r) {
        node.sdo().submit(r);
        for (int n = 0; n < 50 && !r.done(); ++n) {
            turn();
        }
        failed += r.ok() ? 0 : 1;
    };
    const auto write = [&](std::uint16_t index, std::uint8_t sub, std::uint32_t value,
                           std::size_t size) {
        std::uint8_t bytes[4];
        store(bytes, value);
        SdoRequest r{.index = index, .sub = sub, .data = {bytes, size}};
        serve(r);
    };

    counting = true;
    device.start(now);
    for (const auto mode : {SdoMode::segmented, SdoMode::block}) {
        for (const bool up : {false, true}) {
            SdoRequest r{
                .index = 0x2006, .upload = up, .mode = mode, .data = data, .buffer = buffer};
            serve(r);
        }
    }
    write(0x1400, 1, 0x80000205, 4);
    write(0x1600, 0, 0, 1);
    write(0x1600, 1, map_entry(0x2000, 0, 64), 4);
    write(0x1600, 0, 1, 1);
    write(0x1400, 1, 0x205, 4);
    write(0x1017, 0, 10, 2);
    network.command(NmtCommand::start, 0);
    turn();
    device.emcy().raise(0x5000, error_generic);
    device.handle({0x205, {1, 2, 3, 4, 5, 6, 7, 8}}, now);
    device.handle({0x80, {}}, now);
    turn();
    network.command(NmtCommand::reset_node, 5);
    turn();
    counting = false;
    EXPECT_EQ(failed, 0);
    EXPECT_EQ(taken, 0);
    EXPECT_EQ(node.emergency(0).code, 0x5000);
    EXPECT_EQ(device.pdos().tpdo(1).count, 1U);
}

TEST(Memory, Is_not_taken_while_a_master_boots_loses_and_restarts_nodes) {
    const auto with_program = [] {
        Description d = basic_device({.vendor = 1});
        d.add(0x1010, 1, Type::unsigned32, Access::read_write, 1);
        d.add(0x1011, 1, Type::unsigned32, Access::read_write, 1);
        d.add_domain(0x1f50, 1, Access::read_write, 5000);
        d.add(0x1f51, 1, Type::unsigned8, Access::read_write, 1);
        d.add(0x1f56, 1, Type::unsigned32, Access::read_only, 6);
        d.add(0x2000, 0, Type::unsigned32, Access::read_write).mappable();
        add_tpdo(d, 1, {.mapping = {map_entry(0x2000, 0, 32)}});
        return d;
    };
    DeviceEvents events;
    Device good(with_program(), {.node_id = 5}, events),
        wrong(with_program(), {.node_id = 6}, events);
    NodeSetup n;
    n.id = 5;
    n.vendor = 1;
    n.writes = tpdo_writes(1, {.transmission = 1, .mapping = {map_entry(0x2000, 0, 32)}}, 5);
    n.restore = n.save = true;
    n.heartbeat_ms = 20;
    n.master_limit_ms = 500;
    n.retry = 50 * millisecond;
    n.retry_max = 100 * millisecond;
    MasterSetup setup;
    setup.sdo.timeout = 20 * millisecond;
    setup.nodes = {n, n, n};
    setup.nodes[1].id = 6;
    setup.nodes[2].id = 7;
    setup.nodes[1].program = {.id = 7,
                              .update = true,
                              .image = std::vector<std::uint8_t>(3000),
                              .limit = 100 * millisecond};
    setup.nodes[2].mandatory = false;
    FrameQueue out(1024);
    MasterEvents told;
    Master master(setup, out, told);
    Time now = 0;
    bool plugged = true;
    const auto run = [&](Time time) {
        for (const Time end = now + time; now < end; now += millisecond) {
            for (int turn = 0; turn < 20; ++turn) {
                for (Frame f; out.pop(f);) {
                    for (auto* d : {&good, &wrong}) {
                        if (plugged || d == &wrong) {
                            d->handle(f, now);
                        }
                    }
                }
                for (auto* d : {&good, &wrong}) {
                    for (Frame f; d->out().pop(f);) {
                        if (plugged || d == &wrong) {
                            master.handle(f, now);
                        }
                    }
                }
            }
            good.poll(now);
            wrong.poll(now);
            master.poll(now);
        }
    };

    taken = 0;
    counting = true;
    good.start(now);
    wrong.start(now);
    master.start(now);
    run(3 * second);
    const bool was_operational = master.status(5).operational;
    plugged = false;
    run(second);
    const bool was_lost = master.status(5).losses == 1;
    plugged = true;
    run(2 * second);
    const bool came_back = master.status(5).operational;
    master.command(NmtCommand::reset_node, 5, now);
    run(second);
    master.remove(7, now);
    master.stop(now);
    run(second);
    counting = false;
    EXPECT_EQ(taken, 0);
    EXPECT_TRUE(was_operational && was_lost && came_back);
    EXPECT_EQ(master.status(6).result, BootResult::update);
    EXPECT_GT(master.max_task_memory(), 0U);
    EXPECT_LT(master.max_task_memory(), BootChannel::task_bytes * 3 / 4);
    EXPECT_EQ(master.status().state, NetworkState::stopped);
}

TEST(Memory, Is_not_taken_by_a_drive_at_work) {
    DriveSettings settings;
    settings.axes = 2;
    Drive drive(settings, {.node_id = 5});
    auto& dictionary = drive.device().dictionary();
    Time now = 0;
    const auto write = [&](std::uint16_t index, std::int32_t value) {
        std::uint8_t bytes[4];
        store(bytes, value);
        for (const unsigned axis : {0U, 1U}) {
            auto* e = dictionary.find(cia402::of_axis(index, axis), 0);
            dictionary.write(*e, {bytes, e->size});
        }
    };
    const auto run = [&](int ms) {
        while (ms-- > 0) {
            drive.step(now += millisecond);
            drive.device().poll(now);
            for (Frame f; drive.device().out().pop(f);) {
                continue;
            }
        }
    };
    counting = true;
    drive.start(now);
    drive.device().command(NmtCommand::start, now);
    write(0x6098, 24);
    for (int mode = 1; mode <= 10; ++mode) {
        if (mode == 5) continue;
        write(0x6060, mode);
        for (const int word : {0x06, 0x0f, 0x0f, 0x1f, 0x7f, 0x10f}) {
            write(0x607a, 1000 * mode);
            write(0x60ff, 5000);
            write(0x6071, 20);
            write(0x6040, word);
            run(50);
        }
    }
    write(0x2011, 8);
    run(300);
    counting = false;
    EXPECT_EQ(taken, 0);
    EXPECT_EQ(drive.status(1).state, cia402::State::fault);
    EXPECT_GT(drive.status(0).place, 1000);
}

}  // namespace
}  // namespace hal::canopen::test
