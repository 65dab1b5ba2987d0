// SPDX-License-Identifier: MIT
// `hal node`: a command per kind of device.
#pragma once

#include <string>
#include <vector>

#include "bus/node/node_options.hpp"

namespace hal::tools {

struct DriveNodeOptions : NodeOptions {
    unsigned axes = 1;
    std::vector<std::string> motor, without;

    void declare(OptionSet& set) override {
        NodeOptions::declare(set);
        set.value("--axes", axes, "N", "number of axes, 1..8 (default 1)").quietly_in(1, 8);
        set.values("--without", without, "INDEX",
                   "omit an optional object, in hex: 1016, 6007; may be repeated");
        set.values("--motor", motor, "NAME:VALUE",
                   "motor parameters of all axes, as in inertia:1e-4,resolution:8192,endless:1; "
                   "may be repeated");
    }
};

struct IoNodeOptions : NodeOptions {
    unsigned inputs = 64;
    unsigned outputs = 64;
    unsigned analog_inputs = 12;
    unsigned analog_outputs = 12;

    void declare(OptionSet& set) override {
        NodeOptions::declare(set);
        set.value("--inputs", inputs, "N", "digital inputs, 0..64 (default 64)").quietly_in(0, 64);
        set.value("--outputs", outputs, "N", "digital outputs, 0..64 (default 64)")
            .quietly_in(0, 64);
        set.value("--analog-inputs", analog_inputs, "N", "analogue inputs, 0..12 (default 12)")
            .quietly_in(0, 12);
        set.value("--analog-outputs", analog_outputs, "N", "analogue outputs, 0..12 (default 12)")
            .quietly_in(0, 12);
    }
};

struct AxisIoNodeOptions : NodeOptions {
    std::string plant = "axis";
    bool input_stops = false;

    void declare(OptionSet& set) override {
        NodeOptions::declare(set);
        set.value(
            "--plant", plant, "NAME",
            "simulated plant: axis, a slide on a screw (default), or furuta, the pendulum rig");
        set.flag("--input-stops", input_stops, "an open input is a fault (object 2111h)");
    }
};

struct Jr3NodeOptions : NodeOptions {
    std::string stream, record;  ///< files

    void declare(OptionSet& set) override {
        NodeOptions::declare(set);
        set.value("--stream", stream, "FILE",
                  "play the sensor's line from this file, eight clocks per byte, repeated");
        set.value(
            "--record", record, "FILE",
            "record the line of a simulated sensor to this file for the time of --for, and end");
    }
};

struct BootloaderNodeOptions : NodeOptions {
    std::string flash, version = "1.0", image;

    void declare(OptionSet& set) override {
        NodeOptions::declare(set);
        set.value("--program", version, "VERSION",
                  "version of the initial program (default 1.0); none: empty flash");
        set.value("--flash", flash, "FILE", "file that keeps the flash between runs");
        set.value("--make-image", image, "VERSION",
                  "print a program image of this version for download, and end");
    }
};

/// Run a device of each kind. Each returns the exit code.
int run_node_drive(const DriveNodeOptions&);
int run_node_io(const IoNodeOptions&);
int run_node_axis_io(const AxisIoNodeOptions&);
int run_node_safe_io(const NodeOptions&);
int run_node_jr3(const Jr3NodeOptions&);
int run_node_bootloader(const BootloaderNodeOptions&);
int run_node_faults(const Options&);

}  // namespace hal::tools
