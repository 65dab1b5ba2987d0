// SPDX-License-Identifier: MIT
#include <linux/capability.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sys/socket.h>
#include <sys/syscall.h>

#include <algorithm>
#include <cstdlib>
#include <thread>

#include "ethernet/raw/raw_clock.hpp"
#include "hal/privilege.hpp"
#include "interfaces.hpp"

namespace hal::ethernet {
namespace {

constexpr std::uint16_t type = 0x88b5;
constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t us = 1'000;

std::int64_t number_at(std::span<const std::uint8_t> bytes, std::size_t place) {
    std::int64_t value = 0;
    for (std::size_t i = 0; i < 8; ++i) {
        value = value << 8 | bytes[place + i];
    }
    return value;
}

TEST_F(Raw, a_frame_arrives_whole_with_the_time_of_its_arrival) {
    auto here = a();
    auto there = b();
    const auto before = link::monotonic_ns();
    EXPECT_EQ(here->send(frame(there->address(), *here, type, {1, 2, 3}), {}, before),
              Sent::queued);
    ASSERT_TRUE(there->wait(before + 5000 * ms));
    const auto arrival = there->receive(before);
    const auto after = link::monotonic_ns();
    ASSERT_TRUE(arrival);
    EXPECT_EQ(arrival->bytes.size(), smallest_frame);
    EXPECT_EQ((Bytes{arrival->bytes.begin() + 14, arrival->bytes.begin() + 18}),
              (Bytes{1, 2, 3, 0}));
    EXPECT_GE(arrival->time_ns, before);
    EXPECT_LE(arrival->time_ns, after);
    EXPECT_TRUE(silent(*there));
    EXPECT_TRUE(silent(*here));
    EXPECT_EQ(here->statistics().sent, 1U);
    EXPECT_EQ(there->statistics().received_bytes, 60U);
    EXPECT_EQ(there->statistics().mtu, 1500U);
    EXPECT_EQ(there->statistics().speed, 10000U);  // the speed that veth reports
}

TEST_F(Raw, frames_go_there_and_back_with_every_policy) {
    for (const auto policy : {Policy::block, Policy::hybrid, Policy::spin}) {
        auto here = a({.types = {type}, .policy = policy});

        auto there = b({.types = {type}, .policy = policy});
        // hybrid sleeps until shortly before the end, whatever comes
        const auto waited = [](Port& port) {
            bool there_is = false;
            for (int i = 0; i < 5000 && !there_is; ++i) {
                there_is = port.wait(link::monotonic_ns() + ms);
            }
            return there_is;
        };
        std::thread echo([&] {
            for (int left = 200; left > 0 && waited(*there);) {
                while (const auto arrival = there->receive(0)) {
                    const Bytes back(arrival->bytes.begin(), arrival->bytes.end());
                    there->send(back, {}, 0);
                    --left;
                }
            }
        });
        int returned = 0;
        std::int64_t last = 0;
        for (int i = 0; i < 200; ++i) {
            here->send(frame(broadcast, *here, type, {static_cast<std::uint8_t>(i)}), {}, 0);
            if (!waited(*here)) break;
            const auto arrival = here->receive(0);
            EXPECT_EQ(arrival->bytes[14], static_cast<std::uint8_t>(i));
            EXPECT_GT(arrival->time_ns, last);  // stamps go up
            last = arrival->time_ns;
            ++returned;
        }
        echo.join();
        EXPECT_EQ(returned, 200) << static_cast<int>(policy);
    }
}

TEST_F(Raw, types_and_stations_are_chosen_by_the_kernel) {
    auto here = a();
    auto one = b();
    auto several = b({.types = {0x9021, 0x9022}, .policy = Policy::block});

    auto all = b({.policy = Policy::block});
    auto ear = b({.policy = Policy::block, .promiscuous = true});
    const auto send = [&](const Address& to, std::uint16_t of, std::uint8_t mark) {
        here->send(frame(to, *here, of, {mark}), {}, 0);
    };
    send(broadcast, type, 1);
    send(one->address(), 0x9021, 2);
    send(broadcast, 0x9022, 3);
    send({2, 0, 0, 0, 0, 9}, 0x9021, 4);  // for another station
    EXPECT_EQ(firsts(*one, 1), "1");
    EXPECT_EQ(firsts(*several, 2), "23");
    EXPECT_EQ(firsts(*all, 3), "123");
    EXPECT_EQ(firsts(*ear, 4), "1234");
    for (auto* port : {one.get(), several.get(), all.get(), ear.get()}) {
        EXPECT_TRUE(silent(*port));
    }
}

TEST_F(Raw, two_users_of_one_interface_do_not_hear_each_other) {
    auto bus = a({.types = {0x9021}, .policy = Policy::block});

    auto can = a({.types = {0x9023}, .policy = Policy::block});
    auto there = b({.policy = Policy::block});
    EXPECT_EQ(bus->address(), can->address());
    bus->send(frame(broadcast, *bus, 0x9023, {1}), {}, 0);
    can->send(frame(broadcast, *can, 0x9021, {2}), {}, 0);
    EXPECT_EQ(firsts(*there, 2), "12");
    EXPECT_TRUE(silent(*bus));
    EXPECT_TRUE(silent(*can));
    there->send(frame(can->address(), *there, 0x9023, {3}), {}, 0);
    EXPECT_EQ(firsts(*can, 1), "3");
    EXPECT_TRUE(silent(*bus));
}

TEST_F(Raw, the_mtu_of_the_interface_is_the_limit) {
    auto here = a();
    auto there = b();
    EXPECT_EQ(here->send(Bytes(13), {}, 0), Sent::rejected);
    EXPECT_EQ(here->send(frame(broadcast, *here, type, Bytes(1501)), {}, 0), Sent::rejected);
    EXPECT_EQ(here->send(frame(broadcast, *here, type, Bytes(15)), {.stamp_at = 22}, 0),
              Sent::rejected);
    EXPECT_EQ(here->send(frame(broadcast, *here, type, Bytes(1500, 1)), {}, 0), Sent::queued);
    EXPECT_EQ(here->send(frame(broadcast, *here, type, Bytes(1500, 1)), {.stamp_at = 22}, 0),
              Sent::queued);
    EXPECT_EQ(firsts(*there, 2), "11");
    EXPECT_EQ(there->statistics().received_bytes, 3028U);
    EXPECT_EQ(here->statistics().dropped, 3U);
    EXPECT_EQ(here->statistics().errors, 3U);
    ASSERT_TRUE(command("ip link set " + a_ + " mtu 500"));
    EXPECT_TRUE(eventually([&] { return here->statistics().mtu == 500; }));
    EXPECT_EQ(here->send(frame(broadcast, *here, type, Bytes(501)), {}, 0), Sent::rejected);
    EXPECT_EQ(here->send(frame(broadcast, *here, type, Bytes(500, 2)), {}, 0), Sent::queued);
    EXPECT_EQ(firsts(*there, 1), "2");
}

TEST_F(Raw, a_lost_carrier_is_told_and_heals) {
    auto here = a();
    auto there = b();
    ASSERT_TRUE(command("ip link set " + b_ + " down"));
    ASSERT_TRUE(eventually([&] { return !here->statistics().up && !there->statistics().up; }));
    const auto f = frame(broadcast, *here, type, {1});
    EXPECT_EQ(here->send(f, {}, 0), Sent::down);
    EXPECT_FALSE(there->wait(link::monotonic_ns() + 20 * ms));
    EXPECT_EQ(here->statistics().dropped, 1U);
    EXPECT_EQ(here->statistics().downs, 1U);
    ASSERT_TRUE(command("ip link set " + b_ + " up"));
    ASSERT_TRUE(eventually([&] { return here->statistics().up && there->statistics().up; }));
    EXPECT_EQ(here->send(f, {}, 0), Sent::queued);
    EXPECT_EQ(firsts(*there, 1), "1");
    there->send(frame(broadcast, *there, type, {2}), {}, 0);
    EXPECT_EQ(firsts(*here, 1), "2");
}

TEST_F(Raw, an_interface_that_is_removed_may_come_back) {
    auto here = a();
    auto there = b({.types = {type}, .policy = Policy::block, .promiscuous = true});
    ASSERT_TRUE(command("ip link del " + a_));
    ASSERT_TRUE(eventually([&] { return !here->statistics().up && !there->statistics().up; }));
    EXPECT_EQ(here->send(frame(broadcast, *here, type, {1}), {}, 0), Sent::down);
    EXPECT_FALSE(there->wait(link::monotonic_ns() + 10 * ms));
    make();
    ASSERT_TRUE(eventually([&] { return here->statistics().up && there->statistics().up; }));
    EXPECT_EQ(here->send(frame(broadcast, *here, type, {2}), {}, 0), Sent::queued);
    EXPECT_EQ(here->send(frame({2, 0, 0, 0, 0, 9}, *here, type, {3}), {}, 0), Sent::queued);
    EXPECT_EQ(firsts(*there, 2), "23");
}

TEST_F(Raw, a_frame_leaves_at_its_time_and_is_stamped_then) {
    for (const bool pacer : {false, true}) {
        auto there = b();
        auto here = a({.types = {type}, .spin_ns = 10 * ms, .pacer = pacer});
        const auto at = link::monotonic_ns() + 5 * ms;
        const Launch launch{.at_ns = at, .stamp_at = 22, .stamp_add_ns = 1000 * ms};
        EXPECT_EQ(here->send(frame(broadcast, *here, type, Bytes(20)), launch, 0), Sent::queued);
        ASSERT_TRUE(there->wait(at + 5000 * ms));
        const auto arrival = there->receive(0);
        ASSERT_TRUE(arrival);
        const auto stamp = number_at(arrival->bytes, 22) - 1000 * ms;
        EXPECT_GE(stamp, at);
        EXPECT_LE(stamp, arrival->time_ns);
        EXPECT_EQ(here->statistics().launch_error_ns, stamp - at);
    }
}

TEST_F(Raw, what_warms_the_way_is_on_no_wire) {
    for (const bool pacer : {false, true}) {
        auto there = b({.promiscuous = true});
        auto here = a({.types = {type}, .spin_ns = 10 * ms, .pacer = pacer});
        for (std::uint8_t mark = 1; mark < 9; ++mark) {
            EXPECT_EQ(here->send(frame(broadcast, *here, type, {mark}),
                                 {.at_ns = link::monotonic_ns() + ms}, 0),
                      Sent::queued);
            for (bool ours = false; !ours;) {  // the kernel may send on a new interface
                ASSERT_TRUE(there->wait(link::monotonic_ns() + 5000 * ms));
                const auto arrival = there->receive(0);
                ASSERT_TRUE(arrival);
                const auto bytes = arrival->bytes;
                EXPECT_FALSE(std::all_of(bytes.begin(), bytes.begin() + 12,
                                         [](std::uint8_t byte) { return byte == 0; }));
                ours = bytes[12] == type >> 8 && bytes[13] == (type & 0xff);
                EXPECT_TRUE(!ours || bytes[14] == mark);
            }
        }
        EXPECT_EQ(here->statistics().sent, 8U);
        EXPECT_EQ(here->statistics().errors + here->statistics().dropped, 0U);
    }
}

TEST_F(Raw, the_pacer_sends_in_order_of_the_times) {
    auto there = b();
    auto here = a({.types = {type}, .pacer = true});
    const auto now = link::monotonic_ns();
    const auto send = [&](std::uint8_t mark, std::int64_t at) {
        return here->send(frame(broadcast, *here, type, {mark}), {.at_ns = at}, now);
    };
    EXPECT_EQ(send(4, now + 60 * ms), Sent::queued);
    EXPECT_EQ(send(2, now + 40 * ms), Sent::queued);
    EXPECT_EQ(send(3, now + 40 * ms), Sent::queued);  // of one time: as they were sent
    EXPECT_EQ(send(1, now + 30 * ms), Sent::queued);
    EXPECT_EQ(firsts(*there, 4), "1234");
    EXPECT_EQ(here->statistics().late, 0U);
}

TEST_F(Raw, what_is_later_than_its_guard_is_dropped_and_counted) {
    auto there = b();
    auto here = a({.types = {type}, .pacer = true});
    auto plain = a({.types = {type}, .spin_ns = ms});
    const auto now = link::monotonic_ns();
    for (auto* port : {here.get(), plain.get()}) {
        const auto f = frame(broadcast, *port, type, {1});
        EXPECT_EQ(port->send(f, {.at_ns = now - ms, .guard_ns = 1 * us}, now), Sent::late);
        EXPECT_EQ(port->send(f, {.at_ns = now - ms}, now), Sent::queued);
        EXPECT_EQ(port->statistics().late, 1U);
        EXPECT_GE(port->statistics().launch_error_ns, ms);
    }
    const auto f = frame(broadcast, *plain, type, {1});
    // beyond what it would wait
    EXPECT_EQ(plain->send(f, {.at_ns = now + 3'600'000 * ms}, now), Sent::full);
    EXPECT_EQ(plain->statistics().dropped, 1U);
    EXPECT_EQ(firsts(*there, 2), "11");
    EXPECT_TRUE(silent(*there));
}

TEST_F(Raw, a_pacer_that_is_full_says_so_and_ends_with_its_port) {
    auto here = a({.types = {type}, .pacer = true, .send_capacity = 4});
    const auto now = link::monotonic_ns();
    const auto f = frame(broadcast, *here, type, {1});
    for (int i = 0; i < 4; ++i) {
        EXPECT_EQ(here->send(f, {.at_ns = now + 3'600'000 * ms}, now), Sent::queued);
    }
    EXPECT_EQ(here->send(f, {.at_ns = now + 3'600'000 * ms}, now), Sent::full);
    EXPECT_EQ(here->statistics().dropped, 1U);
    EXPECT_EQ(here->statistics().sent, 0U);
}

TEST_F(Raw, the_kernel_stamps_what_leaves_when_asked_to) {
    auto there = b();
    auto here = open_or_fail("eth:" + a_ + "?txstamps");
    const auto before = link::monotonic_ns();
    here->send(frame(broadcast, *here, type, {1}), {}, before);
    ASSERT_TRUE(there->wait(before + 5000 * ms));
    const auto arrival = there->receive(0);
    ASSERT_TRUE(arrival);
    const auto left = here->statistics().departure_ns;
    if (left == 0) {
        GTEST_SKIP() << "this kernel gives no transmit timestamps on veth";
    }
    EXPECT_GE(left, before);
    EXPECT_LE(left, arrival->time_ns);
    EXPECT_EQ(there->statistics().departure_ns, 0);
}

TEST_F(Raw, a_ring_that_is_full_loses_and_counts) {
    auto here = a();
    auto there = b({.types = {type}, .policy = Policy::block, .receive_capacity = 32});
    for (int i = 0; i < 100; ++i) {
        here->send(frame(broadcast, *here, type, {static_cast<std::uint8_t>(i % 10)}), {}, 0);
    }
    EXPECT_EQ(firsts(*there, 32), "01234567890123456789012345678901");
    EXPECT_TRUE(silent(*there));
    EXPECT_TRUE(eventually([&] { return there->statistics().lost == 68; }));
    here->send(frame(broadcast, *here, type, {5}), {}, 0);
    EXPECT_EQ(firsts(*there, 1), "5");
}

TEST_F(Raw, a_frame_stays_until_the_next_is_asked_for) {
    auto here = a();
    auto there = b();
    for (std::uint8_t i = 1; i <= 3; ++i) {
        here->send(frame(broadcast, *here, type, {i}), {}, 0);
    }
    const auto first = there->receive(0);
    ASSERT_TRUE(first);
    for (int i = 0; i < 100; ++i) {
        here->send(frame(broadcast, *here, type, {9}), {}, 0);
    }
    EXPECT_EQ(first->bytes[14], 1);
    EXPECT_EQ(firsts(*there, 2), "23");
}

TEST_F(Raw, lost_and_doubled_and_late_frames_of_a_bad_line_come_as_they_do) {
    auto here = a();

    auto there = b({.types = {type}, .policy = Policy::block, .receive_capacity = 2048});
    if (!command("tc qdisc add dev " + a_ + " root netem loss 20% duplicate 10% delay 1ms 1ms")) {
        GTEST_SKIP() << "this kernel has no netem, or `tc` is missing";
    }
    // Ours go past the queueing discipline; these are sent by a socket that does not.
    const link::Descriptor plain(::socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0));
    sockaddr_ll place{};
    place.sll_family = AF_PACKET;
    place.sll_ifindex = static_cast<int>(if_nametoindex(a_.c_str()));
    ASSERT_EQ(::bind(plain.get(), reinterpret_cast<const sockaddr*>(&place), sizeof place), 0);
    // The kernel stamps a frame before it queues it, and does not empty its queues in the order of
    // the stamps: neighbours in the ring may be stamped in the other order (RealTime::to_monotonic).
    constexpr std::int64_t disorder = 100'000;
    constexpr int count = 500;
    for (int i = 0; i < count; ++i) {
        const auto f = frame(broadcast, *here, type,
                             {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8)});
        ASSERT_EQ(::send(plain.get(), f.data(), f.size(), 0), static_cast<ssize_t>(f.size()));
    }
    std::vector<int> times(count);
    int came = 0;
    int overtaken = 0;
    int newest = -1;
    for (std::int64_t last = 0; there->wait(link::monotonic_ns() + 200 * ms);) {
        const auto arrival = there->receive(0);
        ASSERT_TRUE(arrival);
        const int number = arrival->bytes[14] | arrival->bytes[15] << 8;
        ASSERT_LT(number, count);
        EXPECT_GE(arrival->time_ns, last - disorder);
        last = arrival->time_ns;
        overtaken += number < newest;
        newest = std::max(newest, number);
        ++times[static_cast<std::size_t>(number)];
        ++came;
    }
    EXPECT_GT(std::count(times.begin(), times.end(), 0), count / 20);
    EXPECT_GT(std::count(times.begin(), times.end(), 2), count / 50);
    EXPECT_GT(overtaken, 0);
    EXPECT_EQ(there->statistics().received, static_cast<std::uint64_t>(came));
    EXPECT_EQ(there->statistics().errors, 0U);
}

