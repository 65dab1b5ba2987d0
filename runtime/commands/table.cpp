// SPDX-License-Identifier: MIT
#include "commands/table.hpp"

#include <algorithm>
#include <unordered_map>

#include "commands/files.hpp"
#include "commands/script.hpp"
#include "machine/load/elaborate.hpp"
#include "netlist/journal_line.hpp"
#include "netlist/nodes.hpp"

namespace hal {
namespace {

constexpr unsigned load = 1;
constexpr unsigned config = 2;
constexpr unsigned params = 4;
constexpr unsigned run = 8;  // bits of Lock

namespace kind {
constexpr Behaviour addition{.effect = Effect::addition, .timing = Timing::at_commit};
constexpr Behaviour linking{
    .effect = Effect::addition, .timing = Timing::at_commit, .operands = Operands::arrows};
constexpr Behaviour change{.effect = Effect::change, .timing = Timing::at_commit};
constexpr Behaviour unloading{.effect = Effect::end_of_program, .timing = Timing::at_commit};
constexpr Behaviour deferred{.timing = Timing::at_commit};
constexpr Behaviour on_request{.timing = Timing::at_request};
constexpr Behaviour waiting{.waiting = Waiting::possible};
constexpr Behaviour grouping{.timing = Timing::group};
constexpr Behaviour reading{.effect = Effect::reading};
constexpr Behaviour reading_each{.effect = Effect::reading, .operands = Operands::ranges};
constexpr Behaviour reading_to_file{.effect = Effect::reading, .operands = Operands::paths};
constexpr Behaviour saving{.operands = Operands::paths};
constexpr Behaviour saving_apart{.waiting = Waiting::possible, .operands = Operands::paths};
constexpr Behaviour nothing{.effect = Effect::nothing};
constexpr Behaviour output{.effect = Effect::output};
constexpr Behaviour sourcing{
    .effect = Effect::nothing, .waiting = Waiting::possible, .operands = Operands::paths};
}  // namespace kind

constexpr CommandRow rows[] = {
    // --- components
    {"loadrt", "", "[--native|--linuxcnc] COMPONENT [ARGUMENT=VALUE]...",
     "load a component, or add instances of it",
     "names=a,b names the instances, count=N creates N numbered ones (at most 200000); some "
     "components take num_chan=N and\n"
     "personality=N,N. `hal doc COMPONENT` lists the other arguments. Loading a component again "
     "adds instances.\n"
     "If no component has that name, a compiled module of LinuxCNC is loaded, from the folder in "
     "HAL_RTMOD_DIR or\n"
     "/usr/lib/linuxcnc/modules; --native loads components only, --linuxcnc modules only. With "
     "HALCYON_MODULES=linuxcnc in the environment of the\n"
     "machine, modules come first.",
     edits::loadrt, load, kind::addition},
    {"unloadrt", "", "COMPONENT|INSTANCE|all",
     "unload a component with all its instances, or one instance", "", edits::unload, load,
     kind::change},
    {"unload", "", "COMPONENT|INSTANCE|all",
     "unload a component or an instance, or end a program started by loadusr", "", edits::unload,
     load, kind::unloading},
    {"reload", "", "COMPONENT",
     "replace a loaded plugin by the version that is now on the plugin path, at a cycle boundary",
     "The new version is constructed with the same arguments. Pins of the same name and type keep "
     "their links and values, functions\n"
     "keep their positions in the threads; new pins have their initial values. If a linked pin or "
     "a function in a thread is missing\n"
     "in the new version, or differs, the reload is rejected and nothing changes.",
     edits::reload, load, kind::change},
    {"loadusr", "",
     "[-W] [-Wn NAME] [-w] [-t TIME] [-i] [--restart=no|on-failure|always] [--restart-delay=TIME] "
     "PROGRAM [ARGUMENT]...",
     "start a program",
     "-W waits until the component of the program is ready, -Wn NAME until NAME is; a program "
     "registers over the control socket.\n"
     "With -Wn the name must be free, or that of a dead program, whose pins and links the new one "
     "takes over. If `unload` has asked\n"
     "a program of that name to end, loadusr waits for that first. The wait is reported after 1 s, "
     "10 s and every minute.\n"
     "-w waits for the program to end and fails if its exit status is not 0; -i ignores the "
     "status. In `hal sim`, time stands meanwhile; it passes only as far as the program needs it "
     "to "
     "read a sampler or to feed a streamer.\n"
     "-t TIME (10s, 500ms) limits the wait: then the command fails and the program is terminated.\n"
     "--restart=on-failure restarts the program, after --restart-delay (1s), when a signal "
     "terminated it or its exit status is\n"
     "not 0; --restart=always restarts it whenever it has ended. unloadusr ends it for good; after "
     "5 restarts within 10 s no other follows.",
     command_loadusr, load, kind::waiting},
    {"waitusr", "", "[-t TIME] PROCESS", "wait until a program has ended",
     "PROCESS is the name of the component, or that of the program as loadusr started it. For a "
     "program that has ended, it returns at once.\n"
     "-t TIME (10s, 500ms) limits the wait: then the command fails, and the program continues. In "
     "`hal sim`, time stands meanwhile,\n"
     "as with loadusr -w.",
     command_waitusr, 0, kind::waiting},
    {"unloadusr", "", "PROCESS|all", "end a program (SIGTERM)",
     "Sends SIGTERM and does not wait for the program to end (waitusr does); until then `show "
     "comp` shows it as stopping. Its pins\n"
     "are removed when it ends, those of a dead program at once.",
     command_unloadusr, load, kind::deferred},
    // --- threads and functions
    {"newthread", "",
     "NAME PERIOD_NS [fp] [cpu=N] [policy=fifo|deadline|other] [priority=N] [spin=TIME] "
     "[budget=TIME] "
     "[supervise=TIME|off] [profile=every]",
     "create a real-time thread",
     "All periods are multiples of the shortest. spin= is the time before its deadline from which "
     "the thread polls instead of sleeping;\n"
     "budget= is the execution time beyond which a cycle is a fault; profile=every measures every "
     "function in every cycle.\n"
     "A thread that does not finish a cycle within supervise= (default: 10 periods or 100 ms, "
     "whichever is longer) is stopped by a\n"
     "fault, and its outputs take their safe values; supervise=off disables the supervision.",
     edits::newthread, config, kind::addition},
    {"delthread", "", "THREAD", "remove a thread; its functions are then in no thread", "",
     edits::delthread, config, kind::change},
    {"addf", "", "FUNCTION THREAD [POSITION] | --auto THREAD [FUNCTION]...",
     "add a function to a thread",
     "At the end, or at POSITION: 1 is the first, -1 the last. Functions run in this order.\n"
     "With --auto: adds several functions, or all that are in no thread, in the order of the data "
     "flow.",
     edits::addf, config, kind::addition},
    {"delf", "", "FUNCTION THREAD", "remove a function from a thread", "", edits::delf, config,
     kind::change},
    {"initf", "", "FUNCTION THREAD [POSITION]",
     "run a function once, before the first cycle of the thread", "", edits::initf, config,
     kind::addition},
    {"start", "", "", "let the threads run their functions", "", command_start, run,
     kind::on_request},
    {"stop", "", "", "stop running functions; threads continue, outputs take their safe values", "",
     command_stop, run, kind::on_request},
    {"advance", "", "COUNT|TIME [cycles]",
     "let time pass: `advance 10 cycles` of the fastest thread, or `advance 50ms`",
     "On the virtual clock (hal sim) the threads run for exactly this time; on the real clock the "
     "command waits.",
     command_advance, 0, kind::waiting},
    // --- signals
    {"net", "", "SIGNAL PIN...", "link pins to a signal, which is created if needed",
     "Pins may be preceded by arrows (=>, <=, <=>), which must agree with the directions of the "
     "pins.\n"
     "Ranges and sets expand to several names: net j[0..5]-cmd traj.out-[0..5] => "
     "pid.[0..5].command",
     edits::net, config, kind::linking},
    {"newsig", "", "NAME TYPE", "create a signal: bit float s32 u32 s64 u64 port", "",
     edits::newsig, config, kind::addition},
    {"delsig", "", "SIGNAL|all", "delete a signal and unlink its pins", "", edits::delsig, config,
     kind::change},
    {"linkps", "", "PIN SIGNAL", "link a pin to an existing signal", "", edits::linkps, config,
     kind::linking},
    {"linksp", "", "SIGNAL PIN", "link a pin to an existing signal", "", edits::linksp, config,
     kind::linking},
    {"linkpp", "", "PIN PIN", "link two pins by a signal named after the first", "", edits::linkpp,
     config, kind::linking},
    {"unlinkp", "", "PIN", "unlink a pin from its signal; it keeps its value", "", edits::unlinkp,
     config, kind::change},
    // --- values
    {"setp", "", "PIN-OR-PARAMETER VALUE",
     "set an unlinked input pin or a parameter; also: NAME = VALUE", "", edits::setp, params,
     kind::change},
    {"getp", "", "PIN-OR-PARAMETER", "print the value of a pin or parameter", "", command_getp, 0,
     kind::reading_each},
    {"ptype", "", "PIN-OR-PARAMETER", "print the type of a pin or parameter", "", command_ptype, 0,
     kind::reading_each},
    {"sets", "", "SIGNAL VALUE",
     "set a signal that has no writer; for a port signal: allocate its buffer (bytes)", "",
     edits::sets, 0, kind::change},
    {"gets", "", "SIGNAL", "print the value of a signal", "", command_gets, 0, kind::reading_each},
    {"stype", "", "SIGNAL", "print the type of a signal", "", command_stype, 0, kind::reading_each},
    {"alias", "", "pin|param PIN-OR-PARAMETER NAME", "give a pin or parameter a second name", "",
     edits::alias, config, kind::addition},
    {"unalias", "", "pin|param ALIAS", "remove the second name", "", edits::unalias, config,
     kind::change},
    // --- transactions
    {"begin", "", "", "open a transaction: collect the following edits until `commit`",
     "lock, unlock, start, stop, fault clear and the end of programs (unload, unloadusr) are "
     "collected, too, and are executed right\n"
     "after the edits. loadusr and waitusr are rejected, as is `start` after `stop` or `stop` "
     "after `start`.\n"
     "Commands that only show something, and advance, act at once, on the machine without the "
     "collected edits.",
     command_nothing, 0, kind::grouping},
    {"commit", "", "", "apply all collected edits at the same cycle boundary, or none of them", "",
     command_nothing, 0, kind::grouping},
    {"abort", "", "", "discard the collected edits", "", command_nothing, 0, kind::grouping},
    // --- looking
    {"show", "",
     "[comp|pin|sig|signal|param|parameter|funct|function|thread|alias|timing|latency|fault|all] "
     "[-t TYPE] [PATTERN]...",
     "show tables of components, pins, signals, threads, ...",
     "A pattern is the beginning of a name, or contains * and ?. -t TYPE shows only pins, signals "
     "or parameters of a type.\n"
     "timing: cycles, missed periods and wake-up latency of each thread, execution times of each "
     "function. latency: delay of each\n"
     "signal in cycles, with the reason; a PATTERN is the name of a signal or of a pin. fault: the "
     "faults since start.",
     command_show, 0, kind::reading},
    {"list", "", "comp|pin|sig|signal|param|parameter|funct|function|thread [PATTERN]...",
     "list names on one line", "", command_list, 0, kind::reading},
    {"status", "", "[lock|mem|instance|all]", "show the locks and the number of objects",
     "instance: threads and faults as lines, for hal top.", command_status, 0, kind::reading},
    {"save", "",
     "[comp|alias|sig|signal|sigu|link|linka|net|neta|netl|netla|netal|param|parameter|thread|"
     "unconnectedinpins|signalvalues|all|allu] [FILE]",
     "print the state as commands, to the terminal or a file",
     "all (or nothing): comp, alias, sigu, netla, param, thread; allu also sets unlinked inputs "
     "and signals without writer.",
     command_save, 0, kind::reading_to_file},
    {"fault", "", "clear", "acknowledge all faults that are over",
     "A fault whose condition lasts, such as a thread that hangs or a node that is offline, stays "
     "a fault: the command names it.",
     command_fault, 0, kind::deferred},
    {"journal", "", journal_usage,
     "in a netlist: write a journal of the run; save writes what it has so far",
     "`journal FILE.mcap` in a netlist is `hal run --journal FILE.mcap`, and keep=10min keeps the "
     "last 10 minutes: --journal-keep.\n"
     "`journal save FILE.mcap` writes the journal of the running machine so far. To execute its "
     "cycles again, type:\n"
     "hal replay --exact FILE.mcap.",
     command_journal, 0, kind::saving_apart},
    // --- locks
    {"lock", "", "[none|tune|all]",
     "forbid changes: tune still allows values, start and stop; all (the default) forbids "
     "everything",
     "Values of pins and signals are never locked; `lock all` forbids setp of parameters.",
     command_lock, 0, kind::deferred},
    {"unlock", "", "[all|none|tune]", "release all locks (all, none), or those of tune only", "",
     command_unlock, 0, kind::deferred},
    // --- the shell itself
    {"source", "", "FILE", "run the commands of a file",
     "After `begin` its edits are collected: all of them, or none if a line has an error.",
     command_source, 0, kind::sourcing},
    {"node", "", node_usage.arguments, "in a netlist: assign the following lines to these nodes",
     "The lines up to the next `node` line belong to these nodes. `hal run FILE --node NAME` loads "
     "the part of NAME, the lines before the\n"
     "first `node` line and those after `node all`. A signal that one node writes and others read "
     "is sent over DDS at the interval rate=\n"
     "(10ms). If nothing arrives within deadline=, the readers use the value that `sets` gave the "
     "signal in their own part, else 0.\n"
     "$NODE is the name of the node.",
     command_node, 0, kind::nothing},
    {"echo", "", "", "print each line before it is executed", "", command_echo, 0, kind::output},
    {"unecho", "", "", "end echo", "", command_unecho, 0, kind::output},
    {"debug", "", "LEVEL",
     "set the verbosity: 0 nothing, 1 errors, 2 also results, 3..5 everything", "", command_debug,
     0, kind::nothing},
    {"print", "", "[TEXT]...", "print file, line and the text on stderr", "", command_print, 0,
     kind::output},
    {"help", "", "[COMMAND]", "list all commands, or describe one", "", command_help, 0,
     kind::nothing},
    {"explain", "", "CODE", "explain an error code: what it means and what to do", "",
     command_explain, 0, kind::nothing},
    {"setexact_for_test_suite_only", "", "", "accepted without effect: periods are always exact",
     "", command_nothing, 0, kind::nothing},
    {"quit", "exit", "[STATUS]", "leave the shell, or stop reading the file",
     "STATUS is accepted without effect, as in LinuxCNC.", command_quit, 0, kind::nothing},
};

struct LockBit {
    unsigned bit;
    const char *what, *level;
};
constexpr LockBit lock_bits[] = {{load, "loading", "tune"},
                                 {config, "linking, addf and threads", "tune"},
                                 {params, "setting parameters", "all"},
                                 {run, "start and stop", "all"}};

/// True for a setp that sets a parameter, or one of its names is one.
bool sets_parameter(const Command& command, const Model& model) {
    Diagnostics ignored;
    const auto plain = expand(command, ignored);
    return std::any_of(plain.begin(), plain.end(), [&](const Command& one) {
        const bool assignment = !one.args.empty() && one.args[0].text == "=";
        if (!assignment && one.args.empty()) return false;
        const Pin* const pin = model.find_pin(assignment ? one.name.text : one.args[0].text);
        return pin && pin->dir == HAL_DIR_PARAM;
    });
}

}  // namespace

std::string Context::path(const std::string& text) const {
    return resolve_path(text, options().directory);
}

bool Context::interrupted() { return script.interrupted(*this); }

std::string Context::usage() const { return to_string(row.usage()); }

bool Context::is_absent(std::string_view name, Absences::Kind kind) const {
    return checking() && session.absences().explains(name, kind, session.model());
}

std::span<const CommandRow> command_table() { return rows; }

bool CommandRow::only_reads() const {
    if (function.act == command_source) return false;
    return is_query() || is_apart();
}

const CommandRow* find_command(std::string_view name) {
    static const auto index = [] {
        std::unordered_map<std::string_view, const CommandRow*> all;
        for (const auto& row : rows) {
            all.emplace(row.name, &row);
            if (*row.also) {
                all.emplace(row.also, &row);
            }
        }
        return all;
    }();
    const auto at = index.find(name);
    return at == index.end() ? nullptr : at->second;
}

const CommandRow* row_of(const Command& command) {
    if (command.args.size() == 2 && command.args[0].text == "=") return find_command("setp");
    return find_command(command.name.text);
}

void resolve_set(const Model& model, Command& command) {
    const std::string& name = command.args[0].text;
    command.name.text = !model.find_pin(name) && model.find_signal(name) ? "sets" : "setp";
}

std::vector<std::string> command_names() {
    std::vector<std::string> all;
    for (const auto& row : rows) {
        all.push_back(row.name);
        if (*row.also) {
            all.push_back(row.also);
        }
    }
    return all;
}

void apply_edit(Transaction& transaction, const Command& command, Diagnostics& diagnostics) {
    const CommandRow* const row = row_of(command);
    if (row && row->edits()) return transaction.apply(row->form(), command, diagnostics);
    diagnostics.error("unknown-command", command.name.span,
                      "'" + command.name.text + "' is not an edit");
}

bool check_lock(const CommandRow& row, const Command& command, unsigned lock, const Model& model,
                Diagnostics& diagnostics) {
    const unsigned forbidden = row.lock & lock;
    if (!forbidden || (row.lock == params && !sets_parameter(command, model))) return true;
    for (const auto& entry : lock_bits) {
        if (!(forbidden & entry.bit)) continue;
        diagnostics.error("locked", command.name.span,
                          "'" + command.name.text + "' is locked (" + entry.what + ")",
                          std::string("needs: unlock ") + entry.level,
                          "type `unlock` to release all locks; `status lock` shows them");
        break;
    }
    return false;
}

}  // namespace hal
