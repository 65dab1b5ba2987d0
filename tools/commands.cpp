// SPDX-License-Identifier: MIT
// A row per subcommand, and what its options are; those of `hal node` are in declare_node.cpp. No other source includes CLI11.
#include "commands.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fmt/core.h>
#include <optional>
#include <unistd.h>

#include "base/diagnostic.hpp"
#include "base/types.hpp"
#include "declare_node.hpp"
#include "options.hpp"
#include "paths.hpp"
#include "say.hpp"

namespace hal::tools {

namespace {

struct Subcommand {
    const char* name;     ///< more than one word in a group: "can dump"
    const char* usage;    ///< what may follow the name
    const char* summary;
    int (*run)(const Options&);  ///< nullptr: in hal-bus
    void (*declare)(CLI::App&, Options&);
    bool verbatim = false;  ///< from the first word on everything belongs to the words, `-1` and `--` too
};

void words(CLI::App& app, Options& o, const char* name, const char* what, bool required = true) {
    CLI::Option* option = app.add_option(name, o.words, what);
    if (required) option->required();
}

void named(CLI::App& app, Options& o, const char* what) { app.add_option("-N,--name", o.name, what)->type_name("NAME"); }

void netlists(CLI::App& app, Options& o) {
    app.add_option("-i,--ini", o.ini, "where [SECTION]KEY is looked up")->type_name("FILE");
    app.add_flag("-k,--keep-going", o.keep_going, "go on after an error, command by command, as halcmd -k does");
}

void declare_run(CLI::App& app, Options& o) {
    words(app, o, "FILE", "netlists (.hal), or an INI file whose [HAL]HALFILE names them", false);
    app.add_flag("-I,--interactive", o.interactive, "open the shell after loading; leaving it ends the run");
    for_how_long(app, o, "stop after 10s, 250ms, 2min …; without it: until Ctrl-C");
    named(app, o, "of this instance, when several run on one machine (default: default)");
    netlists(app, o);
    app.add_flag("--no-picture", o.no_picture, "no live picture in the terminal");
    app.add_option("--node", o.part, "of a netlist for several machines: load the part of this one")->type_name("NAME");
    app.add_option("--dds", o.dds, "how nodes meet: interfaces=ADDRESS domain=N peers=… (default: on this machine only)")->type_name("SETTINGS");
}

void declare_sim(CLI::App& app, Options& o) {
    words(app, o, "FILE", "netlists (.hal), or an INI file whose [HAL]HALFILE names them");
    for_how_long(app, o, "advance the virtual clock by 10s, 250ms … after loading");
    app.add_option("--cycles", o.cycles, "advance by so many cycles of the fastest thread after loading")->type_name("N");
    named(app, o, "of the instance");
    netlists(app, o);
    app.add_flag("--report", o.report, "print the timing report on stderr at the end");
    app.add_option("--node", o.part, "of a netlist for several machines: this one alone; without it all of them together")->type_name("NAME");
    app.add_option("-e,--execute", o.execute, "execute this command at the end; of several machines: 'NODE: COMMAND'; may be repeated")
        ->type_name("COMMAND")
        ->allow_extra_args(false);
}

void declare_shell(CLI::App& app, Options& o) {
    named(app, o, "of the instance to talk to; needed when several run");
    app.add_flag("-f,--file", o.from_file, "the first word is a file of commands; without one: standard input");
    app.add_option("-e,--execute", o.execute, "execute this command; may be repeated")->type_name("COMMAND")->allow_extra_args(false);
    app.add_option("-i,--ini", o.ini, "where [SECTION]KEY is looked up, with -f")->type_name("FILE");
    app.add_flag("-k,--keep-going", o.keep_going, "go on after an error");
    app.add_flag("-s,--script", o.script, "output for scripts: no titles, one line per item");
    app.add_flag("--json", o.json, "output as JSON");
    app.add_flag("--echo", o.echo, "echo each command on stderr");
    app.add_flag_callback("-q", [&o] { o.loudness = Loudness::errors; }, "print errors only (the default)");
    app.add_flag_callback("-Q", [&o] { o.loudness = Loudness::nothing; }, "print nothing, not even errors");
    app.add_flag_callback("-v", [&o] { o.loudness = Loudness::results; }, "print the result of each command");
    app.prefix_command();
}

void declare_check(CLI::App& app, Options& o) {
    words(app, o, "FILE", "netlists, in the order they would be loaded");
    app.add_option("-i,--ini", o.ini, "where [SECTION]KEY is looked up")->type_name("FILE");
}

void declare_fmt(CLI::App& app, Options& o) {
    words(app, o, "FILE", "netlists to format in place; - formats standard input");
    app.add_flag("--check", o.check, "change nothing; exit code 1 when a file is not formatted");
}

void declare_graph(CLI::App& app, Options& o) {
    words(app, o, "FILE", "netlists, in the order they would be loaded");
    app.add_option("-o,--output", o.output, "a .svg or .dot file; without it DOT goes to standard output")->type_name("FILE");
    app.add_option("--node", o.part, "of a netlist for several machines: the part of this one")->type_name("NAME");
    app.add_option("-i,--ini", o.ini, "where [SECTION]KEY is looked up")->type_name("FILE");
}

void declare_doc(CLI::App& app, Options& o) {
    words(app, o, "COMPONENT", "as loadrt takes it; without it: all there are", false);
    app.add_flag("--markdown", o.markdown, "as Markdown");
    app.add_flag("--json", o.json, "as JSON");
    app.add_flag("--man", o.man, "as a troff page: hal doc pid --man | man -l -");
    app.add_flag("--html", o.html, "as a web page");
    app.add_flag("--all", o.all, "all components, into the folder of --output: web pages with an index, or what is chosen above");
    app.add_option("-o,--output", o.output, "a folder; each component gets a file")->type_name("DIR");
}

void declare_new(CLI::App& app, Options& o) {
    words(app, o, "component NAME", "the name loadrt will know; letters, digits, - and _");
    app.add_option("--folder", o.folder, "made for it (default: NAME, here)")->type_name("DIR");
}

void declare_compile(CLI::App& app, Options& o) {
    words(app, o, "FILE", "components: .cpp (hal/component.hpp), .comp (LinuxCNC's component language) or .c (LinuxCNC's hal.h)");
    app.add_option("-o,--output", o.output, "install here; default: ~/.local/share/halcyon/components")->type_name("DIR");
    app.add_flag("--check-rt", o.check_rt, "run it 1000 cycles with random and extreme values; name what is not real time");
    app.add_flag("--keep", o.keep, "of a .comp file: leave the C text that was made of it in this folder");
}

void declare_explain(CLI::App& app, Options& o) {
    words(app, o, "CODE", "what stands in [brackets] at the end of a message; without it: all", false);
}

void declare_record(CLI::App& app, Options& o) {
    words(app, o, "CHANNEL FILE", "the number of the sampler (default 0), then the file to write (default: standard output)", false);
    app.add_option("-c,--channel", o.channel, "a sampler by its number or by its instance's name")->type_name("CHANNEL");
    app.add_flag("--csv", o.csv, "comma-separated, with a line of column names first");
    app.add_option("-n,--count", o.count, "end after so many samples")->type_name("N");
    app.add_flag("-t,--tag", o.tag, "begin each line with the sample's number");
    named(app, o, "of the instance to read from");
}

void declare_play(CLI::App& app, Options& o) {
    words(app, o, "CHANNEL FILE", "the number of the streamer (default 0), then the file to read (default: standard input)", false);
    app.add_option("-c,--channel", o.channel, "a streamer by its number or by its instance's name")->type_name("CHANNEL");
    named(app, o, "of the instance to feed");
}

void declare_doctor(CLI::App& app, Options& o) {
    app.add_option("--seconds", o.seconds, "how long each measurement takes (default 2)")->type_name("S")->check(CLI::Range(0.0, 3600.0));
    app.add_flag("--json", o.json, "as JSON");
}

void declare_top(CLI::App& app, Options& o) {
    for_how_long(app, o, "in a terminal: end after 10s …; without it: until Ctrl-C");
    app.add_flag("--once", o.once, "the table once, as it is when the output is no terminal");
    app.add_flag("--json", o.json, "once, as JSON");
    app.add_option("--dds", o.dds, "how to meet others: interfaces=ADDRESS domain=N peers=… (default: on this machine only)")->type_name("SETTINGS");
}

void declare_completion(CLI::App& app, Options& o) { words(app, o, "SHELL", "bash"); }

constexpr const char* address = "can:can0, udp:GROUP:PORT, slcan:/dev/ttyACM0, cane:enp3s0 or replay:FILE; options follow: ?bitrate=500k&datarate=2M&listen";

void filtered(CLI::App& app, Options& o) {
    app.add_option("--filter", o.filters, "only frames with this identifier, or ID/MASK: 181, 180/780, 18FF0000/1FFF0000; may be repeated")
        ->type_name("ID[/MASK]")->allow_extra_args(false);
    app.add_option("-n,--count", o.count, "end after so many frames")->type_name("N");
}

void declare_can_dump(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS", address);
    filtered(app, o);
    for_how_long(app, o, "end after 2s, 500ms …; without it: until Ctrl-C");
    app.add_flag("--json", o.json, "a JSON object per line; the last one holds the statistics");
}

void declare_can_send(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS FRAME", "where to; then frames as candump writes them: 123#1122AABB, 18FF0001#00, 123#R4, 123##1AABB (FD)");
    const auto take = [&o](const std::string& text) {
        const auto ns = parse_duration_ns(text, false);
        if (!ns || *ns <= 0) throw CLI::ValidationError("--every", fmt::format("'{}' is not a duration; write 10ms, 1s or 500us", text));
        o.every_ns = *ns;
    };
    app.add_option_function<std::string>("--every", take, "send them again and again, this far apart")->type_name("TIME");
    for_how_long(app, o, "with --every: end after 2s, 500ms …; without it: until Ctrl-C");
    app.add_option("-n,--count", o.count, "with --every: end after so many rounds")->type_name("N");
}

void declare_can_record(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS FILE", "what to listen to; a .log file (candump's form) or a .pcapng file (Wireshark)");
    filtered(app, o);
    for_how_long(app, o, "end after 2s, 500ms …; without it: until Ctrl-C");
}

void declare_can_replay(CLI::App& app, Options& o) {
    words(app, o, "FILE ADDRESS", "a candump log, pcapng or pcap file; the bus its frames are sent to, at their times");
    app.add_option("--speed", o.speed, "so many times as fast (default 1)")->type_name("FACTOR");
}

void declare_can_load(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS", address);
    for_how_long(app, o, "measure for 5s, 500ms … (default 2s)");
}

void declare_can_nmt(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS COMMAND NODE", "the bus; start, stop, preop, reset or reset-comm; a node 1-127 (or 0x..), or all");
}

void declare_can_scan(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS", address);
    for_how_long(app, o, "listen for 2s, 500ms … (default 1s); as long as the slowest heartbeat finds stopped nodes too");
    app.add_flag("--json", o.json, "as JSON");
}

/// An option that takes a duration.
void duration(CLI::App& app, const char* name, std::int64_t& to, const char* what) {
    const auto take = [name, &to](const std::string& text) {
        const auto ns = parse_duration_ns(text, false);
        if (!ns || *ns < 0) throw CLI::ValidationError(name, fmt::format("'{}' is not a duration; write 10ms, 1s or 500us", text));
        to = *ns;
    };
    app.add_option_function<std::string>(name, take, what)->type_name("TIME");
}

void described(CLI::App& app, Options& o, const char* what = "names and types of the node's objects: an EDS, DCF or XDD file") {
    app.add_option("--eds", o.eds, what)->type_name("FILE");
}

void answered(CLI::App& app, Options& o) { duration(app, "--timeout", o.timeout_ns, "an answer comes within 1s, 200ms … (default 500ms); then it is asked again"); }

void transferred(CLI::App& app, Options& o) {
    described(app, o);
    app.add_option("--type", o.type, "of the value: u8 … u64, i8 … i64, r32, r64, bool, visible_string, octet_string, domain")->type_name("TYPE");
    app.add_flag("--block", o.block, "by block transfer, where the node knows it");
    app.add_flag("--segmented", o.segmented, "never by block transfer");
    answered(app, o);
}

void declare_can_sdo_read(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS NODE OBJECT", "the bus; a node 1-127; objects: INDEX:SUB in hex (6041, 1018:1) or names of the EDS");
    transferred(app, o);
    app.add_option("-o,--output", o.output, "the bytes as they are into this file")->type_name("FILE");
    app.add_flag("--json", o.json, "as JSON, a line per object");
}

void declare_can_sdo_write(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS NODE OBJECT VALUE", "the bus; a node 1-127; INDEX:SUB in hex or a name of the EDS; a number, 0x…, text, or hex bytes");
    transferred(app, o);
    app.add_option("--from", o.input, "the bytes of this file instead of a value")->type_name("FILE");
}

void declare_can_dcf_read(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS NODE", "the bus; a node 1-127");
    described(app, o, "the node's description, EDS, DCF or XDD: which objects it has");
    app.add_option("-o,--output", o.output, "the DCF; without it: standard output")->type_name("FILE");
    answered(app, o);
}

void declare_can_dcf_write(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS NODE FILE", "the bus; a node 1-127; a DCF");
    app.add_flag("--check", o.check, "only say what differs; exit code 1 if anything does");
    answered(app, o);
}

void declare_can_pdo(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS NODE", "the bus; a node 1-127");
    described(app, o);
    answered(app, o);
}

void declare_can_pdo_show(CLI::App& app, Options& o) {
    declare_can_pdo(app, o);
    app.add_flag("--json", o.json, "as JSON, a line per PDO");
}

void declare_can_pdo_switch(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS NODE PDO", "the bus; a node 1-127; rpdo1 … or tpdo1 …");
    answered(app, o);
}

void declare_can_pdo_map(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS NODE PDO OBJECT", "the bus; a node 1-127; rpdo1 … or tpdo1 …; what it carries: INDEX:SUB or a name, with /BITS where the length is not known");
    described(app, o);
    answered(app, o);
    app.add_option("--transmission", o.transmission, "type: 0 SYNC after an event, 1-240 every n-th SYNC, 252, 253 on request, 254, 255 on event")
        ->check(CLI::Range(0, 255))->type_name("N");
    app.add_option("--id", o.id, "identifier in hex; without it, as it is")->type_name("ID");
    duration(app, "--inhibit", o.inhibit_ns, "of a TPDO: at least so long between two");
    duration(app, "--event", o.event_ns, "event timer: a TPDO is sent, an RPDO expected that often");
}

void declare_can_pdo_watch(CLI::App& app, Options& o) {
    declare_can_pdo_show(app, o);
    for_how_long(app, o, "end after 2s, 500ms …; without it: until Ctrl-C");
    app.add_option("-n,--count", o.count, "end after so many PDOs")->type_name("N");
}

void declare_can_lss(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS COMMAND", "the bus; scan, switch configuration|waiting, select VENDOR PRODUCT REVISION SERIAL, inquire, node-id N|none, "
                                     "bit-rate RATE, activate DELAY, store, identify [VENDOR PRODUCT REVISION SERIAL]");
    duration(app, "--timeout", o.timeout_ns, "an answer comes within 1s, 200ms … (default 1s; of each step of a scan 20ms, twice that with each repetition)");
}

void declare_can_gateway(CLI::App& app, Options& o) {
    words(app, o, "ADDRESS", "the buses, as nets 1, 2 …");
    app.add_option("--socket", o.socket, "a local socket made for it (default: halcyon-canopen-gateway in $XDG_RUNTIME_DIR)")->type_name("PATH");
    app.add_option("--listen", o.listen, "a TCP port of this machine instead: 127.0.0.1:6000")->type_name("ADDRESS:PORT");
    app.add_option("--state", o.state, "what `store` keeps, read at the start")->type_name("FILE");
}

void declare_can_drive(CLI::App& app, Options& o) {
    app.add_option("--node", o.drive_node, "the drive: 1-127")->type_name("N");
    app.add_option("--axis", o.drive_axis, "of commands that begin with none: A (the default) to H")->type_name("LETTER");
    app.add_flag("-k,--keep-going", o.keep_going, "commands from a file or pipe: go on after one that failed");
    answered(app, o);
    app.prefix_command();
}

void declare_canopen_plan(CLI::App& app, Options& o) {
    words(app, o, "FILE", "the configuration of the network, NAME.canopen");
    app.add_option("--cycle", o.cycle, "the period of the master's thread, where the SYNC comes with every cycle (default 1ms)")->type_name("TIME");
    app.add_flag("--json", o.json, "as JSON");
}

void declare_tdma_plan(CLI::App& app, Options& o) {
    words(app, o, "FILE", "the schedule of the segment, NAME.tdma or RTnet's tdma.conf");
    app.add_flag("--json", o.json, "as JSON");
    app.add_option("--svg", o.output, "a picture of a cycle into this file; -: standard output")->type_name("FILE");
}

void declare_canopen_check(CLI::App& app, Options& o) { words(app, o, "FILE", "configurations, NAME.canopen"); }

void declare_can_eds_check(CLI::App& app, Options& o) { words(app, o, "FILE", "device descriptions: EDS, DCF, XDD, XDC"); }

// What talks to a bus needs a third of the code, and other libraries: it is in the program hal-bus, which `hal` becomes then.
// This source is compiled for both.
#ifdef HALCYON_BUS_PROGRAM
#define ON_BUS(run) run
#else
#define ON_BUS(run) nullptr
#endif

constexpr Subcommand table[] = {
    {"run", "FILE… [-- ARG…]", "load netlists and run them in real-time threads", run_run, declare_run},
    {"sim", "FILE… [--for TIME] [-- ARG…]", "the same on a virtual clock: deterministic, as fast as it goes", run_sim, declare_sim},
    {"shell", "[COMMAND…]", "talk to a running instance: one command, a file of them, or interactively", run_shell, declare_shell, true},
    {"check", "FILE…", "everything wrong with netlists that can be known without running them", run_check, declare_check},
    {"fmt", "FILE…", "format netlists", run_fmt, declare_fmt},
    {"graph", "FILE… [-o OUT]", "draw netlists", run_graph, declare_graph},
    {"doc", "[COMPONENT…] [--all --output DIR]", "the manual page of a component", run_doc, declare_doc},
    {"new", "component NAME [--folder DIR]", "a component of your own to start from: source, CMakeLists.txt, test", run_new, declare_new},
    {"compile", "FILE… [--output DIR] [--check-rt [-- ARGUMENT=VALUE…]]", "build a plugin from one source file and install it", run_compile, declare_compile},
    {"explain", "[CODE]", "what a diagnostic means and what to do", run_explain, declare_explain},
    {"record", "[CHANNEL] [FILE]", "write what a sampler samples", run_record, declare_record},
    {"play", "[CHANNEL] [FILE]", "feed a streamer", run_play, declare_play},
    {"can dump", "ADDRESS [--filter ID[/MASK]] [--for TIME] [--count N] [--json]", "the frames of a CAN bus, and what they mean", ON_BUS(run_can_dump), declare_can_dump},
    {"can send", "ADDRESS FRAME… [--every TIME [--for TIME]]", "send frames: 123#1122AABB", ON_BUS(run_can_send), declare_can_send},
    {"can record", "ADDRESS FILE.log|FILE.pcapng [--for TIME]", "write what is on a bus to a file", ON_BUS(run_can_record), declare_can_record},
    {"can replay", "FILE ADDRESS [--speed FACTOR]", "send what was recorded, at its times", ON_BUS(run_can_replay), declare_can_replay},
    {"can load", "ADDRESS [--for TIME]", "which identifiers fill the bus", ON_BUS(run_can_load), declare_can_load},
    {"can nmt", "ADDRESS start|stop|preop|reset|reset-comm NODE|all", "tell CANopen nodes which state to take", ON_BUS(run_can_nmt), declare_can_nmt},
    {"can scan", "ADDRESS [--for TIME] [--json]", "the CANopen nodes of a bus: state, device type, identity", ON_BUS(run_can_scan), declare_can_scan},
    {"can sdo read", "ADDRESS NODE OBJECT… [--eds FILE] [--type TYPE] [-o FILE] [--json]", "read objects of a node", ON_BUS(run_can_sdo_read), declare_can_sdo_read},
    {"can sdo write", "ADDRESS NODE OBJECT VALUE|--from FILE [--eds FILE] [--type TYPE]", "write an object of a node", ON_BUS(run_can_sdo_write), declare_can_sdo_write},
    {"can dcf read", "ADDRESS NODE --eds FILE [-o FILE]", "the settings of a node into a DCF", ON_BUS(run_can_dcf_read), declare_can_dcf_read},
    {"can dcf write", "ADDRESS NODE FILE [--check]", "the settings of a DCF into a node: what differs, verified", ON_BUS(run_can_dcf_write), declare_can_dcf_write},
    {"can pdo show", "ADDRESS NODE [--eds FILE] [--json]", "the PDOs of a node and what they carry", ON_BUS(run_can_pdo_show), declare_can_pdo_show},
    {"can pdo map", "ADDRESS NODE PDO [OBJECT[/BITS]…] [--transmission N] [--id ID] [--inhibit TIME] [--event TIME]", "set up a PDO, in the order of CiA 301", ON_BUS(run_can_pdo_map), declare_can_pdo_map},
    {"can pdo enable", "ADDRESS NODE PDO", "switch a PDO on", ON_BUS(run_can_pdo_enable), declare_can_pdo_switch},
    {"can pdo disable", "ADDRESS NODE PDO", "switch a PDO off", ON_BUS(run_can_pdo_disable), declare_can_pdo_switch},
    {"can pdo watch", "ADDRESS NODE [--eds FILE] [--for TIME] [--count N] [--json]", "the values in the PDOs of a node as they pass", ON_BUS(run_can_pdo_watch), declare_can_pdo_watch},
    {"can lss", "ADDRESS COMMAND [ARG…]", "node ids and bit rates: scan, switch, select, inquire, node-id, bit-rate, activate, store, identify", ON_BUS(run_can_lss), declare_can_lss},
    {"can gateway", "ADDRESS… [--socket PATH|--listen 127.0.0.1:PORT] [--state FILE]", "a CiA 309-3 gateway: programs command the network by lines of text", ON_BUS(run_can_gateway), declare_can_gateway},
    {"can drive", "ADDRESS --node N [[AXIS] COMMAND [ARG…]]", "a drive by hand: on, off, go, speed, stop, home, … or a shell of them", ON_BUS(run_can_drive), declare_can_drive, true},
    {"can eds check", "FILE…", "what is wrong with a device description, and what it holds", ON_BUS(run_can_eds_check), declare_can_eds_check},
    {"canopen check", "FILE…", "what is wrong with a network's configuration, and the pins it makes", ON_BUS(run_canopen_check), declare_canopen_check},
    {"canopen plan", "FILE [--cycle TIME] [--json]", "whether every message of a bus arrives in time: worst-case response times", ON_BUS(run_canopen_plan), declare_canopen_plan},
    {"tdma plan", "FILE [--json | --svg FILE]", "the slots of an Ethernet segment as a timeline, its load and the latency from input to output", ON_BUS(run_tdma_plan), declare_tdma_plan},
    {"node drive", "--link ADDRESS --id N [--axes N] [--motor NAME:VALUE] [--fault FAULT] | --eds", "a simulated drive of CiA 402, up to eight axes", ON_BUS(run_node_drive), declare_node_drive},
    {"node io", "--link ADDRESS --id N [--inputs N] [--outputs N] [--fault FAULT] | --eds", "a simulated I/O node of CiA 401", ON_BUS(run_node_io), declare_node_io},
    {"node axis-io", "--link ADDRESS --id N [--plant axis|furuta] [--tdma FILE] [--skew PPM] [--fault FAULT] | --eds", "a simulated axis whose loop is closed over the bus", ON_BUS(run_node_axis_io), declare_node_axis_io},
    {"node safe-io", "--link ADDRESS --id N [--fault FAULT] | --eds", "a simulated safety I/O node of EN 50325-5, for trying out", ON_BUS(run_node_safe_io), declare_node},
    {"node jr3", "--link ADDRESS [--id N] [--stream FILE] [--fault FAULT] | --record FILE --for TIME | --eds", "a simulated force/torque node with a JR3 sensor", ON_BUS(run_node_jr3), declare_node_jr3},
    {"node bootloader", "--link ADDRESS --id N [--flash FILE] [--fault FAULT] | --make-image VERSION | --eds", "a simulated device whose program is changed over the bus", ON_BUS(run_node_bootloader), declare_node_bootloader},
    {"node faults", "", "what simulated devices can do wrong on purpose", ON_BUS(run_node_faults), declare_node_faults},
    {"top", "", "all instances on this machine and the network, their threads and faults", run_top, declare_top},
    {"doctor", "", "what on this machine spoils real time", run_doctor, declare_doctor},
    {"completion", "SHELL", "print a completion script: source <(hal completion bash)", run_completion, declare_completion},
};

/// Commands of two and more words have a first word in common.
struct Group {
    const char* name;
    const char* summary;
};

constexpr Group groups[] = {
    {"can", "a CAN bus by hand: dump, send, record, replay, load, scan, nmt, sdo, dcf, pdo, lss, drive, gateway; eds check"},
    {"canopen", "checks and plans a CANopen network"},
    {"tdma", "plans the time slots of an Ethernet segment"},
    {"node", "simulated CANopen devices as processes: drive, io, axis-io, safe-io, jr3, bootloader; what they can do wrong: faults"},
};

const Group* find_group(std::string_view name) {
    const auto* group = std::find_if(std::begin(groups), std::end(groups), [&](const Group& g) { return name == g.name; });
    return group == std::end(groups) ? nullptr : group;
}

bool belongs(const Subcommand& row, const Group& group) { return std::string_view(row.name).starts_with(std::string(group.name) + " "); }

struct Found {
    const Subcommand* row = nullptr;
    std::size_t words = 0;  ///< how many of those typed are its name
};

/// The row with the longest name that is typed.
Found find(const std::vector<std::string>& typed) {
    Found found;
    std::string name;
    for (std::size_t i = 0; i < typed.size() && i < 4; ++i) {
        name += (i == 0 ? "" : " ") + typed[i];
        const auto* row = std::find_if(std::begin(table), std::end(table), [&](const Subcommand& s) { return name == s.name; });
        if (row != std::end(table)) found = {row, i + 1};
    }
    return found;
}

std::string overview() {
    std::string text = "Halcyon: control components, wired by netlists, run in real-time threads.\n\nusage: hal COMMAND …\n\n";
    const Group* last = nullptr;
    for (const Subcommand& row : table) {
        const std::string_view name(row.name);
        const Group* group = find_group(name.substr(0, name.find(' ')));
        if (group == nullptr) text += fmt::format("  {:11} {}\n", row.name, row.summary);
        else if (group != last) text += fmt::format("  {:11} {}\n", group->name, group->summary);
        last = group;
    }
    return text + "\nhal help COMMAND says more. A first try: hal run halfiles/furuta/hang.hal --for 10s\n";
}

std::string help_of(const Group& group) {
    std::string text = fmt::format("hal {}: {}\n\nusage: hal {} COMMAND …\n\n", group.name, group.summary, group.name);
    for (const Subcommand& row : table)
        if (belongs(row, group)) text += fmt::format("  {:16} {}\n", row.name, row.summary);
    return text + fmt::format("\nhal help {} COMMAND says more.\n", group.name);
}

std::unique_ptr<CLI::App> app_of(const Subcommand& row, Options& options) {
    auto app = std::make_unique<CLI::App>(row.summary, fmt::format("hal {}", row.name));
    row.declare(*app, options);
    app->set_help_flag("-h,--help", "print this");
    app->allow_extras();  // worded here, not by the library
    return app;
}

std::string help_of(const Subcommand& row) {
    Options options;
    const auto app = app_of(row, options);
    std::string text = fmt::format("hal {}: {}\n\nusage: hal {} {}\n", row.name, row.summary, row.name, row.usage);
    for (const CLI::Option* option : app->get_options())
        if (option->get_positional()) text += fmt::format("\n  {:24} {}", option->get_name(true), option->get_description());
    text += "\n";
    for (const CLI::Option* option : app->get_options([](const CLI::Option* o) { return o->nonpositional(); })) {
        const std::string value = option->get_expected_min() > 0 && !option->get_type_name().empty() ? " " + option->get_type_name() : "";
        std::string names;
        for (const std::string& name : option->get_snames()) names += (names.empty() ? "-" : ", -") + name;
        for (const std::string& name : option->get_lnames()) names += (names.empty() ? "--" : ", --") + name;
        text += fmt::format("  {:24} {}\n", names + value, option->get_description());
    }
    return text;
}

std::vector<std::string> option_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options()) {
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
        for (const std::string& name : option->get_snames()) names.push_back("-" + name);
    }
    return names;
}

