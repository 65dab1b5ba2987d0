// SPDX-License-Identifier: MIT
// What was typed, for every subcommand; filled by commands.cpp (subcommands) and classic.cpp (LinuxCNC's program names).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "node/node_options.hpp"

namespace hal::tools {

enum class Loudness { nothing, errors, results };  ///< halcmd's -Q, -q (the default) and -v

struct Options {
    std::string program = "hal";         ///< how messages begin: "hal run", "halcmd"
    std::vector<std::string> words;      ///< the positional arguments: files, a shell command, a component, a code
    std::vector<std::string> arguments;  ///< behind `--`: $1 $2 … and NAME=VALUE of the netlists
    std::string part;                    ///< --node: whose part of the netlists
    std::string dds;                     ///< --dds: arguments of the DDS participant: "interfaces=10.0.0.1 domain=3"
    std::string name;                    ///< --name: of the instance; empty: not given
    std::string ini;
    std::string output;                  ///< -o
    std::string folder;                  ///< --folder: of the new component
    std::int64_t for_ns = -1;            ///< --for; -1: not given
    std::uint64_t cycles = 0;            ///< --cycles; 0: not given
    std::uint64_t count = 0;             ///< -n; 0: without end
    std::string channel;                 ///< of record and play, when it is not among the words: a number or an instance
    std::string name_as_component;       ///< halsampler -N
    bool once = false;                   ///< of top
    bool interactive = false, keep_going = false, no_picture = false, report = false;
    bool from_file = false;              ///< -f: the first word is a file of commands; without one, standard input
    std::vector<std::string> execute;    ///< -e COMMAND
    bool echo = false, script = false, json = false;
    std::string cycle = "1ms";  ///< hal canopen plan
    Loudness loudness = Loudness::errors;
    bool check = false, csv = false, tag = false;
    bool markdown = false, man = false, html = false, all = false;  ///< of doc
    bool check_rt = false, keep = false; ///< of compile
    bool classic = false;                ///< under the name halrun or halcmd: as LinuxCNC does it
    double seconds = 2.0;                ///< of each measurement of doctor
    std::vector<std::string> filters;    ///< --filter ID[/MASK] of the can commands
    std::int64_t every_ns = 0;           ///< --every; 0: not given
    double speed = 1.0;                  ///< of can replay
    NodeOptions node;                    ///< of hal node
    std::string eds;                     ///< --eds: names and types of the objects of a node
    std::string type, input;             ///< of can sdo: --type, --from FILE
    std::int64_t timeout_ns = 0;         ///< --timeout: of one answer; 0: not given
    bool block = false, segmented = false;
    std::string id;                      ///< of can pdo map
    int transmission = -1;               ///< of can pdo map; -1: as it is
    std::int64_t inhibit_ns = -1, event_ns = -1;
    std::string socket, listen, state;   ///< of can gateway
    std::string drive_node, drive_axis;  ///< of can drive
};

/// Each subcommand, in its own file. Returns the exit code.
int run_run(const Options&);
int run_sim(const Options&);
int run_shell(const Options&);
int run_check(const Options&);
int run_fmt(const Options&);
int run_graph(const Options&);
int run_new(const Options&);
int run_compile(const Options&);
int run_doc(const Options&);
int run_explain(const Options&);
int run_record(const Options&);
int run_play(const Options&);
int run_doctor(const Options&);
int run_top(const Options&);
int run_can_dump(const Options&);
int run_can_send(const Options&);
int run_can_record(const Options&);
int run_can_replay(const Options&);
int run_can_load(const Options&);
int run_can_nmt(const Options&);
int run_can_scan(const Options&);
int run_can_drive(const Options&);
int run_can_sdo_read(const Options&);
int run_can_sdo_write(const Options&);
int run_can_dcf_read(const Options&);
int run_can_dcf_write(const Options&);
int run_can_pdo_show(const Options&);
int run_can_pdo_map(const Options&);
int run_can_pdo_enable(const Options&);
int run_can_pdo_disable(const Options&);
int run_can_pdo_watch(const Options&);
int run_can_lss(const Options&);
int run_can_gateway(const Options&);
int run_canopen_check(const Options&);
int run_canopen_plan(const Options&);
int run_tdma_plan(const Options&);
int run_completion(const Options&);
int run_node_drive(const Options&);
int run_node_io(const Options&);
int run_node_axis_io(const Options&);
int run_node_safe_io(const Options&);
int run_node_jr3(const Options&);
int run_node_bootloader(const Options&);
int run_node_faults(const Options&);
int run_can_eds_check(const Options&);

}  // namespace hal::tools
