// SPDX-License-Identifier: MIT
#include "commands/table.hpp"

#include <algorithm>
#include <unordered_map>

#include "machine/elaborate.hpp"
#include "netlist/nodes.hpp"

namespace hal {
namespace {

constexpr unsigned load = 1, config = 2, params = 4, run = 8;  // bits of Lock

constexpr CommandRow rows[] = {
    // --- components
    {"loadrt", "", "COMPONENT [ARGUMENT=VALUE]...", "load a component, or more instances of it",
     "names=a,b gives the instances' names, count=N makes N numbered ones (at most 200000); some components take num_chan=N and\n"
     "personality=N,N. `hal doc COMPONENT` lists the other arguments. Loading a component again adds instances.",
     edits::loadrt, load, command_plain},
    {"unloadrt", "", "COMPONENT|INSTANCE|all", "unload a component with all its instances, or one instance", "", edits::unload, load, command_traceless},
    {"unload", "", "COMPONENT|INSTANCE|all", "unload a component or an instance, or end a program started by loadusr", "", edits::unload, load, command_traceless},
    {"reload", "", "COMPONENT", "put the plugin that is on the plugin path now in the place of the loaded one, at a cycle boundary",
     "The new version is constructed with the same arguments. Pins of the same name and type keep links and values, functions\n"
     "their places in the threads; new pins have their initial values. A linked pin or a function in a thread that the new\n"
     "version has not, or has otherwise, refuses the reload, and nothing changes.",
     edits::reload, load, command_traceless},
    {"loadusr", "", "[-W] [-Wn NAME] [-w] [-t TIME] [-i] [--restart=no|on-failure|always] [--restart-delay=TIME] PROGRAM [ARGUMENT]...", "start a program",
     "-W waits until the program's component is ready, -Wn NAME until NAME is; a program registers over the control socket.\n"
     "With -Wn the name must be free, or that of a dead program, whose pins and links the new one takes over; a program of that\n"
     "name that `unload` has told to end is waited for first. What is waited for is printed after 1 s, 10 s and every minute.\n"
     "-w waits for the program's end and fails when its exit status is not 0; -i ignores the status.\n"
     "-t TIME (10s, 500ms) limits the wait: after it the command fails and the program is ended.\n"
     "--restart=on-failure starts the program again, after --restart-delay (1s), when it has ended by a signal or with an exit\n"
     "status other than 0; always: whenever it has ended. unloadusr ends it for good, and 5 restarts within 10 s are the last.",
     command_loadusr, load, command_waits},
    {"waitusr", "", "[-t TIME] PROCESS", "wait until a program has ended",
     "-t TIME (10s, 500ms) limits the wait: after it the command fails, and the program goes on.", command_waitusr, 0, command_waits},
    {"unloadusr", "", "PROCESS|all", "end a program (SIGTERM)",
     "The program is told to end and is not waited for (waitusr does that); until it has ended, `show comp` calls it stopping. Its\n"
     "pins go when it ends. Of a program that is dead the pins go at once.", command_unloadusr, load, command_deferred},
    // --- threads and functions
    {"newthread", "", "NAME PERIOD_NS [fp] [cpu=N] [policy=fifo|deadline|other] [priority=N] [spin=TIME] [budget=TIME] "
     "[supervise=TIME|off] [profile=every]",
     "make a real-time thread",
     "All periods are multiples of the fastest. spin= is how long before its deadline the thread stops sleeping and spins;\n"
     "budget= is the execution time that counts as a fault; profile=every times every function in every cycle.\n"
     "A thread that ends no cycle for longer than supervise= (default: 10 periods or 100 ms, whichever is longer) is stopped by a fault,\n"
     "and its outputs take their safe values; supervise=off lets it hang unnoticed.",
     edits::newthread, config, command_plain},
    {"delthread", "", "THREAD", "remove a thread; its functions are in no thread then", "", edits::delthread, config, command_traceless},
    {"addf", "", "FUNCTION THREAD [POSITION] | --auto THREAD [FUNCTION]...", "put a function into a thread",
     "At the end, or at POSITION: 1 is the first, -1 the last. The order is the order of execution.\n"
     "With --auto: puts several, or all that are in no thread, in the order of the data flow.",
     edits::addf, config, command_plain},
    {"delf", "", "FUNCTION THREAD", "take a function out of a thread", "", edits::delf, config, command_traceless},
    {"initf", "", "FUNCTION THREAD [POSITION]", "run a function once, before the thread's first cycle", "", edits::initf, config, command_plain},
    {"start", "", "", "let the threads run their functions", "", command_start, run, command_collected},
    {"stop", "", "", "threads go on without their functions; outputs take their safe values", "", command_stop, run, command_collected},
    {"advance", "", "COUNT|TIME [cycles]", "let time pass: `advance 10 cycles` of the fastest thread, or `advance 50ms`",
     "On the virtual clock (hal sim) the threads run exactly so long; on the real clock the command waits.",
     command_advance, 0, command_waits},
    // --- signals
    {"net", "", "SIGNAL PIN...", "link pins to a signal, which is made if needed",
     "Arrows (=>, <=, <=>) may stand before pins: they must agree with the pins' directions.\n"
     "Ranges and sets stand for several names: net j[0..5]-cmd traj.out-[0..5] => pid.[0..5].command",
     edits::net, config, command_arrows},
    {"newsig", "", "NAME TYPE", "make a signal: bit float s32 u32 s64 u64 port", "", edits::newsig, config, command_plain},
    {"delsig", "", "SIGNAL|all", "delete a signal and unlink its pins", "", edits::delsig, config, command_traceless},
    {"linkps", "", "PIN SIGNAL", "link a pin to an existing signal", "", edits::linkps, config, command_arrows},
    {"linksp", "", "SIGNAL PIN", "link a pin to an existing signal", "", edits::linksp, config, command_arrows},
    {"linkpp", "", "PIN PIN", "link two pins by a signal named like the first", "", edits::linkpp, config, command_arrows},
    {"unlinkp", "", "PIN", "take a pin off its signal; it keeps the value", "", edits::unlinkp, config, command_traceless},
    // --- values
    {"setp", "", "PIN-OR-PARAMETER VALUE", "set an unlinked input pin or a parameter; also: NAME = VALUE", "", edits::setp, params, command_traceless},
    {"getp", "", "PIN-OR-PARAMETER", "print the value of a pin or parameter", "", command_getp, 0, command_query | command_each},
    {"ptype", "", "PIN-OR-PARAMETER", "print the type of a pin or parameter", "", command_ptype, 0, command_query | command_each},
    {"sets", "", "SIGNAL VALUE", "set a signal that has no writer; of a port signal: make its buffer", "", edits::sets, 0, command_traceless},
    {"gets", "", "SIGNAL", "print the value of a signal", "", command_gets, 0, command_query | command_each},
    {"stype", "", "SIGNAL", "print the type of a signal", "", command_stype, 0, command_query | command_each},
    {"alias", "", "pin|param PIN-OR-PARAMETER NAME", "give a pin or parameter a second name", "", edits::alias, config, command_plain},
    {"unalias", "", "pin|param ALIAS", "take the second name away", "", edits::unalias, config, command_traceless},
    // --- transactions
    {"begin", "", "", "collect the edits that follow, to take effect at once at `commit`",
     "lock, unlock, start, stop, fault clear and the end of programs (unload, unloadusr) are collected, too, and happen right after\n"
     "the edits have taken effect. loadusr and waitusr are rejected, and so is `start` after `stop` or `stop` after `start`.\n"
     "Commands that look, and advance, act at once: they see the machine without the collected edits.", command_nothing, 0, command_transaction},
    {"commit", "", "", "make all collected edits take effect at one cycle boundary, or none of them", "", command_nothing, 0, command_transaction},
    {"abort", "", "", "forget the collected edits", "", command_nothing, 0, command_transaction},
    // --- looking
    {"show", "", "[comp|pin|sig|signal|param|parameter|funct|function|thread|alias|timing|latency|fault|all] [-t TYPE] [PATTERN]...",
     "tables of what is there",
     "A pattern is the beginning of a name, or has * and ?. -t TYPE shows only pins, signals or parameters of a type.\n"
     "timing: cycles, missed periods and wake-up of each thread, times of each function. latency: cycles of delay of each\n"
     "signal, and why. fault: what went wrong at run time.",
     command_show, 0, command_query},
    {"list", "", "comp|pin|sig|signal|param|parameter|funct|function|thread [PATTERN]...", "names on one line", "", command_list, 0, command_query},
    {"status", "", "[lock|mem|instance|all]", "locks, and how many things there are", "instance: threads and faults as lines, as hal top reads them.", command_status, 0, command_query},
    {"save", "", "[comp|alias|sig|signal|sigu|link|linka|net|neta|netl|netla|netal|param|parameter|thread|unconnectedinpins|signalvalues|all|allu] [FILE]",
     "the state as commands, to the terminal or a file",
     "all (or nothing): comp, alias, sigu, netla, param, thread; allu also sets unlinked inputs and signals without writer.",
     command_save, 0, command_query},
    {"fault", "", "clear", "acknowledge all faults", "", command_fault, 0, command_deferred},
    // --- locks
    {"lock", "", "[none|tune|all]", "forbid changes: tune leaves values, start and stop free, all (or nothing) forbids everything",
     "Values of pins and signals stay free under both: setp of a parameter is what `lock all` forbids.", command_lock, 0, command_deferred | command_checked},
    {"unlock", "", "[all|tune]", "take the locks off, or those of tune only", "", command_unlock, 0, command_deferred | command_checked},
    // --- the shell itself
    {"source", "", "FILE", "run the commands of a file, as if they stood here", "After `begin` its edits are collected: all of them, or none when a line has an error.", command_source, 0, command_apart | command_waits | command_checked},
    {"node", "", node_usage.arguments, "in a netlist: what follows belongs to these nodes, until the next such line",
     "`hal run FILE --node NAME` loads the part of NAME, with the lines before the first node line and those behind `node all`.\n"
     "A signal that one node writes and others read is sent over DDS: every rate= (10ms), and without it for deadline= the readers\n"
     "take the value that `sets` gave the signal in their own part, else 0. $NODE is the node's name.",
     command_node, 0, command_apart | command_checked},
    {"echo", "", "", "print each line before it is run", "", command_echo, 0, command_apart},
    {"unecho", "", "", "the end of echo", "", command_unecho, 0, command_apart},
    {"debug", "", "LEVEL", "how much is said: 0 nothing, 1 errors, 2 also results, 3 to 5 everything", "", command_debug, 0, command_apart},
    {"print", "", "[TEXT]...", "print the place and the text on stderr", "", command_print, 0, command_apart},
    {"help", "", "[COMMAND]", "this list, or more about one command", "", command_help, 0, command_apart},
    {"explain", "", "CODE", "more about an error: what it means and what to do", "", command_explain, 0, command_apart},
    {"setexact_for_test_suite_only", "", "", "accepted and without effect: periods are always exact", "", command_nothing, 0, command_apart | command_checked},
    {"quit", "exit", "", "leave the shell, or stop reading the file", "", command_quit, 0, command_apart | command_checked},
};

struct LockBit {
    unsigned bit;
    const char *what, *level;
};
constexpr LockBit lock_bits[] = {
    {load, "loading", "tune"}, {config, "linking, addf and threads", "tune"}, {params, "setting parameters", "all"}, {run, "start and stop", "all"}};

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

std::string Context::usage() const { return to_string(row.usage()); }

std::span<const CommandRow> command_table() { return rows; }

const CommandRow* find_command(std::string_view name) {
    static const auto index = [] {
        std::unordered_map<std::string_view, const CommandRow*> all;
        for (const auto& row : rows) {
            all.emplace(row.name, &row);
            if (*row.also) all.emplace(row.also, &row);
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
        if (*row.also) all.push_back(row.also);
    }
    return all;
}

void apply_edit(Transaction& transaction, const Command& command, Diagnostics& diagnostics) {
    const CommandRow* const row = row_of(command);
    if (row && row->edits()) return transaction.apply(row->form(), command, diagnostics);
    diagnostics.error("unknown-command", command.name.span, "'" + command.name.text + "' is not an edit");
}

bool check_lock(const CommandRow& row, const Command& command, unsigned lock, const Model& model, Diagnostics& diagnostics) {
    const unsigned refused = row.lock & lock;
    if (!refused || (row.lock == params && !sets_parameter(command, model))) return true;
    for (const auto& entry : lock_bits) {
        if (!(refused & entry.bit)) continue;
        diagnostics.error("locked", command.name.span, "'" + command.name.text + "' is locked (" + entry.what + ")", std::string("needs: unlock ") + entry.level,
                          "type `unlock` to take all locks off; `status lock` shows them");
        break;
    }
    return false;
}

}  // namespace hal
