// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "canopen/device/sensor/jr3.hpp"
#include "device_bench.hpp"

namespace hal::canopen::test {
namespace {

using namespace jr3;

std::vector<Packet> decoded(Decoder& decoder, std::span<const std::uint8_t> bytes) {
    std::vector<Packet> packets;
    for (const auto byte : bytes) {
        for (int bit = 7; bit >= 0; --bit) {
            if (decoder.take((byte >> bit & 1) != 0)) {
                packets.push_back(decoder.packet());
            }
        }
    }
    return packets;
}

std::vector<std::uint8_t> line(Generator& generator, std::size_t bytes) {
    std::vector<std::uint8_t> buffer(bytes);
    generator.fill(buffer);
    return buffer;
}

TEST(Jr3Stream, gives_back_what_went_in) {
    Generator generator;
    const std::int16_t values[] = {24576, -1, 0, 32767, -32768, 0x0ff8, 0x7fe0};
    for (unsigned n = 0; n < 7; ++n) {
        generator.set(n, values[n]);
    }
    Decoder decoder;
    const auto packets = decoded(decoder, line(generator, packet_clocks * addresses * 10 / 8));
    ASSERT_EQ(packets.size(), 159U);  // the first one only shows where packets begin
    EXPECT_EQ(decoder.errors(), 0U);
    for (std::size_t n = 0; n < packets.size(); ++n) {
        const auto address = (n + 1) % addresses;
        EXPECT_EQ(packets[n].address, address);
        if (address < 7) {
            EXPECT_EQ(packets[n].value, values[address]);
        }
    }
}

TEST(Jr3Stream, is_found_from_wherever_it_is_heard) {
    Generator generator;
    // pulses in the data
    for (unsigned n = 0; n < addresses; ++n) {
        generator.set(n, static_cast<std::int16_t>(0xffe7 << (n % 3)));
    }
    const auto bytes = line(generator, 4000);
    for (std::size_t from = 0; from < 200; ++from) {
        Decoder decoder;
        const auto packets = decoded(decoder, std::span(bytes).subspan(from));
        ASSERT_GT(packets.size(), 880U) << from;
        for (std::size_t n = 1; n < packets.size(); ++n) {
            ASSERT_EQ(packets[n].address, (packets[n - 1].address + 1) % addresses) << from;
        }
    }
}

TEST(Jr3Stream, loses_little_to_a_disturbed_bit) {
    Generator generator;
    for (unsigned n = 0; n < 7; ++n) {
        generator.set(n, static_cast<std::int16_t>(1000 * static_cast<int>(n)));
    }
    auto bytes = line(generator, 10000);
    const auto all = bytes.size() * 8 / packet_clocks;
    for (std::size_t at = 500; at < bytes.size(); at += 500) {
        bytes[at] ^= 0x10;
    }
    Decoder decoder;
    const auto packets = decoded(decoder, bytes);
    EXPECT_GT(packets.size(), all - 19 * 4);
    std::size_t wrong = 0;
    for (const auto& p : packets) {
        wrong += p.address < 7 && p.value != 1000 * p.address;
    }
    EXPECT_LE(wrong, 19U);
}

TEST(Jr3Stream, that_stands_still_gives_nothing) {
    Decoder decoder;
    for (int n = 0; n < 1000; ++n) {
        EXPECT_FALSE(decoder.take(true));
    }
    for (int n = 0; n < 1000; ++n) {
        EXPECT_FALSE(decoder.take(false));
    }
    EXPECT_EQ(decoder.packets(), 0U);
}

TEST(Jr3Calibration, comes_through_the_stream_whole) {
    Calibration calibration;
    calibration.serial = 77;
    std::array<std::uint8_t, memory_size> memory{};
    calibration.write(memory);
    Generator generator;
    generator.set_memory(memory);
    const auto begin = line(generator, 1000);  // it is heard from the middle
    Decoder decoder;
    MemoryReader reader;
    Calibration read;
    read.matrix[2][3] = 9;
    std::size_t found = 0;
    const auto bytes = line(generator, packet_clocks * addresses * memory_size * 2 / 8);
    for (const auto& p : decoded(decoder, bytes)) {
        if (p.address == calibration_address && reader.take(static_cast<std::uint16_t>(p.value))) {
            ++found;
            EXPECT_TRUE(read.read(reader.memory()));
        }
    }
    EXPECT_EQ(found, 1U);
    EXPECT_EQ(read.serial, 77U);
    EXPECT_NEAR(read.matrix[2][3], calibration.matrix[2][3], 1e-6);
    memory[100] ^= 1;
    EXPECT_FALSE(read.read(memory));
}

TEST(Jr3Calibration, decouples_what_was_coupled) {
    const Calibration calibration;
    std::array<Six, 6> inverse;
    ASSERT_TRUE(calibration.invert(inverse));
    for (unsigned axis = 0; axis < 6; ++axis) {
        Six wrench{};
        wrench[axis] = 0.7 * calibration.full_scale[axis];
        const auto back = calibration.wrench(calibration.raw(wrench, inverse));
        for (unsigned n = 0; n < 6; ++n) {
            EXPECT_NEAR(back[n], wrench[n], calibration.full_scale[n] / 4000) << axis << n;
        }
    }
    Calibration singular;
    singular.matrix[1] = singular.matrix[0];
    EXPECT_FALSE(singular.invert(inverse));
    Jr3Settings settings;
    settings.calibration = singular;
    EXPECT_THROW(Jr3{settings}, std::invalid_argument);
}

struct Jr3Node : testing::Test {
    Jr3 jr3{Jr3Settings{}};
    Bench bench{jr3, {.node_id = 0x50}};
    static int value(const Frame& f, unsigned n) {
        return load<std::int16_t>(f.data.data() + 2 * n);
    }
};

TEST_F(Jr3Node, sends_forces_and_torques_of_one_sample_at_each_SYNC) {
    jr3.set_wrench({10, -20, 50, 0.5, -1, 2});
    bench.start();
    bench.run(20 * millisecond);
    bench.forget();
    for (int n = 0; n < 5; ++n) {
        bench.run(millisecond);
        bench.sync();
    }
    const auto forces = bench.sent(0x2d0);
    const auto torques = bench.sent(0x4d0);
    ASSERT_EQ(forces.size(), 5U);
    ASSERT_EQ(torques.size(), 5U);
    EXPECT_NEAR(value(forces[4], 0), 1000, 3);
    EXPECT_NEAR(value(forces[4], 1), -2000, 3);
    EXPECT_NEAR(value(forces[4], 2), 5000, 5);
    EXPECT_NEAR(value(torques[4], 0), 500, 2);
    EXPECT_NEAR(value(torques[4], 1), -1000, 2);
    EXPECT_NEAR(value(torques[4], 2), 2000, 2);
    for (unsigned n = 0; n < 5; ++n) {
        EXPECT_EQ(forces[n].data[7], torques[n].data[7]);
    }
    EXPECT_NE(forces[0].data[7], forces[1].data[7]);
    EXPECT_TRUE(bench.sent(0x1d0).empty() && bench.sent(0x3d0).empty());  // closed
}

TEST_F(Jr3Node, opens_and_closes_the_PDOs_of_changes_over_SDO) {
    bench.start();
    bench.run(20 * millisecond);
    ASSERT_EQ(bench.write<std::uint32_t>(0x1800, 1, 0x1d0), Abort::none);
    bench.run(20 * millisecond);
    bench.forget();
    bench.run(50 * millisecond);
    EXPECT_TRUE(bench.sent(0x1d0).empty());  // nothing changes
    jr3.set_wrench({25, 0, 0, 0, 0, 0});
    bench.run(10 * millisecond);
    ASSERT_FALSE(bench.sent(0x1d0).empty());
    EXPECT_NEAR(value(bench.sent(0x1d0).back(), 0), 2500, 3);
    EXPECT_TRUE(bench.sent(0x3d0).empty());
    ASSERT_EQ(bench.write<std::int16_t>(0x7133, 1, 100), Abort::none);  // 1 N
    bench.forget();
    jr3.set_wrench({25.5, 0, 0, 0, 0, 0});
    bench.run(10 * millisecond);
    EXPECT_TRUE(bench.sent(0x1d0).empty());
    jr3.set_wrench({27, 0, 0, 0, 0, 0});
    bench.run(10 * millisecond);
    EXPECT_EQ(bench.sent(0x1d0).size(), 1U);
    ASSERT_EQ(bench.write<std::uint32_t>(0x1800, 1, 0x800001d0), Abort::none);
    bench.forget();
    jr3.set_wrench({40, 0, 0, 0, 0, 0});
    bench.run(10 * millisecond);
    EXPECT_TRUE(bench.sent(0x1d0).empty());
}

TEST_F(Jr3Node, sends_at_SYNC_what_changed_with_type_0) {
    bench.start();
    bench.run(20 * millisecond);
    ASSERT_EQ(bench.write<std::uint8_t>(0x1801, 2, 0), Abort::none);
    bench.sync();
    bench.run(2 * millisecond);
    bench.forget();
    for (int n = 0; n < 3; ++n) {
        bench.sync();
        bench.run(2 * millisecond);
    }
    EXPECT_TRUE(bench.sent(0x2d0).empty());
    jr3.set_wrench({0, 30, 0, 0, 0, 0});
    bench.run(5 * millisecond);
    EXPECT_TRUE(bench.sent(0x2d0).empty());
    for (int n = 0; n < 3; ++n) {
        bench.sync();
        bench.run(2 * millisecond);
    }
    ASSERT_EQ(bench.sent(0x2d0).size(), 1U);
    EXPECT_NEAR(value(bench.sent(0x2d0)[0], 1), 3000, 3);
}

TEST_F(Jr3Node, reads_its_calibration_from_the_stream_and_shows_it) {
    bench.start();
    std::vector<std::uint8_t> memory;
    EXPECT_EQ(bench.read(0x2104, 0, memory), Abort::no_data);
    bench.run(1100 * millisecond);
    EXPECT_TRUE(jr3.calibrated());
    ASSERT_EQ(bench.read(0x2104, 0, memory, SdoMode::block), Abort::none);
    ASSERT_EQ(memory.size(), memory_size);
    Calibration read;
    EXPECT_TRUE(read.read(std::span<const std::uint8_t, memory_size>(memory.data(), memory_size)));
    EXPECT_NEAR(bench.read<float>(0x2100, 1), 1.02F, 1e-6F);
    EXPECT_EQ(bench.read<float>(0x2101, 3), 200.0F);
    EXPECT_NEAR(bench.read<float>(0x2102, 6), 15.8F, 1e-4F);
}

TEST_F(Jr3Node, warns_of_overload_supply_and_a_lost_sensor) {
    bench.start();
    bench.run(20 * millisecond);
    EXPECT_EQ(bench.remote().emergencies(), 0U);
    jr3.set_wrench({0, 0, 210, 0, 0, 0});
    bench.run(5 * millisecond);
    EXPECT_EQ(bench.remote().emergency(0).code, jr3_error::overload);
    EXPECT_EQ(bench.remote().emergency(0).manufacturer[0], 0x04);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6150, 3), 2);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6150, 2), 0);
    jr3.set_wrench({0, 0, 195, 0, 0, 0});
    bench.run(5 * millisecond);
    EXPECT_EQ(bench.remote().emergencies(), 1U);  // not below 95 % yet
    jr3.set_wrench({0, 0, 100, 0, 0, 0});
    bench.run(5 * millisecond);
    EXPECT_EQ(bench.remote().emergency(0).code, 0);
    jr3.set_supply(0.6);
    bench.run(5 * millisecond);
    EXPECT_EQ(bench.remote().emergency(0).code, jr3_error::supply);
    jr3.set_supply(0.75);
    bench.run(5 * millisecond);
    jr3.set_cable(false);
    bench.run(20 * millisecond);
    EXPECT_EQ(bench.remote().emergency(0).code, jr3_error::no_signal);
    EXPECT_EQ(bench.read<std::uint8_t>(0x2201, 0) & jr3_status::no_signal, jr3_status::no_signal);
    jr3.set_cable(true);
    bench.run(20 * millisecond);
    EXPECT_EQ(bench.remote().emergency(0).code, 0);
}

