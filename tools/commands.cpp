// SPDX-License-Identifier: MIT
// The table of subcommands: a row per command. The options are declared in the command's own
// header.
#include "bus/can/dump.hpp"
#include "bus/can/generate.hpp"
#include "bus/can/load.hpp"
#include "bus/can/record.hpp"
#include "bus/can/send.hpp"
#include "bus/can/sniff.hpp"
#include "bus/canopen/dcf.hpp"
#include "bus/canopen/drive.hpp"
#include "bus/canopen/eds_check.hpp"
#include "bus/canopen/flash.hpp"
#include "bus/canopen/gateway.hpp"
#include "bus/canopen/keys.hpp"
#include "bus/canopen/lss.hpp"
#include "bus/canopen/nmt.hpp"
#include "bus/canopen/nodes.hpp"
#include "bus/canopen/pdo.hpp"
#include "bus/canopen/plan.hpp"
#include "bus/canopen/produce.hpp"
#include "bus/canopen/read_all.hpp"
#include "bus/canopen/scan.hpp"
#include "bus/canopen/sdo_command.hpp"
#include "bus/ethercat/ethercat_line.hpp"
#include "bus/ethercat/keys.hpp"
#include "bus/ethercat/options.hpp"
#include "bus/mesa/options.hpp"
#include "bus/modbus/keys.hpp"
#include "bus/modbus/options.hpp"
#include "bus/node/kinds.hpp"
#include "bus/scocan/keys.hpp"
#include "bus/scocan/plan.hpp"
#include "bus/tdma/keys.hpp"
#include "bus/tdma/plan.hpp"
#include "comp/compile.hpp"
#include "comp/new.hpp"
#include "completion.hpp"
#include "doc/doc.hpp"
#include "doc/explain.hpp"
#include "inspect/doctor.hpp"
#include "inspect/graph.hpp"
#include "inspect/play.hpp"
#include "inspect/record.hpp"
#include "inspect/shell.hpp"
#include "inspect/tdma_ping.hpp"
#include "inspect/tdma_status.hpp"
#include "inspect/top.hpp"
#include "linuxcnc/linuxcnc.hpp"
#include "lsp/lsp.hpp"
#include "manual.hpp"
#include "panel/panel.hpp"
#include "record/plot.hpp"
#include "run/check.hpp"
#include "run/determinism_check.hpp"
#include "run/examples.hpp"
#include "run/fmt.hpp"
#include "run/journal_option.hpp"
#include "run/replay.hpp"
#include "run/run.hpp"
#include "run/run_journal.hpp"
#include "run/sim.hpp"
#include "run/sim_record.hpp"
#include "scope/meter.hpp"
#include "scope/scope.hpp"
#include "scope/watch.hpp"
#include "subcommand.hpp"
#include "trace/trace.hpp"

