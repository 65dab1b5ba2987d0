// SPDX-License-Identifier: MIT
// Ordinary packets in slot 1, in both directions, next to undisturbed real-time frames; invalid
// packets.
#include <gtest/gtest.h>

#include <set>

#include "components/fieldbus/tdma/tunnel/tap.hpp"
#include "wire.hpp"

namespace tdma_tests {
namespace {

constexpr Time ms = 1'000'000;
constexpr std::size_t slot_bytes = 600;
constexpr std::size_t mtu = slot_bytes - rtmac_bytes;

using Bytes = std::vector<std::uint8_t>;

/// An Ethernet frame with an IPv4 packet of `length` bytes, marked.
Bytes packet(const Address& to, const Address& from, std::size_t length, unsigned mark = 0) {
    Bytes f(14 + length);
    std::copy(to.begin(), to.end(), f.begin());
    std::copy(from.begin(), from.end(), f.begin() + 6);
    put<std::uint16_t>(f, 12, 0x0800);
    f[14] = 0x45;
    put(f, 16, static_cast<std::uint16_t>(length));
    if (length >= 24) {
        put(f, 34, static_cast<std::uint32_t>(mark));
    }
    return f;
}
unsigned mark_of(std::span<const std::uint8_t> f) { return get<std::uint32_t>(f, 34); }

StationSetup with_tunnel(StationSetup s, Time offset, std::uint32_t size = slot_bytes) {
    s.slots.push_back({.id = tunnel_slot, .offset = offset, .size = size});
    return s;
}

/// Master 1 and station 2, each with a real-time frame in every cycle and a tunnel.
struct Pair : Bed {
    Machine& m = add(1, with_tunnel(master(), 400'000));
    Machine& s = add(2, with_tunnel(slave(300'000), 700'000), {120e-6, 77'000'000});
    Tunnel at_m{m.station};
    Tunnel at_s{s.station};
    Pair() {
        m.station.accompany(nullptr, &at_m);
        s.station.accompany(nullptr, &at_s);
        for (Machine* each : {&m, &s}) {
            each->in_cycle = [](Machine& me) {
                Bytes f = packet(ethernet::broadcast, me.station.address(), 46);
                put(f, 12, cane_type);
                me.station.send(f, 0, 0);
            };
        }
        run(600 * ms);
        EXPECT_TRUE(at_m.open() && at_s.open());
    }
    static Bytes next(Tunnel& t) {
        Bytes out(ethernet::max_frame);
        out.resize(t.take(out));
        return out;
    }
};

TEST(Tunnel, carries_packets_both_ways_in_order) {
    Pair p;
    for (unsigned i = 0; i < 40; ++i) {
        EXPECT_TRUE(p.at_m.give(packet(mac(2), mac(1), 28 + i % 2 * (mtu - 28), i)));
        EXPECT_TRUE(
            p.at_s.give(packet(i % 3 == 0 ? ethernet::broadcast : mac(1), mac(2), 100 + i, i)));
    }
    p.run(60 * ms);
    for (unsigned i = 0; i < 40; ++i) {
        Bytes sent = packet(mac(2), mac(1), 28 + i % 2 * (mtu - 28), i);
        // padded like a short frame
        sent.resize(std::max<std::size_t>(sent.size(), ethernet::smallest_frame - rtmac_bytes));
        EXPECT_EQ(sent, Pair::next(p.at_s)) << i;
        EXPECT_EQ(packet(i % 3 == 0 ? ethernet::broadcast : mac(1), mac(2), 100 + i, i),
                  Pair::next(p.at_m))
            << i;
    }
    EXPECT_EQ(40u, p.at_m.sent());
    EXPECT_EQ(40u, p.at_m.received());
    EXPECT_EQ(40u, p.at_s.received());
    EXPECT_EQ(0u, p.at_m.dropped() + p.at_s.dropped() + p.at_m.rejected() + p.at_s.rejected());
}

TEST(Tunnel, uses_its_own_slot_only) {
    Pair quiet, full;
    quiet.wire.watching = full.wire.watching = true;
    for (int i = 0; i < 100; ++i) {
        for (unsigned k = 0; k < 12; ++k) {
            full.at_m.give(packet(mac(2), mac(1), k % 2 == 0 ? mtu : 40, k));
            full.at_s.give(packet(mac(1), mac(2), k % 3 == 0 ? mtu : 40, k));
        }
        for (Pair* p : {&quiet, &full}) {
            p->run(ms);
        }
        while (!Pair::next(full.at_m).empty() || !Pair::next(full.at_s).empty()) {
        }
    }
    // Real-time frames leave at the same nanosecond, whatever is in slot 1.
    const auto real_time = [](const Pair& p) {
        std::vector<std::pair<int, Time>> when;
        for (const Wire::Frame& f : p.wire.seen) {
            if (decode(f.bytes).kind != Kind::tunnelled) {
                when.emplace_back(f.from, f.left);
            }
        }
        return when;
    };
    EXPECT_GT(real_time(full).size(), 250u);
    EXPECT_EQ(real_time(quiet), real_time(full));
    Time sync = 0;
    int tunnelled = 0;
    for (const Wire::Frame& f : full.wire.seen) {
        const Decoded d = decode(f.bytes);
        if (d.kind == Kind::sync) {
            sync = f.left;
        }
        if (d.kind != Kind::tunnelled) continue;
        ++tunnelled;
        const Time into = f.left - sync;

        const Time takes = static_cast<Time>(ethernet::wire_bytes(f.bytes.size())) * 80;
        const Time offset = f.from == 1 ? 400'000 : 700'000;
        EXPECT_GE(into, offset - 2'000) << f.from;
        EXPECT_LE(into + takes,
                  offset + static_cast<Time>(ethernet::wire_bytes(14 + slot_bytes)) * 80 + 2'000)
            << f.from;
    }
    EXPECT_GT(tunnelled, 190);
    EXPECT_GT(full.at_m.dropped(), 0u) << "more than the slot carries was given";
    EXPECT_EQ(0u, full.m.status().count.intruders + full.s.status().count.intruders);
    EXPECT_EQ(0u, full.m.port.statistics().late + full.s.port.statistics().late);
}

TEST(Tunnel, drops_the_newest_when_it_is_full) {
    Pair p;
    for (unsigned i = 0; i < Tunnel::capacity; ++i) {
        EXPECT_TRUE(p.at_m.give(packet(mac(2), mac(1), mtu, i)));
    }
    EXPECT_FALSE(p.at_m.give(packet(mac(2), mac(1), mtu, 1000)));
    EXPECT_EQ(1u, p.at_m.dropped());
    p.run(200 * ms);
    for (unsigned i = 0; i < Tunnel::capacity; ++i) {
        EXPECT_EQ(i, mark_of(Pair::next(p.at_s)));
    }
    // Nothing is read: the cycle continues, and the oldest packets are kept.
    for (unsigned i = 0; i < Tunnel::capacity + 6; ++i) {
        EXPECT_TRUE(p.at_m.give(packet(mac(2), mac(1), 60, i)));
        p.run(2 * ms);
    }
    EXPECT_EQ(6u, p.at_s.dropped());
    EXPECT_EQ(0u, mark_of(Pair::next(p.at_s)));
}

TEST(Tunnel, rejects_frames_that_do_not_fit_its_slot) {
    Pair p;
    EXPECT_TRUE(p.at_m.give(packet(mac(2), mac(1), mtu)));
    EXPECT_FALSE(p.at_m.give(packet(mac(2), mac(1), mtu + 1)));
    EXPECT_FALSE(p.at_m.give(Bytes(13)));
    EXPECT_FALSE(p.at_m.give(Bytes(1518)));
    EXPECT_EQ(3u, p.at_m.dropped());
}

TEST(Tunnel, has_the_mtu_of_slot_1) {
    EXPECT_EQ(0u, tunnel_mtu(71));
    EXPECT_EQ(68u, tunnel_mtu(72));
    EXPECT_EQ(1496u, tunnel_mtu(1500));
    EXPECT_EQ(1496u, tunnel_mtu(9000));
    Bed bed;
    Machine& without = bed.add(1, master());
    Tunnel none{without.station};
    without.station.accompany(nullptr, &none);
    bed.run(20 * ms);
    ASSERT_TRUE(without.station.ready());
    EXPECT_EQ(0u, none.mtu());
    EXPECT_FALSE(none.open()) << "and slot 0 is the real-time frames' alone";
    EXPECT_FALSE(none.give(packet(mac(2), mac(1), 40)));
    // The schedule changes while it runs.
    StationSetup room = with_tunnel(master(), 400'000);
    room.slot_capacity = 2;
    Machine& later = bed.add(3, room);
    Tunnel tunnel{later.station};
    EXPECT_EQ(mtu, tunnel.mtu());
    ASSERT_TRUE(later.station.reconfigure(with_tunnel(slave(500'000), 600'000, 100)));
    later.station.accompany(nullptr, &tunnel);
    bed.run(600 * ms);
    ASSERT_TRUE(later.station.ready());
    EXPECT_EQ(96u, tunnel.mtu());
}

TEST(Tunnel, sends_no_stale_packets_after_a_sync_loss) {
    Pair p;
    p.m.off = p.m.port.cut = true;
    for (unsigned i = 0; i < 20; ++i) {
        p.at_s.give(packet(mac(1), mac(2), 300, 1));
    }
    p.run(50 * ms);
    EXPECT_FALSE(p.at_s.open());
    EXPECT_FALSE(p.at_s.give(packet(mac(1), mac(2), 300, 2))) << "the station may not send";
    p.wire.watching = true;
    p.m.off = p.m.port.cut = false;
    p.m.next = p.m.port.clock().local(p.now);
    p.run(900 * ms);
    ASSERT_TRUE(p.at_s.open());
    EXPECT_TRUE(p.at_s.give(packet(mac(1), mac(2), 300, 3)));
    p.run(5 * ms);
    int tunnelled = 0;
    for (const Wire::Frame& f : p.wire.seen) {
        if (f.from != 2 || decode(f.bytes).kind != Kind::tunnelled) continue;
        ++tunnelled;
        EXPECT_EQ(3u, get<std::uint32_t>(f.bytes, 38));
    }
    EXPECT_EQ(1, tunnelled);
}

struct Hostile {
    const char* what;
    void (*spoil)(Bytes&);  // a tunnelled IPv4 packet of 100 bytes from 1 to 2
};
class Hostile_frame : public testing::TestWithParam<Hostile> {};
TEST_P(Hostile_frame, is_counted_and_rejected) {
    Pair p;
    Bytes frame(ethernet::max_frame);
    frame.resize(tunnel(packet(mac(2), mac(1), 100), frame));
    ASSERT_TRUE(is_packet(decode(frame), mac(2)));
    GetParam().spoil(frame);
    EXPECT_FALSE(is_packet(decode(frame), mac(2)));
    const auto before = p.at_s.rejected() + p.s.status().count.foreign;
    for (int i = 0; i < 5; ++i) {
        p.at_s.arrived(frame, p.now);  // bypasses the driver's filter
    }
    EXPECT_EQ(before + 5, p.at_s.rejected());
    EXPECT_TRUE(Pair::next(p.at_s).empty());
    EXPECT_EQ(0u, p.at_s.received());
    EXPECT_TRUE(p.s.station.ready());
}
INSTANTIATE_TEST_SUITE_P(
    Tunnel, Hostile_frame,
    testing::Values(
        Hostile{"to_another", [](Bytes& f) { f[5] = 9; }},
        Hostile{"from_itself", [](Bytes& f) { f[11] = 2; }},
        Hostile{"from_a_group", [](Bytes& f) { f[6] |= 1; }},
        Hostile{"no_payload", [](Bytes& f) { f.resize(18); }},
        Hostile{"half_a_header", [](Bytes& f) { f.resize(17); }},
        Hostile{"nothing", [](Bytes& f) { f.clear(); }},
        Hostile{"cut_below_its_length", [](Bytes& f) { f.resize(18 + 99); }},
        Hostile{"longer_than_it_is", [](Bytes& f) { put<std::uint16_t>(f, 20, 101); }},
        Hostile{"shorter_than_its_header", [](Bytes& f) { put<std::uint16_t>(f, 20, 19); }},
        Hostile{"header_of_4_bytes", [](Bytes& f) { f[18] = 0x41; }},
        Hostile{"other_ip_version", [](Bytes& f) { f[18] = 0x65; }},
        Hostile{"short_arp",
                [](Bytes& f) { put<std::uint16_t>(f, 14, 0x0806), f.resize(18 + 27); }},
        Hostile{"short_ipv6",
                [](Bytes& f) { put<std::uint16_t>(f, 14, 0x86dd), f[18] = 0x60, f[22] = 1; }},
        Hostile{"a_length_for_a_type", [](Bytes& f) { put<std::uint16_t>(f, 14, 100); }},
        Hostile{"tunnelled_sync", [](Bytes& f) { put<std::uint16_t>(f, 14, rtmac_type); }},
        Hostile{"tunnelled_rtcfg", [](Bytes& f) { put<std::uint16_t>(f, 14, rtcfg_type); }},
        Hostile{"tunnelled_process_data", [](Bytes& f) { put<std::uint16_t>(f, 14, cane_type); }},
        Hostile{"other_version", [](Bytes& f) { f[16] = 3; }},
        Hostile{"no_tunnel", [](Bytes& f) { f[17] = 0; }},
        Hostile{"longer_than_a_frame", [](Bytes& f) { f.resize(1600); }}),
    [](const auto& test) { return test.param.what; });

TEST(Tunnel, passes_on_only_valid_packets_from_random_frames) {
    Pair p;
    std::mt19937_64 random{7};
    Bytes good(ethernet::max_frame), out(ethernet::max_frame);
    good.resize(tunnel(packet(mac(2), mac(1), 300), good));
    std::uint64_t taken = 0;
    for (int i = 0; i < 20'000; ++i) {
        Bytes f = good;
        for (std::uint64_t n = random() % 5; n > 0; --n) {
            f[random() % 40] = static_cast<std::uint8_t>(random());
        }
        if (random() % 4 == 0) {
            f.resize(random() % 400);
        }
        p.at_s.arrived(f, p.now);
        const std::size_t length = p.at_s.take(out);
        EXPECT_EQ(is_packet(decode(f), mac(2)), length != 0);
        if (length == 0) continue;
        ++taken;
        EXPECT_EQ(f.size() - rtmac_bytes, length);
    }
    EXPECT_EQ(taken, p.at_s.received());
    EXPECT_EQ(20'000 - taken, p.at_s.rejected());
    EXPECT_GT(taken, 1000u);
    EXPECT_GT(p.at_s.rejected(), 1000u);
}

TEST(Tap, accepts_valid_interface_names) {
    for (const char* good : {"hal0", "rtmac%d", "%d", "a.b-c_d", "fifteen-letters"}) {
        EXPECT_EQ("", wrong_name(good)) << good;
    }
    for (const char* bad :
         {"", ".", "..", "a/b", "a b", "a:b", "hal%s", "hal%", "%d%d", "sixteen-letters-"}) {
        const std::string expected = "'" + std::string(bad) +
                                     "' is not a valid interface name; use at most 15 letters and "
                                     "digits, for example hal0, or hal%d for the first free number";
        EXPECT_EQ(expected, wrong_name(bad));
    }
}

TEST(Tap, parses_prefix_lengths_and_netmasks) {
    EXPECT_EQ(24u, parse_prefix("24"));
    EXPECT_EQ(24u, parse_prefix("255.255.255.0"));
    EXPECT_EQ(0u, parse_prefix("0.0.0.0"));
    EXPECT_EQ(32u, parse_prefix("255.255.255.255"));
    EXPECT_EQ(30u, parse_prefix("255.255.255.252"));
    for (const char* bad : {"", "33", "-1", "24x", "255.0.255.0", "0.255.255.255", "1.2.3"}) {
        EXPECT_EQ(std::nullopt, parse_prefix(bad)) << bad;
    }
}

}  // namespace
}  // namespace tdma_tests
