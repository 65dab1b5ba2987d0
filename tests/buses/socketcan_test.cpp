// SPDX-License-Identifier: MIT
// Needs vcan0, vcan1 and the pair vxcan0/vxcan1: on this machine, or in the kernel that uml/run
// starts (socketcan_test.py does).
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "link/can.hpp"
#include "link/system.hpp"

namespace hal::can {
namespace {

class Socketcan : public testing::Test {
protected:
    void SetUp() override {
        if (if_nametoindex("vcan0") == 0) {
            GTEST_SKIP() << "no interface vcan0; socketcan_test.py runs this in user-mode-linux";
        }
    }
    static std::unique_ptr<Link> link(const std::string& address) {
        auto opened = open(address, {.stamps = true});
        EXPECT_TRUE(opened) << opened.problem;
        return std::move(opened.link);
    }
    static bool next(Link& link, Frame& f) {
        while (!link.receive(f, unclocked)) {
            if (!link.wait(2'000'000'000)) return false;
        }
        return true;
    }
    static void until(Link& link, State wanted) {
        Frame f;
        for (int i = 0; i < 500 && link.state() != wanted; ++i) {
            link.receive(f, unclocked);
            timespec pause{0, 10'000'000};
            nanosleep(&pause, nullptr);
        }
        EXPECT_STREQ(to_string(link.state()), to_string(wanted));
    }
    static void run(const std::string& command) {
        ASSERT_EQ(std::system(command.c_str()), 0) << command;
    }
};

TEST_F(Socketcan, frames_of_every_kind_cross_with_the_time_of_arrival) {
    auto a = link("can:vcan0?fd");
    auto b = link("can:vcan0?fd");
    Frame fd(0x12345, std::vector<std::uint8_t>(64, 0x5a));
    fd.bit_rate_switch = true;
    const Frame frames[] = {
        {0x7ff, {1, 2, 3, 4, 5, 6, 7, 8}}, Frame::request(0x701, 1), {0x1abcdef0, {}}, fd};
    const auto before = link::monotonic_ns();
    for (const auto& f : frames) {
        EXPECT_EQ(a->send(f, unclocked), Sent::queued);
    }
    a->flush(unclocked);
    for (const auto& f : frames) {
        Frame got;
        ASSERT_TRUE(next(*b, got));
        EXPECT_TRUE(got.same(f));
        EXPECT_GT(got.time_ns, before - 1'000'000);
        EXPECT_LT(got.time_ns, link::monotonic_ns() + 1'000'000);
    }
    EXPECT_EQ(b->statistics().received, 4U);
    EXPECT_EQ(a->statistics().sent, 4U);
}

TEST_F(Socketcan, own_frames_come_back_marked_when_asked_for) {
    auto a = link("can:vcan0?own");
    auto b = link("can:vcan0");
    a->send({0x123, {1}}, unclocked);
    a->flush(unclocked);
    Frame f;
    ASSERT_TRUE(next(*a, f));
    EXPECT_TRUE(f.own);
    ASSERT_TRUE(next(*b, f));
    EXPECT_FALSE(f.own);
    EXPECT_FALSE(b->wait(10'000'000));
}

TEST_F(Socketcan, filters_are_the_kernels) {
    auto a = link("can:vcan1");
    auto b = link("can:vcan1");
    const Filter only[] = {{0x180, 0x780, false}, {0x1000, 0x1fffffff, true}};
    ASSERT_TRUE(b->set_filters(only));
    const Frame frames[] = {{0x17f, {1}}, {0x180, {1}},  {0x1ff, {1}},
                            {0x200, {1}}, {0x1000, {1}}, {0x1001, {1}}};
    for (const auto& f : frames) {
        a->send(f, unclocked);
    }
    a->flush(unclocked);
    std::vector<std::uint32_t> ids;
    for (Frame f; b->wait(100'000'000);) {
        while (b->receive(f, unclocked)) {
            ids.push_back(f.id);
        }
    }
    EXPECT_EQ(ids, (std::vector<std::uint32_t>{0x180, 0x1ff, 0x1000}));
    EXPECT_TRUE(b->set_filters({}));
    a->send({0x005, {}}, unclocked);
    a->flush(unclocked);
    Frame f;
    EXPECT_TRUE(next(*b, f));
}

TEST_F(Socketcan, bursts_lose_nothing) {
    auto a = link("can:vcan0");
    auto b = link("can:vcan0");
    std::uint32_t sent = 0;
    // larger than a batch of system calls, smaller than the kernel's backlog
    for (int burst = 0; burst < 50; ++burst) {
        std::uint32_t got = sent;
        for (int i = 0; i < 400; ++i, ++sent) {
            ASSERT_EQ(a->send({sent & 0x7ffU, {static_cast<std::uint8_t>(sent >> 11)}}, unclocked),
                      Sent::queued);
        }
        a->flush(unclocked);
        for (Frame f; got < sent; ++got) {
            ASSERT_TRUE(next(*b, f));
            ASSERT_EQ(f.id, got & 0x7ffU);
        }
    }
    EXPECT_EQ(b->statistics().received, sent);
    EXPECT_EQ(b->statistics().lost, 0U);
}

TEST_F(Socketcan, waiting_takes_what_comes_one_by_one_and_in_bursts_and_keeps_the_order) {
    auto a = link("can:vcan0");
    auto b = link("can:vcan0");
    std::uint32_t sent = 0;
    std::uint32_t got = 0;
    const auto take = [&](std::int64_t now_ns) {
        Frame buffer[7];
        for (std::size_t count; (count = b->receive(buffer, now_ns)) > 0;) {
            for (std::size_t n = 0; n < count; ++n, ++got) {
                ASSERT_EQ(buffer[n].id, got & 0x7ffU);
            }
        }
    };
    for (const unsigned burst :
         {1U, 1U, 2U, 1U, 40U, 1U, 100U, 31U, 32U, 33U, 1U, 1U, 1U, 1U, 1U, 1U, 1U, 1U, 1U}) {
        for (unsigned n = 0; n < burst; ++n, ++sent) {
            ASSERT_EQ(a->send({sent & 0x7ffU, {}}, unclocked), Sent::queued);
        }
        a->flush(unclocked);
        while (got < sent) {
            ASSERT_TRUE(b->wait(2'000'000'000));
            const auto before = got;
            take(burst % 2 == 0 ? unclocked : link::monotonic_ns());
            ASSERT_GT(got, before) << "wait() reported a frame to receive";
        }
    }
    EXPECT_EQ(b->statistics().received, sent);
}

TEST_F(Socketcan, waiting_ends_when_nothing_comes) {
    auto a = link("can:vcan0");
    auto b = link("can:vcan0");
    for (const std::int64_t at_most : {0, 1'000'000, 20'000'000, 70'000'000}) {
        const auto began = link::monotonic_ns();
        EXPECT_FALSE(b->wait(at_most));
        EXPECT_GE(link::monotonic_ns() - began, at_most);
        Frame f;
        EXPECT_FALSE(b->receive(f, link::monotonic_ns()));
    }
    // a cycle that found nothing, then waited, is reported in the same cycle
    const auto before = link::monotonic_ns();
    Frame f;
    EXPECT_FALSE(b->receive(f, before));
    a->send({0x7, {}}, unclocked);
    a->flush(unclocked);
    EXPECT_TRUE(b->wait(2'000'000'000));
    EXPECT_TRUE(b->receive(f, before));
}

TEST_F(Socketcan, a_full_queue_of_the_interface_is_waited_out) {
    auto a = link("can:vxcan0");
    auto b = link("can:vxcan1");
    run("ip link set vxcan0 txqueuelen 2");
    for (int i = 0; i < 100; ++i) {
        a->send({0x10, {static_cast<std::uint8_t>(i)}}, unclocked);
    }
    a->flush(unclocked);
    for (int i = 0; i < 100; ++i) {
        a->flush(unclocked);
        Frame f;
        ASSERT_TRUE(next(*b, f));
        EXPECT_EQ(f.data[0], i);
    }
    EXPECT_EQ(a->statistics().dropped, 0U);
}

TEST_F(Socketcan, an_interface_goes_down_and_comes_up) {
    auto a = link("can:vcan1");
    auto b = link("can:vcan1");
    run("ip link set vcan1 down");
    until(*a, State::down);
    EXPECT_EQ(a->send({0x1, {}}, unclocked), Sent::down);
    run("ip link set vcan1 up");
    until(*a, State::active);
    until(*b, State::active);
    a->send({0x1, {}}, unclocked);
    a->flush(unclocked);
    Frame f;
    EXPECT_TRUE(next(*b, f));
    EXPECT_EQ(a->statistics().restarts, 1U);
    EXPECT_FALSE(a->wait(50'000'000));  // on the new socket, too, it ends
}

TEST_F(Socketcan, an_interface_is_removed_and_comes_back) {
    run("ip link add vcan7 type vcan && ip link set vcan7 up");
    auto a = link("can:vcan7");
    auto b = link("can:vcan7");
    run("ip link del vcan7");
    until(*a, State::down);
    until(*b, State::down);
    run("ip link add vcan8 type vcan && ip link add vcan7 type vcan && ip link set vcan7 up");
    until(*a, State::active);
    until(*b, State::active);
    a->send({0x123, {9}}, unclocked);
    a->flush(unclocked);
    Frame f;
    ASSERT_TRUE(next(*b, f));
    EXPECT_EQ(f.data[0], 9);
    run("ip link del vcan7; ip link del vcan8");
}

/// The state that a controller's driver reports, here by hand: a virtual interface has no
/// controller.
struct Controller {
    Controller() : socket(::socket(AF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW)) {
        sockaddr_can address{};
        address.can_family = AF_CAN;
        address.can_ifindex = static_cast<int>(if_nametoindex("vcan0"));
        EXPECT_EQ(::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address),
                  0);
    }
    void tell(canid_t classes, std::uint8_t what = 0, std::uint8_t send_errors = 0,
              std::uint8_t receive_errors = 0) {
        can_frame f{};
        f.can_id = CAN_ERR_FLAG | classes;
        f.can_dlc = CAN_ERR_DLC;
        f.data[1] = what;
        f.data[6] = send_errors;
        f.data[7] = receive_errors;
        ASSERT_EQ(::write(socket.get(), &f, sizeof f), static_cast<ssize_t>(sizeof f));
    }
    link::Descriptor socket;
};

TEST_F(Socketcan, error_frames_tell_the_state_of_the_controller_its_counters_and_what_it_lost) {
    Controller controller;
    auto a = link("can:vcan0");
    auto b = link("can:vcan0?errors");
    const struct {
        std::uint8_t what;
        State state;
    } steps[] = {{CAN_ERR_CRTL_TX_WARNING, State::warning},
                 {CAN_ERR_CRTL_RX_PASSIVE, State::passive},
                 {CAN_ERR_CRTL_RX_WARNING, State::warning},
                 {CAN_ERR_CRTL_TX_PASSIVE, State::passive},
                 {CAN_ERR_CRTL_ACTIVE, State::active}};
    std::uint8_t count = 90;
    for (const auto& step : steps) {
        controller.tell(CAN_ERR_CRTL, step.what, ++count, 7);
        until(*a, step.state);
        until(*b, step.state);
        EXPECT_EQ(a->statistics().send_errors, count);
        EXPECT_EQ(a->statistics().receive_errors, 7);
    }
    EXPECT_EQ(a->statistics().lost, 0U);
    controller.tell(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW);
    controller.tell(CAN_ERR_PROT | CAN_ERR_BUSERROR);
    a->send({0x123, {1}}, unclocked);
    a->flush(unclocked);
    Frame f;
    ASSERT_TRUE(next(*b, f));  // an error frame comes only to who asked for it: the overflow
    EXPECT_TRUE(f.error);
    EXPECT_EQ(f.id, error_controller);
    ASSERT_TRUE(next(*b, f));
    EXPECT_EQ(f.id, error_protocol | error_bus);
    ASSERT_TRUE(next(*b, f));
    EXPECT_FALSE(f.error);
    b->send({0x124, {2}}, unclocked);
    b->flush(unclocked);
    ASSERT_TRUE(next(*a, f));
    EXPECT_EQ(f.id, 0x124U);
    EXPECT_EQ(a->statistics().lost, 1U);
    EXPECT_EQ(a->statistics().errors, 7U);
    EXPECT_EQ(a->statistics().received, 1U);
}

TEST_F(Socketcan,
       bus_off_is_told_nothing_is_sent_meanwhile_and_it_ends_when_the_controller_is_back) {
    Controller controller;
    auto a = link("can:vcan0?restart=0");
    auto b = link("can:vcan0");
    controller.tell(CAN_ERR_BUSOFF);
    until(*a, State::bus_off);
    EXPECT_EQ(a->send({0x1, {}}, unclocked), Sent::bus_off);
    EXPECT_EQ(a->statistics().bus_offs, 1U);
    EXPECT_EQ(a->statistics().dropped, 1U);
    // a virtual interface cannot restart; the controller of a real one can, as it does here
    a->restart();
    EXPECT_FALSE(a->wait(50'000'000));
    EXPECT_EQ(a->state(), State::bus_off);
    controller.tell(CAN_ERR_RESTARTED);
    until(*a, State::active);
    EXPECT_EQ(a->statistics().restarts, 1U);
    a->send({0x2, {}}, unclocked);
    a->flush(unclocked);
    Frame f;
    ASSERT_TRUE(next(*b, f));
    EXPECT_EQ(f.id, 0x2U);
}

TEST_F(Socketcan, a_link_that_only_listens_says_nothing) {
    auto a = link("can:vcan0?listen");
    auto b = link("can:vcan0");
    EXPECT_EQ(a->send({0x1, {}}, unclocked), Sent::rejected);
    b->send({0x2, {}}, unclocked);
    b->flush(unclocked);
    Frame f;
    ASSERT_TRUE(next(*a, f));
    EXPECT_EQ(f.id, 0x2U);
    EXPECT_FALSE(b->wait(20'000'000));
}

TEST_F(Socketcan, what_is_wrong_is_said_with_what_to_type) {
    EXPECT_EQ(open("can:can9").problem,
              "can:can9: no interface can9; to list them: ip -br link; to create a virtual one: "
              "sudo ip link add can9 type vcan "
              "&& sudo ip link set can9 up");
    EXPECT_EQ(open("can:lo").problem,
              "can:lo: lo is not a CAN interface; to list them: ip -br link show type can");
    run("ip link add vcan9 type vcan");
    EXPECT_EQ(open("can:vcan9").problem,
              "can:vcan9: the interface is down; type: sudo ip link set vcan9 up");
    run("ip link set vcan9 mtu 16 up");
    EXPECT_EQ(open("can:vcan9?fd").problem,
              "can:vcan9?fd: the interface is not set up for CAN FD; type: sudo ip link set vcan9 "
              "down && sudo ip link set vcan9 mtu 72 && "
              "sudo ip link set vcan9 up");
    run("ip link del vcan9");
}

}  // namespace
}  // namespace hal::can
