// SPDX-License-Identifier: MIT
// A station that knows only its MAC or IP address gets its schedule and a file from the server.
#include <gtest/gtest.h>

#include "components/fieldbus/tdma/config.hpp"
#include "components/fieldbus/tdma/rtcfg_client.hpp"
#include "components/fieldbus/tdma/rtcfg_server.hpp"
#include "wire.hpp"

namespace tdma_tests {
namespace {

constexpr Time ms = 1'000'000;
constexpr const char* text = R"(
master:
cycle 1000
slot 0 50
slave:
name x
mac 02:00:00:00:00:02
slot 0 300
slave:
name y
ip 10.0.0.3
slot 0 600
)";

struct Listener final : rtcfg::ClientEvents, rtcfg::ServerEvents {
    void on_stage_1(std::span<const std::uint8_t> data) noexcept override { stage_1.assign(data.begin(), data.end()); }
    void on_stage_2(std::span<const std::uint8_t> data) noexcept override { stage_2.assign(data.begin(), data.end()), ++files; }
    void on_dead_station(const Address& who) noexcept override { dead = who; }
    void on_client(std::size_t client, rtcfg::ClientState state) noexcept override { last[client] = state; }
    std::string stage_1, stage_2;
    int files = 0;
    Address dead{};
    std::map<std::size_t, rtcfg::ClientState> last;
};

struct Cell : Bed {
    config::Reading reading = config::read(text);
    Machine& m;
    Machine& x;
    Machine& y;
    Listener at_m, at_x, at_y;
    std::string file;
    std::unique_ptr<rtcfg::Server> server;
    rtcfg::Client client_x, client_y;

    static StationSetup unknown() {
        StationSetup s;
        s.room_for_slots = most_slots;
        return s;
    }
    Cell()
        : m(add(1, config::setup_of(reading.schedule, 0))), x(add(2, unknown())), y(add(3, unknown())), client_x(x.station, {}, at_x),
          client_y(y.station, {true, {10, 0, 0, 3}}, at_y) {
        for (int i = 0; i < 3000; ++i) file += static_cast<char>('a' + i % 26);
        std::vector<rtcfg::Server::ClientSetup> clients(2);
        clients[0] = {mac(2), {}, config::block_of(reading.schedule, 1), file};
        clients[1] = {{}, {true, {10, 0, 0, 3}}, config::block_of(reading.schedule, 2), ""};
        server = std::make_unique<rtcfg::Server>(m.station, rtcfg::Logical{true, {10, 0, 0, 1}}, clients, std::uint16_t{100}, &at_m);
        m.station.accompany(server.get(), nullptr);
        x.station.accompany(&client_x, nullptr);
        y.station.accompany(&client_y, nullptr);
        for (auto [machine, listener] : {std::pair{&x, &at_x}, {&y, &at_y}})
            machine->in_cycle = [known = std::string(), listener](Machine& me) mutable {
                if (listener->stage_1 == known) return;
                known = listener->stage_1;
                const auto block = config::read(known);
                if (!block.good()) return;  // not from our server
                EXPECT_TRUE(me.station.reconfigure(config::setup_of(block.schedule, 0)));
            };
    }
};

TEST(Rtcfg_server, configures_stations_that_know_only_their_address) {
    Cell cell;
    cell.run(4000 * ms);
    EXPECT_TRUE(cell.x.station.ready() && cell.y.station.ready());
    EXPECT_EQ(300'000, cell.x.station.setup().slots.at(0).offset);
    EXPECT_EQ(600'000, cell.y.station.setup().slots.at(0).offset);
    EXPECT_EQ(cell.file, cell.at_x.stage_2);
    EXPECT_EQ(1, cell.at_x.files);
    EXPECT_TRUE(cell.client_x.complete() && cell.client_y.complete());
    EXPECT_EQ(rtcfg::ClientState::ready, cell.server->state(0));
    EXPECT_EQ(rtcfg::ClientState::ready, cell.server->state(1));
}

TEST(Rtcfg_server, notices_a_dead_station_and_configures_it_again) {
    Cell cell;
    cell.run(4000 * ms);
    cell.x.off = cell.x.port.cut = true;
    cell.run(400 * ms);
    EXPECT_EQ(rtcfg::ClientState::dead, cell.at_m.last[0]);
    EXPECT_EQ(mac(2), cell.at_y.dead) << "all are told";
    cell.x.off = cell.x.port.cut = false;  // power-cycled
    cell.client_x.begin();
    cell.x.next = cell.x.port.clock().local(cell.now);
    cell.run(4000 * ms);
    EXPECT_EQ(rtcfg::ClientState::ready, cell.server->state(0));
    EXPECT_EQ(2, cell.at_x.files);
}

TEST(Rtcfg_server, repeats_what_was_lost) {
    Cell cell;
    cell.wire.fault = [&cell](Wire::Frame& f) { return f.bytes[13] != 0x22 || cell.wire.random() % 4 != 0; };
    cell.run(30'000 * ms);
    EXPECT_EQ(cell.file, cell.at_x.stage_2);
    EXPECT_TRUE(cell.client_x.configured());
}

TEST(Rtcfg_client, survives_whatever_comes) {
    Cell cell;
    for (int i = 0; i < 20'000; ++i) {
        std::vector<std::uint8_t> frame(14 + cell.wire.random() % 80);
        for (auto& byte : frame) byte = static_cast<std::uint8_t>(cell.wire.random());
        std::fill_n(frame.begin(), 6, std::uint8_t{0xff});
        frame[12] = 0x90, frame[13] = 0x22;
        if (i % 2 == 0) std::copy_n(mac(1).begin(), 6, frame.begin() + 6);
        if (frame.size() > 14) frame[14] = static_cast<std::uint8_t>((i % 9 == 0 ? 1 : i % 9));
        cell.wire.inject(std::move(frame), 9, 10 * ms + Time{i} * 150'000);
    }
    cell.run(8000 * ms);
    EXPECT_TRUE(cell.x.station.ready());
    EXPECT_LE(cell.at_x.stage_2.size(), 65536U);
}

}  // namespace
}  // namespace tdma_tests
