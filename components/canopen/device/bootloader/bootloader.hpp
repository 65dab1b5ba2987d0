// SPDX-License-Identifier: MIT
// A device with a boot loader (CiA 302): program download (1F50h), program control (1F51h),
// software identification (1F56h) and flash status (1F57h). After an update its revision number and
// software version are those of the new program.
#pragma once

#include <optional>
#include <vector>

#include "canopen/device/program.hpp"

namespace hal::canopen {

/// Header of an image, 20 bytes before the program. All numbers are little endian.
struct ProgramHeader {
    static constexpr std::size_t size = 20;
    static constexpr std::uint32_t signature = 0x50434c48;  ///< "HLCP"
    /// `length` in bytes, CRC-32 of the bytes after the header
    std::uint32_t product = 0;
    std::uint32_t version = 0;
    std::uint32_t length = 0;
    std::uint32_t crc = 0;
};
/// Returns the CRC-32 of Ethernet and zip; object 1F56h is that of the whole image. [any]
std::uint32_t crc32(std::span<const std::uint8_t>) noexcept;
/// Returns an image with `length` bytes of program; version 0x00020001 is 2.1. [any, not real time]
std::vector<std::uint8_t> program_image(std::uint32_t product, std::uint32_t version,
                                        std::size_t length);

struct BootloaderSettings {
    std::uint32_t product = 0x302;
    std::uint32_t serial = 1;
    std::uint32_t version = 0x00010000;  ///< of the initial program; 0: the flash is empty
    std::size_t flash = 1 << 20;  ///< capacity in bytes
    Time erase = 20 * millisecond;  ///< time to clear the flash, ns
    std::uint16_t heartbeat_ms = 0;
    /// initial content of the flash, instead of a program
    std::optional<std::vector<std::uint8_t>> image{};
};

/// Error codes in bits 1..7 of 1F57h (CiA 302); bit 0 is busy.
enum class FlashError : std::uint8_t {
    none = 0,
    no_program = 1,
    unknown_format = 2,
    wrong_data = 3,
    not_cleared = 4,
    write_error = 5,
    address = 6,
    secured = 7,
};

/// The device. All functions are called by the thread that turns its Node.
class Bootloader final : public Program {
public:
    /// Creates the device. Throws std::invalid_argument when the image is longer than the flash.
    /// [setup]
    explicit Bootloader(BootloaderSettings);

    /// Returns true while the program runs, false while the boot loader runs, which accepts a new
    /// program. [realtime]
    bool running() const noexcept { return running_; }
    /// Returns the version of the program in the flash, 0 without a valid one. [realtime]
    std::uint32_t version() const noexcept { return running_ || valid() ? header_.version : 0; }
    /// Returns the error of 1F57h. [realtime]
    FlashError error() const noexcept { return error_; }
    /// Returns the content of the flash. [realtime]
    std::span<const std::uint8_t> flash() const noexcept { return {flash_.data(), used_}; }
    /// Counts the changes of the flash; when it has changed, write_flash() is due. [realtime]
    unsigned changes() const noexcept { return changes_; }

    Description description() const override;
    void attach(Device&) override;
    void boot(Time now) noexcept override;
    void step(Time now) noexcept override;
    std::string summary() const override;
    void on_reset(bool application) noexcept override;
    Abort reading(Entry&) noexcept override;
    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override;

private:
    class Flash final : public Stream {
    public:
        explicit Flash(Bootloader& device) : device_(device) {}
        Abort open_read(Entry&, std::uint32_t&) noexcept override { return Abort::write_only; }
        Abort read(Entry&, std::uint32_t, std::span<std::uint8_t>) noexcept override {
            return Abort::write_only;
        }
        Abort open_write(Entry&, std::uint32_t size) noexcept override;
        Abort write(Entry&, std::uint32_t offset, std::span<const std::uint8_t>) noexcept override;
        Abort close(Entry&, bool writing, bool whole) noexcept override;

    private:
        Bootloader& device_;
    };

    bool valid() const noexcept { return error_ == FlashError::none && used_ != 0; }
    void examine() noexcept;
    void show() noexcept;
    bool busy() const noexcept { return wants_reset_ || writing_ || erasing_; }

    const BootloaderSettings settings_;
    std::vector<std::uint8_t> flash_;
    std::size_t used_ = 0;
    ProgramHeader header_;
    std::uint32_t identification_ = 0;
    FlashError error_ = FlashError::no_program;
    bool running_ = false;
    bool writing_ = false;
    bool erasing_ = false;
    bool wants_reset_ = false;

    bool starts_ = false;
    bool broken_off_ = false;  // a download was; it may be begun anew
    Time now_ = 0;
    Time erased_at_ = 0;
    unsigned changes_ = 0;
    Flash stream_{*this};
};

}  // namespace hal::canopen