int no_such_command(const std::vector<std::string>& typed) {
    Options options;
    std::string word = typed.front();
    if (!word.empty() && word[0] == '-') return fail(options, fmt::format("there is no option '{}'; type: hal help", word));
    const auto ends = [&](std::string_view end) { return word.size() > end.size() && word.ends_with(end); };
    if (ends(".hal") || ends(".ini")) return fail(options, fmt::format("'{0}' is not a command; to run it type: hal run {0}", word));
    std::vector<std::string> names = {"help"};
    std::string where = "hal help";
    if (const Group* group = find_group(word)) {
        if (typed.size() > 1) word += " " + typed[1];
        where += fmt::format(" {}", group->name);
        names.clear();
        for (const Subcommand& row : table)
            if (belongs(row, *group)) names.emplace_back(row.name);
    } else {
        for (const Subcommand& row : table) names.emplace_back(row.name);
        for (const Group& g : groups) names.emplace_back(g.name);
    }
    const std::string hint = did_you_mean(word, names);
    return fail(options, fmt::format("there is no command '{}'; {}", word, hint.empty() ? "type: " + where : hint));
}

int help(const std::vector<std::string>& about) {
    if (about.empty()) return print(overview()) ? 0 : 1;
    if (const Found found = find(about); found.row) return print(help_of(*found.row)) ? 0 : 1;
    if (const Group* group = find_group(about.front()); group && about.size() == 1) return print(help_of(*group)) ? 0 : 1;
    return no_such_command(about);
}