TEST_F(Jr3Node, saturates_when_a_load_is_NaN_or_infinite) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    constexpr double infinite = std::numeric_limits<double>::infinity();
    jr3.set_noise(20);
    bench.start();
    bench.run(20 * millisecond);
    EXPECT_EQ(bench.remote().emergencies(), 0U);
    for (const double load : {nan, infinite, -infinite}) {
        jr3.set_wrench({0, 0, load, 0, 0, 0});
        bench.run(5 * millisecond);
        constexpr unsigned both = jr3_status::saturated | jr3_status::overload;
        EXPECT_EQ(bench.read<std::uint8_t>(0x2201, 0) & both, both) << load;
        EXPECT_EQ(bench.remote().emergency(0).code, jr3_error::overload);
        EXPECT_NE(bench.remote().emergency(0).manufacturer[0] & 0x04, 0) << load;
        EXPECT_NE(bench.read<std::uint8_t>(0x6150, 3), 0) << load;
        EXPECT_GT(std::abs(jr3.wrench()[2]), 190.0) << load;
        jr3.set_wrench({0, 0, 0, 0, 0, 0});
        bench.run(5 * millisecond);
        EXPECT_EQ(bench.read<std::uint8_t>(0x2201, 0) & both, 0U) << load;
        EXPECT_EQ(bench.remote().emergency(0).code, 0);
    }
}

