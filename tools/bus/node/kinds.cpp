// SPDX-License-Identifier: MIT
// `hal node KIND`: creates the device of each kind from the options.
#include "bus/node/kinds.hpp"

#include <fmt/core.h>
#include <stdexcept>

#include "bus/node/run.hpp"
#include "canopen/device/bootloader/bootloader.hpp"
#include "canopen/device/bootloader/flash_file.hpp"
#include "canopen/device/drive/axis_io.hpp"
#include "canopen/device/drive/drive_program.hpp"
#include "canopen/device/io/io.hpp"
#include "canopen/device/safety/safe_io.hpp"
#include "canopen/device/sensor/jr3.hpp"
#include "cli/output.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

/// Parses "2.1" to 0x00020001. Returns false for an invalid version.
bool parse_version(const std::string& text, std::uint32_t& version) {
    const std::string_view all = text;
    const auto point = std::min(all.find('.'), all.size() - 1);
    std::uint16_t major = 0;
    std::uint16_t minor = 0;
    const bool good =
        parse_whole(all.substr(0, point), major) && parse_whole(all.substr(point + 1), minor);
    version = std::uint32_t{major} << 16 | minor;
    return good;
}

/// Records the sensor's line to a file for the time of --for.
int record_line(const Jr3NodeOptions& options) {
    if (options.for_ns < 0) {
        return fail(options, "missing --for; add --for 2s, the calibration takes 1.02 s");
    }
    if (options.for_ns > 600'000'000'000) {
        return fail(
            options,
            "--for is too long; at most 10min, or the file would have hundreds of megabytes");
    }
    canopen::jr3::Calibration calibration;
    calibration.serial = options.serial;
    std::array<std::uint8_t, canopen::jr3::memory_size> memory{};
    calibration.write(memory);
    canopen::jr3::Generator line;
    line.set_memory(memory);
    line.set(canopen::jr3::supply_address, 24576);
    std::string bytes(static_cast<std::size_t>(static_cast<double>(options.for_ns) * 1e-9 *
                                               canopen::jr3::clock_hz / 8),
                      '\0');
    line.fill({reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size()});
    const std::string problem = canopen::write_flash(
        options.record, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    return problem.empty() ? 0 : fail(options, problem);
}

}  // namespace

int run_node_drive(const DriveNodeOptions& options) {
    canopen::DriveSettings settings;
    settings.axes = options.axes;
    settings.serial = options.serial;
    settings.heartbeat_ms = options.heartbeat_ms;
    for (const std::string& text : options.motor) {
        for (auto& axis : settings.axis) {
            if (const std::string problem = canopen::parse_motor(text, axis.motor);
                !problem.empty()) {
                return fail(options, problem);
            }
        }
    }
    constexpr std::uint16_t optional[] = {0x100c, 0x100d, 0x1016, 0x1029};
    for (const std::string& text : options.without) {
        std::uint16_t index = 0;
        if (!parse_whole(text, index, 16) ||
            !(std::find(std::begin(optional), std::end(optional), index) != std::end(optional) ||
              index % 0x800 == 0x6007 % 0x800)) {
            return fail(options, fmt::format("--without '{}': not an optional object of this "
                                             "drive; write 100C, 100D, 1016, 1029 or 6007 "
                                             "(6807, 7007 ... of further axes)",
                                             text));
        }
        settings.without.push_back(index);
    }
    canopen::DriveProgram program(settings);
    return run_node(options,
                    {"drive", "CiA 402, " + fmt::format("{} ax{}s", settings.axes,
                                                        settings.axes == 1 ? 'i' : 'e')},
                    program);
}

int run_node_io(const IoNodeOptions& options) {
    const IoNodeOptions& o = options;
    canopen::Io program(
        {o.inputs, o.outputs, o.analog_inputs, o.analog_outputs, o.serial, o.heartbeat_ms});
    const std::string what =
        fmt::format("CiA 401, {}, {}, {} and {}", counted(o.inputs, "digital input"),
                    counted(o.outputs, "output"), counted(o.analog_inputs, "analogue input"),
                    counted(o.analog_outputs, "output"));
    return run_node(options, {"io", what}, program);
}

int run_node_axis_io(const AxisIoNodeOptions& options) {
    const AxisIoNodeOptions& o = options;
    auto plant = canopen::make_plant(o.plant);
    if (!plant) {
        return fail(options, fmt::format("unknown plant '{}'; write one of: {}", o.plant,
                                         canopen::plant_names));
    }
    canopen::AxisIo program({o.serial, o.heartbeat_ms, o.input_stops}, std::move(plant));
    return run_node(
        options,
        {"axis-io", "control loop over the bus, " +
                        std::string(o.plant == "axis" ? "a slide on a screw" : "the pendulum rig")},
        program);
}

int run_node_safe_io(const NodeOptions& options) {
    canopen::SafeIo program({.serial = options.serial, .heartbeat_ms = options.heartbeat_ms});
    return run_node(options, {"safe-io", "EN 50325-5, 8 safety inputs and outputs, not certified"},
                    program);
}

int run_node_jr3(const Jr3NodeOptions& options) {
    if (!options.record.empty()) return record_line(options);
    canopen::Jr3Settings settings;
    settings.serial = settings.calibration.serial = options.serial;
    settings.heartbeat_ms = options.heartbeat_ms;
    if (!options.stream.empty()) {
        std::string bytes;
        if (!read_file(options.stream, bytes)) {
            return fail(options, fmt::format("cannot read '{}': {}", options.stream, bytes));
        }
        if (bytes.empty()) {
            return fail(
                options,
                fmt::format("'{}' is empty; expected the sensor's line, eight clocks per byte",
                            options.stream));
        }
        settings.recording.assign(bytes.begin(), bytes.end());
    }
    const std::string source =
        options.stream.empty() ? "a simulated sensor" : "the sensor's line in " + options.stream;
    canopen::Jr3 program(std::move(settings));
    return run_node(options, {"jr3", "CiA 404, six-axis force/torque sensor, " + source, 0x50},
                    program);
}

int run_node_bootloader(const BootloaderNodeOptions& options) {
    canopen::BootloaderSettings settings;
    settings.serial = options.serial;
    settings.heartbeat_ms = options.heartbeat_ms;
    const auto version = [&](const std::string& text, std::uint32_t& to) {
        return parse_version(text, to) ||
               (fail(options, fmt::format("invalid version '{}'; write 2.1", text)), false);
    };
    if (!options.image.empty()) {
        std::uint32_t wanted = 0;
        if (!version(options.image, wanted)) return 1;
        const auto image = canopen::program_image(settings.product, wanted, 20000);
        return exit_code(print({reinterpret_cast<const char*>(image.data()), image.size()}));
    }
    if (options.version == "none") {
        settings.version = 0;
    } else if (!version(options.version, settings.version)) {
        return 1;
    }
    if (!options.flash.empty()) {
        if (const std::string problem =
                canopen::read_flash(options.flash, settings.flash, settings.image);
            !problem.empty()) {
            return fail(options, problem);
        }
    }
    try {
        canopen::Bootloader program(std::move(settings));
        const auto keep = [&options, &program, kept = 0U]() mutable {
            if (program.changes() == kept || options.flash.empty()) return std::string();
            kept = program.changes();
            return canopen::write_flash(options.flash, program.flash());
        };
        return run_node(options, {"bootloader", "program download after CiA 302", 0, keep},
                        program);
    } catch (const std::invalid_argument& e) {
        return fail(options, e.what());
    }
}

}  // namespace hal::tools