/// Reads `arguments` into `options`. Returns an exit code when that is the end of it.
std::optional<int> read(const Subcommand& row, std::vector<std::string> arguments, Options& options) {
    const auto app = app_of(row, options);
    std::vector<std::string> behind;
    if (const auto dashes = std::find(arguments.begin(), arguments.end(), "--"); !row.verbatim && dashes != arguments.end()) {
        options.arguments.assign(dashes + 1, arguments.end());
        arguments.erase(dashes, arguments.end());
    }
    try {
        std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
        app->parse(std::move(arguments));
    } catch (const CLI::CallForHelp&) {
        return print(help_of(row)) ? 0 : 1;
    } catch (const CLI::RequiredError&) {
        return fail(options, fmt::format("something is missing; type: hal {} {}", row.name, row.usage));
    } catch (const CLI::ParseError& error) {
        std::string what = error.what();
        constexpr std::string_view unread = "Could not convert: ";  // --speed = fast
        if (const auto equals = what.find(" = "); what.starts_with(unread) && equals != std::string::npos)
            what = fmt::format("{}: '{}' is no number", what.substr(unread.size(), equals - unread.size()), what.substr(equals + 3));
        std::replace(what.begin(), what.end(), '\n', ' ');
        return fail(options, fmt::format("{}; see: hal help {}", what, row.name));
    }
    const std::vector<std::string> extra = app->remaining();
    if (row.verbatim) {
        if (!extra.empty() && extra.front().size() > 1 && extra.front()[0] == '-' && !(extra.front() == "--")) {
            const std::string hint = did_you_mean(extra.front(), option_names(*app));
            return fail(options, fmt::format("there is no option '{}'; {}", extra.front(),
                                             hint.empty() ? fmt::format("see: hal help {}", row.name) : hint));
        }
        options.words.assign(extra.begin() + (!extra.empty() && extra.front() == "--"), extra.end());
    } else if (!extra.empty()) {
        const std::string hint = did_you_mean(extra.front(), option_names(*app));
        const bool option = extra.front().starts_with('-');
        return fail(options, fmt::format("{} '{}'; {}", option ? "there is no option" : "nothing is expected at", extra.front(),
                                         option && !hint.empty() ? hint : fmt::format("see: hal help {}", row.name)));
    }
    return std::nullopt;
}

