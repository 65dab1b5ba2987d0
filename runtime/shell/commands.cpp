// SPDX-License-Identifier: MIT
#include "shell/commands.hpp"

#include <algorithm>
#include <unordered_map>

namespace hal {
namespace {

constexpr unsigned load = 1, config = 2, params = 4, run = 8;  // bits of Lock
constexpr Handler edit = nullptr;

constexpr CommandRow rows[] = {
    // --- components
    {"loadrt", "", "COMPONENT [ARGUMENT=VALUE]...", "load a component, or more instances of it",
     "names=a,b gives the instances' names, count=N makes N numbered ones; some components take num_chan=N and\n"
     "personality=N,N. `hal doc COMPONENT` lists the other arguments. Loading a component again adds instances.",
     edit, load, command_plain},
    {"unloadrt", "", "LOADED|all", "unload a component with all its instances, or one instance", "", edit, load, command_plain},
    {"unload", "", "LOADED|all", "unload a component or an instance, or end a program started by loadusr", "", edit, load, command_plain},
    {"reload", "", "RELOADABLE", "put the plugin that is on the plugin path now in the place of the loaded one, at a cycle boundary",
     "The new version is constructed with the same arguments. Pins of the same name and type keep links and values, functions\n"
     "their places in the threads; new pins have their initial values. A linked pin or a function in a thread that the new\n"
     "version has not, or has otherwise, refuses the reload, and nothing changes.",
     edit, load, command_plain},
    {"loadusr", "", "[-W] [-Wn NAME] [-w] [-i] [--restart=no|on-failure|always] [--restart-delay=TIME] PROGRAM [ARGUMENT]...", "start a program",
     "-W waits until the program's component is ready, -Wn NAME until NAME is; a program says so over the control socket.\n"
     "-w waits for the program's end and fails when its exit status is not 0; -i ignores the status.\n"
     "--restart=on-failure starts the program again, after --restart-delay (1s), when it has ended by a signal or with an exit\n"
     "status other than 0; always: whenever it has ended. unloadusr ends it for good, and 5 restarts within 10 s are the last.",
     command_loadusr, load, command_waits},
    {"waitusr", "", "PROCESS", "wait until a program started by loadusr has ended", "", command_waitusr, 0, command_waits},
    {"unloadusr", "", "PROCESS|all", "end a program started by loadusr (SIGTERM)", "", command_unloadusr, load, command_plain},
    // --- threads and functions
    {"newthread", "", "NAME PERIOD_NS [fp] [cpu=N] [policy=fifo|deadline|other] [priority=N] [spin=TIME] [budget=TIME] [profile=every]",
     "make a real-time thread",
     "All periods are multiples of the fastest. spin= is how long before its deadline the thread stops sleeping and spins;\n"
     "budget= is the execution time that counts as a fault; profile=every times every function in every cycle.",
     edit, config, command_plain},
    {"delthread", "", "THREAD", "remove a thread; its functions are in no thread then", "", edit, config, command_plain},
    {"addf", "", "[--auto] FUNCTION THREAD [POSITION]", "put a function into a thread",
     "At the end, or at POSITION: 1 is the first, -1 the last. The order is the order of execution.\n"
     "addf --auto THREAD [FUNCTION]... puts several, or all that are in no thread, in the order of the data flow.",
     edit, config, command_plain},
    {"delf", "", "FUNCTION THREAD", "take a function out of a thread", "", edit, config, command_plain},
    {"initf", "", "FUNCTION THREAD [POSITION]", "run a function once, before the thread's first cycle", "", edit, config, command_plain},
    {"start", "", "", "let the threads run their functions", "", command_start, run, command_plain},
    {"stop", "", "", "threads go on without their functions; outputs take their safe values", "", command_stop, run, command_plain},
    {"advance", "", "COUNT|TIME [cycles]", "let time pass: `advance 10 cycles` of the fastest thread, or `advance 50ms`",
     "On the virtual clock (hal sim) the threads run exactly so long; on the real clock the command waits.",
     command_advance, 0, command_waits},
    // --- signals
    {"net", "", "SIGNAL PIN...", "link pins to a signal, which is made if needed",
     "Arrows (=>, <=, <=>) may stand before pins: they must agree with the pins' directions.\n"
     "Ranges and sets stand for several names: net j[0..5]-cmd traj.out-[0..5] => pid.[0..5].command",
     edit, config, command_plain},
    {"newsig", "", "NAME TYPE", "make a signal: bit float s32 u32 s64 u64 port", "", edit, config, command_plain},
    {"delsig", "", "SIGNAL|all", "delete a signal and unlink its pins", "", edit, config, command_plain},
    {"linkps", "", "PIN SIGNAL", "link a pin to an existing signal", "", edit, config, command_plain},
    {"linksp", "", "SIGNAL PIN", "link a pin to an existing signal", "", edit, config, command_plain},
    {"linkpp", "", "PIN PIN", "link two pins by a signal named like the first", "", edit, config, command_plain},
    {"unlinkp", "", "LINKED-PIN", "take a pin off its signal; it keeps the value", "", edit, config, command_plain},
    // --- values
    {"setp", "", "SETTABLE VALUE", "set an unlinked input pin or a parameter; also: NAME = VALUE", "", edit, params, command_plain},
    {"getp", "", "PIN-OR-PARAMETER", "print the value of a pin or parameter", "", command_getp, 0, command_plain},
    {"ptype", "", "PIN-OR-PARAMETER", "print the type of a pin or parameter", "", command_ptype, 0, command_plain},
    {"sets", "", "FREE-SIGNAL VALUE", "set a signal that has no writer; of a port signal: make its buffer", "", edit, params, command_plain},
    {"gets", "", "SIGNAL", "print the value of a signal", "", command_gets, 0, command_plain},
    {"stype", "", "SIGNAL", "print the type of a signal", "", command_stype, 0, command_plain},
    {"alias", "", "pin|param PIN-OR-PARAMETER NAME", "give a pin or parameter a second name", "", edit, config, command_plain},
    {"unalias", "", "pin|param ALIAS", "take the second name away", "", edit, config, command_plain},
    // --- transactions
    {"begin", "", "", "collect the edits that follow, to take effect at once at `commit`",
     "Other commands act at once and see the machine without the collected edits.", command_nothing, 0, command_transaction},
    {"commit", "", "", "make all collected edits take effect at one cycle boundary, or none of them", "", command_nothing, 0, command_transaction},
    {"abort", "", "", "forget the collected edits", "", command_nothing, 0, command_transaction},
    // --- looking
    {"show", "", "[comp|pin|sig|signal|param|parameter|funct|function|thread|alias|timing|latency|fault|all] [-t TYPE] [PATTERN]...",
     "tables of what is there",
     "A pattern is the beginning of a name, or has * and ?. -t TYPE shows only pins, signals or parameters of a type.\n"
     "timing: cycles, missed periods and wake-up of each thread, times of each function. latency: cycles of delay of each\n"
     "signal, and why. fault: what went wrong at run time.",
     command_show, 0, command_plain},
    {"list", "", "comp|pin|sig|signal|param|parameter|funct|function|thread [PATTERN]...", "names on one line", "", command_list, 0, command_plain},
    {"status", "", "[lock|mem|instance|all]", "locks, and how many things there are", "instance: threads and faults as lines, as hal top reads them.", command_status, 0, command_plain},
    {"save", "", "[comp|alias|sig|signal|sigu|link|linka|net|neta|netl|netla|netal|param|parameter|thread|unconnectedinpins|signalvalues|all|allu] [FILE]",
     "the state as commands, to the terminal or a file",
     "all (or nothing): comp, alias, sigu, netla, param, thread; allu also sets unlinked inputs and signals without writer.",
     command_save, 0, command_plain},
    {"fault", "", "clear", "acknowledge all faults", "", command_fault, 0, command_plain},
    // --- locks
    {"lock", "", "[none|tune|all]", "forbid changes: tune leaves values, start and stop free, all (or nothing) forbids everything", "", command_lock, 0, command_plain},
    {"unlock", "", "[all|tune]", "take the locks off, or those of tune only", "", command_unlock, 0, command_plain},
    // --- the shell itself
    {"source", "", "FILE", "run the commands of a file, as if they stood here", "", command_source, 0, command_apart | command_waits | command_checked},
    {"node", "", "NAME... [rate=TIME] [deadline=TIME]", "in a netlist: what follows belongs to these nodes, until the next such line",
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
    {"quit", "exit", "", "leave the shell, or stop reading the file", "", command_quit, 0, command_apart},
};

struct LockBit {
    unsigned bit;
    const char *what, *level;
};
constexpr LockBit lock_bits[] = {
    {load, "loading", "tune"}, {config, "linking, addf and threads", "tune"}, {params, "setting values", "all"}, {run, "start and stop", "all"}};

}  // namespace

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

std::vector<std::string> command_names() {
    std::vector<std::string> all;
    for (const auto& row : rows) {
        all.push_back(row.name);
        if (*row.also) all.push_back(row.also);
    }
    return all;
}

std::vector<ArgumentWord> argument_words(const CommandRow& row) {
    std::vector<ArgumentWord> words;
    const std::string_view text = row.arguments;
    std::size_t at = 0;
    while (at < text.size()) {
        if (text[at] == ' ') {
            ++at;
            continue;
        }
        // A bracket may hold a blank: "[-t TYPE]" is one optional group of two words.
        const bool optional = text[at] == '[';
        auto end = optional ? text.find(']', at) : text.find(' ', at);
        if (end == text.npos) end = text.size();
        std::string_view inner = text.substr(at + (optional ? 1 : 0), end - at - (optional ? 1 : 0));
        if (optional) ++end;
        bool repeats = false;
        if (text.substr(end).starts_with("...")) {
            repeats = true;
            end += 3;
        }
        if (inner.ends_with("...")) {
            repeats = true;
            inner.remove_suffix(3);
        }
        for (std::size_t begin = 0; begin <= inner.size();) {
            const auto blank = std::min(inner.find(' ', begin), inner.size());
            words.push_back({inner.substr(begin, blank - begin), optional, repeats, begin > 0});
            begin = blank + 1;
        }
        at = end;
    }
    return words;
}

bool check_arity(const CommandRow& row, const Command& command, Diagnostics& diagnostics) {
    std::size_t least = 0, most = 0;
    for (const auto& word : argument_words(row)) {
        if (!word.optional) ++least;
        most = word.repeats || most == SIZE_MAX ? SIZE_MAX : most + 1;
    }
    const std::size_t given = command.args.size();
    if (given >= least && given <= most) return true;
    const bool few = given < least;
    const std::size_t bound = few ? least : most;
    const Span at = few ? command.name.span : Span{command.args[most].span.source, command.args[most].span.begin, command.span.end};
    diagnostics.error("wrong-arguments", at,
                      std::string(row.name) + " takes " + (least == most ? "" : few ? "at least " : "at most ") + std::to_string(bound) +
                          (bound == 1 ? " argument, not " : " arguments, not ") + std::to_string(given),
                      "", std::string(row.name) + (*row.arguments ? " " : "") + row.arguments);
    return false;
}

bool check_lock(const CommandRow& row, const Command& command, unsigned lock, Diagnostics& diagnostics) {
    const unsigned refused = row.lock & lock;
    if (!refused) return true;
    for (const auto& entry : lock_bits) {
        if (!(refused & entry.bit)) continue;
        diagnostics.error("locked", command.name.span, "'" + command.name.text + "' is locked (" + entry.what + ")", std::string("needs: unlock ") + entry.level,
                          "type `unlock` to take all locks off; `status lock` shows them");
        break;
    }
    return false;
}

}  // namespace hal
