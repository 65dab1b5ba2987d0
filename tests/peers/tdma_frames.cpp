// SPDX-License-Identifier: MIT
// tdma_frames CAPTURE FIELDS: a frame of each kind that TDMA and RTcfg send, as our encoders make
// them, by our recorder in a pcapng file; beside it what an independent decoder must read: a line
// for each frame, NAME=VALUE and spaces, the names as tshark has them.
#include <array>
#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "fieldbus/tdma/config/schedule.hpp"
#include "fieldbus/tdma/wire/rtcfg_frames.hpp"
#include "fieldbus/tdma/wire/tdma_frames.hpp"
#include "link/ethernet_capture.hpp"

namespace {

using namespace hal::tdma;
namespace ethernet = hal::ethernet;
using rtcfg::Id;

constexpr Address master{0x02, 0, 0, 0, 0, 1};
constexpr Address station{0x02, 0, 0, 0, 0, 2};
constexpr Time large = 0x7122334455667788;

class Capture {
public:
    Capture(const char* capture, const char* fields)
        : recorder_(ethernet::record(capture, "tdma", problem_)), fields_(fields) {}
    void add(std::span<const std::uint8_t> frame, const std::string& fields) {
        if (recorder_ && !recorder_->write(++time_ * 1'000'000, frame)) {
            problem_ = "a frame cannot be written";
        }
        fields_ << "eth.dst=" << address(frame, 0) << " eth.src=" << address(frame, 6) << ' '
                << fields << '\n';
    }
    bool end() {
        if (recorder_ && !recorder_->flush()) {
            problem_ = "the capture cannot be written";
        }
        if (!problem_.empty()) {
            std::fprintf(stderr, "%s\n", problem_.c_str());
        }
        return problem_.empty() && fields_.good();
    }

private:
    static std::string address(std::span<const std::uint8_t> frame, std::size_t at) {
        Address a{};
        for (std::size_t i = 0; i < a.size(); ++i) {
            a[i] = frame[at + i];
        }
        return ethernet::to_string(a);
    }
    std::string problem_;
    std::unique_ptr<ethernet::Recorder> recorder_;
    std::ofstream fields_;
    std::int64_t time_ = 0;
};

std::string n(std::uint64_t value) { return std::to_string(value); }
std::string hex(std::span<const std::uint8_t> bytes) {
    std::string text;
    for (const std::uint8_t b : bytes) {
        char digits[4];
        std::snprintf(digits, sizeof digits, "%02x", b);
        text += digits;
    }
    return text;
}

void tdma_frames(Capture& out) {
    const std::string head = "rtmac.header.ver=2 rtmac.header.flags=0x00 tdma.ver=0x0201 ";
    for (const std::uint32_t cycle : {0U, 7U, 0xffffffffU}) {
        out.add(encode(master, Sync{cycle, large, large - 12'345}),
                head + "tdma.id=0x0000 tdma.sync.cycle=" + n(cycle) + " tdma.sync.xmit_stamp=" +
                    n(large) + " tdma.sync.sched_xmit=" + n(large - 12'345));
    }
    out.add(encode(master, station, Request{large, 0xfffffff0, 650'000}),
            head + "tdma.id=0x0010 tdma.req_cal.xmit_stamp=" + n(large) +
                " tdma.req_cal.rpl_cycle=4294967280 tdma.req_cal.rpl_slot=650000");
    out.add(encode(station, master, Reply{large, 12'345'678'901, 98'765'432'109}),
            head + "tdma.id=0x0011 tdma.rpl_cal.req_stamp=" + n(large) +
                " tdma.rpl_cal.rcv_stamp=12345678901 tdma.rpl_cal.xmit_stamp=98765432109");
    std::array<std::uint8_t, 70> packet{};
    std::array<std::uint8_t, 80> tunnelled{};
    packet[0] = 2;
    packet[5] = 2;
    packet[6] = 2;
    packet[11] = 1;
    packet[12] = 0x88;

    packet[13] = 0xb5;
    out.add(std::span(tunnelled).first(tunnel(packet, tunnelled)),
            "rtmac.header.ver=2 rtmac.header.flags=0x01 rtmac.header.flags.tunnel=1");
}

void rtcfg_frame(Capture& out, rtcfg::Message m, const std::string& fields) {
    m.from = m.id == Id::stage_1 || m.id == Id::stage_2 || m.id == Id::stage_2_fragment ||
                     m.id == Id::dead_station
                 ? master
                 : station;
    std::array<std::uint8_t, ethernet::max_frame> frame{};
    const std::size_t length = rtcfg::encode(m, frame);
    out.add(std::span(frame).first(length),
            "rtcfg.vers=0 rtcfg.id=" + n(static_cast<unsigned>(m.id)) + " " + fields);
}

void rtcfg_frames(Capture& out) {
    const config::ReadResult reading = config::read(
        "master:\ncycle 1000\nslot 0 50\nslave:\nname x\nip 10.0.0.2\nslot 0 300 1/2 60\nslot 3 "
        "600\n");
    const std::string block = config::block_of(reading.schedule, 1);  // as a master sends it
    const std::span text(reinterpret_cast<const std::uint8_t*>(block.data()), block.size());
    std::vector<std::uint8_t> file(700);
    for (std::size_t i = 0; i < file.size(); ++i) {
        file[i] = static_cast<std::uint8_t>(i * 7);
    }

    for (const bool by_ip : {false, true}) {
        rtcfg::Message m;
        m.to = by_ip ? ethernet::broadcast : station;
        const std::string type = by_ip ? "rtcfg.address_type=1 rtcfg.client_ip_address=10.0.0.2"
                                       : "rtcfg.address_type=0";
        if (by_ip) {
            m.client = {true, {10, 0, 0, 2}};
            m.server = {true, {10, 0, 0, 1}};
        }
        m.id = Id::stage_1;
        m.burst = 4;
        m.data = text;
        rtcfg_frame(out, m,
                    type + (by_ip ? " rtcfg.server_ip_address=10.0.0.1" : "") +
                        " rtcfg.burst_rate=4 rtcfg.s1_config_length=" + n(block.size()) +
                        " rtcfg.config_data=" + hex(text));
        m.id = Id::announce_new;
        m.flags = rtcfg::wants_stage_2;
        m.burst = 3;
        rtcfg_frame(
            out, m,
            type + " rtcfg.client_flags.available=1 rtcfg.client_flags.ready=0 rtcfg.burst_rate=3");
        m.id = Id::announce_reply;
        m.to = master;
        m.flags = rtcfg::is_ready;
        rtcfg_frame(
            out, m,
            type + " rtcfg.client_flags.available=0 rtcfg.client_flags.ready=1 rtcfg.padding=0");
        m.id = Id::dead_station;
        m.to = ethernet::broadcast;
        m.dead = station;
        rtcfg_frame(out, m,
                    type + " rtcfg.client_hw_address=" + hex(station) + std::string(52, '0'));
    }
    rtcfg::Message m;
    m.to = station;
    m.id = Id::stage_2;
    m.flags = rtcfg::is_ready;
    m.active = 5;
    m.heartbeat_ms = 250;

    m.length = 700;
    m.data = std::span(file).first(rtcfg::stage_2_capacity(400));
    rtcfg_frame(out, m,
                "rtcfg.server_flags.ready=1 rtcfg.active_stations=5 rtcfg.hearbeat_period=250 "
                "rtcfg.s2_config_length=700 "
                "rtcfg.config_data=" +
                    hex(m.data));
    m.id = Id::stage_2_fragment;
    m.offset = 388;
    m.data = std::span(file).subspan(388);
    rtcfg_frame(out, m, "rtcfg.config_offset=388 rtcfg.config_data=" + hex(m.data));
    m = {};
    m.to = master;
    m.id = Id::acknowledge;
    m.length = 700;
    rtcfg_frame(out, m, "rtcfg.ack_length=700");
    m.id = Id::ready;
    m.to = ethernet::broadcast;
    rtcfg_frame(out, m, "");
    m.id = Id::heartbeat;
    m.to = master;
    rtcfg_frame(out, m, "");
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 3) {
        std::fputs("usage: tdma_frames CAPTURE FIELDS\n", stderr);
        return 2;
    }
    Capture out(arguments[1], arguments[2]);
    tdma_frames(out);
    rtcfg_frames(out);
    return out.end() ? 0 : 1;
}
