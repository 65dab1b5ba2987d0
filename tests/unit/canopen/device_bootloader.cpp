// SPDX-License-Identifier: MIT
#include <filesystem>

#include "canopen/device/bootloader/bootloader.hpp"
#include "canopen/device/bootloader/flash_file.hpp"
#include "device_bench.hpp"

namespace hal::canopen::test {
namespace {

constexpr std::uint8_t stop = 0;
constexpr std::uint8_t start = 1;
constexpr std::uint8_t clear = 3;
constexpr std::uint32_t busy = 1;  // bit 0 of 1F57h

struct BootloaderDevice : testing::Test {
    Bootloader device{BootloaderSettings{}};
    Bench bench{device};
    const std::vector<std::uint8_t> update = program_image(0x302, 0x00020001, 3000);
    void SetUp() override { bench.run(2 * millisecond); }

    Abort control(std::uint8_t what) {
        const auto why = bench.write(0x1f51, 1, what);
        bench.run(5 * millisecond);
        return why;
    }
    void stop_and_clear() {
        ASSERT_EQ(control(stop), Abort::none);
        ASSERT_EQ(control(clear), Abort::none);
        while ((bench.read<std::uint32_t>(0x1f57, 1) & 1) != 0) {
            bench.run(5 * millisecond);
        }
    }
    std::string software() {
        std::vector<std::uint8_t> text;
        bench.read(0x100a, 0, text);
        return {text.begin(), text.end()};
    }
};

TEST_F(BootloaderDevice, runs_its_initial_program_after_power_on) {
    EXPECT_TRUE(device.running());
    EXPECT_EQ(bench.read<std::uint32_t>(0x1018, 3), 0x00010000U);
    EXPECT_EQ(software(), "1.0");
    EXPECT_EQ(bench.read<std::uint8_t>(0x1f51, 1), 1);
    EXPECT_EQ(bench.read<std::uint32_t>(0x1f56, 1), crc32(device.flash()));
    EXPECT_EQ(bench.read<std::uint32_t>(0x1f57, 1), 0U);
}

TEST_F(BootloaderDevice, accepts_a_new_program_by_block_and_by_segmented_transfer) {
    for (const auto mode : {SdoMode::block, SdoMode::segmented}) {
        const auto image =
            program_image(0x302, mode == SdoMode::block ? 0x00020001 : 0x00030000, 5000);
        stop_and_clear();
        EXPECT_EQ(bench.read<std::uint32_t>(0x1018, 3), 0U);
        EXPECT_EQ(software(), "bootloader");
        EXPECT_EQ(bench.read<std::uint32_t>(0x1f57, 1), 1U << 1);  // no valid program
        ASSERT_EQ(bench.write(0x1f50, 1, image, mode), Abort::none);
        EXPECT_EQ(bench.read<std::uint32_t>(0x1f57, 1), 0U);
        EXPECT_EQ(bench.read<std::uint32_t>(0x1f56, 1), crc32(image));
        bench.forget();
        ASSERT_EQ(control(start), Abort::none);
        EXPECT_EQ(bench.sent(0x705).size(), 1U);  // boot-up
        EXPECT_EQ(bench.read<std::uint32_t>(0x1018, 3),
                  mode == SdoMode::block ? 0x00020001U : 0x00030000U);
        EXPECT_EQ(software(), mode == SdoMode::block ? "2.1" : "3.0");
    }
}

TEST_F(BootloaderDevice, rejects_commands_out_of_order) {
    EXPECT_EQ(bench.write(0x1f50, 1, update), Abort::device_state);  // the program runs
    EXPECT_EQ(control(clear), Abort::device_state);
    EXPECT_EQ(control(7), Abort::value);
    ASSERT_EQ(control(stop), Abort::none);
    EXPECT_EQ(bench.write(0x1f50, 1, update), Abort::device_state);  // not cleared
    EXPECT_EQ(bench.read<std::uint32_t>(0x1f57, 1), 4U << 1);
    ASSERT_EQ(control(clear), Abort::none);
    EXPECT_EQ(bench.read<std::uint32_t>(0x1f57, 1) & 1, 1U);  // for 20 ms
    EXPECT_EQ(bench.write(0x1f50, 1, update), Abort::device_state);
    bench.run(30 * millisecond);
    EXPECT_EQ(control(start), Abort::device_state);  // nothing to start
    EXPECT_EQ(bench.write(0x1f50, 1, update), Abort::none);
    EXPECT_EQ(control(start), Abort::none);
    EXPECT_TRUE(device.running());
    std::vector<std::uint8_t> back;
    EXPECT_EQ(bench.read(0x1f50, 1, back), Abort::write_only);
}

TEST_F(BootloaderDevice, does_not_start_a_damaged_program_or_one_of_another_product) {
    auto damaged = update;
    damaged[100] ^= 1;
    const struct {
        std::vector<std::uint8_t> image;
        std::uint32_t error;
    } cases[] = {{damaged, 3},
                 {program_image(0x303, 0x00020001, 100), 2},
                 {std::vector<std::uint8_t>(50, 7), 2}};
    for (const auto& c : cases) {
        stop_and_clear();
        EXPECT_EQ(bench.write(0x1f50, 1, c.image), Abort::cannot_store);
        EXPECT_EQ(bench.read<std::uint32_t>(0x1f57, 1), c.error << 1);
        EXPECT_EQ(control(start), Abort::device_state);
    }
    bench.node.power(false);
    bench.run(5 * millisecond);
    bench.node.power(true);
    bench.run(5 * millisecond);
    EXPECT_FALSE(device.running());
    EXPECT_EQ(software(), "bootloader");
    stop_and_clear();
    EXPECT_EQ(bench.write(0x1f50, 1, std::vector<std::uint8_t>((1 << 20) + 1)), Abort::too_long);
    EXPECT_EQ(bench.read<std::uint32_t>(0x1f57, 1), 6U << 1);
}

/// The device resets only after it has sent the response to the command; requests received before
/// the reset see it busy.
TEST_F(BootloaderDevice, reports_busy_in_1F57h_between_a_stop_command_and_its_reset) {
    const Frame stop_program(0x605, {0x2f, 0x51, 0x1f, 1, stop, 0, 0, 0}),
        read_status(0x605, {0x40, 0x57, 0x1f, 1, 0, 0, 0, 0});
    bench.forget();
    bench.send(stop_program);
    bench.send(read_status);
    bench.send(stop_program);
    bench.now += 100 * microsecond;
    bench.turn();
    const auto responses = bench.sent(0x585);
    ASSERT_EQ(responses.size(), 3U);
    EXPECT_EQ(responses[0].data[0], 0x60);
    EXPECT_EQ(load<std::uint32_t>(responses[1].data.data() + 4), busy);  // no error
    EXPECT_EQ(responses[2].data[0], 0x80);
    EXPECT_EQ(load<std::uint32_t>(responses[2].data.data() + 4),
              static_cast<std::uint32_t>(Abort::device_state));
    EXPECT_TRUE(device.running());
    EXPECT_TRUE(bench.sent(0x705).empty());

    bench.run(2 * millisecond);
    EXPECT_FALSE(device.running());
    EXPECT_EQ(bench.sent(0x705).size(), 1U);  // the boot-up message of the boot loader
    EXPECT_EQ(bench.read<std::uint32_t>(0x1f57, 1), 0U);
}

TEST_F(BootloaderDevice, accepts_a_download_after_an_aborted_one) {
    stop_and_clear();
    SdoRequest r{.index = 0x1f50, .sub = 1, .mode = SdoMode::segmented, .data = update};
    bench.remote().sdo().submit(r);
    bench.run(20 * millisecond);
    ASSERT_FALSE(r.done());
    EXPECT_GT(device.flash().size(), 20U);
    bench.remote().sdo().cancel(r);
    bench.run(5 * millisecond);
    EXPECT_EQ(device.error(), FlashError::wrong_data);
    EXPECT_EQ(control(start), Abort::device_state);
    ASSERT_EQ(bench.write(0x1f50, 1, update), Abort::none);
    ASSERT_EQ(control(start), Abort::none);
    EXPECT_EQ(device.version(), 0x00020001U);
}

TEST(FlashFile, reads_back_what_was_written) {
    const auto path = (std::filesystem::path(testing::TempDir()) / "flash-file-test").string();
    std::filesystem::remove(path);
    std::optional<std::vector<std::uint8_t>> image;
    EXPECT_EQ(read_flash(path, 100, image), "");
    EXPECT_FALSE(image.has_value());
    const std::vector<std::uint8_t> bytes{1, 2, 3};
    EXPECT_EQ(write_flash(path, bytes), "");
    EXPECT_EQ(read_flash(path, 3, image), "");
    EXPECT_EQ(image, bytes);
    EXPECT_EQ(read_flash(path, 2, image), "'" + path + "' is longer than the flash of 2 bytes");
    EXPECT_EQ(write_flash("/nowhere/flash", bytes),
              "cannot write '/nowhere/flash': No such file or directory");
    std::filesystem::remove(path);
    Bootloader empty(BootloaderSettings{.version = 0});
    EXPECT_FALSE(empty.running());
    EXPECT_EQ(crc32(std::span(reinterpret_cast<const std::uint8_t*>("123456789"), 9)), 0xcbf43926U);
}

}  // namespace
}  // namespace hal::canopen::test
