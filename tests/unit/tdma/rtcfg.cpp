// SPDX-License-Identifier: MIT
// A station that knows only its MAC or IP address gets its schedule and a file from the server.
#include <gtest/gtest.h>

#include <unistd.h>

#include <cstdio>

#include "components/fieldbus/tdma/rtcfg/rtcfg_applicant.hpp"
#include "components/fieldbus/tdma/rtcfg/rtcfg_service.hpp"
#include "wire.hpp"

namespace tdma_tests {
namespace {

constexpr Time ms = 1'000'000;
constexpr const char* text = R"(
master:
cycle 1000
heartbeat 100
slot 0 50
slave:
name x
mac 02:00:00:00:00:02
stage2 x.cfg
slot 0 300
slave:
name y
ip 10.0.0.3
slot 0 600 1/1 100
slot 2 700
)";

/// A station that knows only its address, with the applicant of its component; the helper runs
/// after each cycle.
struct Newcomer {
    Newcomer(Machine& m, rtcfg::Logical own, std::string file)
        : machine(m),
          applicant("tdma." + std::to_string(m.port.address()[5]), m.station, own, std::move(file),
                    m) {
        m.station.accompany(&applicant.client(), nullptr);
        m.in_cycle = [this](Machine& at) {
            applicant.work(at.next);
            configured += applicant.cycle() ? 1 : 0;
        };
    }
    Machine& machine;
    rtcfg::Applicant applicant;
    int configured = 0;
};

struct Cell : Bed {
    config::ReadResult reading = config::read(text);
    Machine& m;
    Machine& x;
    Machine& y;
    std::string file, path = testing::TempDir() + "tdma_rtcfg_" + std::to_string(getpid());
    std::unique_ptr<rtcfg::Service> service;
    Newcomer at_x, at_y;

