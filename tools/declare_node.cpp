// SPDX-License-Identifier: MIT
#include "declare_node.hpp"

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "base/types.hpp"
#include "options.hpp"

namespace hal::tools {

void for_how_long(CLI::App& app, Options& o, const char* what) {
    const auto take = [&o](const std::string& text) {
        const auto ns = parse_duration_ns(text, false);
        if (!ns || *ns < 0) throw CLI::ValidationError("--for", fmt::format("'{}' is not a duration; write 10s, 250ms or 2min", text));
        o.for_ns = *ns;
    };
    app.add_option_function<std::string>("--for", take, what)->type_name("TIME");
}

/// What every kind of simulated device takes.
void declare_node(CLI::App& app, Options& o) {
    NodeOptions& n = o.node;
    app.add_option("--link", n.link, "the bus: can:can0, udp:GROUP:PORT, slcan:/dev/ttyACM0, cane:enp3s0; options follow: ?bitrate=500k")
        ->type_name("ADDRESS");
    app.add_option("--id", n.id, "its node-id, 1-127 or 0x..; none: an LSS master gives it one")->type_name("N");
    app.add_flag("--eds", n.eds, "print its EDS and end");
    app.add_option("--fault", n.faults,
                   "what it does wrong: late-sdo, mute:from=5s:for=1s, twice:every=3 …; list: hal node faults; may be repeated")
        ->type_name("FAULT")
        ->allow_extra_args(false);
    app.add_option("--set", n.settings, "the world around it: NAME=VALUE, or NAME=VALUE@2s for later; may be repeated")
        ->type_name("NAME=VALUE")->allow_extra_args(false);
    app.add_option("--heartbeat", n.heartbeat_ms, "ms between heartbeats until a master says otherwise (default 0: none)")->type_name("MS");
    app.add_option("--serial", n.serial, "its serial number (default 1)")->type_name("N");
    app.add_flag("--start", n.starts_itself, "operational after boot-up without a master");
    app.add_option("--tdma", n.tdma,
                   "a TDMA station on the interface of --link cane:IF, by this schedule; auto: the master sends it (RTcfg)")
        ->type_name("FILE");
    app.add_option("--station", n.station, "its name in the schedule (default: the one with the interface's address)")->type_name("NAME");
    app.add_option("--tunnel", n.tunnel,
                   "an interface for ordinary packets, which leave in slot 1, as in hal0; its address is the schedule's ip")
        ->type_name("NAME");
    app.add_option("--skew", n.skew, "how much faster its clock is than this machine's, as in 200ppm")->type_name("PPM");
    app.add_option("--drift", n.drift, "how that changes in a second, as in 0.1ppm")->type_name("PPM");
    for_how_long(app, o, "end after 10s, 2min …; without it: until Ctrl-C");
}

void declare_node_drive(CLI::App& app, Options& o) {
    declare_node(app, o);
    app.add_option("--axes", o.node.axes, "1-8 (default 1)")->check(CLI::Range(1, 8).description(""))->type_name("N");
    app.add_option("--motor", o.node.motor, "of all axes: NAME:VALUE, as in inertia:1e-4,resolution:8192,endless:1; may be repeated")
        ->type_name("NAME:VALUE")->allow_extra_args(false);
}

void declare_node_io(CLI::App& app, Options& o) {
    declare_node(app, o);
    NodeOptions& n = o.node;
    app.add_option("--inputs", n.inputs, "digital inputs, 0-64 (default 64)")->check(CLI::Range(0, 64).description(""))->type_name("N");
    app.add_option("--outputs", n.outputs, "digital outputs, 0-64 (default 64)")->check(CLI::Range(0, 64).description(""))->type_name("N");
    app.add_option("--analog-inputs", n.analog_inputs, "0-12 (default 12)")->check(CLI::Range(0, 12).description(""))->type_name("N");
    app.add_option("--analog-outputs", n.analog_outputs, "0-12 (default 12)")->check(CLI::Range(0, 12).description(""))->type_name("N");
}

void declare_node_axis_io(CLI::App& app, Options& o) {
    declare_node(app, o);
    app.add_option("--plant", o.node.plant, "what it drives: axis, a slide on a screw (default), or furuta, the pendulum rig")
        ->type_name("NAME");
    app.add_flag("--input-stops", o.node.input_stops, "an open input is a fault from the beginning");
}

void declare_node_jr3(CLI::App& app, Options& o) {
    declare_node(app, o);
    app.add_option("--stream", o.node.stream, "the sensor's line from this file, eight clocks to a byte, over and over")->type_name("FILE");
    app.add_option("--record", o.node.record, "write the line of a simulated sensor for the time of --for into this file, and end")
        ->type_name("FILE");
}

void declare_node_bootloader(CLI::App& app, Options& o) {
    declare_node(app, o);
    app.add_option("--program", o.node.version, "version of the program it comes with (default 1.0); none: its flash is empty")
        ->type_name("VERSION");
    app.add_option("--flash", o.node.flash, "keeps the flash from run to run")->type_name("FILE");
    app.add_option("--make-image", o.node.image, "print a program of this version, to be downloaded, and end")->type_name("VERSION");
}

void declare_node_faults(CLI::App&, Options&) {}

}  // namespace hal::tools
