// SPDX-License-Identifier: MIT
// An SDO client and the server of an example device on the wire of bus.hpp.
#pragma once

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "bus.hpp"

namespace hal::canopen::test {

/// Returns `size` pseudo-random bytes; the same for the same seed.
inline std::vector<std::uint8_t> pattern(std::size_t size, unsigned seed) {
    std::vector<std::uint8_t> data(size);
    unsigned x = seed * 2654435761U + 1;
    for (auto& b : data) {
        x = x * 1664525U + 1013904223U;
        b = static_cast<std::uint8_t>(x >> 24);
    }
    return data;
}

/// One client and one server on a wire.
struct SdoBed {
    Recorder events;
    Bus bus;
    Device device;
    FrameQueue out{1024};
    SdoClient client;
    Time now = 0;

    explicit SdoBed(bool tolerant = false,
                    const SdoClientSettings& settings = {.timeout = 50 * millisecond,
                                                         .resends = 5,
                                                         .restarts = 20})
        : device(example(),
                 {.node_id = 5,
                  .sdo = {.timeout = 1 * second,
                          .acknowledge_after = 10 * millisecond,
                          .tolerate_repeats = tolerant}},
                 events),
          client(out, settings) {
        bus.logging = false;
        bus.attach(device);
        bus.attach(out, [this](const Frame& f, Time t) {
            if (client.listens_to(f)) {
                client.handle(f, t);
            }
        });
        client.configure(5);
        device.start(now);
        bus.exchange(now);
    }
    bool run(SdoRequest& r, int steps = 400'000) {
        client.submit(r);
        for (int n = 0; n < steps && !r.done(); ++n) {
            client.poll(now);
            device.poll(now);
            if (!bus.exchange(now)) {
                now += millisecond;
            }
        }
        return r.done();
    }
};

}  // namespace hal::canopen::test