TEST_F(Raw, stamps_do_not_jump_when_the_clock_is_set) {
    if (std::getenv("HALCYON_MAY_SET_CLOCK") == nullptr) {
        GTEST_SKIP() << "sets the system's clock: runs in user-mode-linux only";
    }
    auto here = a();
    auto there = b();
    const auto set = [](std::int64_t by) {
        const auto time = link::clock_ns(CLOCK_REALTIME) + by;
        const timespec t{time / 1'000'000'000, time % 1'000'000'000};
        ASSERT_EQ(clock_settime(CLOCK_REALTIME, &t), 0);
    };
    const auto come = [&] {  // a busy kernel delivers a moment later
        auto arrival = there->receive(0);
        for (int n = 0; n < 1000 && !arrival; ++n) {
            usleep(1000);
            arrival = there->receive(0);
        }
        return arrival;
    };
    // the two clocks are read one after the other, each by a call of that kernel
    constexpr std::int64_t between = 100'000;
    const auto f = frame(broadcast, *here, type, {1});
    for (const std::int64_t step : {0, 3'600'000, -7'200'000, 500, -20}) {
        const auto first = link::monotonic_ns();
        here->send(f, {}, 0);
        set(step * ms);  // between the arrival and its reading
        const auto one = come();
        ASSERT_TRUE(one);
        EXPECT_GE(one->time_ns, first - between) << step;
        EXPECT_LE(one->time_ns, link::monotonic_ns() + between) << step;
        usleep(50'000);
        const auto second = link::monotonic_ns();
        here->send(f, {}, 0);
        const auto two = come();
        ASSERT_TRUE(two);
        EXPECT_GE(two->time_ns, second - between) << step;
        EXPECT_LE(two->time_ns, link::monotonic_ns() + between) << step;
    }
}

TEST_F(Raw, open_reports_what_to_do_on_failure) {
    EXPECT_EQ(open("eth:nosuch0").problem.substr(0, 52),
              "eth:nosuch0: no interface 'nosuch0'; interfaces are ");
    EXPECT_NE(open("eth:nosuch0").problem.find(a_), std::string::npos);
    EXPECT_EQ(open("eth:").problem.substr(0, 57),
              "eth:: missing interface; write eth:enp3s0; interfaces are");
    EXPECT_EQ(open("eth:" + a_, {.types = std::vector<std::uint16_t>(65)}).problem,
              "eth:" + a_ + ": more than 64 Ethertypes on one port; open several ports");
}

TEST_F(Raw, open_reports_how_to_grant_a_missing_capability) {
    std::string problem;
    std::thread([&] {  // capabilities are a thread's own
        __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
        __user_cap_data_struct none[2]{};
        syscall(SYS_capset, &header, none);
        problem = open("eth:" + a_).problem;
    })
        .join();
    const std::string grant = grant_command();
    EXPECT_TRUE(grant.starts_with("sudo setcap cap_sys_nice,cap_ipc_lock,cap_net_raw=ep /"))
        << grant;
    EXPECT_EQ(problem, "eth:" + a_ +
                           ": raw Ethernet needs the capability CAP_NET_RAW; grant it with: " +
                           grant + "; to see the capabilities: hal doctor");
}

TEST(RawClock, a_stamp_that_does_not_fit_is_of_a_clock_that_was_set) {
    rawether::RealTime clock;
    const auto now = link::monotonic_ns();
    const auto real = link::clock_ns(CLOCK_REALTIME);
    EXPECT_NEAR(static_cast<double>(clock.to_monotonic(real, now - ms, now + ms)),
                static_cast<double>(now), 200'000.0);
    constexpr std::int64_t hour = 3'600'000 * ms;
    EXPECT_EQ(clock.to_monotonic(real + hour, now - ms, now), now);
    EXPECT_EQ(clock.to_monotonic(real - hour, now - ms, now), now);
    EXPECT_EQ(clock.to_monotonic(0, now - ms, now), now);
}

TEST(RawClock, who_looks_all_the_time_is_told_to_rest_before_the_kernel_makes_him) {
    rawether::SpinBudget bounded(true), unbounded(false);
    std::int64_t now = link::monotonic_ns();
    std::int64_t rested = 0;
    const auto start = now;
    for (int i = 0; i < 50'000; ++i) {
        EXPECT_TRUE(unbounded.spent(now, now + 50 * us));
        const bool may = bounded.spent(now, now + 50 * us);
        now += 50 * us;
        if (!may) {
            now += rawether::SpinBudget::rest_ns;
            rested += rawether::SpinBudget::rest_ns;
        }
    }
    const auto share = static_cast<double>(rested) / static_cast<double>(now - start);
    EXPECT_GT(share, 0.08);
    EXPECT_LT(share, 0.20);
}

}  // namespace
}  // namespace hal::ethernet