TEST_F(Jr3Node, is_zeroed_and_tared) {
    jr3.set_wrench({12, 0, 0, 0, 0, 0});
    bench.start();
    bench.run(20 * millisecond);
    EXPECT_EQ(bench.write<std::uint32_t>(0x6139, 1, 0x12345678), Abort::cannot_store);
    EXPECT_EQ(bench.write<std::uint32_t>(0x6139, 1, 0x65726174), Abort::none);  // "tare"
    bench.run(2 * millisecond);
    EXPECT_NEAR(bench.read<float>(0x6140, 1), 0.0F, 0.01F);
    EXPECT_NEAR(bench.read<float>(0x6130, 1), 12.0F, 0.03F);
    EXPECT_EQ(bench.write<std::uint32_t>(0x6125, 1, 0x6f72657a), Abort::none);  // "zero"
    bench.run(2 * millisecond);
    EXPECT_NEAR(bench.read<float>(0x6130, 1), 0.0F, 0.01F);
    EXPECT_EQ(bench.write<float>(0x6126, 2, 2.0F), Abort::none);
    jr3.set_wrench({12, 10, 0, 0, 0, 0});
    bench.run(5 * millisecond);
    EXPECT_NEAR(bench.read<std::int16_t>(0x7130, 2), 2000, 6);
    EXPECT_NEAR(bench.read<std::int32_t>(0x9130, 2), 2000, 6);
}

