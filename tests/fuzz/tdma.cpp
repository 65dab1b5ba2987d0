// SPDX-License-Identifier: MIT
// TDMA: any frame is read within its bytes or rejected, and what was read is written identically;
// any schedule is read, or rejected with a position, and an accepted one can be used.
#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <vector>

#include "components/fieldbus/tdma/config/schedule_plan.hpp"
#include "components/fieldbus/tdma/rtcfg/rtcfg_client.hpp"
#include "components/fieldbus/tdma/rtcfg/rtcfg_server.hpp"
#include "components/fieldbus/tdma/station/station.hpp"
#include "components/fieldbus/tdma/tunnel/tunnel.hpp"
#include "components/fieldbus/tdma/wire/rtcfg_frames.hpp"
#include "components/fieldbus/tdma/wire/tdma_frames.hpp"
#include "tests/fuzz/driver/require.hpp"

namespace {

using namespace hal::tdma;
using hal::fuzz::require;

void frames(std::span<const std::uint8_t> given) {
    // so that a byte too far is seen
    const std::vector<std::uint8_t> frame(given.begin(), given.end());
    const Decoded d = decode(frame);
    require((d.kind == Kind::none) == (d.defect != Defect::none),
            "a frame is something, or there is a reason");
    if (d.kind == Kind::sync) {
        require(decode(encode(d.from, d.sync)).sync.stamp == d.sync.stamp,
                "a sync is written as it was read");
    }
    if (d.kind == Kind::request) {
        require(
            decode(encode(d.to, d.from, d.request)).request.reply_offset == d.request.reply_offset,
            "a request too");
    }
    if (d.kind == Kind::reply) {
        require(decode(encode(d.to, d.from, d.reply)).reply.received == d.reply.received,
                "a reply too");
    }
    if (d.kind == Kind::ping) {
        require(decode(encode(d.to, d.from, d.ping)).ping.number == d.ping.number, "a ping too");
    }
    if (d.kind == Kind::echo) {
        require(decode(encode(d.to, d.from, d.echo)).echo.stamp == d.echo.stamp, "an answer too");
    }
    std::array<std::uint8_t, 1514> out{}, back{};
    if (const std::size_t n = tunnel(frame, out); n != 0) {
        require(untunnel(std::span(out).first(n), back) == frame.size(),
                "what went into the tunnel comes out");
        require(std::memcmp(back.data(), frame.data(), frame.size()) == 0, "as it was");
    }
    const std::size_t packet = untunnel(frame, out);
    require(!is_packet(d, d.to) || packet == frame.size() - rtmac_bytes,
            "what is a packet has a place in the kernel's longest frame");
    rtcfg::Message m;
    if (!rtcfg::decode(frame, m)) return;
    const std::size_t n = rtcfg::encode(m, out);
    rtcfg::Message again;
    require(n == 0 || (rtcfg::decode(std::span(out).first(n), again) && again.id == m.id &&
                       again.from == m.from),
            "RTcfg is written as it was read");
}

struct Nothing final : rtcfg::ClientEvents {
    void on_stage_1(std::span<const std::uint8_t> bytes, const Address&) noexcept override {
        require(bytes.size() <= 65535, "one frame");
    }
    void on_stage_2(std::vector<std::uint8_t>& file, std::uint32_t length,
                    const Address&) noexcept override {
        require(length <= file.size(), "the received part fits into the file");
    }
    void on_dead_station(const Address&) noexcept override {}
    void on_other_server(const Address&) noexcept override {}
};

/// Both ends of RTcfg get it, when they know nobody and when they know each other.
void configuration(std::span<const std::uint8_t> given) {
    const std::vector<std::uint8_t> frame(given.begin(), given.end());
    static Station station(StationSetup{.slots = {{.size = 200}}});
    static Nothing nothing;
    static rtcfg::Client client(station, {}, nothing);
    rtcfg::Message m;
    const bool read = rtcfg::decode(frame, m);
    const auto before = client.foreign();
    client.begin();
    client.arrived(frame, 1);
    require(read || client.foreign() == before + 1, "what cannot be read is counted");
    require(!client.configured(), "a frame alone configures nothing");
    client.accept(m.from, 100);
    for (int i = 0; i < 3; ++i) {
        client.arrived(frame, 2);
        client.before_slots(3);
    }
    // only who sends the syncs serves
    static Station leading(StationSetup{.role = Role::master, .slots = {{.size = 200}}});
    static const auto segment = hal::ethernet::open("sim:fuzz");
    static const bool leads = [] {
        leading.attach(*segment.port);
        for (Time now = 1'000'000; now < 20'000'000; now += 1'000'000) {
            leading.receive(now);
        }
        return leading.ready() && leading.status().leading;
    }();
    require(leads, "a master that is alone leads");
    rtcfg::Server server(
        leading, {},
        {{m.from, {}, "slave:\nslot 0 100\n", "a file"}, {{}, {true, {10, 0, 0, 3}}, "", ""}}, 100);
    server.before_slots(0);
    for (Time now = 1; now < 3'000'000'000; now += 700'000'000) {
        server.arrived(frame, now);
        server.heard(m.from, now);
        server.before_slots(now);
    }
    require(server.ready() <= server.clients(), "as many as there are");
}

void schedule(std::string_view text) {
    const config::ReadResult reading = config::read(text);
    for (const config::Message& m : reading.messages) {
        require(m.at.offset + std::size_t{m.at.length} <= text.size(), "a place lies in the text");
        require(!m.sentence.empty(), "a message is not empty");
    }
    if (!reading.good()) return;
    const plan::Plan p = plan::plan_of(reading.schedule);
    require(p.load >= 0 && p.load <= 1.0001, "what fits is not more than the line");
    for (std::size_t i = 0; i < reading.schedule.stations.size(); ++i) {
        StationSetup setup = config::setup_of(reading.schedule, i);
        setup.queue = 1;
        const Station station(setup);
        require(config::read(config::block_of(reading.schedule, i)).schedule.stations.size() == 1,
                "a station's block is a schedule");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size != 0 && data[0] < 0x20 && data[0] != '\n') {
        frames({data, size});
        configuration({data, size});
    } else {
        schedule({reinterpret_cast<const char*>(data), size});
    }
    return 0;
}