    static StationSetup unknown() {
        StationSetup s;
        s.slot_capacity = max_slots;
        s.configured = false;
        return s;
    }
    Cell()
        : m(add(1, config::setup_of(reading.schedule, 0))),
          x(add(2, unknown())),
          y(add(3, unknown())),
          at_x(x, {}, path),
          at_y(y, {true, {10, 0, 0, 3}}, "") {
        for (int i = 0; i < 3000; ++i) {
            file += static_cast<char>('a' + i % 26);
        }
        const auto read = [this](const std::string& name, std::string& bytes) {
            EXPECT_EQ("x.cfg", name);
            bytes = file;
            return true;
        };
        service = std::make_unique<rtcfg::Service>(m.station, reading.schedule, 0, read, m);
        m.station.accompany(&service->server(), nullptr);
        std::remove(path.c_str());
    }
    ~Cell() { std::remove(path.c_str()); }
    rtcfg::ClientState state(std::size_t client) const { return service->server().state(client); }
    std::string received() const {
        std::string bytes;
        return config::read_from_disk(path, bytes) ? bytes : "";
    }
    void inject(rtcfg::Message message, int from, Time at) {
        message.from = mac(from);
        std::vector<std::uint8_t> frame(ethernet::max_frame);
        frame.resize(rtcfg::encode(message, frame));
        wire.inject(frame, from, at);
    }
};

/// Captures standard error.
struct Notice {
    Notice() { testing::internal::CaptureStderr(); }
    std::string text() { return testing::internal::GetCapturedStderr(); }
};

TEST(Rtcfg_server, configures_stations_that_know_only_their_address) {
    Cell cell;
    Notice said;
    cell.run(4000 * ms);
    EXPECT_EQ(
        "tdma.2: configured by 02:00:00:00:00:01 as station x: 1 slot, cycle 1000 us\n"
        "tdma.3: configured by 02:00:00:00:00:01 as station y: 2 slots, cycle 1000 us\n"
        "tdma.2: received '" +
            cell.path + "' from 02:00:00:00:00:01 (3000 bytes)\n",
        said.text());
    EXPECT_TRUE(cell.x.station.ready() && cell.y.station.ready());
    EXPECT_EQ(300'000, cell.x.station.setup().slots.at(0).offset);
    EXPECT_EQ(600'000, cell.y.station.setup().slots.at(0).offset);
    EXPECT_EQ(2U, cell.y.station.setup().slots.at(1).id);
    EXPECT_EQ("y", cell.at_y.applicant.accepted()->schedule.stations.at(0).name);
    EXPECT_EQ(cell.file, cell.received());
    EXPECT_EQ(3000U, cell.at_x.applicant.file_bytes());
    EXPECT_TRUE(cell.at_x.applicant.client().complete() && cell.at_y.applicant.client().complete());
    EXPECT_EQ(rtcfg::ClientState::ready, cell.state(0));
    EXPECT_EQ(rtcfg::ClientState::ready, cell.state(1));
    EXPECT_EQ(2U, cell.service->server().ready());
    EXPECT_EQ(0U, cell.service->server().foreign() + cell.at_x.applicant.foreign() +
                      cell.at_y.applicant.foreign());
}

TEST(Rtcfg_server, does_not_invite_a_station_that_already_sends) {
    Cell cell;
    Notice said;
    cell.x.in_cycle = nullptr;
    cell.x.station.accompany(nullptr, nullptr);
    // from its own file
    ASSERT_TRUE(cell.x.station.reconfigure(config::setup_of(cell.reading.schedule, 1)));
    cell.run(3000 * ms);
    ASSERT_TRUE(cell.x.station.ready());
    cell.x.in_cycle = [](Machine& me) {
        std::array<std::uint8_t, 60> frame{0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 2,
                                           0,    0,    0,    0,    2,    0x90, 0x23};
        me.station.send(frame, 0, 0);
    };
    cell.run(2000 * ms);
    int invitations = 0;
    cell.wire.fault = [&](Wire::Frame& f) {
        rtcfg::Message message;
        if (rtcfg::decode(f.bytes, message) && message.id == rtcfg::Id::stage_1) {
            ++invitations;
        }
        return true;
    };
    cell.run(5000 * ms);
    EXPECT_EQ(0, invitations);
    said.text();
}

TEST(Rtcfg_server, reports_a_dead_station_and_configures_it_again) {
    Cell cell;
    Notice said;
    cell.run(4000 * ms);
    cell.x.off = cell.x.port.cut = true;
    cell.run(400 * ms);
    EXPECT_EQ(rtcfg::ClientState::dead, cell.state(0));
    EXPECT_EQ(1U, cell.service->dead());
    EXPECT_EQ(1, cell.m.events[Event::station_dead]);
    EXPECT_EQ(mac(2), cell.y.last_who[Event::reported_dead]) << "all stations are notified";
    cell.x.off = cell.x.port.cut = false;  // power-cycled
    cell.at_x.applicant.begin();
    cell.x.next = cell.x.port.clock().local(cell.now);
    cell.run(4000 * ms);
    EXPECT_EQ(rtcfg::ClientState::ready, cell.state(0));
    EXPECT_EQ(0U, cell.service->dead());
    EXPECT_EQ(2, cell.m.events[Event::station_ready] - 1) << "x twice, y once";
    EXPECT_EQ(2, cell.at_x.configured);
    said.text();
}

TEST(Rtcfg_server, finds_running_stations_after_a_restart) {
    Cell cell;
    Notice said;
    cell.run(4000 * ms);
    cell.service->begin();
    EXPECT_EQ(0U, cell.service->server().ready());
    cell.run(4000 * ms);
    EXPECT_EQ(2U, cell.service->server().ready());
    EXPECT_EQ(1, cell.at_x.configured) << "the same configuration changes nothing";
    EXPECT_EQ(0, cell.x.events[Event::sync_lost]);
    said.text();
}

TEST(Rtcfg_server, repeats_lost_frames) {
    Cell cell;
    Notice said;
    cell.wire.fault = [&cell](Wire::Frame& f) {
        return f.bytes[13] != 0x22 || cell.wire.random() % 4 != 0;
    };
    cell.run(30'000 * ms);
    EXPECT_EQ(cell.file, cell.received());
    EXPECT_EQ(2U, cell.service->server().ready());
    said.text();
}

TEST(Rtcfg_server, reports_a_slot_that_is_too_short_for_an_offline_station) {
    Cell cell;
    StationSetup small = config::setup_of(cell.reading.schedule, 0);
    small.slots[0].size = 100;
    ASSERT_TRUE(cell.m.station.reconfigure(small));
    cell.run(20'000 * ms);
    EXPECT_EQ(2, cell.m.events[Event::station_too_long]);
    EXPECT_EQ(State::unconfigured, cell.x.status().state);
    EXPECT_EQ(0, cell.x.events[Event::running]);
}

TEST(Rtcfg_service, of_a_backup_omits_files_that_only_the_master_has) {
    const auto reading = config::read(
        "cycle 1000\nmaster:\nslot 0 100\nbackup-master:\nname b\nbackup-offset 60\nslot 0 300\n"
        "slave:\nname x\nmac 02:00:00:00:00:03\nstage2 x.cfg\nslot 0 600");
    ASSERT_TRUE(reading.good()) << config::to_string(reading, "");
    Cell cell;
    const auto none = [](const std::string&, std::string& bytes) {
        bytes = "No such file or directory";
        return false;
    };
    EXPECT_THROW(rtcfg::Service(cell.m.station, reading.schedule, 0, none, cell.m),
                 std::invalid_argument);
    EXPECT_EQ(1U,
              rtcfg::Service(cell.m.station, reading.schedule, 1, none, cell.m).server().clients())
        << "x";
}

TEST(Rtcfg_client, ignores_a_second_server_and_another_configuration_while_running) {
    Cell cell;
    Notice said;
    cell.run(4000 * ms);
    ASSERT_TRUE(cell.x.station.ready());
    const std::string other = "cycle 2000\nslave:\nslot 0 900\n";
    rtcfg::Message m;
    m.id = rtcfg::Id::stage_1;
    m.to = mac(2);
    m.data = std::span(reinterpret_cast<const std::uint8_t*>(other.data()), other.size());
    for (int i = 0; i < 5; ++i) {
        cell.inject(m, 9, cell.now + (2 * i + 1) * ms);
    }
    cell.run(20 * ms);
    EXPECT_EQ(1, cell.x.events[Event::other_server]);
    EXPECT_EQ(mac(9), cell.x.last_who[Event::other_server]);
    // as if from the master
    for (int i = 0; i < 5; ++i) {
        cell.inject(m, 1, cell.now + (2 * i + 1) * ms);
    }
    cell.run(20 * ms);
    EXPECT_EQ(1, cell.x.events[Event::other_configuration]);
    EXPECT_EQ(10U, cell.at_x.applicant.foreign());
    EXPECT_TRUE(cell.x.station.ready());
    EXPECT_EQ(300'000, cell.x.station.setup().slots.at(0).offset);
    said.text();
}

TEST(Rtcfg_client, ignores_a_fragment_for_another_station) {
    Cell cell;
    Notice said;
    cell.run(4000 * ms);
    rtcfg::Client& client = cell.at_x.applicant.client();
    ASSERT_TRUE(client.complete());
    rtcfg::Message m;
    m.id = rtcfg::Id::stage_2_fragment;
    m.from = mac(1);
    m.to = mac(9);
    std::array<std::uint8_t, ethernet::max_frame> frame{};
    client.arrived(std::span(frame).first(rtcfg::encode(m, frame)), cell.now);
    EXPECT_EQ(1U, client.foreign());
    m.to = mac(2);
    client.arrived(std::span(frame).first(rtcfg::encode(m, frame)), cell.now);
    EXPECT_EQ(1U, client.foreign());
    said.text();
}

TEST(Rtcfg_client, reports_an_invalid_configuration_once_and_accepts_the_next) {
    Cell cell;
    Notice said;
    cell.m.off = true;
    const std::string wrong = "cycle 1000\nslave:\nslott 0 900\n";
    rtcfg::Message m;
    m.id = rtcfg::Id::stage_1;
    m.to = mac(2);
    m.data = std::span(reinterpret_cast<const std::uint8_t*>(wrong.data()), wrong.size());
    for (int i = 0; i < 5; ++i) {
        cell.inject(m, 9, 10 * ms + i * 5 * ms);
    }
    cell.run(100 * ms);
    EXPECT_EQ(
        "tdma.2: rejected the configuration from 02:00:00:00:00:09: stage 1:3:1: error: unknown "
        "key 'slott'; "
        "did you mean 'slot'?; waiting for another\n",
        said.text());
    EXPECT_EQ(State::unconfigured, cell.x.status().state);
    EXPECT_EQ(5U, cell.at_x.applicant.foreign());
    Notice again;
    cell.m.off = false;
    cell.m.next = cell.m.port.clock().local(cell.now);
    cell.run(4000 * ms);
    EXPECT_TRUE(cell.x.station.ready());
    again.text();
}

TEST(Rtcfg_client, reports_at_most_three_invalid_configurations) {
    Cell cell;
    Notice said;
    cell.m.off = true;
    for (int i = 0; i < 50; ++i) {
        const std::string wrong = "cy\x1b[2Jcle " + std::to_string(i) + "\nslave:\nslott 0 900\n";
        rtcfg::Message m;
        m.id = rtcfg::Id::stage_1;
        m.to = mac(2);
        m.data = std::span(reinterpret_cast<const std::uint8_t*>(wrong.data()), wrong.size());
        cell.inject(m, 9, 10 * ms + i * 5 * ms);
    }
    cell.run(400 * ms);
    const std::string words = said.text();
    EXPECT_EQ(3, std::count(words.begin(), words.end(), '\n')) << words;
    EXPECT_TRUE(words.ends_with("; waiting for another (further rejections are not reported)\n"))
        << words;
    EXPECT_TRUE(
        words.starts_with("tdma.2: rejected the configuration from 02:00:00:00:00:09: stage 1:1:1: "
                          "error: unknown key "
                          "'cy?[2Jcle'; "))
        << words;
    EXPECT_EQ(50U, cell.at_x.applicant.foreign());
}

TEST(Rtcfg_client, stays_configured_under_random_frames) {
    Cell cell;
    Notice said;
    for (int i = 0; i < 20'000; ++i) {
        std::vector<std::uint8_t> frame(14 + cell.wire.random() % 80);
        for (auto& byte : frame) {
            byte = static_cast<std::uint8_t>(cell.wire.random());
        }
        std::copy_n((i % 3 == 0   ? mac(2)
                     : i % 3 == 1 ? mac(1)
                                  : ethernet::broadcast)
                        .begin(),
                    6, frame.begin());
        frame[12] = 0x90;
        frame[13] = 0x22;
        if (i % 2 == 0) {
            std::copy_n(mac(1 + i / 2 % 2).begin(), 6, frame.begin() + 6);
        }
        if (frame.size() > 14) {
            frame[14] = static_cast<std::uint8_t>((i % 9 == 0 ? 1 : i % 9));
        }
        cell.wire.inject(std::move(frame), 9, 10 * ms + Time{i} * 150'000);
    }
    cell.run(8000 * ms);
    EXPECT_TRUE(cell.x.station.ready());
    EXPECT_EQ(300'000, cell.x.station.setup().slots.at(0).offset);
    EXPECT_EQ(1, cell.at_x.configured);
    EXPECT_EQ(0, cell.x.events[Event::sync_lost]);
    EXPECT_GT(cell.at_x.applicant.foreign() + cell.service->server().foreign(), 1000U);
    said.text();
}

}  // namespace
}  // namespace tdma_tests
