// SPDX-License-Identifier: MIT
// `hal can flash`: program download after CiA 302-3: stop the program, erase the flash, download,
// start, and check the result.
#include "bus/canopen/flash.hpp"

#include <cstring>
#include <fmt/core.h>
#include <unistd.h>

#include "bus/canopen/node_client.hpp"
#include "cli/output.hpp"

namespace hal::tools {

using canopen::SdoMode;
using canopen::SdoRequest;

namespace {

constexpr std::uint8_t stop_program = 0;
constexpr std::uint8_t start_program = 1;
constexpr std::uint8_t clear_program = 3;
// bit 0 of 1F57h; its error code when erased
constexpr std::uint32_t flash_busy = 1;
constexpr std::uint32_t no_valid_program = 1;
constexpr std::uint32_t any_error = 0xff;
constexpr std::int64_t between_looks = 100'000'000;
constexpr std::int64_t device_timeout_ns = 60'000'000'000;

const char* flash_error(std::uint32_t code) {
    constexpr const char* words[] = {"no error",
                                     "no valid program",
                                     "unknown data format",
                                     "wrong data or checksum",
                                     "flash not cleared before writing",
                                     "flash write error",
                                     "address error",
                                     "flash secured"};
    if (code < std::size(words)) return words[code];
    if (code == 63) return "unspecified error";
    return "manufacturer-specific error";
}

class Flash {
public:
    Flash(const FlashOptions& options, std::uint8_t node, std::uint8_t program,
          const std::string& image)
        : options_(options),
          station_(options, options.timeout_ns),
          node_(node),
          program_(program),
          image_(image) {}

    int run() {
        if (!station_.open(options_.words[0])) return 1;
        std::uint32_t running = 0;
        if (const Answer has = read(0x1f51, running); has == Answer::silent) {
            return report(0x1f51);
        } else if (has == Answer::refused) {
            return fail(options_, fmt::format("node {} has no program control 1F51:{} ({}): it "
                                              "does not support program download",
                                              node_, program_, canopen::to_string(last_.abort)));
        }
        if (!note("stopping the program") || !control(stop_program) || !settle("stop", any_error)) {
            return 1;
        }
        if (!note("erasing the flash") || !control(clear_program) ||
            !settle("erase", no_valid_program)) {
            return 1;
        }
        if (!note(fmt::format("downloading {} bytes", image_.size())) || !download() ||
            !settle("download", 0)) {
            return 1;
        }
        if (!note("starting the program") || !control(start_program)) return 1;
        return look();
    }

private:
    enum class Answer { value, refused, silent };

    bool note(const std::string& text) const {
        return print(fmt::format("node {}: {}\n", node_, text));
    }
    int report(std::uint16_t index) const {
        return station_.fail_transfer(node_, last_, fmt::format("{:04X}:{}", index, program_));
    }

    Answer read(std::uint16_t index, std::uint32_t& value) { return read(index, program_, value); }
    Answer read(std::uint16_t index, std::uint8_t sub, std::uint32_t& value) {
        std::uint8_t bytes[8] = {};
        last_ = {.index = index, .sub = sub, .upload = true, .buffer = bytes};
        const bool ok = station_.transfer(node_, last_);
        if (ok) {
            std::memcpy(&value, bytes, sizeof value);
        }
        if (ok) return Answer::value;
        if (last_.aborted_by_server) return Answer::refused;
        return Answer::silent;
    }
    /// Sends a command. A node that restarts into its boot loader may not respond; settle() finds
    /// out.
    bool control(std::uint8_t value) {
        last_ = {.index = 0x1f51, .sub = program_, .data = std::span(&value, 1)};
        if (station_.transfer(node_, last_) ||
            (!last_.aborted_by_server && !station_.bus.stop.requested())) {
            return true;
        }
        report(0x1f51);
        return false;
    }
    bool download() {
        last_ = {
            .index = 0x1f50,
            .sub = program_,
            .mode = options_.segmented ? SdoMode::segmented : SdoMode::automatic,
            .data = std::span(reinterpret_cast<const std::uint8_t*>(image_.data()), image_.size())};
        return station_.transfer(node_, last_) || (report(0x1f50), false);
    }
    /// Waits until 1F57h reports the flash ready. `allowed`: the error code that belongs to this
    /// step; any_error: ignores a stale one.
    bool settle(const char* step, std::uint32_t allowed) {
        for (const std::int64_t end = monotonic_ns() + device_timeout_ns;
             monotonic_ns() < end && !station_.bus.stop.requested();) {
            std::uint32_t status = 0;
            switch (read(0x1f57, status)) {
            // an optional object: only the responses to the commands are known
            case Answer::refused: return true;
            case Answer::silent: break;
            case Answer::value:
                if ((status & flash_busy) != 0) break;
                if (const std::uint32_t error = status >> 1 & 0x7f;
                    error != 0 && error != allowed && allowed != any_error) {
                    fail(options_,
                         fmt::format("node {}: {} failed: {} (1F57:{} = 0x{:08X}); the node has no "
                                     "valid program now; to retry, type the same command",
                                     node_, step, flash_error(error), program_, status));

                    return false;
                }
                return true;
            }
            station_.until([] { return false; }, between_looks);
        }
        fail(options_,
             fmt::format(
                 "node {}: {} {}; the node may have no valid program now", node_, step,
                 station_.bus.stop.requested() ? "interrupted" : "not finished within 60 s"));

        return false;
    }
    int look() {
        std::uint32_t running = 0;
        std::uint32_t id = 0;
        for (const std::int64_t end = monotonic_ns() + device_timeout_ns;
             monotonic_ns() < end && !station_.bus.stop.requested();) {
            station_.until([] { return false; }, between_looks);
            if (read(0x1f51, running) != Answer::value) {
                continue;  // starting
            }
            if ((running & 0xff) != start_program) {
                return fail(options_,
                            fmt::format("node {} did not start the program: 1F51:{} is {}", node_,
                                        program_, running & 0xff));
            }
            const bool has_id = read(0x1f56, id) == Answer::value;
            return note(has_id
                            ? fmt::format("program running, software identification 0x{:08X}", id)
                            : "program running")
                       ? 0
                       : 1;
        }
        return report(0x1f51);
    }

    const FlashOptions& options_;
    NodeClient station_;
    const std::uint8_t node_, program_;
    const std::string& image_;
    SdoRequest last_;
};

}  // namespace

int run_can_flash(const FlashOptions& options) {
    if (options.words.size() != 3) {
        return fail(options, "expected ADDRESS NODE IMAGE; type: hal can flash ADDRESS NODE IMAGE");
    }
    std::uint8_t node = 0;
    if (!node_of(options, options.words[1], node)) return 1;
    std::string image;
    if (!read_file(options.words[2], image)) {
        return fail(options, fmt::format("cannot read '{}': {}", options.words[2], image));
    }
    if (image.empty()) {
        return fail(options, fmt::format("'{}' is empty; the node is unchanged", options.words[2]));
    }
    return Flash(options, node, static_cast<std::uint8_t>(options.program_number), image).run();
}

}  // namespace hal::tools