namespace hal::tools {

namespace {

constexpr Subcommand sim_command() {
    Subcommand row = command<SimOptions, IN_CORE(run_sim)>(
        "sim", "FILE… [--for TIME] [-- ARG…]",
        "run netlists on a virtual clock: deterministic, as fast as possible");
#ifdef HALCYON_TOOLS_PROGRAM
    row.run = [](const Options& options) {
        return run_recorded_sim(static_cast<const SimOptions&>(options));
    };
#else
    row.needs_tools = [](const Options& options) {
        return !static_cast<const SimOptions&>(options).record.empty();
    };
#endif
    return row;
}

constexpr Subcommand run_command() {
    Subcommand row = command<RunOptions, IN_CORE(run_run)>(
        "run", "FILE… [-- ARG…]", "load netlists and run them in real-time threads");
#ifdef HALCYON_TOOLS_PROGRAM
    row.run = [](const Options& options) {
        return run_journaled(static_cast<const RunOptions&>(options));
    };
#else
    row.needs_tools = [](const Options& options) {
        RunOptions own = static_cast<const RunOptions&>(options);
        add_journal_of_netlists(own);
        return !own.journal.empty();
    };
#endif
    return row;
}

constexpr Subcommand check_command() {
    Subcommand row = command<CheckOptions, IN_CORE(run_check)>(
        "check", "FILE… [--assume NAME]", "check netlists without running them");
#ifdef HALCYON_TOOLS_PROGRAM
    row.run = [](const Options& options) {
        const auto& own = static_cast<const CheckOptions&>(options);
        return own.deterministic ? run_determinism_check(own) : run_check(own);
    };
#else
    row.needs_tools = [](const Options& options) {
        return static_cast<const CheckOptions&>(options).deterministic;
    };
#endif
    return row;
}

constexpr Subcommand table[] = {
    run_command(),
    command<ExamplesOptions, IN_CORE(run_examples)>("examples", "[NAME [OPTION of hal run…]]",
                                                    "list the machines to start from, or run one",
                                                    true),
    sim_command(),
    command<LinuxcncOptions, OF_LINUXCNC(run_linuxcnc)>(
        "linuxcnc", "FILE.ini [-- ARG…]",
        "run a LinuxCNC configuration: its netlists, task, I/O and display, until the display "
        "ends"),
    command<RemoteShellOptions, IN_CORE(run_shell)>(
        "shell", "[COMMAND…]",
        "command a running instance: one command, a file of commands, or interactively", true),
    check_command(),
    command<FmtOptions, IN_CORE(run_fmt)>("fmt", "FILE…", "format netlists"),
    command<LspOptions, IN_TOOLS(run_lsp)>(
        "lsp", "[--ini FILE] [--name NAME]",
        "serve an editor: diagnostics, completion, hover, rename (Language Server Protocol)"),
    command<GraphOptions, IN_TOOLS(run_graph)>(
        "graph", "FILE… [-o OUT] [--cluster KIND] [--around NAME [--depth N]]", "draw netlists"),
    command<DocOptions, IN_TOOLS(run_doc)>("doc", "[COMPONENT…] [--all --output DIR]",
                                           "print the manual page of a component"),
    command<NewOptions, IN_TOOLS(run_new)>(
        "new", "component|machine NAME [--folder DIR] [--axes N] [--bus BUS]",
        "create a component or a machine to start from, with a test"),
    command<CompileOptions, IN_TOOLS(run_compile)>(
        "compile", "FILE… [--output DIR] [--check-rt [-- ARGUMENT=VALUE…]]",
        "build a plugin from one source file and install it"),
    command<ExplainOptions, IN_TOOLS(run_explain)>(
        "explain", "[CODE]", "explain a diagnostic code and what to do about it"),
    command<RecordOptions, IN_TOOLS(run_record)>(
        "record", "FILE NAME… [--last TIME] | [CHANNEL] [FILE]",
        "record any values of a running instance to MCAP or CSV, or the samples of a sampler"),
    command<PlotOptions, IN_TOOLS(run_plot)>("plot", "FILE [NAME…] [-o OUT.svg]",
                                             "draw values of a recording"),
    command<ReplayOptions, IN_TOOLS(run_replay)>(
        "replay", "FILE NETLIST… [--tolerance X]",
        "drive a netlist with a recording on a virtual clock, and compare"),
    command<PlayOptions, IN_TOOLS(run_play)>("play", "[CHANNEL] [FILE]", "feed a streamer"),
    command<DumpOptions, ON_BUS(run_can_dump)>(
        "can dump",
        "ADDRESS… [--filter ID[/MASK]] [--time relative|delta|absolute] [--for TIME] [--count N] "
        "[--json]",
        "print and decode the frames of a CAN bus"),
    command<SendOptions, ON_BUS(run_can_send)>(
        "can send", "ADDRESS FRAME… [--every TIME [--for TIME]]", "send frames: 123#1122AABB"),
    command<CanRecordOptions, ON_BUS(run_can_record)>("can record",
                                                      "ADDRESS FILE.log|FILE.pcapng [--for TIME]",
                                                      "record the frames of a bus to a file"),
    command<CanReplayOptions, ON_BUS(run_can_replay)>(
        "can replay", "FILE ADDRESS [--speed FACTOR]",
        "replay a recording with its original timing"),
    command<BusLoadOptions, ON_BUS(run_can_load)>("can load", "ADDRESS [--for TIME]",
                                                  "measure the bus load per identifier"),
    command<NodesOptions, OF_CANOPEN(run_can_nodes)>(
        "can nodes", "ADDRESS [--for TIME] [--json]",
        "list the live nodes by listening: state, heartbeat age, last emergencies"),
    command<SniffOptions, ON_BUS(run_can_sniff)>(
        "can sniff", "ADDRESS [--filter ID[/MASK]] [--for TIME]",
        "show one line per identifier, with changed bytes marked"),
    command<GenerateOptions, ON_BUS(run_can_generate)>(
        "can generate", "ADDRESS [--every TIME] [--id ID[-ID]] [--count N]",
        "send random or counting frames"),
    command<ProduceOptions, OF_CANOPEN(run_can_produce)>(
        "can produce", "ADDRESS heartbeat NODE|sync|guarding NODE [--every TIME]",
        "send a heartbeat, SYNC or guarding requests periodically"),
    command<FlashOptions, OF_CANOPEN(run_can_flash)>(
        "can flash", "ADDRESS NODE IMAGE [--program N]",
        "download a program to a node: stop, erase, download, start"),
    command<NmtOptions, OF_CANOPEN(run_can_nmt)>(
        "can nmt", "ADDRESS start|stop|preop|reset|reset-comm NODE|all",
        "send an NMT command to CANopen nodes"),
    command<ScanOptions, OF_CANOPEN(run_can_scan)>(
        "can scan", "ADDRESS [--for TIME] [--json]",
        "scan a bus for CANopen nodes: state, device type, identity"),
    command<SdoReadOptions, OF_CANOPEN(run_can_sdo_read)>(
        "can sdo read", "ADDRESS NODE OBJECT… [--eds FILE] [--type TYPE] [-o FILE] [--json]",
        "read objects of a node"),
    command<SdoWriteOptions, OF_CANOPEN(run_can_sdo_write)>(
        "can sdo write", "ADDRESS NODE OBJECT VALUE|--from FILE [--eds FILE] [--type TYPE]",
        "write an object of a node"),
    command<ReadAllOptions, OF_CANOPEN(run_can_read_all)>(
        "can read-all", "ADDRESS NODE --eds FILE [-o FILE.csv] [--json]",
        "read all objects of a node that its EDS lists, including read-only objects"),
    command<DcfReadOptions, OF_CANOPEN(run_can_dcf_read)>("can dcf read",
                                                          "ADDRESS NODE --eds FILE [-o FILE]",
                                                          "read the settings of a node into a DCF"),
    command<DcfWriteOptions, OF_CANOPEN(run_can_dcf_write)>(
        "can dcf write", "ADDRESS NODE FILE [--check]",
        "write the settings of a DCF to a node: only differences, verified"),
    command<PdoShowOptions, OF_CANOPEN(run_can_pdo_show)>(
        "can pdo show", "ADDRESS NODE [--eds FILE] [--json]",
        "show the PDOs of a node and their mapping"),
    command<PdoMapOptions, OF_CANOPEN(run_can_pdo_map)>(
        "can pdo map",
        "ADDRESS NODE PDO [OBJECT[/BITS]…] [--transmission N] [--id ID] [--inhibit TIME] [--event "
        "TIME]",
        "configure a PDO in the order of CiA 301"),
    command<PdoSwitchOptions, OF_CANOPEN(run_can_pdo_enable)>("can pdo enable", "ADDRESS NODE PDO",
                                                              "enable a PDO"),
    command<PdoSwitchOptions, OF_CANOPEN(run_can_pdo_disable)>("can pdo disable",
                                                               "ADDRESS NODE PDO", "disable a PDO"),
    command<PdoWatchOptions, OF_CANOPEN(run_can_pdo_watch)>(
        "can pdo watch", "ADDRESS NODE [--eds FILE] [--for TIME] [--count N] [--json]",
        "print the values in the PDOs of a node as they are sent"),
    command<LssOptions, OF_CANOPEN(run_can_lss)>(
        "can lss", "ADDRESS COMMAND [ARG…]",
        "LSS, node IDs and bit rates: scan, switch, select, inquire, node-id, bit-rate, activate, "
        "store, identify"),
    command<GatewayOptions, OF_CANOPEN(run_can_gateway)>(
        "can gateway",
        "ADDRESS… [--socket PATH|--listen 127.0.0.1:PORT] [--state FILE] | --connect "
        "HOST:PORT|PATH [COMMAND…]",
        "run a CiA 309-3 gateway, controlled by lines of text, or its client"),
    command<DriveOptions, OF_CANOPEN(run_can_drive)>(
        "can drive", "ADDRESS --node N [[AXIS] COMMAND [ARG…]]",
        "operate a drive: on, off, go, speed, stop, home, …, or an interactive shell", true),
    command<EdsCheckOptions, OF_CANOPEN(run_can_eds_check)>(
        "can eds check", "FILE…", "check a device description and summarise it"),
    command<Options, OF_CANOPEN(run_canopen_keys)>(
        "canopen keys", "", "list the keys of the configuration of a network"),
    command<CanopenCheckOptions, OF_CANOPEN(run_canopen_check)>(
        "canopen check", "FILE…", "check a network configuration and list its pins"),
    command<CanopenPlanOptions, OF_CANOPEN(run_canopen_plan)>(
        "canopen plan", "FILE [--cycle TIME] [--json | --svg FILE]",
        "compute worst-case response times of all messages of a bus"),
    command<EthercatOptions, OF_ETHERCAT(run_ethercat_scan)>(
        "ethercat scan", "ADDRESS|--emulate LINE [--json]",
        "show the slaves of an EtherCAT bus as a tree: states, names, ports, delays"),
    command<EthercatOptions, OF_ETHERCAT(run_ethercat_slaves)>(
        "ethercat slaves", "ADDRESS|--emulate LINE [--json]",
        "list the slaves: position, alias, state, name"),
    command<EthercatPositionOptions, OF_ETHERCAT(run_ethercat_states)>(
        "ethercat states", "ADDRESS|--emulate LINE [-p N] [STATE] [--json]",
        "print the states of the slaves with the cause of an error, or request a state"),
    command<EthercatOptions, OF_ETHERCAT(run_ethercat_crc)>(
        "ethercat crc", "ADDRESS|--emulate LINE [--json]",
        "print the error counters of all ports and name the faulty cable"),
    command<EthercatValueOptions, OF_ETHERCAT(run_ethercat_upload)>(
        "ethercat upload", "ADDRESS|--emulate LINE [-p N] INDEX SUB [--type TYPE] [--json]",
        "read an object of a slave"),
    command<EthercatValueOptions, OF_ETHERCAT(run_ethercat_download)>(
        "ethercat download", "ADDRESS|--emulate LINE [-p N] INDEX SUB VALUE [--type TYPE] [--json]",
        "write an object of a slave"),
    command<EthercatPositionOptions, OF_ETHERCAT(run_ethercat_reg_read)>(
        "ethercat reg-read", "ADDRESS|--emulate LINE [-p N] REGISTER [BYTES] [--json]",
        "read registers of a slave"),
    command<EthercatPositionOptions, OF_ETHERCAT(run_ethercat_reg_write)>(
        "ethercat reg-write", "ADDRESS|--emulate LINE [-p N] REGISTER BYTE… [--json]",
        "write registers of a slave"),
    command<EthercatPositionOptions, OF_ETHERCAT(run_ethercat_sii_read)>(
        "ethercat sii-read", "ADDRESS|--emulate LINE [-p N] [--json] > FILE",
        "read the EEPROM of a slave (SII)"),
    command<EthercatPositionOptions, OF_ETHERCAT(run_ethercat_sii_write)>(
        "ethercat sii-write", "ADDRESS|--emulate LINE [-p N] FILE [--json]",
        "write the EEPROM of a slave (SII)"),
    command<EthercatPositionOptions, OF_ETHERCAT(run_ethercat_alias)>(
        "ethercat alias", "ADDRESS|--emulate LINE [-p N] ALIAS [--json]",
        "write the alias of a slave to its EEPROM"),
    command<EthercatOptions, OF_ETHERCAT(run_ethercat_pdos)>(
        "ethercat pdos", "ADDRESS|--emulate LINE [--json]",
        "list the process data of the slaves, as their EEPROMs have it"),
    command<EthercatPositionOptions, OF_ETHERCAT(run_ethercat_sdos)>(
        "ethercat sdos", "ADDRESS|--emulate LINE [-p N] [--json]",
        "list the object dictionary of a slave"),
    command<EthercatFileOptions, OF_ETHERCAT(run_ethercat_foe_read)>(
        "ethercat foe-read",
        "ADDRESS|--emulate LINE [-p N] NAME [--boot] [--password N] [--json] > FILE",
        "read a file of a slave in PRE-OP or BOOT"),
    command<EthercatFileOptions, OF_ETHERCAT(run_ethercat_foe_write)>(
        "ethercat foe-write",
        "ADDRESS|--emulate LINE [-p N] FILE [NAME] [--boot] [--password N] [--json]",
        "write a file to a slave in PRE-OP, or its firmware in BOOT"),
    command<EthercatConfigOptions, OF_ETHERCAT(run_ethercat_config)>(
        "ethercat config", "ADDRESS|--emulate LINE|--esi LIST NAME [--json]",
        "write NAME.ethercat and a netlist to start from for the slaves of a bus, or for "
        "descriptions"),
    command<EthercatPositionOptions, OF_ETHERCAT(run_ethercat_xml)>(
        "ethercat xml", "ADDRESS|--emulate LINE [-p N] [--json] > FILE",
        "print a device description (ESI) of a slave from its EEPROM"),
    command<EthercatOptions, OF_ETHERCAT(run_ethercat_graph)>(
        "ethercat graph", "ADDRESS|--emulate LINE [--json] > FILE",
        "draw the topology of a bus as SVG"),
    command<EthercatOptions, OF_ETHERCAT(run_ethercat_dc)>(
        "ethercat dc", "ADDRESS|--emulate LINE [--json]",
        "print the deviations of the clocks of the slaves"),
    command<EthercatDumpOptions, OF_ETHERCAT(run_ethercat_dump)>(
        "ethercat dump", "ADDRESS|FILE [--filter WORD] [--for TIME] [--count N] [--json]",
        "print the datagrams of a bus or of a capture in words"),
    command<Options, OF_ETHERCAT(run_ethercat_keys)>("ethercat keys", "",
                                                     "list the keys of the configuration of a bus"),
    command<EthercatCheckOptions, OF_ETHERCAT(run_ethercat_check)>(
        "ethercat check", "FILE… [--json]", "check the configuration of a bus and list its pins"),
    command<EthercatPlanOptions, OF_ETHERCAT(run_ethercat_plan)>(
        "ethercat plan", "FILE [--json | --svg FILE]",
        "compute frames, wire time, cycle time and latency of a bus"),
    command<EthercatLcecOptions, OF_ETHERCAT(run_ethercat_lcec_conf)>(
        "ethercat lcec-conf", "FILE [--name NAME]",
        "check the configuration of the component lcec, for loadusr (lcec_conf)"),
    command<Options, OF_MODBUS(run_modbus_keys)>("modbus keys", "",
                                                 "list the keys of the configuration of a line"),
    command<ModbusCheckOptions, OF_MODBUS(run_modbus_check)>(
        "modbus check", "FILE…", "check the configuration of a Modbus line"),
    command<ModbusPlanOptions, OF_MODBUS(run_modbus_plan)>(
        "modbus plan", "FILE [--answer TIME] [--json]",
        "print the telegrams of a Modbus line, its load, and how old each value can be"),
    command<ModbusScanOptions, OF_MODBUS(run_modbus_scan)>(
        "modbus scan", "LINE [--first N] [--last N] [--timeout TIME]",
        "find the slaves on a Modbus line"),
    command<ModbusAccessOptions, OF_MODBUS(run_modbus_read)>(
        "modbus read", "LINE SLAVE TABLE ADDRESS [COUNT] [--timeout TIME]",
        "read registers or bits of a Modbus slave"),
    command<ModbusAccessOptions, OF_MODBUS(run_modbus_write)>(
        "modbus write", "LINE SLAVE TABLE ADDRESS VALUE… [--timeout TIME]",
        "write registers or coils of a Modbus slave"),
    command<ModbusMonitorOptions, OF_MODBUS(run_modbus_monitor)>(
        "modbus monitor", "LINE [--for TIME]", "print the frames on a serial line"),
    command<ModbusMb2halOptions, OF_MODBUS(run_modbus_mb2hal)>(
        "modbus mb2hal", "FILE [--check] [--name NAME]",
        "exchange the transactions of LinuxCNC's mb2hal, for loadusr (mb2hal)"),
    command<MesaScanOptions, OF_MESA(run_mesa_scan)>(
        "mesa scan", "[HOST | NETWORK/BITS]… [--timeout TIME]", "find Mesa Ethernet cards"),
    command<MesaCardOptions, OF_MESA(run_mesa_info)>(
        "mesa info", "HOST [--json]", "print what a Mesa card has: firmware, ports, modules"),
    command<MesaCardOptions, OF_MESA(run_mesa_pins)>(
        "mesa pins", "HOST [--json]", "list the pins of a Mesa card and their modules"),
    command<MesaAccessOptions, OF_MESA(run_mesa_read)>(
        "mesa read", "HOST ADDRESS [COUNT] [--space N]", "read registers of a Mesa card"),
    command<MesaAccessOptions, OF_MESA(run_mesa_write)>(
        "mesa write", "HOST ADDRESS VALUE… [--space N]", "write registers of a Mesa card"),
    command<MesaDoctorOptions, OF_MESA(run_mesa_doctor)>(
        "mesa doctor", "HOST [--count N] [--every TIME] [--json]",
        "measure lost packets and round trips on the way to a Mesa card"),
    command<Options, OF_SCOCAN(run_scocan_keys)>("scocan keys", "",
                                                 "list the keys of the slot table of a bus"),
    command<ScocanPlanOptions, OF_SCOCAN(run_scocan_plan)>(
        "scocan plan", "FILE [--mode MODE] [--json | --svg FILE]",
        "print the slots of a CAN bus as a timeline, its load and the worst-case latency of each "
        "message"),
    command<Options, OF_TDMA(run_tdma_keys)>("tdma keys", "",
                                             "list the keys of the schedule of a segment"),
    command<TdmaPlanOptions, OF_TDMA(run_tdma_plan)>(
        "tdma plan", "FILE [--json | --svg FILE]",
        "print the slots of an Ethernet segment as a timeline, its load and its input-to-output "
        "latency"),
    command<TdmaStatusOptions, IN_TOOLS(run_tdma_status)>(
        "tdma status", "[--name NAME] [--json]",
        "print the stations of a segment as a running machine receives them"),
    command<TdmaPingOptions, IN_TOOLS(run_tdma_ping)>(
        "tdma ping", "STATION [-c COUNT] [--from COMPONENT] [--name NAME]",
        "measure the round-trip time to a station of a segment"),
    command<DriveNodeOptions, OF_CANOPEN(run_node_drive)>(
        "node drive",
        "--link ADDRESS --id N [--axes N] [--motor NAME:VALUE] [--fault FAULT] | --eds",
        "simulate a CiA 402 drive with up to eight axes"),
    command<IoNodeOptions, OF_CANOPEN(run_node_io)>(
        "node io", "--link ADDRESS --id N [--inputs N] [--outputs N] [--fault FAULT] | --eds",
        "simulate a CiA 401 I/O node"),
    command<AxisIoNodeOptions, OF_CANOPEN(run_node_axis_io)>(
        "node axis-io",
        "--link ADDRESS --id N [--plant axis|furuta] [--tdma FILE] [--skew PPM] [--fault FAULT] | "
        "--eds",
        "simulate an axis whose control loop is closed over the bus"),
    command<NodeOptions, OF_CANOPEN(run_node_safe_io)>(
        "node safe-io", "--link ADDRESS --id N [--fault FAULT] | --eds",
        "simulate an EN 50325-5 safety I/O node (for experiments only)"),
    command<Jr3NodeOptions, OF_CANOPEN(run_node_jr3)>(
        "node jr3",
        "--link ADDRESS [--id N] [--stream FILE] [--fault FAULT] | --record FILE --for TIME | "
        "--eds",
        "simulate a force/torque node with a JR3 sensor"),
    command<BootloaderNodeOptions, OF_CANOPEN(run_node_bootloader)>(
        "node bootloader",
        "--link ADDRESS --id N [--flash FILE] [--fault FAULT] | --make-image VERSION | --eds",
        "simulate a device with a boot loader"),
    command<EthercatLineOptions, OF_ETHERCAT(run_node_ethercat)>(
        "node ethercat", "FILE --link ADDRESS [--backup ADDRESS] [--for TIME]",
        "emulate a line of EtherCAT slaves on a network interface"),
    command<ModbusNodeOptions, OF_MODBUS(run_node_modbus)>(
        "node modbus", "FILE [--link ADDRESS] [--fault FAULT] [--for TIME]",
        "emulate the slaves and drives of a Modbus line on a pseudo terminal or a TCP port"),
    command<MesaNodeOptions, OF_MESA(run_node_mesa)>(
        "node mesa", "FILE [--address HOST] [--fault FAULT] [--loss SHARE] [--for TIME]",
        "emulate a Mesa Ethernet card and the machine behind it"),
    command<Options, OF_CANOPEN(run_node_faults)>(
        "node faults", "", "list the faults that simulated devices can inject"),
    command<TopOptions, IN_TOOLS(run_top)>(
        "top", "", "show all instances on this machine and the network, their threads and faults"),
    command<WatchOptions, IN_TOOLS(run_watch)>(
        "watch", "NAME… [--for TIME] [--once]",
        "show values of a running instance live, with minimum, maximum and rate"),
    command<MeterOptions, IN_TOOLS(run_meter)>(
        "meter", "NAME [--for TIME]", "show one value of a running instance in large digits"),
    command<ScopeOptions, IN_TOOLS(run_scope)>(
        "scope",
        "NAME… [--trigger TRIGGER] [--pre TIME] [--post TIME] [--svg FILE] [--csv FILE] [--png "
        "FILE]",
        "show signals of a running instance over time, with trigger and measurements"),
    command<TraceOptions, IN_TOOLS(run_trace)>(
        "trace", "FILE [--for TIME] [--on-overrun|--on-fault [--keep TIME]] [--sched]",
        "record what the threads of a running instance run, as a Perfetto timeline"),
    command<PanelOptions, OF_PANEL(run_panel)>(
        "panel", "[FILE] [--write] [--listen ADDRESS]",
        "show a running machine in a web browser: values, graph, scope, user panels"),
    command<DoctorOptions, IN_TOOLS(run_doctor)>(
        "doctor", "[--interface NAME [--try]]",
        "check whether this machine, or a network interface, is fit for real time"),
    command<CompletionOptions, IN_CORE(run_completion)>(
        "completion", "SHELL", "print a completion script: source <(hal completion bash)"),
    command<ManualOptions, IN_TOOLS(run_manual)>(
        "manual", "[PAGE…] [--output DIR]",
        "print manual pages of the commands: hal manual hal-run | man -l -"),
};

constexpr Group groups[] = {
    {"can", "CAN bus tools"},
    {"canopen", "tools for the configuration of a CANopen network"},
    {"ethercat", "EtherCAT bus tools"},
    {"modbus", "Modbus tools"},
    {"scocan", "time slots of a CAN bus"},
    {"tdma", "time slots of an Ethernet segment"},
    {"node",
     "simulated CANopen devices as processes, an EtherCAT line, Modbus slaves, and the faults that "
     "can be injected"},
};

}  // namespace

std::span<const Subcommand> subcommands() {
    return table;
}

std::span<const Group> subcommand_groups() {
    return groups;
}

}  // namespace hal::tools
