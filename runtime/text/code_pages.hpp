// SPDX-License-Identifier: MIT
// The table behind codes.hpp: a row per diagnostic code, sorted by name. `page` is what `hal explain CODE` prints:
// what it means, why it is refused, what to do; an example where it helps. tests/errors/<name>.hal provokes it.
#pragma once

namespace hal {

struct CodePage {
    const char* name;
    const char* page;
};

inline constexpr CodePage code_pages[] = {
    {"alias-taken",
     "A pin has at most one alias, and this one has an alias already.\n\n"
     "Take the old one off with `unalias pin ALIAS`, then give the new one."},
    {"bad-argument",
     "A load argument has a value its component does not accept: not a number where one is needed, out of its limits, or a "
     "list that does not fit the number of instances.\n\n"
     "`hal doc COMPONENT` lists a component's arguments with their defaults and limits."},
    {"bad-component-source",
     "A `.comp` file is declarations, each ended by a `;`, then a line that consists of `;;`, then C code. Here the declarations cannot be "
     "read, or contradict each other or the code. All mistakes are reported at once; the C compiler sees the code only when there are none.\n\n"
     "`component NAME \"…\"; pin in float in; pin out float out; function _; license \"GPL\"; ;;` and `out = in;`, the `;;` on a line of its "
     "own. docs/tutorials/linuxcnc-components.md has examples."},
    {"bad-duration",
     "`advance` lets time pass: so many cycles of the fastest thread, or so long. A bare number says neither.\n\n"
     "Examples: `advance 10 cycles`, `advance 250ms`, `advance 2s`. Units: ns us ms s min h."},
    {"bad-ini-line",
     "An INI file consists of `[SECTION]` lines, `KEY = value` lines, comments (`#` or `;` as the first character of a line), and "
     "`#INCLUDE FILE`. A line that is none of these is ignored with this warning; a section name without its `]` too.\n\n"
     "Included files may include others, up to 16 deep; deeper means that a file includes itself."},
    {"bad-node",
     "A `node NAME...` line of a netlist begins the part of these nodes, which ends at the next such line; `node all` begins a part of all "
     "nodes, as are the lines before the first. A name has letters, digits, - and _, at most 32 of them, and `all` stands alone.\n\n"
     "`node cell`, `node robot1 robot2 rate=10ms deadline=100ms`. docs/tutorials/distributed.md has a whole example."},
    {"bad-period",
     "The period of a thread is a whole number of nanoseconds, at least 1000 (1 us): 1000000 is a millisecond.\n\n"
     "Example: `newthread servo-thread 1000000`, or `loadrt threads name1=base period1=50000 name2=servo period2=1000000`."},
    {"bad-plugin",
     "The file was found but is not a usable component: it is not a shared library for this machine, it exports no symbol "
     "`hal_plugin`, it was built for another major version of the interface, or its description is incomplete.\n\n"
     "Rebuild it against the installed `hal/component.hpp`. `nm -D FILE` must show `hal_plugin`."},
    {"bad-position",
     "The third argument of addf is a place in the thread: 1 is the first, 2 the second, -1 the last, -2 the one before it. "
     "0 means nothing, and a place must exist.\n\n"
     "Without it the function is appended."},
    {"bad-range",
     "A name may contain a range or a set: `pid.[0..5].enable` stands for six names, `[00..11]` keeps leading zeros, `[5..0]` counts "
     "down, `pid.{x,y,z}.enable` stands for three; several in one word are combined, the last one running fastest. The bounds are whole "
     "numbers, a `{` has its `}`, a set is not empty and does not contain another, and a command stands for at most 1000000 names.\n\n"
     "Nothing is expanded between quotes, nor in print, echo, help, loadusr and source."},
    {"bad-reference",
     "`$NAME` and `$(NAME)` stand for an environment variable, `[SECTION]KEY` and `[SECTION](KEY)` for a value of the INI file. Here "
     "a `$` or `[` is followed by no name, or its bracket is not closed. Quotes do not protect them.\n\n"
     "`[0..5]` is a range of names, and in show and list a `[` may be part of a pattern."},
    {"bad-value",
     "The text is not a value of the pin's or signal's type, or is outside its range. Nothing is rounded or wrapped "
     "silently.\n\n"
     "bit: TRUE FALSE 1 0 yes no on off. s32 u32 s64 u64: decimal, 0x hexadecimal, leading 0 octal. float: 1.5, -2e-3."},
    {"binary-text",
     "A netlist is plain text in UTF-8. This file contains a zero byte, or another control character outside of a comment, so it is "
     "something else: a program, a picture, a text in UTF-16. Nothing of it was used.\n\n"
     "`file FILE` says what it is; `iconv -f utf-16 -t utf-8` converts a text."},
    {"camera-text",
     "The calibration of a camera or of the ground that it sees cannot be read, or fits no camera. A camera's file is lines: `size 640 480`, `focal 600 600`, "
     "`centre 319.5 239.5`, `distortion k1 k2 p1 p2 k3`; or the YAML that OpenCV's calibration writes. The ground's file has a line `u v x y` for each of four "
     "points or more: pixel from the left, from the top, place in mm.\n\n"
     "`hal doc vision_marker` and `hal doc vision_homography` have examples."},
    {"cannot-write",
     "`save` could not write the file; nothing else was changed. The reason is the system's.\n\n"
     "Without a file name `save` prints to the terminal."},
    {"canopen-line",
     "A line of a CANopen configuration (`NAME.canopen`) that means nothing where it stands: neither a [section] nor KEY = VALUE, a section "
     "or key that does not exist or comes twice.\n\n"
     "Sections are [bus], [defaults], [type NAME], [node ID NAME], [messages]. docs/canopen-configuration.md lists their keys."},
    {"canopen-load",
     "The messages of a CANopen configuration cannot all arrive in time on this bus: computed from the longest possible frames, all of them "
     "due at once. The network runs all the same, and frames come late.\n\n"
     "`hal canopen plan FILE` shows the arithmetic and what would help: a higher bit rate, a longer SYNC period, fewer PDOs, a second bus."},
    {"canopen-node",
     "Nodes or messages of a CANopen configuration are in each other's way: a node-id, a name or an identifier twice; or a node is told "
     "something that needs what is not there, such as a SYNC."},
    {"canopen-object",
     "An object that the node does not have by its description, that a PDO cannot carry, or that does not fit beside others: a PDO holds "
     "64 bits.\n\n"
     "Objects are written by name, in lower case with dashes, or as 0x6064 or 0x6099:1; `hal canopen check FILE` lists those in use. "
     "Without a description an object needs its type: `0x2000:1 u16`."},
    {"canopen-value",
     "A value of a CANopen configuration that its key does not take. The help says what it takes.\n\n"
     "Times have a unit (us, ms, s, min), numbers are decimal or hexadecimal with 0x."},
    {"construct-failed",
     "The component refused to be made: its constructor gave the reason that is printed. Nothing of it is left behind.\n\n"
     "`hal doc COMPONENT` shows its arguments."},
    {"continued-comment",
     "A `\\` at the end of a line joins the next line to it before comments are looked for, as in LinuxCNC. A comment that ends in "
     "`\\` therefore swallows the next line, and what stands there is not run.\n\n"
     "Take the `\\` away, or write the comment behind the last line of the command."},
    {"cross-thread-io",
     "I/O pins of this signal stand in several threads: they share one cell, as in LinuxCNC, and its value may change in the "
     "middle of a cycle. All other signals that cross threads are whole finished cycles."},
    {"cyclic-order",
     "`addf --auto` found a loop in the dataflow and had to cut it: the named signal is read one cycle late. Put the "
     "functions in the order you want to cut it elsewhere."},
    {"dos-line-endings",
     "Lines of this file end in CR LF. They are read as if they ended in LF; this is said once per file.\n\n"
     "`hal fmt` or `sed -i 's/\\r$//' FILE` converts the file."},
    {"eds-count",
     "A number in a device description (EDS, DCF, XDD) and what it counts do not agree: objects in a list, sub-indices of an object, lines "
     "of a comment, PDOs. What is described counts, the number does not.\n\n"
     "`SubNumber` counts sub-index 0, too."},
    {"eds-missing",
     "A key or a section that CiA 306 demands is not there, or is empty. The message says what was assumed.\n\n"
     "An object without `DataType` can be read and written as bytes only."},
    {"eds-object",
     "Something about an object as a whole: a kind, data type or access type that does not exist, sub-indices of a plain variable, a "
     "default mapping that names what is not there or has another length."},
    {"eds-syntax",
     "A line of a device description that is neither a [section] nor Key=Value, a section or key that comes twice, a comment where none may "
     "be, or text in an unusual encoding. Comments begin with `;` and have a line of their own.\n\n"
     "When something is said twice the last one counts."},
    {"eds-unreadable",
     "The file is no device description, so nothing of it was used: it is empty, no text, or has neither objects nor [DeviceInfo]."},
    {"eds-value",
     "A value that is no number, does not fit into its data type or lies outside of its limits, or is spelled in a way that other tools "
     "understand differently.\n\n"
     "Numbers are decimal, or hexadecimal with 0x. A leading 0 makes a number octal, as in C; `$NODEID+0x180` adds the node-id."},
    {"function-in-thread",
     "A function runs in one thread, at one place. It was added a second time.\n\n"
     "Move it with `delf FUNCTION THREAD` followed by addf."},
    {"hung-thread",
     "A thread has finished no cycle for longer than its supervision limit (10 periods or 100 ms, whichever is longer; `newthread ... "
     "supervise=TIME`). The supervisor, which runs outside of the threads, has stopped its functions, written its declared safe values and "
     "called the emergency functions of its components. The fault (`show fault`) names the function and why it does not return: it uses "
     "CPU time (an endless loop), waits in a system call, is stopped by a debugger, or gets no CPU time.\n\n"
     "Commands that need an answer of the thread (setp, sets, edits, start, stop, delthread, unload) fail with this code as long as it "
     "hangs; other threads go on. Should the function return, no other function of the thread runs and the outputs stay safe until "
     "`start`. A function that never returns ends only with the process; the exit status of `hal run` is then 1.\n\n"
     "A function of a cycle must not block, wait or loop without a bound; work that may take long belongs into a thread of the "
     "component. A debugger on a running machine needs `newthread ... supervise=off`.\n\n"
     "`hal sim` has no such limit, since a cycle of its virtual clock may take any wall time. A cycle that takes more than 10 s is reported on "
     "stderr while it runs, and `--cycle-limit TIME` ends the run with this code and status 1; after Ctrl-C the limit is two seconds."},
    {"init-done",
     "initf functions run once, in a cycle of their own before the first cyclic pass of their thread. This thread has made "
     "that pass, so the function would never run."},
    {"instance-running",
     "Each instance of the runtime has a name of its own, and one of this name runs. Its control socket stays its own.\n\n"
     "Give the new one another name: `hal run --name second FILE.hal`."},
    {"interrupted",
     "A command that was waiting (loadusr -w, loadusr -W, waitusr, advance) was told to stop, or the one who gave it has gone.\n\n"
     "What was done before it stays done."},
    {"is-a-program",
     "unloadrt unloads what is loaded into this process. The component is a program of its own: loadusr started it, or it registered "
     "over the control socket.\n\n"
     "`unloadusr NAME` asks the program to end (SIGTERM); of one that is dead it removes the pins that are left."},
    {"linked-set",
     "A linked pin takes its value from its signal; setp would be overwritten at once, so it is refused.\n\n"
     "Set the signal with sets (when nothing writes it), or unlink the pin with unlinkp first."},
    {"locked",
     "A lock forbids this kind of change. `lock tune` forbids loading, linking, addf and threads; `lock all` also forbids setting "
     "parameters, start and stop. Values of pins and signals can always be set, as in LinuxCNC.\n\n"
     "`status lock` shows what is locked, `unlock` takes all locks off, `unlock tune` those of tune."},
    {"lone-carriage-return",
     "A carriage return stands in the middle of a line. Such a line looks like several in an editor but is one for the netlist, so it "
     "is refused; other lines with the same fault are not listed.\n\n"
     "`tr '\\r' '\\n' < OLD > NEW` converts a file whose lines end in CR only."},
    {"matrix-text",
     "A file of matrices is NAME = and the numbers behind it, a row to a line or a `;` between rows, spaces or commas between numbers; `diag` before "
     "the numbers of a diagonal; `#` before a comment. All rows of a matrix are of one length.\n\n"
     "Example: `A = 0 1` and in the line below it `-2 -3`; `Q = diag 10 1`."},
    {"matrix-value",
     "A matrix can be read but does not do: its size does not go with the others', it should be symmetric or positive, or the plant that it "
     "is part of cannot be steered or observed. The sentence names the mode or the state.\n\n"
     "`hal doc COMPONENT` says what its matrices mean and which sizes they have."},
    {"misplaced-node",
     "`node` lines stand in the netlist that `hal run`, `hal sim` or `hal check` is given. They are not typed in the shell, and not written in "
     "a file that is read by `source`: what that file holds belongs to the node that reads it.\n\n"
     "Write `node NAME` above the `source` line."},
    {"model-text",
     "A file of a nonlinear model (`loadrt ekf model=FILE`) is lines of five kinds: `constant NAME = FORMULA`, `input NAME`, `state NAME = START sigma S noise N`, "
     "`NAME' = FORMULA` for the derivative of each state, `measure NAME = FORMULA sigma S`. One of them cannot be read, names what is not there, or is missing.\n\n"
     "Formulas have + - * / ^, brackets, pi, sin cos tan asin acos atan atan2 sqrt exp log abs tanh min max. `hal doc ekf` has an example."},
    {"name-taken",
     "Pins, aliases, signals, functions, instances and threads have names of their own kind that stand for one thing; pins "
     "and signals share one set of names, and so do components and programs. The name is in use.\n\n"
     "Give instances names with `names=`, or choose another signal name. A program's name is free when the program has ended: "
     "`unload NAME` ends it, and `loadusr -Wn NAME` waits for that."},
    {"names-and-count",
     "`names=` and `count=` (or `num_chan=`) both say how many instances there are; only one of them may be given."},
    {"no-alias",
     "unalias takes the alias of a pin; the named pin has none. `show alias` lists all aliases."},
    {"no-dds",
     "The nodes of this netlist exchange signals, for which DDS is used, and this build of Halcyon has none: Fast DDS was not there when it "
     "was built, or it was built with -DHALCYON_DDS=OFF.\n\n"
     "On Debian: `sudo apt install libfastrtps-dev`, and build again. `hal check` and `hal sim` take netlists with nodes without it."},
    {"no-program",
     "loadusr could not start the program: it is not in PATH, is not executable, or the system refused.\n\n"
     "A path with a / is taken as it stands; `~` is the home directory."},
    {"no-socket",
     "The control socket of the instance could not be made; without it no shell could reach the running machine. The sockets lie in "
     "$XDG_RUNTIME_DIR/halcyon, or in /tmp/halcyon-UID, a folder that must belong to you and be closed to others."},
    {"no-such-component",
     "No plugin of this name was found on the search path: HALCYON_PLUGIN_PATH, the user's plugin folder, the build tree, "
     "the installation.\n\n"
     "`hal doc` lists every component that can be loaded."},
    {"no-such-function",
     "There is no function of this name. Functions come with instances: `show funct` lists them, `hal doc COMPONENT` says "
     "what each does."},
    {"no-such-node",
     "`--node NAME` chooses the part of the netlist that this machine loads, and no `node` line names that one.\n\n"
     "The message lists the nodes there are. Lines before the first `node` line belong to all of them."},
    {"no-such-pin",
     "There is no pin or parameter of this name. Pins come with instances: `show pin INSTANCE` lists them, `hal doc "
     "COMPONENT` says what each does."},
    {"no-such-signal",
     "There is no signal of this name. Signals are made by net or newsig: `show sig` lists them."},
    {"no-such-thread",
     "There is no thread of this name. Threads are made by `newthread NAME PERIOD_NS` or `loadrt threads name1=… period1=…`; "
     "`show thread` lists them."},
    {"no-such-type",
     "The type names are bit, float, s32, u32, s64, u64, port, and in the second dialect bool, real, si32, ui32, sint, uint."},
    {"no-thread",
     "The command needs a thread, and there is none.\n\n"
     "Make one: `newthread servo-thread 1000000`, or `loadrt threads name1=servo-thread period1=1000000`."},
    {"no-transaction",
     "`commit` and `abort` end what `begin` started, and no `begin` came before in this shell or file.\n\n"
     "Outside begin … commit each line takes effect by itself, and in a file all edits up to the next command that acts on the machine."},
    {"node-crossing",
     "A signal whose writer and readers stand on different nodes is sent from one to the other. That needs one output on one node and inputs "
     "on the others, a type other than port, and a thread on each of these nodes that sends and takes it.\n\n"
     "Signals that several nodes have and none writes, or that each writes itself, are not sent: each node has its own."},
    {"not-a-program",
     "waitusr and unloadusr are about programs outside the runtime: those started by loadusr, and those that registered over "
     "the control socket.\n\n"
     "Components inside the runtime are unloaded by unloadrt or unload; `show comp` lists both, programs as type User."},
    {"not-in-thread",
     "delf takes a function out of the thread it is in. This one is not in the named thread."},
    {"open-transaction",
     "Edits between `begin` and `commit` are collected and take effect together. A second `begin` before that means nothing, and "
     "a file that ends before its `commit` changes nothing with the collected edits.\n\n"
     "loadusr and waitusr cannot be among them: a program cannot be started tentatively. `start` and `stop` can, but not both: they "
     "would happen at the same time. What is rejected leaves the transaction open in a shell; in a file it ends it, and nothing is "
     "changed.\n\n"
     "End the transaction with `commit`, or forget it with `abort`."},
    {"out-of-memory",
     "The system gave no more memory while an edit was made. The edit was undone; the machine runs on as it was.\n\n"
     "`ulimit -v` and `ulimit -l` limit the memory and the locked memory of a process; `free -h` shows what the machine has."},
    {"output-set",
     "Only the component writes an output; setp on it would be overwritten in the next cycle.\n\n"
     "To force a value downstream, unlink the output and set the signal: `unlinkp OUT`, `sets SIGNAL VALUE`."},
    {"parameter-link",
     "Parameters are set, not linked. In LinuxCNC's terms: setp works on it, net does not."},
    {"period-multiple",
     "All periods are multiples of the fastest thread's, so that the threads keep a fixed phase. Choose one that is, as the "
     "help line says."},
    {"pin-linked",
     "A pin is in at most one signal. Unlink it first with unlinkp, or link the other pins to the signal it is in."},
    {"port-sized",
     "The buffer of a port signal is allocated once, by the first sets; its size does not change afterwards."},
    {"program-ended",
     "loadusr -W waits until the program's component is ready, and the program ended first.\n\n"
     "Its own messages say why, and the help of this one when its registration was rejected. A program registers over the control socket with the request {\"component\":\"NAME\"}; "
     "-Wn NAME waits for another name than the program's."},
    {"program-failed",
     "loadusr -w waits for the program's end and takes an exit status other than 0 as an error, as LinuxCNC does.\n\n"
     "`loadusr -i -w PROGRAM` ignores the status."},
    {"program-timeout",
     "What `-t TIME` allows a program has passed: it did not become ready (loadusr -W, -Wn), or did not end (loadusr -w, waitusr).\n\n"
     "loadusr has sent the program SIGTERM, and sends SIGKILL when that does not end it within 5 s; its name is free at once. waitusr leaves "
     "the program alone. `show comp` lists the programs and their states; the help of the message says what the program has done so far."},
    {"range-length",
     "The ranges and sets of one command run along with each other, so each of them must stand for as many names as the one in the "
     "first word: `net j[0..2]-cmd traj.[0..2].out => pid.{x,y,z}.command` is three commands.\n\n"
     "When the first word has no range, ranges in the others are lists in place: `net on s.on => pid.{x,y,z}.enable` is one command."},
    {"recursive-source",
     "A file reads itself by `source`, directly or through others; it would never end. The places show the way round.\n\n"
     "Put what both need into a third file."},
    {"reload-conflict",
     "`reload` puts a new version of a plugin in the place of the loaded one. What the machine uses of the old version must be there in "
     "the new one: pins on signals with the same type and direction, functions that are in threads, the component's name. Nothing was "
     "changed; the old version runs on.\n\n"
     "Take the pin off its signal (`unlinkp PIN`) or the function out of its thread (`delf FUNCTION THREAD`) first; both and the reload "
     "can take effect together between `begin` and `commit`."},
    {"reload-dropped",
     "A parameter or an input that had been set is not in the new version of the component, or has another type there. The reload took "
     "effect, and the value is lost.\n\n"
     "A `setp` of it in the netlist will fail the next time the netlist is loaded."},
    {"several-nodes",
     "The netlist has `node` lines: it is for several machines, each of which loads its own part of it.\n\n"
     "`hal run FILE --node NAME` loads the part of one. `hal check FILE` checks all of them, `hal sim FILE` runs them together in one process."},
    {"signal-named-like-pin",
     "net takes the signal's name first, then pins. The first name is a pin's, so the signal's name was probably forgotten.\n\n"
     "`net SIGNAL pin pin …`"},
    {"silent-thread",
     "A thread did not take part in the command within its timeout: one of its functions hangs, or the thread gets no CPU time. An edit "
     "was withdrawn; nothing changed. Only a thread with `supervise=off`, or with a supervision limit above one second, gets this far: "
     "others are declared hung before (`hal explain hung-thread`).\n\n"
     "`show thread` and `show fault` say more; a function that never returns ends only with the process."},
    {"spread-pins",
     "The functions of one instance run in different threads, and some of its pins belong to all its functions: they would "
     "be read and written by two threads at once.\n\n"
     "Put the functions into one thread. (Components made for several threads name the function that uses each pin.)"},
    {"stale-read",
     "The reader's function runs before the writer's in the same thread, so it sees the value of the cycle before: one cycle "
     "old. Often that is wanted (a feedback loop has to be cut somewhere); if not, change the order with addf positions or "
     "let `addf --auto` choose it."},
    {"start-failed",
     "The component could not acquire what it needs (a device, a socket, a file) and gave the reason that is printed. The "
     "whole edit was undone."},
    {"substitution-too-long",
     "The values put in place of `$NAME` and `[SECTION]KEY` in one file are longer than 32 MB together. No machine needs that; a value is "
     "wrong, or a reference stands in a generated file far too often."},
    {"tdma-line",
     "A line of a TDMA schedule that means nothing where it stands: a block or key that does not exist, comes twice, or lacks its value; or "
     "one that is missing, as the cycle.\n\n"
     "Blocks are master:, backup-master:, slave:, as in RTnet's tdma.conf. docs/tdma.md lists their keys."},
    {"tdma-schedule",
     "A TDMA schedule that cannot work: slots in each other's time or beyond the cycle, a slot too short for its frame, a backup master that "
     "decides before it can know, a station that cannot be calibrated. The sentence has the arithmetic, the help what to change.\n\n"
     "`hal tdma plan FILE` shows a good one as a timeline."},
    {"tdma-value",
     "A value of a TDMA schedule that its key does not take. The help says what it takes.\n\n"
     "Times are in microseconds, as RTnet writes them, or have a unit: 50, 50us, 1ms."},
    {"thread-refused",
     "The operating system gave no thread, mostly because a limit on processes or memory is reached: see `ulimit -a`."},
    {"too-many-errors",
     "Of one file the first 20 malformed lines are shown, and how many more there are. They often have one cause: repair the first and "
     "check again."},
    {"two-readers",
     "A port is a byte stream: what one reader takes is gone for the other. It has one writer and one reader."},
    {"too-many-words",
     "A file may consist of 5000000 words, which is a million nets. This one has more, so it is not a netlist; nothing of it was used."},
    {"two-writers",
     "A signal has one writer: one OUT pin, or any number of I/O pins, never both. A second output on the same signal "
     "would make its value depend on the order of functions.\n\nJoin two sources with sum2, or2 or mux2, or unlink the first one with unlinkp."},
    {"type-mismatch",
     "All pins of a signal have one type; nothing is converted silently. Insert a conv_ component between them, as the help "
     "line says."},
    {"unchecked-lines",
     "Lines of a netlist depend on something that is missing: a component that is not installed here, a file that cannot be read, a program "
     "that `hal check` does not start, or a component named by --assume. They cannot be judged, so they are counted and not reported as "
     "errors one by one.\n\n"
     "The error about what is missing comes once, where it is loaded. `hal check --assume NAME` accepts a component that exists only on "
     "another machine; its lines stay unchecked."},
    {"unknown-argument",
     "The component has no load argument of this name, and ignoring it could hide a mistake.\n\n"
     "`hal doc COMPONENT` lists its arguments. All components take count=, names= and personality=."},
    {"unknown-command",
     "The first word of a line is a command, and there is none of this name.\n\n"
     "`help` lists all commands, `help COMMAND` tells more about one. To set a pin by assignment, put blanks around the =: `pid.0.Pgain = 5`."},
    {"unknown-option",
     "The command has no such option.\n\n"
     "`help COMMAND` shows its options. Options stand before the other arguments: those behind a program's name belong to the program."},
    {"unknown-word",
     "One of a few words is expected here, and this is none of them.\n\n"
     "The message lists the words; `help COMMAND` explains them."},
    {"unreadable-file",
     "The file cannot be read; the system's reason is part of the message. A file may be at most 1 GB."},
    {"unset-ini-key",
     "`[SECTION]KEY` and `[SECTION](KEY)` stand for a value of the INI file, `[]KEY` for the first KEY of any section. There is no such "
     "value, or no INI file was given. Section and key are case-sensitive.\n\n"
     "Give the file with `hal run --ini FILE.ini …`, with halcmd and halrun by `-i FILE.ini`."},
    {"unset-variable",
     "`$NAME` and `$(NAME)` stand for an environment variable, and this one is not set. A name may contain letters, digits, `.`, `_` and "
     "`-`, so `$HOME-x` is the variable `HOME-x`; write `$(HOME)-x`. Quotes do not protect a `$`."},
    {"unsupported-component",
     "The `.comp` file is correct, but asks for something that exists only inside of LinuxCNC: a part of its motion controller, or a program "
     "of its own that shares HAL's memory.\n\n"
     "The message says what to do instead."},
    {"unsupported-file",
     "Tcl files are not read: they are programs, not netlists.\n\n"
     "Most are loops over names, which a .hal file says with ranges and sets: `net j[0..5]-cmd traj.out-[0..5] => pid.[0..5].command`."},
    {"unterminated-quote",
     "A quote, ' or \", is opened and not closed before the end of the line. Quotes protect blanks and `#`; they stay in the word. There is "
     "no escape character, but one kind of quote may stand inside the other: \"it's\".\n\n"
     "An apostrophe in a comment does no harm."},
    {"unthreaded-function",
     "The instance is linked but none of its functions is in a thread, so its outputs never change. Add it with addf, or "
     "unload the instance."},
    {"writer-set",
     "A signal with a writer gets its value from there in every cycle; sets would be overwritten at once, so it is refused.\n\n"
     "Unlink the writer first, as the help line says."},
    {"wrong-arguments",
     "The command was given too few or too many words, or a word it does not know. `help COMMAND` shows how it is used."},
    {"wrong-arrow",
     "The arrow points against the pin's direction: `=>` stands before pins that read the signal, `<=` before the pin that "
     "writes it. LinuxCNC ignores arrows, so this is only a warning; but one of the two, arrow or pin, is probably a slip."},
};

}  // namespace hal