/// Does not return, unless there is no such program.
int become_bus_program(char** argv) {
    const auto program = std::filesystem::read_symlink("/proc/self/exe").replace_filename("hal-bus");
    ::execv(program.c_str(), argv);
    return fail(Options{}, fmt::format("cannot start {}: {}; it belongs beside hal: build or install Halcyon again", program.string(), std::strerror(errno)));
}

}  // namespace

int run_command_line(int argc, char** argv) {
    const std::vector<std::string> all(argv + std::min(argc, 1), argv + argc);
    if (all.empty()) return help({});
    if (all[0] == "help" || all[0] == "--help" || all[0] == "-h") return help({all.begin() + 1, all.end()});
    if (all[0] == "--version" || all[0] == "version") return print(fmt::format("hal {}\n", paths::version)) ? 0 : 1;
    const auto [row, name_words] = find(all);
    if (!row && find_group(all[0]) && (all.size() == 1 || all[1] == "help" || all[1] == "--help" || all[1] == "-h")) return help({all[0]});
    if (!row) return no_such_command(all);
    if (!row->run) return become_bus_program(argv);
    Options options;
    options.program = fmt::format("hal {}", row->name);
    if (const auto end = read(*row, {all.begin() + static_cast<std::ptrdiff_t>(name_words), all.end()}, options)) return *end;
    return row->run(options);
}

std::vector<Completion> completions() {
    std::vector<Completion> all;
    for (const Subcommand& row : table) {
        Options options;
        const std::string name = row.name;
        const auto space = name.find(' ');
        if (all.empty() || all.back().name != name.substr(0, space)) all.push_back({name.substr(0, space), {}, {}});
        if (space != name.npos) all.back().words.push_back(name.substr(space + 1, name.find(' ', space + 1) - space - 1));
        for (std::string& option : option_names(*app_of(row, options)))
            if (auto& known = all.back().options; std::find(known.begin(), known.end(), option) == known.end()) known.push_back(std::move(option));
    }
    return all;
}

}  // namespace hal::tools
