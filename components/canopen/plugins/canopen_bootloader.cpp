// SPDX-License-Identifier: MIT
#include <cstdio>

#include "canopen/device/bootloader/bootloader.hpp"
#include "canopen/device/bootloader/flash_file.hpp"
#include "canopen/device/component.hpp"

namespace {

using namespace hal::canopen;

struct CanopenBootloader final : NodeComponent {
    explicit CanopenBootloader(const hal_host* host) : NodeComponent(host, 4) {}

    hal::Argument version{*this,
                          "version",
                          0x10000,
                          "version of the initial program, 0x00020001 is 2.1; 0: empty flash",
                          {.min = 0, .max = 0xffffffffLL}};
    hal::TextArgument flash{
        *this, "flash", "",
        "file that keeps the flash between runs; written when the component stops"};

    hal::Function run{*this, "update", &CanopenBootloader::update, "receives and sends frames"};

    hal::Out<bool> running{*this, "running", "true: the program runs; false: the boot loader runs"};
    hal::Out<std::uint32_t> program_version{
        *this, "program-version", "version of the program in the flash; 0: no valid program"};
    hal::Out<std::uint32_t> flash_error{
        *this, "flash-error",
        "error of 1F57h: 0 none, 1 no program, 2 unknown format, 3 damaged, 4 not cleared, 5 write "
        "error, 6 too long, 7 secured"};

    void update(hal::Cycle cycle) noexcept {
        turn(cycle);
        running = node().powered() && bootloader_->running();
        program_version = bootloader_->version();
        flash_error = static_cast<std::uint32_t>(bootloader_->error());
    }
    void stop() noexcept {
        if (bootloader_ && bootloader_->changes() != 0 && !flash.get().empty()) {
            if (const auto problem = write_flash(flash.get(), bootloader_->flash());
                !problem.empty()) {
                std::fprintf(stderr, "canopen_bootloader: %s\n", problem.c_str());
            }
        }
        NodeComponent::stop();
    }

private:
    Program& program() override {
        BootloaderSettings settings;
        settings.serial = serial();
        settings.heartbeat_ms = heartbeat();

        settings.version = static_cast<std::uint32_t>(version);
        if (!flash.get().empty()) {
            if (const auto problem = read_flash(flash.get(), settings.flash, settings.image);
                !problem.empty()) {
                throw std::runtime_error(problem);
            }
        }
        bootloader_ = std::make_unique<Bootloader>(std::move(settings));
        return *bootloader_;
    }
    std::unique_ptr<Bootloader> bootloader_;
};

}  // namespace

HAL_COMPONENT(CanopenBootloader, "canopen_bootloader",
              "Simulated CANopen device with a boot loader for program download", R"(
Objects 1F50h (program data), 1F51h (program control: 0 stop, 1 start, 2 reset, 3 clear), 1F56h
(software identification: the CRC-32 of the image) and 1F57h (flash status) of CiA 302. To update
the program a master stops it, clears the flash, waits until 1F57h is not busy, writes the image and
starts it. The device then boots with the revision number (1018h:3) and software version (100Ah) of
the new program.

An image is a 20-byte header followed by the program. The header is `HLCP`, product code 0x302,
version, length and CRC-32 of the program, all little endian. `hal node bootloader --make-image 2.1`
prints one.

    loadrt canopen_bootloader link=sim:arm id=4
    addf canopen-bootloader.0.update servo
    start
)")
