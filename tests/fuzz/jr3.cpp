// SPDX-License-Identifier: MIT
// The line of a force/torque sensor, as it may come from a recording, a damaged cable or a wrong
// one. The first byte chooses: the packets in it, its calibration memory, or the whole node behind
// it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "canopen/device/sensor/jr3.hpp"
#include "canopen/protocol/numbers.hpp"
#include "tests/fuzz/driver/require.hpp"

using namespace hal::canopen;

namespace {

using hal::fuzz::require;

template <class Take>
void each_bit(std::span<const std::uint8_t> bytes, Take take) {
    for (const auto byte : bytes) {
        for (int bit = 7; bit >= 0; --bit) {
            take((byte >> bit & 1) != 0);
        }
    }
}

void packets(std::span<const std::uint8_t> bytes) {
    jr3::Decoder decoder;
    std::size_t found = 0;
    each_bit(bytes, [&](bool bit) {
        if (!decoder.take(bit)) return;
        ++found;
        require(decoder.packet().address < jr3::addresses, "an address has four bits");
        require(decoder.locked(), "a packet is taken only where packets are known to be");
    });
    require(found == decoder.packets() && found * 32 <= bytes.size() * 8,
            "no more packets than there are bits for");
    // After anything, a good line is understood again with its third packet.
    jr3::Generator generator;
    for (unsigned n = 0; n < jr3::addresses; ++n) {
        generator.set(n, static_cast<std::int16_t>(n * 0x1111));
    }
    std::array<std::uint8_t, 17 * 16> good{};
    generator.fill(good);
    const auto before = decoder.packets();
    each_bit(good, [&](bool bit) {
        if (decoder.take(bit) && decoder.packets() > before + 1) {
            require(decoder.packet().address == 7 ||
                        decoder.packet().value ==
                            static_cast<std::int16_t>(decoder.packet().address * 0x1111),
                    "a good packet is read as it was sent");
        }
    });
    require(decoder.packets() >= before + good.size() * 8 / jr3::packet_clocks - 3,
            "a good line is found soon");
}

void memory(std::span<const std::uint8_t> bytes) {
    jr3::MemoryReader reader;
    jr3::Calibration calibration;
    for (std::size_t n = 0; n + 1 < bytes.size(); n += 2) {
        if (reader.take(static_cast<std::uint16_t>(bytes[n] << 8 | bytes[n + 1]))) {
            calibration.read(reader.memory());
        }
    }
    // The same bytes as the content of a memory that is otherwise in order.
    std::array<std::uint8_t, jr3::memory_size> image{};
    std::copy(jr3::signature.begin(), jr3::signature.end(), image.begin());
    std::copy_n(bytes.begin(), std::min(bytes.size(), image.size() - jr3::signature.size() - 2),
                image.begin() + jr3::signature.size());
    store(image.data() + image.size() - 2, crc16(std::span(image).first(image.size() - 2)));
    if (!calibration.read(image)) return;
    for (const double value : calibration.wrench({32767, -32768, 1, 0, -1, 32767})) {
        require(std::isfinite(value), "a wrench is a number");
    }
    std::array<jr3::Six, 6> inverse{};
    if (calibration.invert(inverse)) {
        calibration.raw({1e9, -1e9, 0, 1, 2, 3}, inverse);
    }
}

void node(std::span<const std::uint8_t> bytes) {
    Jr3Settings settings;
    settings.recording.assign(bytes.begin(), bytes.end());
    Jr3 jr3(std::move(settings));
    auto& device = jr3.make({.node_id = 0x50, .queue = 64, .auto_start = true});
    jr3.attach(device);
    jr3.boot(0);
    for (Time now = 0; now < 50 * millisecond; now += millisecond) {
        jr3.step(now);
        if (now % (5 * millisecond) == 0) {
            device.handle(Frame(0x80, {}), now);
        }
        device.poll(now);
        for (Frame f; device.out().pop(f);) {
            require(f.length <= 8 && f.id <= 0x7ff, "a frame that can be sent");
        }
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::span rest(data + 1, size - 1);
    if (data[0] % 3 == 0) {
        packets(rest);
    } else if (data[0] % 3 == 1) {
        memory(rest);
    } else {
        node(rest);
    }
    return 0;
}
