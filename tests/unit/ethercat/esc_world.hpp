// SPDX-License-Identifier: MIT
// A line of emulated controllers and a hand to send datagrams into it.
#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "ethercat/esc/line.hpp"
#include "ethercat/wire/frames.hpp"
#include "ethercat/wire/registers.hpp"
#include "ethercat/wire/sii.hpp"
#include "ethercat/wire/states.hpp"

namespace esc_world {

using namespace hal::ethercat;

/// Follows every request at once, and keeps what the master wrote.
struct Firmware : esc::Application {
    int runs = 0;
    int starts = 0;
    std::vector<std::int64_t> times;
    std::vector<std::uint8_t> input;  ///< written to sync manager 3 at each run
    bool follow = true;
    bool trips = false;
    bool waiting = true;

    bool waits() const noexcept override { return waiting; }
    void power_on(esc::Pdi&) noexcept override { ++starts; }
    void run(esc::Pdi& pdi, std::int64_t now_ns) noexcept override {
        ++runs;
        times.push_back(now_ns);
        if (!input.empty()) {
            pdi.write_sync_manager(3, input);
        }
        if (follow) {
            if (const auto control = pdi.take_al_control()) {
                pdi.set_al_status(*control & 0x0f, 0);
            }
        }
        if (trips && pdi.watchdog_expired() && pdi.al_status() == 8) {
            pdi.set_al_status(0x14, 0x1b);
        }
    }
};

/// An SII image with identity and a good checksum.
inline std::vector<std::uint8_t> image(std::uint16_t alias = 0, bool emulation = false) {
    std::vector<std::uint8_t> words(256, 0);
    put<std::uint16_t>(&words[0], emulation ? 0x0104 : 0x0005);
    put<std::uint16_t>(&words[8], alias);
    put<std::uint32_t>(&words[16], 0x5a);
    put<std::uint32_t>(&words[20], 0x1234);
    words[14] = sii::checksum(words);
    put<std::uint16_t>(&words[128], 0xffff);
    return words;
}

struct World {
    esc::Line line;
    std::int64_t now_ns = 1'000'000;
    std::int64_t gap_ns = 100'000;    ///< from frame to frame
    esc::End end = esc::End::primary;
    esc::Line::Passage out;
    std::array<std::uint8_t, max_frame_bytes> frame{};
    std::vector<std::uint8_t> data;   ///< of the answer
    std::uint16_t event = 0;

    struct Item {
        Command command;
        std::uint32_t address;
        std::vector<std::uint8_t> data;
        std::uint16_t wkc = 0;
    };
    /// Sends datagrams in one frame; returns false if it is lost.
    bool send(std::vector<Item>& items) {
        FrameWriter writer(frame, {0x10, 0, 0, 0, 0, 1});
        for (std::size_t i = 0; i < items.size(); ++i) {
            std::uint8_t* to =
                writer.add(items[i].command, static_cast<std::uint8_t>(i), items[i].address,
                           static_cast<std::uint16_t>(items[i].data.size()));
            std::copy(items[i].data.begin(), items[i].data.end(), to);
        }
        const std::size_t length = writer.finish().size();
        now_ns += gap_ns;
        out = line.process({frame.data(), length}, end, now_ns);
        FrameReader reader({frame.data(), length});
        for (Item& item : items) {
            const auto d = reader.next();
            if (!d) {
                ADD_FAILURE() << "datagram missing";
            }
            item.data.assign(d->data, d->data + d->length);
            item.wkc = d->wkc();
            event = d->event();
        }
        return !out.lost;
    }
    /// Sends one datagram; returns its working counter, -1 if the frame is lost.
    int send(Command command, std::uint32_t address, std::vector<std::uint8_t> bytes) {
        std::vector<Item> items{{command, address, std::move(bytes)}};
        const bool back = send(items);
        data = items[0].data;
        return back ? items[0].wkc : -1;
    }
    template <class T>
    static std::vector<std::uint8_t> bytes(T value) {
        std::vector<std::uint8_t> b(sizeof value);
        put(b.data(), value);
        return b;
    }
    template <class T>
    T read(unsigned slave, std::uint16_t reg) {
        EXPECT_EQ(
            send(Command::aprd, at_position(slave, reg), std::vector<std::uint8_t>(sizeof(T))), 1)
            << std::hex << reg;
        return get<T>(data.data());
    }
    template <class T>
    void write(unsigned slave, std::uint16_t reg, T value) {
        EXPECT_EQ(send(Command::apwr, at_position(slave, reg), bytes(value)), 1) << std::hex << reg;
    }
    void sync_manager(unsigned slave, unsigned n, std::uint16_t start, std::uint16_t length,
                      std::uint8_t control) {
        std::vector<std::uint8_t> b(8);
        put(&b[0], start);
        put(&b[2], length);
        b[4] = control;
        b[6] = 1;
        EXPECT_EQ(send(Command::apwr, at_position(slave, registers::sync_manager_at(n)), b), 1);
    }
    struct Map {
        std::uint32_t logical;
        std::uint16_t length;
        unsigned start = 0;
        unsigned stop = 7;
        std::uint16_t physical;
        unsigned bit = 0;
        std::uint8_t type;
    };
    void fmmu(unsigned slave, unsigned n, const Map& m) {
        std::vector<std::uint8_t> b(16);
        put(&b[0], m.logical);
        put(&b[4], m.length);
        put(&b[8], m.physical);
        b[6] = static_cast<std::uint8_t>(m.start);
        b[7] = static_cast<std::uint8_t>(m.stop);

        b[10] = static_cast<std::uint8_t>(m.bit);
        b[11] = m.type;
        b[12] = 1;
        EXPECT_EQ(send(Command::apwr, at_position(slave, registers::fmmu_at(n)), b), 1);
    }
};

}  // namespace esc_world
