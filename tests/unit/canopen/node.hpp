// SPDX-License-Identifier: MIT
// A device alone on a wire, and the test as the rest of the network.
#pragma once

#include <gtest/gtest.h>

#include "bus.hpp"

namespace hal::canopen::test {

struct Node : testing::Test {
    Recorder events;
    Bus bus;
    std::unique_ptr<Device> device;
    Time now = 0;

    void make(const Description& d,
              DeviceSettings settings = {.node_id = 5, .pdo = {.send_at_start = false}}) {
        device = std::make_unique<Device>(d, settings, events);
        bus.attach(*device);
        device->start(now);
        run(0);
    }
    void SetUp() override { make(example()); }
    void run(Time ms) {
        for (Time n = 0; n <= ms; ++n) {
            if (n != 0) {
                now += millisecond;
            }
            device->poll(now);
            bus.exchange(now);
        }
    }
    void send(const Frame& f) {
        bus.inject(f, now);
        bus.exchange(now);
    }
    void nmt(NmtCommand c, std::uint8_t to = 5) { send({0, {static_cast<std::uint8_t>(c), to}}); }
    /// The answer of the server to one request.
    Frame sdo(std::initializer_list<std::uint8_t> request) {
        bus.log.clear();
        send({0x605, request});
        const auto answers = bus.sent(0x585);
        return answers.size() == 1 ? answers[0] : Frame{};
    }
    Abort write(std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned size) {
        Frame f(0x605, {static_cast<std::uint8_t>(0x23 | (4 - size) << 2),
                        static_cast<std::uint8_t>(index), static_cast<std::uint8_t>(index >> 8),
                        sub, 0, 0, 0, 0});
        store(f.data.data() + 4, value);
        bus.log.clear();
        send(f);
        const auto answers = bus.sent(0x585);
        if (answers.size() != 1) return Abort::timeout;
        return answers[0].data[0] == 0x60
                   ? Abort::none
                   : static_cast<Abort>(load<std::uint32_t>(answers[0].data.data() + 4));
    }
    std::uint32_t read(std::uint16_t index, std::uint8_t sub) {
        const auto f = sdo({0x40, static_cast<std::uint8_t>(index),
                            static_cast<std::uint8_t>(index >> 8), sub, 0, 0, 0, 0});
        return load<std::uint32_t>(f.data.data() + 4);
    }
    std::vector<Frame> since(std::uint32_t cob) { return bus.sent(cob); }
};

}  // namespace hal::canopen::test
