// SPDX-License-Identifier: MIT
// The table behind codes.hpp: a row per diagnostic code, sorted by name. `page` is what `hal
// explain CODE` prints: what it means, why it is an error, what to do; an example where it helps.
// tests/errors/<name>.hal provokes it.
#pragma once

namespace hal {

struct CodePage {
    const char* name;
    const char* page;
};

inline constexpr CodePage code_pages[] = {
    {"bad-argument",
     "A load argument has a value that its component does not accept: text where a number is "
     "required, a number out of range, or a "
     "list whose length does not match the number of instances.\n\n"
     "`hal doc COMPONENT` lists the arguments of a component with their defaults and ranges."},
    {"bad-component-source",
     "A `.comp` file contains declarations, each terminated by `;`, then a line that contains only "
     "`;;`, then C code. Here a "
     "declaration is invalid, or contradicts another declaration or the code. All errors are "
     "reported at once; the C compiler runs "
     "only when there are none.\n\n"
     "`component NAME \"…\"; pin in float in; pin out float out; function _; license \"GPL\"; ;;` "
     "and `out = in;`, with `;;` on a "
     "line of its own. docs/tutorials/linuxcnc-components.md has examples."},
    {"bad-duration",
     "`advance` runs a number of cycles of the fastest thread, or lets a duration pass. A number "
     "without a unit is ambiguous.\n\n"
     "Examples: `advance 10 cycles`, `advance 250ms`, `advance 2s`. Units: ns us ms s min h."},
    {"bad-ini-line",
     "An INI file contains `[SECTION]` lines, `KEY = value` lines, comments (`#` or `;` as the "
     "first character of a line), and "
     "`#INCLUDE FILE`. Any other line is ignored with this warning, as is a section name without "
     "its `]`.\n\n"
     "Included files may include others, up to 16 levels deep; deeper nesting means that a file "
     "includes itself."},
    {"bad-node",
     "A `node NAME...` line of a netlist begins the part that belongs to these nodes. The part "
     "ends at the next `node` line. Lines "
     "after `node all`, and lines before the first `node` line, belong to all nodes. A name "
     "consists of letters, digits, - and _, at "
     "most 32 of them, and `all` cannot be combined with names.\n\n"
     "`node cell`, `node robot1 robot2 rate=10ms deadline=100ms`. docs/tutorials/distributed.md "
     "has a complete example."},
    {"bad-period",
     "The period of a thread is a whole number of nanoseconds, at least 1000 (1 us): 1000000 is a "
     "millisecond.\n\n"
     "Example: `newthread servo-thread 1000000`, or `loadrt threads name1=base period1=50000 "
     "name2=servo period2=1000000`."},
    {"bad-plugin",
     "The file was found but is not a usable component: it is not a shared library for this "
     "machine, does not export the symbol "
     "`hal_plugin`, was built for another major version of the interface, or its description is "
     "incomplete.\n\n"
     "Rebuild it against the installed `hal/component.hpp`. `nm -D FILE` must list `hal_plugin`."},
    {"bad-position",
     "The third argument of addf is a position in the thread: 1 is the first, 2 the second, -1 the "
     "last, -2 the one before the last. "
     "0 is invalid, and the position must exist.\n\n"
     "Without a position the function is appended."},
    {"bad-range",
     "A name may contain ranges and sets: `pid.[0..5].enable` expands to six names, `[00..11]` "
     "keeps leading zeros, `[5..0]` counts "
     "down, `pid.{x,y,z}.enable` expands to three names. Several in one word are combined; the "
     "last one varies fastest. The bounds "
     "are whole numbers, every `{` needs its `}`, a set is not empty and cannot be nested, and a "
     "command expands to at most 1000000 "
     "names.\n\n"
     "Nothing is expanded inside quotes, nor in print, echo, help, loadusr and source."},
    {"bad-reference",
     "`$NAME` and `$(NAME)` refer to an environment variable, `[SECTION]KEY` and `[SECTION](KEY)` "
     "to a value of the INI file. Here "
     "the name after `$` or `[` is missing, or the bracket is not closed. References are also "
     "replaced inside quotes.\n\n"
     "`[0..5]` is a range of names. In show and list, `[` may be part of a pattern."},
    {"bad-value",
     "The text is not a value of the type of the pin or signal, or is out of its range. Values are "
     "never rounded or wrapped silently.\n\n"
     "bit: TRUE FALSE 1 0 yes no on off. s32 u32 s64 u64: decimal, 0x hexadecimal, leading 0 "
     "octal. float: 1.5, -2e-3."},
    {"binary-text",
     "A netlist is plain text in UTF-8. This file contains a zero byte, or another control "
     "character outside a comment, so it is not "
     "a netlist: perhaps a program, a picture, or a text in UTF-16. The whole file was ignored.\n\n"
     "`file FILE` shows the type of a file; `iconv -f utf-16 -t utf-8` converts a text."},
    {"camera-text",
     "The calibration file of a camera, or of the ground in its view, is malformed or does not "
     "match the camera. A camera file "
     "contains the lines `size 640 480`, `focal 600 600`, `centre 319.5 239.5`, `distortion k1 k2 "
     "p1 p2 k3`; or the YAML that the "
     "OpenCV calibration writes. A ground file contains a line `u v x y` for each of at least four "
     "points: pixel from the left, pixel "
     "from the top, position in mm.\n\n"
     "`hal doc vision_marker` and `hal doc vision_homography` have examples."},
    {"cannot-write",
     "`save` or `journal save` could not write the file; nothing else was changed. The message "
     "includes the reason: that of the system, or that the machine has no journal (hal run --journal "
     "FILE.mcap).\n\n"
     "Without a file name `save` prints to the terminal."},
    {"canopen-line",
     "A line of a CANopen configuration (`NAME.canopen`) is invalid at its position: it is neither "
     "a [section] nor KEY = VALUE, or "
     "the section or key is unknown or a duplicate.\n\n"
     "Sections are [bus], [defaults], [type NAME], [node ID NAME], [messages]. "
     "docs/canopen-configuration.md lists their keys."},
    {"canopen-load",
     "The messages of a CANopen configuration cannot all arrive in time on this bus. The bus load "
     "is calculated for the longest "
     "possible frames, all due at once. The network runs nevertheless, but frames arrive late.\n\n"
     "`hal canopen plan FILE` shows the calculation and the options: a higher bit rate, a longer "
     "SYNC period, fewer PDOs, a second "
     "bus."},
    {"canopen-node",
     "Nodes or messages of a CANopen configuration conflict: a duplicate node ID, name or "
     "identifier; or a setting of a node requires "
     "something that is missing, such as a SYNC."},
    {"canopen-object",
     "The object is missing in the description of the node, cannot be mapped to a PDO, or exceeds "
     "the space remaining in it: a PDO "
     "holds 64 bits.\n\n"
     "Objects are written by name, in lower case with dashes, or as 6064 or 6099:1; `hal "
     "canopen check FILE` lists those in use. "
     "Without a description an object needs its type: `2000:1 u16`."},
    {"canopen-value",
     "The value of a key of a CANopen configuration is invalid. The help line shows the valid "
     "values.\n\n"
     "Times have a unit (us, ms, s, min); numbers are decimal, or hexadecimal with 0x."},
    {"construct-failed",
     "The instance could not be created: the constructor of the component failed for the reason in "
     "the message. The edit was rolled "
     "back.\n\n"
     "`hal doc COMPONENT` lists its arguments."},
    {"continued-comment",
     "A `\\` at the end of a line joins the next line to it before comments are removed, as in "
     "LinuxCNC. A comment that ends in `\\` "
     "therefore includes the next line, which is not executed.\n\n"
     "Remove the `\\`, or move the comment after the last line of the command."},
    {"cross-thread-io",
     "The I/O pins of this signal belong to functions in several threads. They share one cell, as "
     "in LinuxCNC, and its value may "
     "change in the middle of a cycle. All other signals that cross threads carry values of "
     "complete, finished cycles."},
    {"cyclic-order",
     "`addf --auto` found a loop in the dataflow and had to cut it: the named signal is read one "
     "cycle late. To cut the loop "
     "elsewhere, add the functions in that order."},
    {"dos-line-endings",
     "Lines of this file end in CR LF. They are read as if they ended in LF; the warning appears "
     "once per file.\n\n"
     "`hal fmt` or `sed -i 's/\\r$//' FILE` converts the file."},
    {"eds-count",
     "A number in a device description (EDS, DCF, XDD) differs from what it counts: objects in a "
     "list, sub-indices of an object, "
     "lines of a comment, PDOs. The number is ignored; what the file actually describes is "
     "used.\n\n"
     "`SubNumber` includes sub-index 0."},
    {"eds-missing",
     "A key or section that CiA 306 requires is missing or empty. The message names the assumed "
     "value.\n\n"
     "An object without `DataType` can only be read and written as bytes."},
    {"eds-object",
     "The description of an object is invalid as a whole: an unknown object, data or access type, "
     "sub-indices of a plain variable, or "
     "a default mapping of an object that is missing or has a different length."},
    {"eds-syntax",
     "A line of a device description is neither a [section] nor Key=Value, a section or key is a "
     "duplicate, a comment is at an "
     "invalid position, or the text is in an unusual encoding. Comments begin with `;` on a line "
     "of their own.\n\n"
     "Of duplicates the last one is used."},
    {"eds-unreadable",
     "The file is not a device description: it is empty, not text, or contains neither objects nor "
     "[DeviceInfo]. The whole file was "
     "ignored."},
    {"eds-value",
     "A value is not a number, exceeds its data type or its limits, or is written in a form that "
     "other tools interpret differently.\n\n"
     "Numbers are decimal, or hexadecimal with 0x. A leading 0 makes a number octal, as in C; "
     "`$NODEID+0x180` adds the node ID."},
    {"ethercat-line",
     "A line of an EtherCAT configuration (`NAME.ethercat`) is invalid at its position: it is "
     "neither a [section] nor KEY = VALUE, or the "
     "section, key or element is unknown or a duplicate.\n\ndocs/ethercat-configuration.md lists "
     "sections and keys, also those of LinuxCNC's "
     "`ethercat-conf.xml`."},
    {"ethercat-object",
     "The object is missing in the description of the slave, cannot be mapped to a PDO, or exceeds "
     "what the PDO can hold.\n\n"
     "An object is its hexadecimal index and its decimal sub-index: `6040` or `60FE:1`. Without a "
     "description it needs its type: `2000:1 u16`."},
    {"ethercat-slave",
     "Slaves of an EtherCAT configuration conflict or are incomplete: a duplicate position, alias "
     "or name, or a missing identity."},
    {"ethercat-value",
     "The value of a key of an EtherCAT configuration is invalid. The help line shows the valid "
     "values.\n\n"
     "Times have a unit (ns, us, ms, s). An index is hexadecimal, all other numbers are decimal, "
     "or "
     "hexadecimal with 0x."},
    {"function-in-thread",
     "A function runs in one thread, at one position. This one is already in a thread.\n\n"
     "Move it with `delf FUNCTION THREAD` followed by addf."},
    {"hung-thread",
     "A thread has not finished a cycle within its supervision limit (10 periods or 100 ms, "
     "whichever is longer; `newthread ... "
     "supervise=TIME`). The supervisor, which runs outside the threads, stopped its functions, "
     "wrote the declared safe values and "
     "called the emergency functions of its components. The fault (`show fault`) names the "
     "function and why it does not return: it "
     "uses CPU time (an endless loop), waits in a system call, or is stopped by a debugger. A "
     "thread that gets no CPU time is `starved-thread` instead.\n\n"
     "Commands that need a response of the thread (setp, sets, edits, start, stop, delthread, "
     "unload) fail with this code while it "
     "hangs; other threads continue. If the function returns, no other function of the thread runs "
     "and the outputs stay safe until "
     "`start`. A function that never returns ends only with the process; the exit status of `hal "
     "run` is then 1.\n\n"
     "A function that runs in a cycle must not block, wait or loop without a bound; move work that "
     "may take long to a thread of the "
     "component. To debug a running machine, use `newthread ... supervise=off`.\n\n"
     "`hal sim` has no supervision limit, since a cycle of its virtual clock may take any wall "
     "time. A cycle that takes more than 10 "
     "s is reported on stderr while it runs, and `--cycle-limit TIME` ends the run with this code "
     "and status 1; after Ctrl-C the "
     "limit is two seconds."},
    {"ignored-option",
     "An option of a thread has no effect, because another one excludes it or the machine cannot "
     "do it. The thread runs without it.\n\n"
     "Only threads with `policy=fifo`, the default, have a priority. Threads with "
     "`policy=deadline` run on all CPUs. A thread whose `cpu=N` does not exist, is offline or is "
     "outside the cpuset of the process runs where the kernel puts it; `lscpu -e` lists the CPUs, "
     "and `taskset -pc PID` those of a process."},
    {"ini-version",
     "LinuxCNC 2.9 and later start a configuration only if its INI file has `[EMC]VERSION = 1.1`. "
     "Files of 2.7 and before have another version, or none: "
     "names of sections, keys and pins have changed since. `hal linuxcnc` rejects them, too.\n\n"
     "LinuxCNC's program converts the file and its netlists: `update_ini FILE.ini` (it keeps a "
     "copy)."},
    {"ini-without-netlist",
     "An INI file that is run names its netlists: `HALFILE` or `HALCMD` in the section `[HAL]`. "
     "Keys "
     "and sections are case-sensitive. `POSTGUI_HALFILE` alone is not enough: only a display loads "
     "it. A file that has only values for other netlists is given "
     "with `hal run --ini FILE.ini FILE.hal`."},
    {"incomplete-recording",
     "A recording was cut off, as by a power failure or an incomplete copy, or is damaged. What it "
     "has is played; the message "
     "states from which time on rows are missing, and of which values.\n\n"
     "Copy the file again, or record again. An .mcap that ends without a summary can be used up to "
     "its last complete second."},
    {"init-done",
     "initf functions run once, in a cycle of their own before the first cyclic pass of their "
     "thread. This thread has already made "
     "that pass, so the function would never run."},
    {"instance-running",
     "Each running instance of Halcyon has a unique name, and an instance of this name is already "
     "running. It keeps its control "
     "socket.\n\n"
     "Choose another name for the new instance: `hal run --name second FILE.hal`."},
    {"interrupted",
     "A command that was waiting (loadusr -w, loadusr -W, waitusr, advance) was cancelled, or its "
     "client disconnected.\n\n"
     "Commands executed before it remain in effect."},
    {"invalid-name",
     "The name of a signal, an alias, a thread or an instance is one word of a netlist. A name "
     "that "
     "the parser would read "
     "otherwise (a blank or a line end in it, '#', '$', '[' or '{', an open quote) could be made "
     "by "
     "a program, but no netlist "
     "could use it, and what `save` prints could not be loaded.\n\n"
     "Use letters, digits, '-', '_', '.' and ':'."},
    {"is-a-program",
     "unloadrt unloads components from this process. This component is a program of its own: it "
     "was started by loadusr, or registered "
     "over the control socket.\n\n"
     "`unloadusr NAME` asks the program to end (SIGTERM). If the program has already ended, it "
     "removes the remaining pins."},
    {"lasting-fault",
     "`fault clear` acknowledges faults that are over. The condition of these faults lasts: a "
     "thread hangs or is stopped, a node is offline, a "
     "link has no carrier, a cycle still takes too long. They stay faults: `ok` of the component "
     "`faults` remains FALSE, and the emergency "
     "stop chain open. All other faults were acknowledged.\n\n"
     "`show fault` marks faults that last. Remove the cause (a thread that a fault stopped needs "
     "`start`), then type `fault clear` again. The end "
     "of a condition does not acknowledge its fault."},
    {"linked-set",
     "A linked pin takes its value from its signal, which would overwrite the value of setp in the "
     "next cycle.\n\n"
     "Set the signal with sets (if it has no writer), or unlink the pin with unlinkp first."},
    {"linuxcnc-argument",
     "`hal check --linuxcnc`: the loader of LinuxCNC 2.9, or its module, rejects this argument of "
     "loadrt: it is unknown there, missing, not a whole number, a list that is too long, or out of "
     "range. Up to 2.9.8, a thread with `fp1=0` also takes no function that uses floating "
     "point.\n\n"
     "`hal doc COMPONENT` lists the arguments that work here."},
    {"linuxcnc-command",
     "`hal check --linuxcnc` reports what runs here and is an error for LinuxCNC 2.9. This "
     "command, option or range of names is an addition of ours; halcmd "
     "rejects it, or takes it for something else.\n\n"
     "`begin` and `commit` may be left out: a file is a transaction in any case. "
     "docs/linuxcnc-compatibility.md lists all differences."},
    {"linuxcnc-name",
     "`hal check --linuxcnc`: names of components, pins, parameters, signals, functions, threads "
     "and aliases have at most 47 characters in LinuxCNC, with the "
     "pin `FUNCTION.time` that it creates for each function.\n\n"
     "Shorten the name of the instance, `names=...`, or of the signal."},
    {"linuxcnc-threads",
     "`hal check --linuxcnc`: LinuxCNC creates threads from the fastest to the slowest and rejects "
     "one that is faster than the first. Here they may come in any "
     "order.\n\n"
     "`loadrt threads name1=base period1=50000 name2=servo period2=1000000`"},
    {"linuxcnc-value",
     "`hal check --linuxcnc`: halcmd of LinuxCNC 2.9 takes `TRUE`, `FALSE`, `1` and `0` for a bit, "
     "in any case, and creates signals of the types bit, float, s32, "
     "u32 and port. `yes`, `no`, `on` and `off` came with LinuxCNC 2.10."},
    {"locked",
     "A lock forbids this kind of change. `lock tune` forbids loading, linking, addf and threads; "
     "`lock all` also forbids setting "
     "parameters, start and stop. Values of pins and signals can always be set, as in LinuxCNC.\n\n"
     "`status lock` shows the active locks, `unlock` releases all of them, `unlock tune` those of "
     "tune."},
    {"lone-carriage-return",
     "A line contains a carriage return that is not at its end. An editor may show such a line as "
     "several lines, but for the netlist or the INI file "
     "it is one, so it is rejected. Further lines with the same error are not listed.\n\n"
     "`tr '\\r' '\\n' < OLD > NEW` converts a file whose lines end in CR only."},
    {"lost-writer",
     "The edit has taken the only writer of a signal: by unload, by unlinkp, or because its program "
     "ended. Pins that read the signal keep the value it has from then on, as in LinuxCNC, which "
     "does not mention it. The value is the safe value of the writer where it declares one (`hal "
     "doc COMPONENT`), as outputs of the components for safety do; otherwise it is the last one, "
     "so that an enable may stay TRUE.\n\n"
     "Link another writer or set a value. An edit that replaces the writer at once, between `begin` "
     "and `commit` or in a file, causes no warning."},
    {"matrix-text",
     "A matrix file contains `NAME = ` followed by numbers: one row per line, or `;` between rows; "
     "spaces or commas between numbers. "
     "`diag` precedes the numbers of a diagonal matrix, `#` begins a comment. All rows of a matrix "
     "have the same length.\n\n"
     "Example: `A = 0 1` and on the next line `-2 -3`; `Q = diag 10 1`."},
    {"matrix-value",
     "The matrix is well-formed but unsuitable: its size does not match the other matrices, it is "
     "not symmetric or not positive as "
     "required, or the plant that it describes is uncontrollable or unobservable. The message "
     "names the mode or the state.\n\n"
     "`hal doc COMPONENT` describes the matrices of a component and their sizes."},
    {"misplaced-node",
     "`node` lines are only allowed in the netlist that is passed to `hal run`, `hal sim` or `hal "
     "check`. They are not allowed in the "
     "shell, nor in a file that is read by `source`: the contents of such a file belong to the "
     "node that reads it.\n\n"
     "Write `node NAME` above the `source` line."},
    {"mobile-text",
     "A file of a component for mobile robots has an invalid line. A floor plan (`floor=FILE`) has "
     "lines `wall X1 Y1 X2 Y2`, `box X1 Y1 X2 Y2`, "
     "`circle X Y RADIUS` and `beacon X Y RADIUS`; a list of goals (`loadrt goals file=FILE`) has "
     "lines `goal X Y`; all in metres.\n\n"
     "A program of steps (`loadrt step_program file=FILE`) declares `input` and `output` names, "
     "then steps: `step NAME`, and in it `set OUTPUT`, "
     "`when INPUT and not INPUT -> STEP` and `after 2s -> STEP`; `at 88s -> STEP` counts from the "
     "end of the first step. `hal doc step_program` has "
     "an example."},
    {"model-text",
     "A model file (`loadrt ekf model=FILE`) contains five kinds of lines: `constant NAME = "
     "FORMULA`, `input NAME`, `state NAME = "
     "START sigma S noise N`, `NAME' = FORMULA` for the derivative of each state, `measure NAME = "
     "FORMULA sigma S`. One of these "
     "lines is malformed, missing, or refers to an unknown name.\n\n"
     "Formulas have + - * / ^, brackets, pi, sin cos tan asin acos atan atan2 sqrt exp log abs "
     "tanh min max. `hal doc ekf` has an "
     "example."},
    {"mesa-line",
     "A line of the configuration of an emulated Mesa card is invalid at its position: an unknown "
     "section or key, or a key without a value.\n\n"
     "The sections are [card], [motor NAME], [switch NAME], [spindle NAME], [input NAME], [output "
     "NAME], [type NAME] and [defaults]. docs/mesa.md lists their keys."},
    {"mesa-plant",
     "The parts of an emulated Mesa card and its machine do not fit: a module or terminal that "
     "the card does not have, a switch without a motor, a name that is given twice, two "
     "parts with one encoder.\n\n"
     "`hal explain mesa-line` lists the sections, docs/mesa.md what each card has."},
    {"mesa-value",
     "A value of the configuration of an emulated Mesa card is invalid: a type of card, a number, "
     "a time, a terminal. The help line shows the valid values."},
    {"modbus-line",
     "A line of a Modbus configuration is invalid at its position: an unknown section, key or "
     "option, or a value without one.\n\n"
     "The sections are [bus], [slave N NAME], [type NAME] and [defaults]. docs/modbus.md lists "
     "their keys."},
    {"modbus-slave",
     "The slaves of a Modbus configuration cannot work together: a duplicate address or name, two "
     "values that write the same register, or a profile without its registers. The warning about "
     "a missing stop telegram is also of this kind: a slave keeps its last command when the "
     "machine ends.\n\n"
     "`hal modbus plan FILE` shows the telegrams of a valid configuration."},
    {"modbus-value",
     "A value of a Modbus configuration is invalid: a number, a time, a register, a type. The help "
     "line shows the valid values.\n\n"
     "Registers are written as the table and the address on the wire, `holding 0x2103`, or as in "
     "manuals, `48452`. A bit of a register is `holding 0x2101.3`."},
    {"module-in-use",
     "A LinuxCNC module cannot be unloaded while another loaded module calls its code: motmod uses "
     "a trajectory planner, a homing and a "
     "kinematics module, the drivers of Mesa cards use hostmot2.\n\n"
     "The help line shows what to type. `unload all` unloads all components, those that use others "
     "first; between `begin` and `commit` the "
     "order does not matter."},
    {"name-taken",
     "The name is already in use. Names are unique among pins and signals, among aliases, "
     "functions, instances and threads each, and "
     "among components and programs.\n\n"
     "Name instances with `names=`, or choose another signal name. The name of a program is free "
     "once the program has ended: `unload "
     "NAME` ends it, and `loadusr -Wn NAME` waits for that."},
    {"names-and-count",
     "Both `names=` and `count=` (or `num_chan=`) set the number of instances. Use only one of "
     "them."},
    {"no-dds",
     "The nodes of this netlist exchange signals over DDS, which this build of Halcyon does not "
     "include: Fast DDS was missing when it "
     "was built, or it was built with -DHALCYON_PACKAGE_DDS=OFF.\n\n"
     "On Debian: `sudo apt install libfastrtps-dev`, then build again. `hal check` and `hal sim` "
     "accept netlists with nodes without "
     "DDS."},
    {"no-latency",
     "`show latency NAME` has nothing to show: no signal or pin has this name, or it does not link "
     "a writer to a reader.\n\n"
     "The latency of a signal is the delay from its writer to a reader. `show latency` lists all; "
     "a name may be that of the signal, of the writer or of a reader, or begin it."},
    {"no-program",
     "loadusr could not start the program: it is not in PATH, is not executable, or the system "
     "denied it.\n\n"
     "A path that contains / is used as written; `~` is the home directory."},
    {"no-socket",
     "The control socket of the instance could not be created, so no shell could connect to the "
     "running machine. The sockets are in "
     "$XDG_RUNTIME_DIR/halcyon, or in /tmp/halcyon-UID, a folder that must belong to you and be "
     "inaccessible to others."},
    {"no-such-component",
     "No plugin of this name is on the search path: HALCYON_PLUGIN_PATH, the user's plugin folder, "
     "the build tree, the installation.\n\n"
     "`hal doc` lists every component that can be loaded."},
    {"no-such-function",
     "Unknown function. Functions are created with instances: `show funct` lists them, `hal doc "
     "COMPONENT` describes them."},
    {"no-such-node",
     "`--node NAME` selects the part of the netlist that this machine loads, but no `node` line "
     "has this name.\n\n"
     "The message lists the nodes of the netlist. Lines before the first `node` line belong to all "
     "of them."},
    {"no-such-pin",
     "Unknown pin or parameter. Pins are created with instances: `show pin INSTANCE` lists them, "
     "`hal doc COMPONENT` describes them."},
    {"no-such-signal",
     "Unknown signal. Signals are created by net or newsig: `show sig` lists them."},
    {"no-such-thread",
     "Unknown thread. Threads are created by `newthread NAME PERIOD_NS` or `loadrt threads name1=… "
     "period1=…`; `show thread` lists "
     "them."},
    {"no-such-type",
     "The type names are bit, float, s32, u32, s64, u64, port, and in the second dialect bool, "
     "real, si32, ui32, sint, uint."},
    {"no-thread",
     "The command requires a thread, but none exists.\n\n"
     "Create one: `newthread servo-thread 1000000`, or `loadrt threads name1=servo-thread "
     "period1=1000000`."},
    {"no-transaction",
     "`commit` and `abort` end the transaction that `begin` opened, but no transaction is open in "
     "this shell or file.\n\n"
     "Outside begin … commit each line takes effect on its own; in a file, all edits up to the "
     "next command that acts on the machine "
     "take effect together."},
    {"node-crossing",
     "A signal whose writer and readers are on different nodes is sent from one to the other. That "
     "requires one output on one node "
     "and inputs on the others, a type other than port, and on each of these nodes a thread that "
     "sends or receives it.\n\n"
     "Signals that several nodes have, but that none writes or each writes itself, are not sent: "
     "each node has its own."},
    {"not-a-program",
     "waitusr and unloadusr apply to programs outside the runtime: those started by loadusr, and "
     "those that registered over the "
     "control socket.\n\n"
     "Components inside the runtime are unloaded by unloadrt or unload; `show comp` lists both, "
     "programs with the type User."},
    {"not-in-thread",
     "delf removes a function from its thread, but this function is not in the named thread."},
    {"not-permitted",
     "Linux lets a process send signals only to processes of its own user. The program registered "
     "with the machine as root or belongs to "
     "another user, so the machine can neither end it nor release its name. It keeps running and "
     "keeps its pins.\n\n"
     "`show comp` lists its process ID. End it as that user or with `sudo kill PID`; the machine "
     "then notices the closed connection."},
    {"nothing-ran",
     "Time passed in a simulation, but no function ran, so no value could change: the threads were "
     "never started, no function is in a "
     "thread, or the machine has no thread. `hal run` and `hal sim --for` start the threads; a "
     "netlist that uses `advance` starts them itself.\n\n"
     "Write `start` before the first `advance`, and `addf FUNCTION THREAD` for each function."},
    {"open-transaction",
     "Edits between `begin` and `commit` are collected and take effect together. A second `begin` "
     "before `commit` is invalid, and a "
     "file that ends before its `commit` changes nothing with the collected edits.\n\n"
     "loadusr and waitusr cannot be part of a transaction, because starting a program cannot be "
     "rolled back. `start` and `stop` can, "
     "but not both: they would happen at the same time. In a shell the transaction stays open "
     "after a rejected command; in a file it "
     "ends, and nothing is changed.\n\n"
     "End the transaction with `commit`, or discard it with `abort`."},
    {"out-of-memory",
     "The system ran out of memory during an edit. The edit was rolled back; the machine continues "
     "unchanged.\n\n"
     "`ulimit -v` and `ulimit -l` limit the memory and the locked memory of a process; `free -h` "
     "shows the memory of the machine."},
    {"output-set",
     "Only its component writes an output, and would overwrite the value of setp in the next "
     "cycle.\n\n"
     "To force a value downstream, unlink the output and set the signal: `unlinkp OUT`, `sets "
     "SIGNAL VALUE`."},
    {"panel-element",
     "A PyVCP file is invalid at this place: the XML is malformed, an element in a container is "
     "unknown, or the value of an option is not a "
     "literal of Python (options are never evaluated).\n\n"
     "docs/panel.md describes the differences from LinuxCNC's pyvcp."},
    {"panel-line",
     "A line of a .panel file is invalid: an unknown widget or option, a value of the wrong type, "
     "a duplicate pin, a container without "
     "`end`.\n\n"
     "docs/panel.md lists the widgets with their options."},
    {"parameter-link", "Parameters cannot be linked: use setp instead of net."},
    {"period-multiple",
     "All periods must be multiples of the period of the fastest thread, so that the threads keep "
     "a fixed phase. The help line "
     "suggests one."},
    {"pin-linked",
     "A pin is in at most one signal. Unlink it first with unlinkp, or link the other pins to the "
     "signal it is in."},
    {"port-sized",
     "The buffer of a port signal is allocated once, by the first sets; its size is fixed "
     "afterwards."},
    {"program-ended",
     "loadusr -W waits until the component of the program is ready, but the program ended "
     "first.\n\n"
     "See the messages of the program; if its registration was rejected, the help line contains "
     "the reason. A program registers over "
     "the control socket with the request {\"component\":\"NAME\"}; use -Wn NAME if that name "
     "differs from the name of the program."},
    {"program-failed",
     "loadusr -w waits for the end of the program and treats an exit status other than 0 as an "
     "error, as LinuxCNC does.\n\n"
     "`loadusr -i -w PROGRAM` ignores the status."},
    {"program-timeout",
     "A program exceeded the timeout `-t TIME`: it did not become ready (loadusr -W, -Wn), or did "
     "not end (loadusr -w, waitusr).\n\n"
     "loadusr has sent SIGTERM to the program, and sends SIGKILL if it has not ended after 5 s; "
     "its name is free at once. waitusr "
     "leaves the program running. `show comp` lists the programs and their states; the help line "
     "shows what the program has done so "
     "far."},
    {"range-length",
     "The ranges and sets of one command are expanded in parallel, so each of them must have as "
     "many elements as the one in the first "
     "word: `net j[0..2]-cmd traj.[0..2].out => pid.{x,y,z}.command` expands to three commands.\n\n"
     "If the first word has no range, ranges in the other words are expanded in place: `net on "
     "s.on => pid.{x,y,z}.enable` is one "
     "command."},
    {"recursive-source",
     "A file includes itself by `source`, directly or through other files, which would never end. "
     "The labels show the chain.\n\n"
     "Move what both files need to a third file."},
    {"reload-conflict",
     "`reload` replaces a loaded plugin by its new version. Whatever the machine uses of the old "
     "version must exist in the new one: "
     "pins on signals with the same type and direction, functions that are in threads, the name of "
     "the component. Nothing was "
     "changed; the old version continues to run.\n\n"
     "First remove the pin from its signal (`unlinkp PIN`) or the function from its thread (`delf "
     "FUNCTION THREAD`); between `begin` "
     "and `commit` this and the reload take effect together.\n\n"
     "A LinuxCNC module cannot be reloaded: unload it, then load it again."},
    {"reload-dropped",
     "A parameter or an input whose value had been set is missing in the new version of the "
     "component, or has a different type. The "
     "reload took effect, and the value is lost.\n\n"
     "A `setp` of this name in the netlist will fail the next time the netlist is loaded.\n\n"
     "The same is reported of a variable with state that is missing in the new version or has a "
     "different type: the new instance begins without it, as after `loadrt`. Stop the machine "
     "before such a reload where that matters."},
    {"scocan-line",
     "A line of a SCoCAN table is invalid at its position: an unknown or duplicate key, an "
     "incomplete line, or a slot outside of a mode.\n\n"
     "Keys are bitrate, cycle, slots, guard, idle, lost, node, mode, message; a line that begins "
     "with a number is a slot of the mode above it. "
     "docs/scocan.md lists them."},
    {"scocan-slots",
     "The SCoCAN table cannot work: a slot is too short for its frame, is used twice in the same "
     "cycle, an identifier has two senders, there is no "
     "SYNC node, or the guard time is shorter than the clocks require. `hal scocan plan` also "
     "reports a message that can miss its deadline. The message contains the calculation, the help "
     "line the remedy.\n\n"
     "`hal scocan plan FILE` shows a valid table as a timeline."},
    {"scocan-value",
     "A value of a SCoCAN table is invalid: a time, a number, a name, an identifier. The help line "
     "shows the valid values.\n\n"
     "Times have a unit: 500us, 10ms. Identifiers are 0x010..0x77F; the others belong to the "
     "discipline itself."},
    {"repeated-function",
     "Two functions in threads run the same code of the same instance. `lcec.read-all` runs "
     "`lcec.0.read`, `lcec.1.read` ... of all masters: with both in a thread, the bus is read "
     "twice in each cycle, and with `lcec.write-all` and `lcec.0.write`, two frames are sent.\n\n"
     "LinuxCNC's lcec loads and runs such a netlist without a message. Halcyon also runs it, with "
     "this warning, while both functions are in one thread. In two threads the same code would run "
     "at the same time on the same data: that is an error.\n\n"
     "Keep either the function for all masters or those of single masters."},
    {"several-nodes",
     "The netlist has `node` lines: it is for several machines, each of which loads its own "
     "part.\n\n"
     "`hal run FILE --node NAME` loads one part. `hal check FILE` checks all of them, `hal sim "
     "FILE` runs them together in one "
     "process."},
    {"shared-time",
     "`advance` in a netlist for several machines, all of which `hal sim` runs together. Their "
     "time is one: a node cannot let it pass by itself, and while the netlist is loaded, the "
     "signals between the nodes are not linked yet.\n\n"
     "`hal sim FILE --for 5s` lets time pass for all nodes after loading. Behind it, `-e` executes "
     "commands of one node, and lets more time pass: `-e 'desk: stop' -e 'all: advance 1s' -e "
     "'motor: getp node.desk.online'`. With `--node NAME` only this node runs, and may "
     "`advance`."},
    {"short-list",
     "An argument with a value per instance lists fewer values than there are instances. Those "
     "beyond "
     "the end of the list have the default, as the arrays of LinuxCNC's components do: `loadrt "
     "can_receive names=a,b id=0x101` gives `b` the identifier of the default. List a value for "
     "each "
     "instance if that is not what you mean."},
    {"signal-named-like-pin",
     "net takes the name of the signal first, then pins. The first name is the name of a pin, so "
     "the signal name is probably missing.\n\n"
     "`net SIGNAL pin pin …`"},
    {"silent-thread",
     "A thread did not respond to the command within the timeout: one of its functions hangs, or "
     "the thread gets no CPU time. The "
     "edit was rolled back; nothing changed. This happens only to a thread with `supervise=off`, "
     "or with a supervision limit above "
     "one second: others are declared hung first (`hal explain hung-thread`).\n\n"
     "`show thread` and `show fault` show details; a function that never returns ends only with "
     "the process."},
    {"spread-pins",
     "The functions of one instance run in different threads, and some of its pins belong to all "
     "of its functions: two threads would "
     "read and write them at the same time.\n\n"
     "Add the functions to one thread. (A component that supports several threads declares which "
     "function uses each pin.)"},
    {"stale-read",
     "The function of the reader runs before the function of the writer in the same thread, so it "
     "reads the value of the previous "
     "cycle. Often this is intended (a feedback loop has to be cut somewhere); if not, change the "
     "order with addf positions, or let "
     "`addf --auto` choose it."},
    {"start-failed",
     "The component could not acquire a resource (a device, a socket, a file) for the reason in "
     "the message. The whole edit was "
     "rolled back."},
    {"starved-thread",
     "A thread was ready to run, but got no CPU time for its supervision limit (10 periods or 100 "
     "ms, whichever is longer; `newthread ... "
     "supervise=TIME`). Its functions are not the cause: something else uses its CPU, such as a "
     "real-time process or thread of a higher "
     "priority, or the CPU quota of its control group is used up. The functions were stopped and "
     "the declared safe values written, as for a "
     "thread that hangs.\n\n"
     "The message names the process or thread if it still runs. Move it to another CPU (`taskset "
     "-cp CPU PID`), lower its priority, or bind the "
     "thread to another CPU: `newthread NAME PERIOD cpu=N`. `hal doctor` shows what else delays "
     "real-time threads. Then type `start`."},
    {"substitution-too-long",
     "The values that replace `$NAME` and `[SECTION]KEY` in one file exceed 32 MB in total. "
     "Probably a value is wrong, or a generated "
     "file contains far too many references."},
    {"tdma-line",
     "A line of a TDMA schedule is invalid at its position: an unknown or duplicate block or key, "
     "or a key without a value. Or a "
     "required line is missing, such as the cycle.\n\n"
     "Blocks are master:, backup-master:, slave:, as in RTnet's tdma.conf. docs/tdma.md lists "
     "their keys."},
    {"tdma-schedule",
     "The TDMA schedule cannot work: slots overlap or exceed the cycle, a slot is too short for "
     "its frame, a backup master would have "
     "to decide too early, or a station cannot be calibrated. The message contains the "
     "calculation, the help line the remedy.\n\n"
     "`hal tdma plan FILE` shows a valid schedule as a timeline."},
    {"tdma-value",
     "The value of a key of a TDMA schedule is invalid. The help line shows the valid values.\n\n"
     "Times are in microseconds, as RTnet writes them, or have a unit: 50, 50us, 1ms."},
    {"thread-refused",
     "The operating system could not create a thread, usually because a limit on processes or "
     "memory is reached: see `ulimit -a`."},
    {"too-many-errors",
     "Only the first 20 malformed lines of a file are shown, and the number of further ones. They "
     "often have one cause: fix the first "
     "and check again."},
    {"two-readers",
     "A port is a byte stream with one writer and one reader: bytes that one reader takes are lost "
     "for the other."},
    {"too-many-words",
     "A file may contain at most 5000000 words, about a million nets. This file has more, so it is "
     "probably not a netlist; the whole "
     "file was ignored."},
    {"two-writers",
     "A signal has one writer: one OUT pin, or any number of I/O pins, never both. With a second "
     "output, the value of the signal "
     "would depend on the order of functions.\n\n"
     "Join two sources with sum2, or2 or mux2, or unlink the first one with unlinkp."},
    {"type-mismatch",
     "All pins of a signal have the same type; values are never converted silently. Insert the "
     "conv_ component that the help line "
     "names."},
    {"unchecked-lines",
     "Lines of a netlist depend on something that is unavailable: a component that is not "
     "installed here, a file that cannot be read, "
     "a program that `hal check` does not start, or a component named by --assume. These lines "
     "cannot be checked, so they are counted "
     "instead of being reported as errors one by one.\n\n"
     "The missing item itself is reported once, where it is loaded. `hal check --assume NAME` "
     "accepts a component that exists only on "
     "another machine; its lines remain unchecked."},
    {"unknown-argument",
     "The component has no load argument of this name. It is rejected, since ignoring it could "
     "hide a mistake.\n\n"
     "`hal doc COMPONENT` lists its arguments. All components accept count=, names= and "
     "personality=."},
    {"unknown-command",
     "The first word of a line is a command, and this one is unknown.\n\n"
     "`help` lists all commands, `help COMMAND` describes one. To set a pin by assignment, put "
     "spaces around the =: `pid.0.Pgain = 5`."},
    {"unknown-option",
     "The command has no such option.\n\n"
     "`help COMMAND` lists its options. Options precede the other arguments: those after the name "
     "of a program belong to the program."},
    {"unknown-word",
     "One of a few keywords is expected here.\n\n"
     "The message lists them; `help COMMAND` describes them."},
    {"unreadable-file",
     "The file cannot be read; the message includes the reason that the system reports. A file may "
     "be at most 1 GB."},
    {"unset-ini-key",
     "`[SECTION]KEY` and `[SECTION](KEY)` refer to a value of the INI file, `[]KEY` to the first "
     "KEY of any section. The INI file has "
     "no such value, or no INI file was given. Section and key are case-sensitive.\n\n"
     "Specify the file with `hal run --ini FILE.ini …`, with halcmd and halrun by `-i FILE.ini`."},
    {"unset-variable",
     "`$NAME` and `$(NAME)` refer to an environment variable, and this one is not set. A name may "
     "contain letters, digits, `.`, `_` "
     "and `-`, so `$HOME-x` is the variable `HOME-x`; write `$(HOME)-x`. A `$` is also replaced "
     "inside quotes."},
    {"unsupported-component",
     "The `.comp` file is correct, but requires something that exists only inside LinuxCNC: a part "
     "of its motion controller, or a "
     "separate program that accesses HAL's shared memory.\n\n"
     "The message names the alternative."},
    {"unsupported-file",
     "The file is not a netlist: it is a device description, a configuration of a bus, a "
     "recording, "
     "the source of a component or a program. The help names the command for it.\n\n"
     "A Tcl file is a program: `hal run`, `hal sim` and `halrun` execute it, and nothing can be "
     "known about it before. `hal check` and clients of a "
     "running machine take .hal and .ini files only; `haltcl FILE.tcl` runs a Tcl file on a "
     "running machine.\n\n"
     "Most of these files are loops over names, which a .hal file expresses by ranges and sets: "
     "`net j[0..5]-cmd traj.out-[0..5] => "
     "pid.[0..5].command`."},
    {"unterminated-quote",
     "A quote, ' or \", is opened but not closed before the end of the line. Quotes protect spaces "
     "and `#`; they remain part of the "
     "word. There is no escape character, but one kind of quote may appear inside the other: "
     "\"it's\".\n\n"
     "An apostrophe in a comment is harmless."},
    {"unthreaded-function",
     "The function is in no thread, and pins that it reads or writes are linked, but nothing "
     "updates them. Netlists, and transactions of several commands, are checked as a whole. An "
     "edit "
     "that removes a function from its thread (delf, delthread) causes the warning in any case; "
     "other single commands do not, because the addf may follow.\n\n"
     "Add the function with addf, or unload the instance."},
    {"writer-set",
     "A signal with a writer gets its value from the writer in every cycle, which would overwrite "
     "the value of sets.\n\n"
     "Unlink the writer first, as the help line shows."},
    {"value-wraps",
     "`setp` and `sets` set the low 32 bits of a whole number that is out of the range of its s32 "
     "or u32, as LinuxCNC 2.9 does: 3000000000 is "
     "-1294967296 as s32. LinuxCNC 2.10 rejects such a number. There is no warning for a pattern "
     "of bits (0xFFFFFFFF for an s32) or for "
     "a negative number that fits into 32 bits (-1 for a u32).\n\n"
     "Write the number that is meant, or use a type that can hold it: s64, u64 or float."},
    {"wrong-arguments",
     "The command has too few or too many arguments, or an unexpected one. `help COMMAND` shows "
     "its usage."},
    {"wrong-arrow",
     "The arrow contradicts the direction of the pin: `=>` precedes pins that read the signal, "
     "`<=` precedes the pin that writes it. "
     "LinuxCNC ignores arrows, so this is only a warning; but either the arrow or the pin is "
     "probably wrong."},
};

}  // namespace hal