TEST_F(Jr3Node, blinks_in_pre_operational) {
    bench.run(10 * millisecond);
    int changes = 0;
    for (int n = 0; n < 100; ++n) {
        const bool was = jr3.led();
        bench.run(10 * millisecond);
        changes += jr3.led() != was;
    }
    EXPECT_EQ(changes, 5);  // a second
    bench.command(NmtCommand::start);
    EXPECT_TRUE(jr3.led());
    bench.command(NmtCommand::stop);
    EXPECT_FALSE(jr3.led());
}

TEST(Jr3Recording, is_decoded_over_and_over) {
    Generator generator;
    const Calibration calibration;
    std::array<Six, 6> inverse;
    ASSERT_TRUE(calibration.invert(inverse));
    const auto raw = calibration.raw({1, 2, 3, 0.1, 0.2, 0.3}, inverse);
    for (unsigned n = 0; n < 6; ++n) {
        generator.set(n + 1, raw[n]);
    }
    generator.set(supply_address, 24576);
    Jr3Settings settings;
    settings.recording = line(generator, packet_clocks * addresses / 8 * 4);
    Jr3 jr3(settings);
    Bench bench(jr3, {.node_id = 0x50});
    bench.start();
    bench.run(100 * millisecond);
    for (unsigned n = 0; n < 3; ++n) {
        EXPECT_NEAR(jr3.wrench()[n], 1.0 + n, 0.02);
    }
    EXPECT_NEAR(static_cast<double>(jr3.decoder().packets()), 0.1 * clock_hz / packet_clocks, 400);
    EXPECT_EQ(jr3.decoder().errors(), 0U);
}

}  // namespace
}  // namespace hal::canopen::test
