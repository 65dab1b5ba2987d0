// SPDX-License-Identifier: MIT
// The tunnel's interfaces in the kernel, in a network namespace of this process's own: a frame from
// the one to the other, the stations between them on the virtual wire.
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "components/fieldbus/tdma/tunnel/tap.hpp"
#include "link/system.hpp"
#include "wire.hpp"

namespace tdma_tests {
namespace {

constexpr Time ms = 1'000'000;
// experimental Ethertype of IEEE 802: no protocol answers it
constexpr std::uint16_t experimental = 0x88b5;

/// Creates a network namespace. Returns the reason of a failure.
std::string enter() {
    if (::unshare(CLONE_NEWNET) != 0 && ::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) {
        return "no network namespace may be made here";
    }
    const hal::link::Descriptor tun(::open("/dev/net/tun", O_RDWR | O_CLOEXEC));
    return tun ? "" : "there is no /dev/net/tun here";
}

/// A socket on one interface, for frames as they are.
hal::link::Descriptor raw(const std::string& name) {
    hal::link::Descriptor fd(::socket(AF_PACKET, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(experimental);
    address.sll_ifindex = static_cast<int>(if_nametoindex(name.c_str()));
    EXPECT_EQ(0, ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address))
        << name << ": " << hal::link::reason();
    return fd;
}

/// An answer of the kernel about an interface.
template <class Read>
auto asked(const std::string& name, unsigned long what, Read read) {
    const hal::link::Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    ifreq request{};
    name.copy(request.ifr_name, IFNAMSIZ - 1);
    EXPECT_EQ(0, ioctl(socket.get(), what, &request)) << name << ": " << hal::link::reason();
    return read(request);
}

struct Taps : testing::Test, Bed {
    Machine* m = nullptr;
    Machine* s = nullptr;
    std::unique_ptr<Tunnel> at_m, at_s;

    void SetUp() override {
        static const std::string why_not = enter();
        if (!why_not.empty()) {
            GTEST_SKIP() << why_not;
        }
        StationSetup first = master();
        StationSetup second = slave(300'000);
        first.slots.push_back({.id = tunnel_slot, .offset = 400'000, .size = 300});
        second.slots.push_back({.id = tunnel_slot, .offset = 700'000, .size = 200});
        m = &add(1, first);
        s = &add(2, second, {120e-6, 77'000'000});
        at_m = std::make_unique<Tunnel>(m->station);
        at_s = std::make_unique<Tunnel>(s->station);
        m->station.accompany(nullptr, at_m.get());
        s->station.accompany(nullptr, at_s.get());
        run(600 * ms);
    }
    /// Advances the simulated time until the condition is true; the kernel and the interfaces'
    /// threads use real time.
    template <class Condition>
    bool eventually(Condition condition) {
        for (int i = 0; i < 20'000; ++i) {
            if (condition()) return true;
            run(ms);
            usleep(1000);
        }
        return false;
    }
};

TEST_F(Taps, carry_a_frame_from_one_to_the_other) {
    const auto first = open_tap(*at_m, {"hal%d", mac(1), config::Ip{10, 9, 0, 1}, 20}, "tdma.0");
    ASSERT_NE(nullptr, first.tap) << first.problem;
    const auto second = open_tap(*at_s, {"other0", mac(2)}, "tdma.1");
    ASSERT_NE(nullptr, second.tap) << second.problem;
    EXPECT_EQ("hal0", first.tap->name());
    EXPECT_EQ(296, asked("hal0", SIOCGIFMTU, [](const ifreq& r) { return r.ifr_mtu; }));
    EXPECT_EQ(196, asked("other0", SIOCGIFMTU, [](const ifreq& r) { return r.ifr_mtu; }));
    const auto ip = [](const ifreq& r) {
        return ntohl(reinterpret_cast<const sockaddr_in*>(&r.ifr_addr)->sin_addr.s_addr);
    };
    EXPECT_EQ(0x0a090001u, asked("hal0", SIOCGIFADDR, ip));
    EXPECT_EQ(0xfffff000u, asked("hal0", SIOCGIFNETMASK, ip));
    EXPECT_EQ(mac(2), asked("other0", SIOCGIFHWADDR, [](const ifreq& r) {
        Address a{};
        std::copy_n(r.ifr_hwaddr.sa_data, 6, a.begin());
        return a;
    }));
    const auto running = [](const ifreq& r) {
        return (r.ifr_flags & (IFF_UP | IFF_RUNNING)) == (IFF_UP | IFF_RUNNING);
    };
    ASSERT_TRUE(eventually([&] {
        return asked("hal0", SIOCGIFFLAGS, running) && asked("other0", SIOCGIFFLAGS, running);
    }));

    const auto here = raw("hal0");
    const auto there = raw("other0");
    std::vector<std::uint8_t> frame(120), got(2000);
    const Address to = mac(2);
    const Address from = mac(1);
    std::copy(to.begin(), to.end(), frame.begin());
    std::copy(from.begin(), from.end(), frame.begin() + 6);
    put(frame, 12, experimental);
    for (std::uint8_t i = 14; i < 120; ++i) {
        frame[i] = i;
    }
    ssize_t length = 0;
    ASSERT_TRUE(eventually([&] {  // the kernel drops frames while the interface comes up
        (void)!::send(here.get(), frame.data(), frame.size(), 0);
        return (length = ::recv(there.get(), got.data(), got.size(), 0)) > 0;
    }));
    got.resize(static_cast<std::size_t>(length));
    EXPECT_EQ(frame, got);
    EXPECT_GT(at_m->sent(), 0u);
    EXPECT_GT(at_s->received(), 0u);

    // Without a master the interface has no carrier.
    m->off = m->port.cut = true;
    EXPECT_TRUE(eventually([&] { return !asked("other0", SIOCGIFFLAGS, running); }));
    m->off = m->port.cut = false;
    m->next = m->port.clock().local(now);
    EXPECT_TRUE(eventually([&] { return asked("other0", SIOCGIFFLAGS, running); }));
}

TEST_F(Taps, follow_another_schedule_and_are_removed_with_their_station) {
    auto opened = open_tap(*at_s, {"hal5", mac(2)}, "tdma.1");
    ASSERT_NE(nullptr, opened.tap) << opened.problem;
    EXPECT_EQ("interface hal5 is in use by another process; use another name, for example hal%d",
              open_tap(*at_m, {"hal5", mac(1)}, "x").problem);
    EXPECT_EQ(
        "interface lo exists, but is not a TAP interface; use another name, for example hal%d",
        open_tap(*at_m, {"lo", mac(1)}, "x").problem);
    StationSetup changed = slave(300'000);
    changed.slots.push_back({.id = tunnel_slot, .offset = 700'000, .size = 500});
    ASSERT_TRUE(s->station.reconfigure(changed));
    EXPECT_TRUE(eventually([&] {
        return asked("hal5", SIOCGIFMTU, [](const ifreq& r) { return r.ifr_mtu; }) == 496;
    }));
    opened.tap.reset();
    EXPECT_EQ(0u, if_nametoindex("hal5"));
}

}  // namespace
}  // namespace tdma_tests
